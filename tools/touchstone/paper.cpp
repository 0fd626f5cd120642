// touchstone paper: repeats the published experiments and compares the results with the published claims.
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
#include "haptics/loop/setting_table.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/measure/report.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/compare.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/figures.hpp"
#include "tools/touchstone/scene_path.hpp"
#include "tools/touchstone/settings_choice.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using Runs = std::vector<ComparedRun>;
using Values = std::vector<double>;

struct PaperCommand {
    fs::path out;
    bool quick = false;
};

constexpr double kBudget = 1000;  // µs, of a tick at 1 kHz
/// The solver that the paper proposes, and the one that it compares with.
const std::string kPublished = "pqp", kFormer = "active-set";
std::string exactSolver() { return std::string(kExactSolver); }
std::string inPaperMode(const std::string& solver) { return "paper " + solver; }
std::string inDefaultMode(const std::string& solver) { return "default " + solver; }

/// Upper ends of the classes of pair counts by which times are reported.
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

/// Times of each solver in paper mode by the number of intersecting pairs.
ordered_json classesOf(const std::vector<const Runs*>& motions) {
    ordered_json classes = ordered_json::array();
    for (std::size_t k = 0; k + 1 < std::size(kPairs); ++k) {
        ordered_json line{{"pairs_from", kPairs[k] + 1}, {"pairs_to", kPairs[k + 1]}};
        for (const std::string& name : processorSolvers()) {
            Values times, iterations;
            for (const Runs* runs : motions) {
                const ComparedRun& run = runOf(*runs, inPaperMode(name));
                const auto keep = pairsFrom(kPairs[k] + 1, kPairs[k + 1] + 1);
                const Values more = valuesOf(run, keep, stepTime);
                times.insert(times.end(), more.begin(), more.end());
                const Values steps = valuesOf(run, keep, [](const TickRecord& t, std::size_t) { return t.iterations; });
                iterations.insert(iterations.end(), steps.begin(), steps.end());
            }
            line["ticks"] = times.size();
            line[name + "_p50_us"] = times.empty() ? ordered_json() : ordered_json(*percentile(times, 50));
            line[name + "_max_us"] = times.empty() ? ordered_json() : ordered_json(mostOf(times));
            line[name + "_iterations"] = times.empty() ? ordered_json() : ordered_json(meanOrZero(iterations));
        }
        classes.push_back(std::move(line));
    }
    return classes;
}

/// Mean time of each solver over every problem of a motion in paper mode, with a cold start each time, µs.
using ColdTimes = std::map<std::string, double>;
ColdTimes coldTimes(const sandbox::HapticScene& scene, const ComparedRun& run, const std::string& motion,
                    std::optional<double> seconds) {
    constexpr int kRows = 1024;  // maximum row count of paper mode
    std::vector<std::pair<std::string, std::unique_ptr<Solver>>> solvers;
    std::map<std::string, Values> times;
    for (const std::string& name : processorSolvers()) solvers.emplace_back(name, findSolver(name)->make(kRows));
    sandbox::HeadlessOptions options{.device = "demo:" + motion, .seconds = seconds, .timing = false};
    options.onSolve = [&](const QpProblem& problem, const SolveResult&) {
        for (auto& [name, solver] : solvers) {
            solver->reset();
            const double start = threadCpuMicroseconds();
            solver->solve(problem, solverSettings(run.settings));
            times[name].push_back(threadCpuMicroseconds() - start);
        }
    };
    sandbox::runHeadless(scene, run.settings, options);
    ColdTimes means;
    for (const auto& solver : solvers) means[solver.first] = meanOrZero(times[solver.first]);
    return means;
}

/// The first ticks of the phases in which the shaft is separate, turned and pushed in, and the end.
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

/// The published claims and the measured results; `agrees` is null for partial agreement.
ordered_json claimsOf(const Runs& shallow, const Runs& deeper, const Runs& shaft, const Phases& phases,
                      const ColdTimes& cold) {
    ordered_json claims = ordered_json::array();
    const auto add = [&](const char* key, const char* published, const std::string& measured, ordered_json agrees) {
        claims.push_back({{"key", key}, {"published", published}, {"measured", measured}, {"agrees", agrees}});
    };
    const ComparedRun &active = runOf(shallow, inPaperMode(kFormer)), &pqp = runOf(shallow, inPaperMode(kPublished)),
                      &exact = runOf(shallow, inPaperMode(exactSolver()));
    const auto mean = [](const ComparedRun& run, double TickRecord::*time) {
        return meanOrZero(valuesOf(run, inContact, [&](const TickRecord& t, std::size_t) { return t.*time; }));
    };
    const double solve = mean(active, &TickRecord::solveUs) / mean(pqp, &TickRecord::solveUs),
                 total = mean(active, &TickRecord::totalUs) / mean(pqp, &TickRecord::totalUs);
    const double coldSolve = cold.at(kFormer) / cold.at(kPublished);
    add("speed",
        "PQP is two to three times faster than active set: a third of the optimization time, half of the total",
        engine::formatted(
            "optimization %.2g times, in total %.2g times as fast as %s, which starts from the contacts of the "
            "previous tick; optimization %.2g times as fast as %s with a cold start (%.3g and %.3g µs); %s, which the "
            "paper does not compare, %.2g times as fast as %s in total",
            solve, total, kFormer.c_str(), coldSolve, kFormer.c_str(), cold.at(kFormer), cold.at(kPublished),
            exactSolver().c_str(), mean(pqp, &TickRecord::totalUs) / mean(exact, &TickRecord::totalUs),
            kPublished.c_str()),
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
        engine::formatted("with 150 to 250 pairs (%zu ticks) %s takes %.3g µs on average and %.3g µs at most",
                          at200.size(), kPublished.c_str(), meanOrZero(at200), mostOf(at200)),
        at200.empty() ? ordered_json() : ordered_json(fast));

    const Values above = valuesOf(active, pairsFrom(101, 1 << 30), stepTime);
    int slowest = 0;
    for (const Runs* runs : {&shallow, &deeper})
        for (const TickRecord& tick : runOf(*runs, inPaperMode(kFormer)).ticks)
            if (tick.totalUs > kBudget && (slowest == 0 || tick.pairs < slowest)) slowest = tick.pairs;
    const auto late = std::count_if(above.begin(), above.end(), [](double us) { return us > kBudget; });
    add("active-set", "with more than 100 pairs active set takes longer than 1 ms",
        engine::formatted(
            "%zu of %zu such ticks take longer; %.3g µs on average, %.3g µs at most%s", std::size_t(late), above.size(),
            meanOrZero(above), mostOf(above),
            slowest ? engine::formatted("; smallest pair count of a tick that takes longer: %d", slowest).c_str()
                    : "; no tick with up to 1000 pairs does"),
        late > 0 && 2 * std::size_t(late) >= above.size());

    const auto depthOf = [](const Runs& runs, const std::string& name) {
        return mostOf(runOf(runs, name).penetration);
    };
    const std::string published = inPaperMode(kPublished), exactPaper = inPaperMode(exactSolver()),
                      exactDefault = inDefaultMode(exactSolver());
    const double paperDepth =
        std::max({depthOf(shallow, published), depthOf(deeper, published), depthOf(shaft, published)});
    add("penetration", "no interpenetration, even at sharp keys",
        engine::formatted(
            "deepest in paper mode with %s: %.2g mm (figure 5), %.2g mm (deeper), %.2g mm (shaft); with the exact "
            "solver %.2g, %.2g, %.2g mm; default mode %.2g, %.2g, %.2g mm; penalty %.2g, %.2g, %.2g mm",
            kPublished.c_str(), depthOf(shallow, published), depthOf(deeper, published), depthOf(shaft, published),
            depthOf(shallow, exactPaper), depthOf(deeper, exactPaper), depthOf(shaft, exactPaper),
            depthOf(shallow, exactDefault), depthOf(deeper, exactDefault), depthOf(shaft, exactDefault),
            depthOf(shallow, "penalty"), depthOf(deeper, "penalty"), depthOf(shaft, "penalty")),
        paperDepth <= 1e-3);

    const auto axial = [&](const std::string& name) {
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
    const auto [before, after] = axial(published);
    const auto [beforeDefault, afterDefault] = axial(exactDefault);
    add("axial", "the axial force falls remarkably when the keys meet the keyways",
        engine::formatted("from %.3g N to %.2g N (default mode: %.3g N to %.2g N)", before, after, beforeDefault,
                          afterDefault),
        before > 0 && after < 0.2 * before);
    return claims;
}

/// The experiments with one scene.
class Experiment {
  public:
    Experiment(const char* scene, const PaperCommand& command) : command_(command), name_(scene) {
        sandbox::SceneOptions options{.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()};
        options.allTrees = true;
        if (command.quick) options.leaves = 256;
        scene_ = sandbox::openScene(findScene(scene), options);
    }

    /// Compares the cases on one motion; the names of its files begin with `name`.
    Runs run(const char* motion, const std::vector<CompareCase>& cases, const std::string& name,
             const std::vector<std::string>& set = {}) {
        ComparedMotion wanted{scene_};
        wanted.device = std::string("demo:") + motion;
        wanted.set = set;
        wanted.set.emplace_back("geometry=spheres");  // the published system, also in default mode
        wanted.seconds = seconds();
        Runs runs = compareMotion(wanted, cases, command_.quick ? 1 : 5);
        writeComparison(runs, command_.out, name + "-");
        const World& world = *scene_.world;
        results_.push_back({{"name", name},
                            {"motion", motion},
                            {"set", set},
                            {"scene", name_},
                            {"tool_leaves", world.tool.spheres->leafCount()},
                            {"obstacle_leaves", world.obstacles.front().part.spheres->leafCount()},
                            {"rows", comparisonRows(runs)}});
        return runs;
    }

    ColdTimes cold(const Runs& runs, const char* motion) const {
        return coldTimes(scene_, runOf(runs, inPaperMode(kPublished)), motion, seconds());
    }

    /// Draws four steps of the motion.
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

int paper(const PaperCommand& command) {
    makeFolder(command.out, "the experiments");
    const std::vector<CompareCase> all = casesOf({"paper", "default", "penalty"}, processorSolvers());

    ordered_json results = sandbox::buildInfo();
    results["quick"] = command.quick;
    results["solvers"] = {{"published", kPublished}, {"former", kFormer}, {"exact", exactSolver()}};
    Experiment bunnies("bunnies", command), spline("spline-05", command);
    const Runs shallow = bunnies.run("figure-5", all, "figure-5"),
               deeper = bunnies.run("figure-5-deeper", all, "figure-5-deeper");
    // In the paper about 200 pairs, the deepest, form the constraints. The second run keeps all rows of paper mode.
    const Runs shaft = spline.run("figure-7", all, "figure-7", {"paper_rows=200"});
    spline.run("figure-7", casesOf({"paper"}, processorSolvers()), "figure-7-1024");
    const Phases phases = phasesOf(shaft.front());

    bunnies.draw(runOf(shallow, inPaperMode(kPublished)), "figure-5");
    spline.draw(runOf(shaft, inDefaultMode(exactSolver())), "figure-7");

    results["motions"] = bunnies.results();
    for (const ordered_json& motion : spline.results()) results["motions"].push_back(motion);
    results["classes"] = classesOf({&shallow, &deeper});
    results["phases"] = phaseRows(shaft, phases);
    results["claims"] = claimsOf(shallow, deeper, shaft, phases, bunnies.cold(shallow, "figure-5"));
    writeFile(command.out / "paper.json", "the results", results.dump(1) + "\n");
    drawFigures("paper", command.out);
    for (const ordered_json& claim : results["claims"]) {
        const ordered_json& agrees = claim["agrees"];
        std::printf("%s\n  measured: %s\n  %s\n", claim["published"].get<std::string>().c_str(),
                    claim["measured"].get<std::string>().c_str(),
                    agrees.is_null()     ? "agrees in part"
                    : agrees.get<bool>() ? "agrees"
                                         : "does not agree");
    }
    std::printf("the results are in %s\n", command.out.string().c_str());
    return kOk;
}

constexpr const char* kPaperFooter =
    "tools/document_paper makes docs/paper.md from the results.\n\nExample:\n  touchstone paper --out paper\n";

}  // namespace

void addPaper(CLI::App& program, Action& action) {
    const auto options = std::make_shared<PaperCommand>();
    CLI::App* command = addCommand(program, "paper", "Repeat the published experiments, figures 5 to 7", kPaperFooter);
    command->add_option("--out", options->out, "folder for tables, figures, pictures and paper.json")->required();
    command->add_flag("--quick", options->quick, "coarse trees and short motions, to check that it works");
    command->callback([options, &action] { action = [options] { return paper(*options); }; });
}

}  // namespace touchstone::app
