#include "haptics/sandbox/measure/contact_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "haptics/files/output_file.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/qp/cone_newton.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/sandbox/measure/pareto.hpp"
#include "haptics/sandbox/measure/watched_solver.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone::sandbox {
namespace {

constexpr int kMaxRepetitions = 31, kMinRepetitions = 3;
constexpr double kRepetitionsUs = 20'000;                        // wall time after which no further repetition begins
constexpr double kCoarsest = 1, kFinest = 1e-8, kPerDecade = 2;  // tolerances
constexpr double kFinestOnCard = 1e-5;                           // that single precision reaches

std::vector<double> tolerancesOf(const SolverInfo& info) {
    if (info.exact) return {0};
    std::vector<double> tolerances;
    const double finest = info.roundTrip ? kFinestOnCard : kFinest;
    const int steps = static_cast<int>(std::lround(std::log10(kCoarsest / finest) * kPerDecade));
    for (int i = 0; i <= steps; ++i) tolerances.push_back(kCoarsest * std::pow(10, -i / kPerDecade));
    return tolerances;
}

/// Median time of repeated solves, µs; nothing when cancelled. `solve` returns the time of one.
std::optional<double> timeRepeated(const std::function<bool()>& goOn, const std::function<double()>& solve) {
    std::vector<double> times;
    double spent = 0;
    for (int k = 0; k < kMaxRepetitions && (k < kMinRepetitions || spent < kRepetitionsUs); ++k) {
        if (!goOn()) return {};
        times.push_back(solve());
        spent += times.back();
    }
    return percentile(times, 50);
}

/// One solver on the contact, called as the tick calls it.
class SolverRun {
  public:
    SolverRun(const FrozenContact& contact, const SolverInfo& info, const Vec6& exact)
        : contact_(contact),
          info_(info),
          solver_(info.make(contact.rows.size())),
          screen_(contact.rows.size()),
          exact_(exact) {}

    /// False when cancelled.
    bool run(double tolerance, const std::function<bool()>& goOn, SweepPoint& point) {
        Settings set = contact_.settings;
        if (!info_.exact) set.tolerance = tolerance;
        const SolverSettings settings = solverSettings(set);
        const StageClock clock = stageClock();
        const bool screens = !info_.exact && !settings.paperForm;
        const Screening screening = screens ? set.screening : Screening::None;
        const auto us = timeRepeated(goOn, [&] {
            solver_->reset();
            const auto screened = [&] { return &screen_.run(contact_.rows, screening, contact_.reach, set.trust); };
            if (contact_.options.warm && !settings.paperForm)
                solver_->solve({contact_.stiffness, contact_.wantedBefore, screened()}, settings);
            const std::uint64_t start = clock.now();
            const QpProblem now{contact_.stiffness, contact_.wanted, screened()};
            const SolveResult result = solver_->solve(now, settings);
            const double spent = static_cast<double>(clock.now() - start) * clock.microseconds;
            const WrenchError error = wrenchError(now, result.x, exact_);
            point = {.solver = info_.name,
                     .tolerance = tolerance,
                     .forceError = error.force_N,
                     .torqueError = error.torque_mNm,
                     .iterations = result.iterations,
                     .status = result.byProcessor ? SolveStatus::Invalid : result.status};
            return spent;
        });
        point.us = us.value_or(0);
        return us.has_value();
    }

  private:
    const FrozenContact& contact_;
    const SolverInfo& info_;
    std::unique_ptr<Solver> solver_;
    RowScreen screen_;
    Vec6 exact_;
};

/// Likewise with friction. False when cancelled.
bool runFriction(const FrozenContact& contact, const FrictionSolverInfo& info, const Vec6& exact,
                 const std::function<bool()>& goOn, SweepPoint& point) {
    const auto made = info.make(int(contact.contacts.size()));
    made->limitWork(contact.settings.solverWork);
    std::vector<FrictionContact> contacts = contact.contacts;
    Vec6 begin = Vec6::Zero();
    if (contact.options.warm) {
        const FrictionResult before = made->solve({contact.stiffness, contact.wantedBefore, contacts}, begin);
        if (before.status != FrictionStatus::None) begin = before.x;
        for (std::size_t i = 0; i < contacts.size(); ++i)
            if (before.status != FrictionStatus::None) contacts[i].startForce = before.forces[i];
    }
    const FrictionProblem problem{contact.stiffness, contact.wanted, contacts};
    const StageClock clock = stageClock();
    const auto us = timeRepeated(goOn, [&] {
        const std::uint64_t start = clock.now();
        const FrictionResult result = made->solve(problem, begin);
        const double spent = static_cast<double>(clock.now() - start) * clock.microseconds;
        const WrenchError error = wrenchError({contact.stiffness, contact.wanted, nullptr}, result.x, exact);
        point = {.solver = info.name,
                 .forceError = error.force_N,
                 .torqueError = error.torque_mNm,
                 .iterations = result.iterations,
                 .status = result.status == FrictionStatus::None ? SolveStatus::Invalid : SolveStatus::Solved};
        return spent;
    });
    point.us = us.value_or(0);
    return us.has_value();
}

}  // namespace

std::optional<FrozenContact> freezeContact(const World& world, const Settings& settings, const TickRecord& before,
                                           const TickRecord& now, const SweepOptions& options) {
    Settings exact = settings;
    exact.solver = kExactSolver;
    exact.frictionSolver = kExactFrictionSolver;
    exact.shadow = kNoSolver;
    exact.pause = false;
    if (options.allRows) exact.adaptiveMargin = false;
    std::optional<FrozenContact> largest;
    const auto freeze = [&](int size, const Vec6& stiffness, const Vec6& wanted) {
        if (largest && std::max(largest->rows.size(), int(largest->contacts.size())) > size) return false;
        largest = FrozenContact{.stiffness = stiffness,
                                .wanted = wanted,
                                .wantedBefore = wanted,
                                .options = options,
                                .settings = settings,
                                .reach = world.reach(),
                                .tick = now.tick};
        return true;
    };
    TickState state(world);
    std::unique_ptr<Solver>& solver = renderer(state, kExactSolver);
    solver = std::make_unique<WatchedSolver>(std::move(solver), [&](const QpProblem& problem,
                                                                    const SolveResult& result) {
        if (result.status != SolveStatus::Invalid && freeze(problem.rows->size(), problem.stiffness, problem.wanted))
            largest->rows = *problem.rows;
    });
    std::unique_ptr<FrictionSolver>& frictionSolver = frictionRenderer(state, exact.frictionSolver);
    frictionSolver = std::make_unique<WatchedFrictionSolver>(
        std::move(frictionSolver), [&](const FrictionProblem& problem, const FrictionResult& result) {
            if (result.status == FrictionStatus::None ||
                !freeze(int(problem.contacts.size()), problem.stiffness, problem.wanted))
                return;
            largest->contacts.assign(problem.contacts.begin(), problem.contacts.end());
            // An answer as the start would favor what iterates from there.
            for (FrictionContact& contact : largest->contacts) contact.startForce.setZero();
        });
    state.resume(before);
    step(world, exact, {now.X_WT_device}, state);
    if (largest && settings.mode == Mode::Default) {
        const auto atC = [&](const Pose& X_WT) { return Pose{X_WT * world.p_TC(), X_WT.q}; };
        largest->wantedBefore = incrementBetween(atC(before.X_WT), atC(before.X_WT_device));
    }
    return largest;
}

bool fitsTick(const SolverInfo& info, const Settings& settings) {
    return isUsable(info) && (!info.roundTrip || info.roundTrip().us < 1e6 / settings.rate);
}

std::optional<Sweep> sweepContact(const FrozenContact& contact, const std::function<bool(double)>& progress,
                                  bool slowCards) {
    const auto table = solverTable();
    const auto isRun = [&](const SolverInfo& info) {
        return slowCards ? isUsable(info) : fitsTick(info, contact.settings);
    };
    std::size_t planned = contact.rubs() ? frictionSolverTable().size() : 0;
    for (const SolverInfo& info : table) planned += contact.rubs() || !isRun(info) ? 0 : tolerancesOf(info).size();

    Sweep sweep{.tick = contact.tick,
                .rows = contact.rubs() ? int(contact.contacts.size()) : contact.rows.size(),
                .mode = contact.settings.mode,
                .friction = contact.rubs(),
                .points = {}};
    const auto goOn = [&] {
        return !progress || progress(static_cast<double>(sweep.points.size()) / static_cast<double>(planned));
    };
    if (contact.rubs()) {
        ConeNewton reference(int(contact.contacts.size()));
        const FrictionResult truth =
            reference.solve({contact.stiffness, contact.wanted, contact.contacts}, Vec6::Zero());
        if (truth.status == FrictionStatus::None) return sweep;  // no error is known
        const Vec6 exact = truth.x;
        for (const FrictionSolverInfo& solver : frictionSolverTable()) {
            SweepPoint point;
            if (!runFriction(contact, solver, exact, goOn, point)) return std::nullopt;
            sweep.points.push_back(point);
        }
    } else {
        const auto reference = findSolver(kExactSolver)->make(contact.rows.size());
        const Vec6 exact =
            reference->solve({contact.stiffness, contact.wanted, &contact.rows}, solverSettings(contact.settings)).x;
        for (const SolverInfo& solver : table) {
            if (!isRun(solver)) continue;
            SolverRun run(contact, solver, exact);
            for (const double tolerance : tolerancesOf(solver)) {
                SweepPoint point;
                if (!run.run(tolerance, goOn, point)) return std::nullopt;
                sweep.points.push_back(point);
            }
        }
    }
    // A solver without an answer is no point of the front.
    std::vector<TimeAndError> points;
    std::vector<std::size_t> which;
    for (std::size_t i = 0; i < sweep.points.size(); ++i) {
        const SweepPoint& point = sweep.points[i];
        if (point.status == SolveStatus::Invalid) continue;
        points.emplace_back(point.us, std::max(kLeastError, point.forceError));
        which.push_back(i);
    }
    for (const std::size_t i : paretoFront(points)) sweep.points[which[i]].onFront = true;
    return sweep;
}

std::optional<SweepPoint> pointAt(const Sweep& sweep, std::string_view solver, double tolerance) {
    const SweepPoint *coarser = nullptr, *finer = nullptr;  // neighbors of the tolerance
    for (const SweepPoint& point : sweep.points) {
        if (point.solver != solver) continue;
        if (!coarser || point.tolerance >= tolerance) coarser = &point;
        finer = &point;
        if (point.tolerance <= tolerance) break;
    }
    if (!coarser) return std::nullopt;
    SweepPoint at = *coarser;
    if (coarser == finer || !(finer->tolerance > 0) || tolerance >= coarser->tolerance) return at;
    const double share = std::clamp(
        std::log(tolerance / coarser->tolerance) / std::log(finer->tolerance / coarser->tolerance), 0.0, 1.0);
    const auto between = [share](double a, double b, double least) {
        return std::exp((1 - share) * std::log(std::max(a, least)) + share * std::log(std::max(b, least)));
    };
    at.tolerance = tolerance;
    at.us = between(coarser->us, finer->us, 1e-6);
    at.forceError = between(coarser->forceError, finer->forceError, kLeastError);
    at.torqueError = between(coarser->torqueError, finer->torqueError, kLeastError);
    return at;
}

void writeSweep(const Sweep& sweep, const std::filesystem::path& file) {
    std::ostringstream out;
    out << "tick,rows,mode,solver,tolerance,time_us,force_error_N,torque_error_mNm,iterations,status,on_front\n";
    for (const SweepPoint& p : sweep.points)
        out << sweep.tick << ',' << sweep.rows << ',' << modeNames()[static_cast<std::size_t>(sweep.mode)] << ','
            << p.solver << ',' << p.tolerance << ',' << p.us << ',' << p.forceError << ',' << p.torqueError << ','
            << p.iterations << ',' << name(p.status) << ',' << int(p.onFront) << '\n';
    writeFile(file, "the sweep", out.view());
}

void SweepRun::start(std::shared_ptr<const World> world, const Settings& settings, const TickRecord& before,
                     const TickRecord& now, const SweepOptions& options) {
    Background::start([world = std::move(world), settings, before, now, options](const MeasureProgress& progress) {
        const auto contact = freezeContact(*world, settings, before, now, options);
        if (!contact)
            throw std::runtime_error(hasFriction(*world, settings)
                                         ? "Nothing touches the tool in this tick: press it into contact, then sweep."
                                         : "Nothing is near the tool in this tick: bring it into contact, then sweep.");
        return sweepContact(*contact, progress, false);
    });
}

}  // namespace touchstone::sandbox
