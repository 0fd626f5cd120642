// touchstone bench friction: the time and error of the friction solvers on the contacts of a pad.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>

#include "haptics/files/output_file.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/qp/contact_forces.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/csv.hpp"

namespace touchstone::app {
namespace {

constexpr int kPadRows = 200;
/// The hand tilts and slides a pad, so that three of its feet carry force in the end; one that is flat it only presses.
struct PadMotion {
    int feet;
    bool flat;
};
constexpr PadMotion kPads[] = {{3, false}, {18, false}, {18, true}};
constexpr double kCoefficient = 0.4;

/// A tool with feet on a ring, pressed on a plane, and rows of other places that it does not reach. The hand presses,
/// slides, turns and tilts it, and rests in between. The tool follows the exact answers, and every solver is given the
/// problems that the exact one is given in the tick: the contacts that carry force or are crossed, with the forces of
/// the tick before.
class Pad final : public RowContacts {
  public:
    struct Tick {
        std::vector<double> gaps;  ///< of the rows, mm
        Vec6 wanted;
        std::vector<FrictionContact> contacts;
    };

    Pad(const PadMotion& motion, int count) : rows(kPadRows) {
        const int feet = motion.feet;
        std::mt19937_64 random(1);
        std::uniform_real_distribution<double> unit(0, 1);
        std::normal_distribution<double> noise;
        stiffness << 1, 1, 1, 1000, 1000, 1000;
        std::vector<double> gaps;
        for (int i = 0; i < kPadRows; ++i) {
            const bool foot = i < feet;
            const double angle = 2 * std::numbers::pi * (foot ? double(i) / feet : unit(random));
            const double radius = foot ? 10 : 12 + 20 * unit(random), tilt = foot ? 0 : 0.8 * unit(random);
            const Vec3 along(std::cos(angle), std::sin(angle), 0);
            places_.push_back(radius * along - Vec3(0, 0, 5));
            Vec6 row;
            const Vec3 n = std::cos(tilt) * Vec3::UnitZ() - std::sin(tilt) * along;
            row << n, places_.back().cross(n);
            gaps.push_back(foot ? 0 : 0.5 + 0.5 * unit(random));
            rows.push(row, gaps.back(), std::uint64_t(i));
        }
        ContactForces forces;
        ConeNewton exact(ContactForces::kMaxContacts);
        const auto frictionless = findSolver(kExactSolver)->make(kPadRows);
        Vec6 tool = Vec6::Zero();
        for (int i = 0; i < count; ++i) {
            Vec6 device = deviceAt(0.001 * i);
            if (motion.flat) device << 0, 0, -3 - std::sin(0.002 * i), 0, 0, 0;
            for (int k = 0; k < 6; ++k) device[k] += (k < 3 ? 0.002 : 5e-5) * noise(random);
            ticks.push_back({gaps, device - tool, {}});
            set(ticks.back());
            const auto result = forces.solve(problem(ticks.back()), {}, *this, *frictionless, exact, true);
            ticks.back().contacts.assign(forces.contacts().begin(), forces.contacts().end());
            forces.endTick();
            tool += result.x;
            for (int row = 0; row < kPadRows; ++row)
                gaps[std::size_t(row)] = std::max(0.0, gaps[std::size_t(row)] + rows.row(row).dot(result.x));
        }
    }

    void set(const Tick& tick) { std::copy(tick.gaps.begin(), tick.gaps.end(), rows.gap()); }
    QpProblem problem(const Tick& tick) const { return {stiffness, tick.wanted, &rows}; }
    FrictionProblem frictionProblem(const Tick& tick) const { return {stiffness, tick.wanted, tick.contacts}; }
    Place placeOf(std::uint64_t id) const noexcept override {
        return {places_[id], Vec3::Zero(), kCoefficient, kCoefficient};
    }

    RowSet rows;
    Vec6 stiffness;
    std::vector<Tick> ticks;

  private:
    /// mm and rad at a time in s.
    static Vec6 deviceAt(double t) {
        const double tau = 2 * std::numbers::pi, slow = std::sin(tau * 0.31 * t);
        const double moves = std::max(0.0, std::sin(tau * 0.17 * t));  // half of the time at rest
        Vec6 device;
        device << 8 * moves * std::sin(tau * 0.7 * t), 8 * moves * std::cos(tau * 0.43 * t), -3 - slow,
            0.006 * std::sin(tau * 0.53 * t), 0.006 * std::cos(tau * 0.37 * t), 0.03 * moves * std::sin(tau * 0.9 * t);
        return device;
    }

    std::vector<Vec3> places_;  ///< of the contacts, from C, mm
};

/// One solver on the pad; without `info` the exact solver without friction, on all rows.
class PadRun {
  public:
    PadRun(Pad& pad, const FrictionSolverInfo* info)
        : pad_(pad), info_(info), frictionless_(findSolver(kExactSolver)->make(kPadRows)) {
        if (info) solver_ = info->make(ContactForces::kMaxContacts);
    }

    /// CPU time of each tick, µs.
    std::vector<double> time() {
        return run([](const Pad::Tick&, const FrictionResult&) {});
    }

    /// Compares each answer with Coulomb's law, and that of a baseline with the exact one.
    QpCost judge() {
        ConeNewton exact(ContactForces::kMaxContacts);
        std::vector<double> errors, residuals, hovers, contacts, loaded, iterations;
        int missing = 0;
        run([&](const Pad::Tick& tick, const FrictionResult& result) {
            iterations.push_back(result.iterations);
            if (!info_) return;
            contacts.push_back(double(tick.contacts.size()));
            const auto carries = [](const Vec3& force) { return !force.isZero(0); };
            loaded.push_back(double(std::count_if(result.forces.begin(), result.forces.end(), carries)));
            if (result.status == FrictionStatus::None || (info_->exact && result.status != FrictionStatus::Exact)) {
                ++missing;
                return;
            }
            hovers.push_back(hoverOf(tick, result));
            residuals.push_back(coulombResiduals(pad_.frictionProblem(tick), result.x, result.forces).worst_N());
            if (info_->exact) return;
            const FrictionResult truth = exact.solve(pad_.frictionProblem(tick), Vec6::Zero());
            if (truth.status != FrictionStatus::Exact) return;
            errors.push_back(wrenchError(pad_.problem(tick), result.x, truth.x).force_N);
        });
        const auto orNull = [](std::vector<double>& values, double percent) {
            const auto value = percentile(values, percent);
            return value ? QpCost(*value) : QpCost();
        };
        return {{"contacts_p50", orNull(contacts, 50)},
                {"loaded_p50", orNull(loaded, 50)},
                {"iterations_p50", orNull(iterations, 50)},
                {"error_p50_N", orNull(errors, 50)},
                {"error_max_N", orNull(errors, 100)},
                {"residual_max_N", orNull(residuals, 100)},
                {"hover_p50_mm", orNull(hovers, 50)},
                {"hover_max_mm", orNull(hovers, 100)},
                {"missing_share", double(missing) / double(pad_.ticks.size())}};
    }

  private:
    /// As in TickRecord: the greatest gap over contacts that carry more than max(0.02 N, 1 % of the largest force).
    static double hoverOf(const Pad::Tick& tick, const FrictionResult& result) {
        double largest = 0, hover = 0;
        for (std::size_t i = 0; i < tick.contacts.size(); ++i)
            largest = std::max(largest, tick.contacts[i].n.dot(result.forces[i]));
        for (std::size_t i = 0; i < tick.contacts.size(); ++i)
            if (tick.contacts[i].n.dot(result.forces[i]) > std::max(0.02, 0.01 * largest))
                hover = std::max(hover, tick.contacts[i].distance(result.x));
        return hover;
    }

    template <class Then>
    std::vector<double> run(Then&& then) {
        std::vector<double> times;
        frictionless_->reset();
        for (const Pad::Tick& tick : pad_.ticks) {
            pad_.set(tick);
            FrictionResult result;
            const double start = threadCpuMicroseconds();
            if (info_)
                result = solver_->solve(pad_.frictionProblem(tick), Vec6::Zero());
            else
                result.iterations = frictionless_->solve(pad_.problem(tick), {}).iterations;
            times.push_back(threadCpuMicroseconds() - start);
            then(tick, result);
        }
        return times;
    }

    Pad& pad_;
    const FrictionSolverInfo* info_;
    std::unique_ptr<FrictionSolver> solver_;
    std::unique_ptr<Solver> frictionless_;
};

std::vector<QpCost> measureFriction(const PadMotion& motion, bool quick) {
    Pad pad(motion, quick ? 500 : 10'000);
    std::vector<const FrictionSolverInfo*> solvers{nullptr};
    for (const FrictionSolverInfo& info : frictionSolverTable()) solvers.push_back(&info);
    std::vector<QpCost> costs;
    for (const FrictionSolverInfo* info : solvers) {
        PadRun run(pad, info);
        QpCost cost{{"rows", kPadRows},
                    {"feet", motion.feet},
                    {"flat", motion.flat},
                    {"friction", info != nullptr},
                    {"solver", info ? info->name : kExactSolver},
                    {"ticks", pad.ticks.size()}};
        cost.update(run.judge());  // which also warms the caches
        std::vector<double> clock = timeConstant(1000, 0), medians, tails, constants, shortest;
        const double reading = *percentile(clock, 50);
        for (int pass = 0; pass < (quick ? 1 : 3); ++pass) {
            std::vector<double> times = run.time();
            if (shortest.empty()) shortest = times;
            std::transform(times.begin(), times.end(), shortest.begin(), shortest.begin(),
                           [](double a, double b) { return std::min(a, b); });
            const double median = *percentile(times, 50);
            std::vector<double> equal = timeConstant(times.size(), median - reading);
            medians.push_back(median - reading);
            tails.push_back(*percentile(times, 99.9) - reading);
            constants.push_back(*percentile(equal, 99.9) - reading);
        }
        cost["median_us"] = *percentile(medians, 50);
        cost["p999_us"] = *percentile(tails, 50);
        cost["constant_p999_us"] = *percentile(constants, 50);
        cost["shortest_p999_us"] = *percentile(shortest, 99.9) - reading;
        costs.push_back(std::move(cost));
    }
    return costs;
}

struct BenchFrictionCommand {
    std::filesystem::path csv;  ///< empty: none
    bool quick = false;
};

int benchFriction(const BenchFrictionCommand& command) {
    std::vector<QpCost> table;
    std::printf("%4s %8s  %-16s %10s %10s %9s %9s %17s %19s %8s\n", "rows", "loaded", "solver", "median µs", "p99.9 µs",
                "constant", "shortest", "force error N", "hover mm", "missing");
    std::printf("%4s %8s  %-16s %9s %9s %10s %10s %17s %19s %8s\n", "", "", "", "", "", "p99.9 µs", "p99.9 µs",
                "median / max", "median / max", "%");
    for (const PadMotion& motion : kPads) {
        for (const QpCost& cost : measureFriction(motion, command.quick)) {
            const auto number = [&](const char* key) { return cost[key].is_null() ? 0 : cost[key].get<double>(); };
            std::printf("%4d %8.0f  %-16s %9.2f %9.2f %9.2f %9.2f %8.2g %8.2g %9.2g %9.2g %8.3g%s\n", kPadRows,
                        number("loaded_p50"), cost["solver"].get<std::string>().c_str(), number("median_us"),
                        number("p999_us"), number("constant_p999_us"), number("shortest_p999_us"),
                        number("error_p50_N"), number("error_max_N"), number("hover_p50_mm"), number("hover_max_mm"),
                        100 * number("missing_share"), cost["friction"].get<bool>() ? "" : "  without friction");
            std::fflush(stdout);
            table.push_back(cost);
        }
    }
    if (!command.csv.empty()) writeFile(command.csv, "the table", toCsv(table));
    return kOk;
}

}  // namespace

const CLI::App* addBenchFriction(CLI::App& bench, Action& action) {
    const auto options = std::make_shared<BenchFrictionCommand>();
    CLI::App* friction = addCommand(
        bench, "friction", "Measure the friction solvers alone, on pads of 3 and 18 contacts in 200 rows",
        "Missing: answers of the exact solver that are not exact to rounding, and those that a baseline\n"
        "does not find, so that the exact solver takes over. Times are thread CPU time less that of reading\n"
        "the clock; constant: the same for a constant workload of equal duration; shortest: the shortest time\n"
        "of each tick in three passes, since the noise of the machine seldom hits the same tick twice.\n\n"
        "Example:\n  touchstone bench friction --csv friction.csv\n");
    friction->add_option("--csv", options->csv, "write the table to a CSV file");
    friction->add_flag("--quick", options->quick, "fewer ticks");
    friction->callback([options, &action] { action = [options] { return benchFriction(*options); }; });
    return friction;
}

}  // namespace touchstone::app
