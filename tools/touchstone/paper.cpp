// touchstone paper: the published experiments again, and what came out beside what was published.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/scene/text.hpp"
#include "engine/view/image_file.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/measure/report.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/compare.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/gnuplot.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using Runs = std::vector<ComparedRun>;
using Values = std::vector<double>;

constexpr double kBudget = 1000;  // µs, of a tick at 1 kHz
/// Upper ends of the classes of pairs that times are told by.
constexpr int kPairs[] = {0, 50, 100, 150, 200, 300, 500, 1000};

const ComparedRun& runOf(const Runs& runs, const std::string& name) {
    return *std::find_if(runs.begin(), runs.end(), [&](const ComparedRun& run) { return run.what.name() == name; });
}

double meanOrZero(const Values& values) { return values.empty() ? 0 : mean(values); }
double mostOf(const Values& values) { return values.empty() ? 0 : *std::max_element(values.begin(), values.end()); }

/// value(tick, index) of the ticks that keep(tick, index).
template <class Keep, class Value>
Values valuesOf(const ComparedRun& run, Keep keep, Value value) {
    Values values;
    for (std::size_t i = 0; i < run.ticks.size(); ++i)
        if (keep(run.ticks[i], i)) values.push_back(value(run.ticks[i], i));
    return values;
}
const auto inContact = [](const TickRecord& tick, std::size_t) { return tick.pairs > 0; };
const auto stepTime = [](const TickRecord& tick, std::size_t) { return tick.totalUs; };
auto pairsFrom(int from, int to) {
    return [=](const TickRecord& tick, std::size_t) { return tick.pairs >= from && tick.pairs < to; };
}

/// Times of each case in paper mode by how many pairs intersect.
ordered_json classesOf(const std::vector<const Runs*>& motions) {
    ordered_json classes = ordered_json::array();
    for (std::size_t k = 0; k + 1 < std::size(kPairs); ++k) {
        ordered_json line{{"pairs_from", kPairs[k] + 1}, {"pairs_to", kPairs[k + 1]}};
        for (const char* solver : {"active-set", "pqp", "dual-active-set"}) {
            Values times, iterations;
            for (const Runs* runs : motions) {
                const ComparedRun& run = runOf(*runs, std::string("paper ") + solver);
                const auto keep = pairsFrom(kPairs[k] + 1, kPairs[k + 1] + 1);
                const Values more = valuesOf(run, keep, stepTime);
                times.insert(times.end(), more.begin(), more.end());
                const Values steps = valuesOf(run, keep, [](const TickRecord& t, std::size_t) { return t.iterations; });
                iterations.insert(iterations.end(), steps.begin(), steps.end());
            }
            const std::string name = solver;
            line["ticks"] = times.size();
            line[name + "_p50_us"] = times.empty() ? ordered_json() : ordered_json(*percentile(times, 50));
            line[name + "_max_us"] = times.empty() ? ordered_json() : ordered_json(mostOf(times));
            line[name + "_iterations"] = times.empty() ? ordered_json() : ordered_json(meanOrZero(iterations));
        }
        classes.push_back(std::move(line));
    }
    return classes;
}

/// Mean time of each solver on every problem of a motion in paper mode, started afresh each time, µs: no tick before
/// helps.
using ColdTimes = std::map<std::string, double>;
ColdTimes coldTimes(const sandbox::HapticScene& scene, const ComparedRun& run, const std::string& motion,
                    std::optional<double> seconds) {
    constexpr int kRows = 1024;  // most of paper mode
    std::vector<std::unique_ptr<Solver>> solvers;
    std::vector<Values> times(solverTable().size());
    for (const SolverInfo& info : solverTable()) solvers.push_back(info.make(kRows));
    sandbox::HeadlessOptions options{.device = "demo:" + motion, .seconds = seconds, .timing = false};
    options.onSolve = [&](const QpProblem& problem, const SolveResult&) {
        for (std::size_t k = 0; k < solvers.size(); ++k) {
            solvers[k]->reset();
            const double start = threadCpuMicroseconds();
            solvers[k]->solve(problem, solverSettings(run.settings));
            times[k].push_back(threadCpuMicroseconds() - start);
        }
    };
    sandbox::runHeadless(scene, run.settings, options);
    ColdTimes means;
    for (std::size_t k = 0; k < solvers.size(); ++k) means[std::string(solverTable()[k].name)] = meanOrZero(times[k]);
    return means;
}

double collisionAt(const ComparedRun& r, std::size_t i) { return r.ticks[i].collisionUs; }
double solveAt(const ComparedRun& r, std::size_t i) { return r.ticks[i].solveUs; }
double stepAt(const ComparedRun& r, std::size_t i) { return r.ticks[i].totalUs; }
double pairsAt(const ComparedRun& r, std::size_t i) { return r.ticks[i].pairs; }
template <int axis>
double forceAt(const ComparedRun& r, std::size_t i) {
    return r.ticks[i].wrench_C.force[axis];
}
template <int axis>
double torqueAt(const ComparedRun& r, std::size_t i) {
    return r.ticks[i].wrench_C.torque[axis];
}

using Curve = std::pair<const char*, double (*)(const ComparedRun&, std::size_t)>;
/// One plot of a column of plots over time.
std::string panel(const ComparedRun& run, const std::string& title, const std::string& axis,
                  const std::vector<Curve>& curves) {
    Lines lines;
    for (const auto& [name, value] : curves) lines.add(name, overTime(run, value), "lines");
    return lines.data() + "set title \"" + title + "\" noenhanced\nset ylabel \"" + axis + "\"\n" + lines.plot();
}
/// What begins a column of plots over the same time.
std::string column(const ComparedRun& run) {
    const double end = static_cast<double>(run.ticks.size()) * 1000 / run.settings.rate;
    return "set multiplot layout 3,1\nset lmargin 9\nset rmargin 20\nset key outside right\nset xlabel \"ms\"\nset "
           "xrange [0:" +
           text(end) + "]\n";
}
const std::vector<Curve> kTimes{{"total", stepAt}, {"optimisation", solveAt}, {"collision", collisionAt}};

void drawFigure5(const Runs& runs, const fs::path& folder, const std::string& name) {
    const ComparedRun &active = runOf(runs, "paper active-set"), &pqp = runOf(runs, "paper pqp");
    gnuplot(folder, name,
            column(pqp) + panel(pqp, "(a) pairs of spheres that intersect", "pairs", {{"pairs", pairsAt}}) +
                panel(active, "(b) with active-set", "µs", kTimes) + panel(pqp, "(c) with pqp", "µs", kTimes) +
                "unset multiplot\n",
            860);
}

void drawFigure6(const Runs& runs, const fs::path& folder) {
    std::vector<std::pair<std::string, Values>> groups;
    for (const ComparedRun& run : runs) {
        if (run.what.mode != "paper") continue;
        const auto mean = [&](double TickRecord::*time) {
            return meanOrZero(valuesOf(run, inContact, [&](const TickRecord& t, std::size_t) { return t.*time; }));
        };
        groups.push_back({run.what.solver,
                          {mean(&TickRecord::collisionUs), mean(&TickRecord::solveUs), mean(&TickRecord::totalUs)}});
    }
    gnuplot(folder, "figure-6",
            "set ylabel \"mean, µs\"\nset key outside top horizontal\n" +
                bars(groups, {"collision", "optimisation", "total"}));
}

/// Where the shaft is separate, turned, pushed in: first tick of each and the end.
using Phases = std::array<std::size_t, 4>;
constexpr const char* kPhaseNames[] = {"separate and pressed", "rotating", "inserting"};

double twist(const Pose& pose) { return 2 * std::atan2(pose.q.y(), pose.q.w()); }

Phases phasesOf(const ComparedRun& run) {
    constexpr double kTurned = 1e-3;  // rad
    const auto at = [&](std::size_t i) { return twist(run.ticks[i].X_WT_device); };
    const std::size_t end = run.ticks.size();
    std::size_t turns = 0, turned = 0;
    while (turns < end && std::abs(at(turns) - at(0)) < kTurned) ++turns;
    for (turned = turns; turned < end && std::abs(at(turned)) > kTurned;) ++turned;
    return {0, turns, turned, end};
}

ordered_json phaseRows(const Runs& runs, const Phases& phases) {
    ordered_json rows = ordered_json::array();
    for (const ComparedRun& run : runs)
        for (std::size_t k = 0; k < 3; ++k) {
            const auto here = [&](const TickRecord&, std::size_t i) { return i >= phases[k] && i < phases[k + 1]; };
            const auto of = [&](auto value) { return valuesOf(run, here, value); };
            const Values axial = of([](const TickRecord& t, std::size_t) { return std::abs(t.wrench_C.force.y()); });
            rows.push_back(
                {{"case", run.what.name()},
                 {"phase", kPhaseNames[k]},
                 {"from_ms", phases[k]},
                 {"to_ms", phases[k + 1]},
                 {"axial_max_N", mostOf(axial)},
                 {"axial_end_N", axial.empty() ? 0 : axial.back()},
                 {"lateral_max_N", mostOf(of([](const TickRecord& t, std::size_t) {
                      return std::hypot(t.wrench_C.force.x(), t.wrench_C.force.z());
                  }))},
                 {"torque_max_mNm",
                  mostOf(of([](const TickRecord& t, std::size_t) { return t.wrench_C.torque.norm(); }))},
                 {"pairs_max", mostOf(of([](const TickRecord& t, std::size_t) { return double(t.pairs); }))},
                 {"collision_mean_us", meanOrZero(of([](const TickRecord& t, std::size_t) { return t.collisionUs; }))},
                 {"solve_mean_us", meanOrZero(of([](const TickRecord& t, std::size_t) { return t.solveUs; }))},
                 {"step_max_us", mostOf(of(stepTime))},
                 {"penetration_max_mm",
                  mostOf(of([&](const TickRecord&, std::size_t i) { return run.penetration[i]; }))},
                 {"depth_end_mm", phases[k + 1] ? -run.ticks[phases[k + 1] - 1].X_WT.p.y() : 0}});
        }
    return rows;
}

void drawFigure7(const ComparedRun& run, const Phases& phases, const fs::path& folder, const std::string& name) {
    std::string walls;
    for (const std::size_t tick : {phases[1], phases[2]})
        walls += "set arrow from first " + std::to_string(tick) + ", graph 0 to first " + std::to_string(tick) +
                 ", graph 1 nohead linecolor rgb grey dashtype 2\n";
    gnuplot(folder, name,
            walls + column(run) +
                panel(run, "force: separate | rotating | inserting", "N",
                      {{"x", forceAt<0>}, {"y, axial", forceAt<1>}, {"z", forceAt<2>}}) +
                panel(run, "torque", "mN·m", {{"x", torqueAt<0>}, {"y, axial", torqueAt<1>}, {"z", torqueAt<2>}}) +
                panel(run, "time", "µs", {{"optimisation", solveAt}, {"collision", collisionAt}}) + "unset multiplot\n",
            860);
}

/// The published sentences and what is measured; `agrees` null: in part.
ordered_json claimsOf(const Runs& shallow, const Runs& deeper, const Runs& shaft, const Phases& phases,
                      const ColdTimes& cold) {
    ordered_json claims = ordered_json::array();
    const auto add = [&](const char* key, const char* published, const std::string& measured, ordered_json agrees) {
        claims.push_back({{"key", key}, {"published", published}, {"measured", measured}, {"agrees", agrees}});
    };
    const ComparedRun &active = runOf(shallow, "paper active-set"), &pqp = runOf(shallow, "paper pqp"),
                      &exact = runOf(shallow, "paper dual-active-set");
    const auto mean = [](const ComparedRun& run, double TickRecord::*time) {
        return meanOrZero(valuesOf(run, inContact, [&](const TickRecord& t, std::size_t) { return t.*time; }));
    };
    const double solve = mean(active, &TickRecord::solveUs) / mean(pqp, &TickRecord::solveUs),
                 total = mean(active, &TickRecord::totalUs) / mean(pqp, &TickRecord::totalUs);
    const double coldSolve = cold.at("active-set") / cold.at("pqp");
    add("speed",
        "PQP is two to three times faster than active set: a third of the optimisation time, half of the total",
        engine::formatted(
            "optimisation %.2g times, in total %.2g times as fast as active-set, which starts from the contacts of "
            "the tick before; optimisation %.2g times as fast where active-set starts afresh each tick (%.3g and "
            "%.3g µs); dual-active-set, which was not compared then, %.2g times as fast as pqp in total",
            solve, total, coldSolve, cold.at("active-set"), cold.at("pqp"),
            mean(pqp, &TickRecord::totalUs) / mean(exact, &TickRecord::totalUs)),
        solve >= 2       ? ordered_json(true)
        : coldSolve >= 2 ? ordered_json()
                         : ordered_json(false));

    const auto steps = [](const TickRecord& t, std::size_t) { return double(t.iterations); };
    const Values iterations = valuesOf(pqp, inContact, steps);
    const double average = meanOrZero(iterations), most = mostOf(iterations);
    add("iterations", "PQP takes six iterations on average and ten at most",
        engine::formatted("%.3g on average, %.0f at most", average, most),
        most <= 10      ? ordered_json(true)
        : average <= 10 ? ordered_json()
                        : ordered_json(false));

    const Values at200 = valuesOf(pqp, pairsFrom(150, 251), stepTime);
    const bool fast = mostOf(at200) < kBudget;
    add("budget", "with about 200 pairs the whole tick stays below 1 ms",
        engine::formatted("with 150 to 250 pairs (%zu ticks) pqp takes %.3g µs on average and %.3g µs at most",
                          at200.size(), meanOrZero(at200), mostOf(at200)),
        at200.empty() ? ordered_json() : ordered_json(fast));

    const Values above = valuesOf(active, pairsFrom(101, 1 << 30), stepTime);
    int slowest = 0;
    for (const Runs* runs : {&shallow, &deeper})
        for (const TickRecord& tick : runOf(*runs, "paper active-set").ticks)
            if (tick.totalUs > kBudget && (slowest == 0 || tick.pairs < slowest)) slowest = tick.pairs;
    const auto late = std::count_if(above.begin(), above.end(), [](double us) { return us > kBudget; });
    add("active-set", "with more than 100 pairs active set takes longer than 1 ms",
        engine::formatted("%zu of %zu such ticks take longer; %.3g µs on average, %.3g µs at most%s", std::size_t(late),
                          above.size(), meanOrZero(above), mostOf(above),
                          slowest
                              ? engine::formatted("; the fewest pairs of a tick that takes longer: %d", slowest).c_str()
                              : "; none does up to 1000 pairs"),
        late > 0 && 2 * std::size_t(late) >= above.size());

    const auto depthOf = [](const Runs& runs, const char* name) { return mostOf(runOf(runs, name).penetration); };
    const double paperDepth =
        std::max({depthOf(shallow, "paper pqp"), depthOf(deeper, "paper pqp"), depthOf(shaft, "paper pqp")});
    add("penetration", "no interpenetration, even at sharp keys",
        engine::formatted(
            "deepest in paper mode with pqp: %.2g mm (figure 5), %.2g mm (deeper), %.2g mm (shaft); with the exact "
            "solver %.2g, %.2g, %.2g mm; default mode %.2g, %.2g, %.2g mm; penalty %.2g, %.2g, %.2g mm",
            depthOf(shallow, "paper pqp"), depthOf(deeper, "paper pqp"), depthOf(shaft, "paper pqp"),
            depthOf(shallow, "paper dual-active-set"), depthOf(deeper, "paper dual-active-set"),
            depthOf(shaft, "paper dual-active-set"), depthOf(shallow, "default dual-active-set"),
            depthOf(deeper, "default dual-active-set"), depthOf(shaft, "default dual-active-set"),
            depthOf(shallow, "penalty"), depthOf(deeper, "penalty"), depthOf(shaft, "penalty")),
        paperDepth <= 1e-3);

    const auto axial = [&](const char* name) {
        const ComparedRun& run = runOf(shaft, name);
        const auto force = [](const TickRecord& t, std::size_t) { return std::abs(t.wrench_C.force.y()); };
        const auto during = [&](std::size_t from, std::size_t to) {
            return valuesOf(
                run, [=](const TickRecord&, std::size_t i) { return i >= from && i < to; }, force);
        };
        constexpr std::size_t kAfter = 150;  // ticks of rest once the turn has ended
        const Values before = during(phases[1], phases[1] + 100), after = during(phases[2], phases[2] + kAfter);
        return std::pair{meanOrZero(before), after.empty() ? 0 : after.back()};
    };
    const auto [before, after] = axial("paper pqp");
    const auto [beforeDefault, afterDefault] = axial("default dual-active-set");
    add("axial", "the axial force falls remarkably when the keys meet the keyways",
        engine::formatted("from %.3g N to %.2g N (default mode: %.3g N to %.2g N)", before, after, beforeDefault,
                          afterDefault),
        before > 0 && after < 0.2 * before);
    return claims;
}

/// What `touchstone paper` does with one scene.
class Experiment {
  public:
    Experiment(const char* scene, const PaperCommand& command) : command_(command), name_(scene) {
        sandbox::SceneOptions options{.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()};
        if (command.quick) options.leaves = 256;
        scene_ = sandbox::openScene(findScene(scene), options);
    }

    /// `name`: of the files; the motion's where nothing is set.
    Runs run(const char* motion, const std::vector<CompareCase>& cases, const std::string& name,
             const std::vector<std::string>& set = {}) {
        ComparedMotion wanted{scene_};
        wanted.device = std::string("demo:") + motion;
        wanted.set = set;
        wanted.seconds = seconds();
        Runs runs = compareMotion(wanted, cases, command_.quick ? 1 : 5);
        writeComparison(runs, command_.out, name + "-");
        const World& world = *scene_.world;
        results_.push_back({{"name", name},
                            {"motion", motion},
                            {"set", set},
                            {"scene", name_},
                            {"tool_leaves", world.tool->leafCount()},
                            {"obstacle_leaves", world.obstacles.front().tree->leafCount()},
                            {"rows", comparisonRows(runs)}});
        return runs;
    }

    ColdTimes cold(const Runs& runs, const char* motion) const {
        return coldTimes(scene_, runOf(runs, "paper pqp"), motion, seconds());
    }

    /// Four steps of the way as pictures.
    void draw(const ComparedRun& run, const std::string& name) const {
        for (int k = 0; k < 4; ++k) {
            const TickRecord& tick = run.ticks[run.ticks.size() * static_cast<std::size_t>(2 * k + 1) / 8];
            sandbox::ScenePicture picture;
            picture.width = 640;
            picture.height = 480;
            engine::writePng(command_.out / (name + "-step-" + std::to_string(k + 1) + ".png"),
                             sandbox::renderScene(scene_, tick, run.settings, picture));
        }
    }

    const ordered_json& results() const { return results_; }

  private:
    std::optional<double> seconds() const {
        return command_.quick ? std::optional(2.8) : std::nullopt;  // the shaft is turned by then
    }

    const PaperCommand& command_;
    const char* name_;
    sandbox::HapticScene scene_;
    ordered_json results_ = ordered_json::array();
};

}  // namespace

int paper(const PaperCommand& command) {
    requireGnuplot();
    makeFolder(command.out, "the experiments");
    const std::vector<CompareCase> all =
        casesOf({"paper", "default", "penalty"}, {"active-set", "pqp", "dual-active-set"});

    ordered_json results = sandbox::buildInfo();
    results["quick"] = command.quick;
    Experiment bunnies("bunnies", command), spline("spline-05", command);
    const Runs shallow = bunnies.run("figure-5", all, "figure-5"),
               deeper = bunnies.run("figure-5-deeper", all, "figure-5-deeper");
    // As published, about 200 pairs form the constraints: the deepest. And once more with all that paper mode keeps.
    const Runs shaft = spline.run("figure-7", all, "figure-7", {"paper_rows=200"});
    spline.run("figure-7", casesOf({"paper"}, {"active-set", "pqp", "dual-active-set"}), "figure-7-1024");
    const Phases phases = phasesOf(shaft.front());

    drawFigure5(shallow, command.out, "figure-5");
    drawFigure5(deeper, command.out, "figure-5-deeper");
    drawFigure6(shallow, command.out);
    drawFigure7(runOf(shaft, "paper pqp"), phases, command.out, "figure-7");
    drawFigure7(runOf(shaft, "default dual-active-set"), phases, command.out, "figure-7-default");
    bunnies.draw(runOf(shallow, "paper pqp"), "figure-5");
    spline.draw(runOf(shaft, "default dual-active-set"), "figure-7");

    results["motions"] = bunnies.results();
    for (const ordered_json& motion : spline.results()) results["motions"].push_back(motion);
    results["classes"] = classesOf({&shallow, &deeper});
    results["phases"] = phaseRows(shaft, phases);
    results["claims"] = claimsOf(shallow, deeper, shaft, phases, bunnies.cold(shallow, "figure-5"));
    writeFile(command.out / "paper.json", "the results", results.dump(1) + "\n");
    for (const ordered_json& claim : results["claims"]) {
        const ordered_json& agrees = claim["agrees"];
        std::printf("%s\n  measured: %s\n  %s\n", claim["published"].get<std::string>().c_str(),
                    claim["measured"].get<std::string>().c_str(),
                    agrees.is_null()     ? "agrees in part"
                    : agrees.get<bool>() ? "agrees"
                                         : "does not agree");
    }
    std::printf("all of it is in %s\n", command.out.string().c_str());
    return kOk;
}

}  // namespace touchstone::app
