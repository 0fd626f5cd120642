// Measures the cases of a scene: each is run once in full to judge it, then timed in runs that alternate with those of
// the other cases.
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/measure/error_split.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/bench.hpp"

namespace touchstone::app {
namespace {

/// Limit of an exact answer's KKT residuals on rows of unit normal, in mm, N and mJ.
constexpr double kExactResidual = 1e-6;
/// Upper ends of the classes of the device's depth beyond the tool by which times are reported, mm.
constexpr int kDepths[] = {1, 2, 5, 10, 20, 40};
constexpr const char* kStageNames[] = {"step", "collision", "solve", "list_worker",
                                       "both"};  // both: step and list worker
constexpr std::size_t kStages = std::size(kStageNames);
constexpr double kSlowUs = 70;  // the goal for bunnies: at most one tick in a thousand takes longer

/// Checks every problem that the solver was given, and every tick. Times count only if no check fails.
class Judge {
  public:
    Judge(const Settings& settings, double tolerance)
        : exact_(findSolver(settings.solver)->exact), limit_(exact_ ? kExactResidual : tolerance * (1 + 1e-6)) {}

    void solved(const QpProblem& problem, const SolveResult& result) {
        ++statuses_[static_cast<std::size_t>(result.status)];
        const bool elastic = result.status == SolveStatus::Elastic && exact_;
        if (result.status != SolveStatus::Solved && !elastic) return;
        RowSet softened(elastic ? problem.rows->size() : 0);
        if (elastic) soften(problem, result.slack, softened);
        const KktResiduals kkt = kktResiduals({problem.stiffness, problem.wanted, elastic ? &softened : problem.rows},
                                              result.x, result.multipliers);
        residual_ = std::max({residual_, kkt.dual_N, kkt.stationarity_N, exact_ ? kkt.primal_mm : 0.0,
                              exact_ ? kkt.complementarity_mJ : natural(problem, result)});
    }

    /// The rows that an elastic answer satisfies: each is relaxed by the slack in the metric of the stiffness.
    static void soften(const QpProblem& problem, double slack, RowSet& softened) {
        for (int i = 0; i < problem.rows->size(); ++i) {
            const Vec6 j = problem.rows->row(i);
            const double length = j.cwiseQuotient(problem.stiffness.cwiseSqrt()).norm();
            softened.push(j, problem.rows->gap()[i] + slack * length, problem.rows->id(i));
        }
    }

    void ticked(const TickRecord& record) {
        nonFinite_ += (record.flags & kNonFinite) != 0;
        overflows_ += (record.flags & kListOverflow) != 0;
        byProcessor_ += (record.flags & kByProcessor) != 0;
        inexact_ += record.screenInexact > 0;
    }

    /// The reason why the times do not count; empty if they do.
    std::string why() const {
        std::string text;
        const auto say = [&](std::uint64_t count, const std::string& what) {
            if (count > 0) text += (text.empty() ? "" : "; ") + std::to_string(count) + " " + what;
        };
        for (const SolveStatus status : {SolveStatus::IterationLimit, SolveStatus::Invalid})
            say(statuses_[static_cast<std::size_t>(status)], std::string("answers are ") + name(status));
        say(nonFinite_, "non-finite ticks");
        say(overflows_, "ticks with an overflowing list");
        say(byProcessor_, "ticks that the card left to the processor");
        if (residual_ > limit_) {
            char number[96];
            std::snprintf(number, sizeof number, "%sresidual %.2g above %.2g", text.empty() ? "" : "; ", residual_,
                          limit_);
            text += number;
        }
        return text;
    }
    double residual() const { return residual_; }
    std::uint64_t elastic() const { return statuses_[static_cast<std::size_t>(SolveStatus::Elastic)]; }
    std::uint64_t inexact() const { return inexact_; }

  private:
    /// max |min(y_i, s_i / q_i)|, the residual that the tolerance of an approximate solver bounds, N.
    double natural(const QpProblem& problem, const SolveResult& result) {
        forces_.assign(static_cast<std::size_t>(problem.rows->size()), 0);
        for (const Multiplier& y : result.multipliers) forces_[static_cast<std::size_t>(y.row)] = y.value;
        double worst = 0;
        for (int i = 0; i < problem.rows->size(); ++i) {
            const Vec6 row = problem.rows->row(i);
            const double q = row.cwiseAbs2().cwiseQuotient(problem.stiffness).sum();
            const double s = row.dot(result.x) + problem.rows->gap()[i];
            if (q > 0) worst = std::max(worst, std::abs(std::min(forces_[static_cast<std::size_t>(i)], s / q)));
        }
        return worst;
    }

    const bool exact_;
    const double limit_;
    std::array<std::uint64_t, 4> statuses_{};
    std::uint64_t nonFinite_ = 0, overflows_ = 0, byProcessor_ = 0, inexact_ = 0;
    double residual_ = 0;
    std::vector<double> forces_;
};

nlohmann::ordered_json medianOrNull(std::vector<double> values) {
    const std::optional<double> value = percentile(values, 50);
    return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

/// Times of one case, collected run by run.
struct Timing {
    std::array<std::array<std::vector<double>, 3>, kStages> percentiles;  ///< of each run: p50, p99, p99.9
    std::vector<double> most, constantMost;
    std::vector<double> slow;      ///< share of a run's ticks above kSlowUs
    std::vector<double> firstTen;  ///< longest of the motion's first ten ticks, for each repetition
    std::array<std::vector<double>, 3> constant;
    std::vector<std::vector<double>> byDepth = std::vector<std::vector<double>>(std::size(kDepths));
    std::size_t ticks = 0;  ///< smallest tick count of a run

    void add(std::array<std::vector<double>, kStages>& times, std::vector<double>& equal) {
        ticks = ticks == 0 ? times[0].size() : std::min(ticks, times[0].size());
        const auto count = std::count_if(times[0].begin(), times[0].end(), [](double us) { return us > kSlowUs; });
        slow.push_back(static_cast<double>(count) / static_cast<double>(times[0].size()));
        for (std::size_t stage = 0; stage < kStages; ++stage) addPercentiles(times[stage], percentiles[stage]);
        most.push_back(*std::max_element(times[0].begin(), times[0].end()));
        addPercentiles(equal, constant);
        constantMost.push_back(*std::max_element(equal.begin(), equal.end()));
    }

  private:
    static void addPercentiles(std::vector<double>& values, std::array<std::vector<double>, 3>& to) {
        const Percentiles got = touchstone::percentiles(values);
        for (const auto& [at, value] : {std::pair{0, got.p50}, std::pair{1, got.p99}, std::pair{2, got.p999}})
            to[static_cast<std::size_t>(at)].push_back(*value);
    }
};

/// Arithmetic of constant cost per round.
void work(std::uint64_t rounds) {
    volatile double x = 1;
    for (std::uint64_t i = 0; i < rounds; ++i) x = x * 0.999999 + 1e-6;
}

}  // namespace

std::vector<double> timeConstant(std::size_t count, double us) {
    static const double roundsPerUs = [] {
        constexpr std::uint64_t kRounds = 2'000'000;
        work(kRounds);
        const double start = threadCpuMicroseconds();
        work(kRounds);
        return kRounds / (threadCpuMicroseconds() - start);
    }();
    const auto rounds = static_cast<std::uint64_t>(us * roundsPerUs);
    std::vector<double> times(count);
    for (double& time : times) {
        const double start = threadCpuMicroseconds();
        work(rounds);
        time = threadCpuMicroseconds() - start;
    }
    return times;
}

namespace {

/// The sizes of the parts as far as the world has them.
void addSizes(BenchRow& row, const World& world) {
    const Obstacle& obstacle = world.obstacles.front();
    for (const auto& [name, surface, tree] :
         {std::tuple{"tool", world.tool.surface.get(), world.tool.spheres.get()},
          std::tuple{"obstacle", obstacle.part.surface.get(), obstacle.part.spheres.get()}}) {
        row[std::string(name) + "_leaves"] = tree ? nlohmann::ordered_json(tree->leafCount()) : nullptr;
        row[std::string(name) + "_triangles"] =
            surface ? nlohmann::ordered_json(surface->features.faces.size()) : nullptr;
    }
    std::set<const Surface*> surfaces{world.tool.surface.get()};  // equal parts share one
    for (const Obstacle& each : world.obstacles) surfaces.insert(each.part.surface.get());
    surfaces.erase(nullptr);
    std::size_t bytes = 0, triangles = 0;
    for (const Surface* surface : surfaces) {
        bytes += surface->bytes();
        triangles += surface->features.faces.size();
    }
    row["surface_bytes_per_triangle"] =
        triangles > 0 ? nlohmann::ordered_json(double(bytes) / double(triangles)) : nullptr;
}

/// A case while it is measured.
class Measuring {
  public:
    Measuring(const sandbox::HapticScene& scene, const BenchCase& wanted)
        : scene_(scene),
          case_(wanted),
          settings_(wanted.settings(scene.settings)),
          judge_(settings_, wanted.tolerance),
          motions_(wanted.parts.empty() ? std::vector{wanted.motion} : wanted.parts) {
        options_.timing = false;
    }

    /// Runs the case once in full, which is also the warm-up.
    void judge() {
        options_.onSolve = [&](const QpProblem& problem, const SolveResult& result) { judge_.solved(problem, result); };
        sandbox::RunStatistics statistics;
        options_.onTick = [&](const TickRecord& record, double penetration) {
            judge_.ticked(record);
            records_.push_back(record);
            statistics.add(record, penetration, 1000 / settings_.rate);
        };
        for (const std::string& motion : motions_) {
            options_.device = "demo:" + motion;
            const sandbox::Report one = sandbox::runHeadless(scene_, settings_, options_).report;
            hashes_.push_back(one.hash);
            report_.checks.insert(report_.checks.end(), one.checks.begin(), one.checks.end());
        }
        statistics.write(report_);
        options_.onSolve = nullptr;
        options_.onTick = nullptr;
        options_.paced = case_.listWorker;
    }

    void splitErrors(const MeshReference& reference, int samples) {
        std::vector<std::size_t> touching;
        for (std::size_t i = 1; i < records_.size(); ++i)
            if (records_[i].wrench_C.force.norm() > sandbox::kContactForce && !(records_[i].flags & kNonFinite))
                touching.push_back(i);
        const auto count = std::min(static_cast<std::size_t>(samples), touching.size());
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t at = touching[(2 * i + 1) * touching.size() / (2 * count)];
            try {
                const sandbox::ErrorSplit split =
                    sandbox::splitError(*scene_.world, settings_, reference, records_[at - 1], records_[at]);
                if (split.converged)
                    splits_.push_back(split);
                else
                    ++lost_;
            } catch (const std::invalid_argument&) {
                ++lost_;  // the meshes overlap, so the exact answer does not exist
            }
        }
    }

    void time(const BenchEffort& effort) {
        if (!judge_.why().empty() || report_.ticks == 0) return;
        if (!timing_.most.empty() && spent_ > effort.atMost) return;
        std::array<std::vector<double>, kStages> times;
        const double start = threadCpuMicroseconds();
        do {
            std::size_t tick = 0;
            for (std::size_t motion = 0; motion < motions_.size(); ++motion) {
                options_.device = "demo:" + motions_[motion];
                const sandbox::TimedRun run = sandbox::timeHeadless(scene_, settings_, options_);
                if (run.hash != hashes_[motion])
                    throw std::runtime_error(case_.key() +
                                             ": a repeated run gave different results, which is a bug in the program: "
                                             "please report it");
                double first = 0;
                for (std::size_t i = 0; i < std::min<std::size_t>(10, run.ticks.size()); ++i)
                    first = std::max(first, run.ticks[i].step);
                timing_.firstTen.push_back(first);
                for (const sandbox::TickTimes& one : run.ticks) {
                    times[0].push_back(one.step);
                    times[1].push_back(one.collision);
                    times[2].push_back(one.solve);
                    times[3].push_back(one.listWorker);
                    times[4].push_back(one.step + one.listWorker);
                    const double depth = records_[tick++].wrench_C.force.norm() / settings_.stiffness;
                    const auto at =
                        std::lower_bound(std::begin(kDepths), std::end(kDepths), depth) - std::begin(kDepths);
                    if (depth > 0 && at < std::ssize(kDepths))
                        timing_.byDepth[static_cast<std::size_t>(at)].push_back(one.step);
                }
            }
        } while (times[0].size() < (case_.listWorker ? effort.paced : effort.ticks) &&
                 threadCpuMicroseconds() - start < 1e6 * effort.seconds);
        std::vector<double> equal = timeConstant(times[0].size(), percentiles(times[0]).p50.value_or(0));
        timing_.add(times, equal);
        spent_ += 1e-6 * (threadCpuMicroseconds() - start);
    }

    BenchRow row() const {
        const auto orNull = [](const std::optional<double>& value) {
            return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
        };
        std::vector<double> screened;
        for (const TickRecord& record : records_) screened.push_back(record.rowsScreened);
        BenchRow row{{"key", case_.key()},
                     {"scene", case_.scene},
                     {"motion", case_.motion},
                     {"mode", case_.mode},
                     {"geometry", case_.geometry},
                     {"solver", case_.solver},
                     {"tolerance", case_.tolerance > 0 ? nlohmann::ordered_json(case_.tolerance) : nullptr},
                     {"leaves", case_.leaves},
                     {"linearizations", linearizationsOf(settings_, geometryOf(settings_))},
                     {"screening", case_.screening},
                     {"rate_Hz", settings_.rate},
                     {"valid", judge_.why().empty()},
                     {"why", judge_.why()},
                     {"ticks", report_.ticks}};
        addSizes(row, *scene_.world);
        row["clearance_mm"] = orNull(scene_.roles.clearance);
        addTimes(row);
        row["rows_p50"] = orNull(report_.rows.p50);
        row["rows_max"] = orNull(report_.rows.max);
        row["rows_screened_p50"] = medianOrNull(screened);
        row["rows_screened_max"] = orNull(percentile(screened, 100));
        row["screen_inexact_ticks"] = judge_.inexact();
        row["iterations_p50"] = orNull(report_.iterations.p50);
        row["penetration_max_mm"] = orNull(report_.penetration.max);
        row["hover_p99_mm"] = orNull(report_.hover.p99);
        row["hover_max_mm"] = orNull(report_.hover.max);
        row["force_max_N"] = report_.force;
        row["dforce_max_N_per_ms"] = orNull(report_.forceChange.max);
        row["elastic_answers"] = judge_.elastic();
        row["rows_truncated"] = report_.rowsTruncated;
        row["residual"] = judge_.residual();
        row["outcome_met"] = report_.met();
        addErrors(row);
        return row;
    }

  private:
    void addTimes(BenchRow& row) const {
        constexpr const char* kNames[] = {"_p50_us", "_p99_us", "_p999_us"};
        const bool valid = !timing_.most.empty();
        row["runs"] = timing_.most.size();
        row["run_ticks"] = timing_.ticks;
        for (std::size_t stage = 0; stage < kStages; ++stage)
            for (std::size_t i = 0; i < 3; ++i)
                row[std::string(kStageNames[stage]) + kNames[i]] = medianOrNull(timing_.percentiles[stage][i]);
        const auto least = [&](const std::vector<double>& values) {
            return valid ? nlohmann::ordered_json(*std::min_element(values.begin(), values.end())) : nullptr;
        };
        row["step_worst_us"] = least(timing_.most);
        row["step_first_ten_us"] = least(timing_.firstTen);
        row["step_slow_share"] = medianOrNull(timing_.slow);
        for (std::size_t i = 0; i < 3; ++i)
            row[std::string("constant") + kNames[i]] = medianOrNull(timing_.constant[i]);
        row["constant_worst_us"] = least(timing_.constantMost);
        for (std::size_t i = 0; i < std::size(kDepths); ++i)
            row["depth_" + std::to_string(kDepths[i]) + "mm_us"] = medianOrNull(timing_.byDepth[i]);
    }

    void addErrors(BenchRow& row) const {
        using Split = sandbox::ErrorSplit;
        using Error = sandbox::AnswerError;
        row["samples"] = splits_.size();
        row["samples_lost"] = lost_;
        for (const auto& [name, share] :
             {std::pair{"error", &Split::total}, std::pair{"geometry", &Split::geometry},
              std::pair{"linearization", &Split::linearization}, std::pair{"solver", &Split::solver}}) {
            for (const auto& [unit, value] : {std::pair{"mm", &Error::position}, std::pair{"rad", &Error::rotation},
                                              std::pair{"N", &Error::force}, std::pair{"mNm", &Error::torque}}) {
                std::vector<double> values;
                for (const Split& split : splits_) values.push_back(split.*share.*value);
                row[std::string(name) + "_p50_" + unit] = medianOrNull(values);
                row[std::string(name) + "_max_" + unit] =
                    values.empty() ? nlohmann::ordered_json()
                                   : nlohmann::ordered_json(*std::max_element(values.begin(), values.end()));
            }
        }
    }

    const sandbox::HapticScene& scene_;
    const BenchCase case_;
    const Settings settings_;
    sandbox::HeadlessOptions options_;
    Judge judge_;
    const std::vector<std::string> motions_;
    std::vector<std::uint64_t> hashes_;  // of each motion
    sandbox::Report report_;             // of all motions
    std::vector<TickRecord> records_;
    std::vector<sandbox::ErrorSplit> splits_;
    int lost_ = 0;
    Timing timing_;
    double spent_ = 0;  // CPU time of the timed runs, s
};

}  // namespace

std::vector<BenchRow> measureCases(const sandbox::HapticScene& opened, std::span<const BenchCase> cases,
                                   const BenchEffort& effort) {
    const std::unique_ptr<const MeshReference> reference(
        effort.samples > 0 ? new MeshReference(sandbox::meshReferenceOf(opened)) : nullptr);
    std::vector<Measuring> all;
    for (const BenchCase& wanted : cases) {
        Measuring& one = all.emplace_back(opened, wanted);
        std::fprintf(stderr, "%s\n", wanted.key().c_str());
        one.judge();
        if (reference) one.splitErrors(*reference, effort.samples);
    }
    for (int run = 0; run < effort.runs; ++run)
        for (Measuring& one : all) one.time(effort);
    std::vector<BenchRow> rows;
    for (const Measuring& one : all) rows.push_back(one.row());
    return rows;
}

}  // namespace touchstone::app
