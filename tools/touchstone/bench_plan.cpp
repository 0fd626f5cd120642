// The plan of a sweep: which cases it measures.
#include <algorithm>
#include <array>

#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

constexpr double kQuickPaperRate = 250;  // Hz; a tick of paper mode takes milliseconds, so --quick runs fewer of them
constexpr int kLinearizations[] = {1, 2, 4};
constexpr int kTradeLeaves[] = {512, 4096, 16384}, kCurveLeaves[] = {512, 1024, 2048, 4096, 8192, 16384, 32768, 64000};
constexpr int kQuickLeaves[] = {512, 2048, 8192, 64000};
constexpr double kTolerances[] = {1, 0.01, 1e-4}, kQuickTolerances[] = {1, 0.1, 0.01};
constexpr double kPaperTolerances[] = {1, 0.01};
constexpr const char* kFits[] = {"spline",
                                 "spline-01"};  // tree walks may dominate their ticks: also with the list worker
constexpr const char* kMeshScenes[] = {"bunnies", "spline", "spline-01", "spline-002", "spline-001", "peg-h7", "nut"};
constexpr const char* kJumps[] = {"-teleport", "-walk"};  // in the names of motions
constexpr double kUsualTolerance = 0.01;

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    return text;
}

/// A scene without its world. Throws if nothing moves in it.
sandbox::HapticScene contentsOf(const std::string& name) {
    sandbox::SceneOptions options;
    options.buildWorld = false;
    sandbox::HapticScene scene = sandbox::openScene(findScene(name), options);
    if (!scene.missing.empty()) throw std::runtime_error(name + ": " + scene.missing);
    if (scene.motions.empty())
        throw std::runtime_error(name + ": nothing moves the tool: give its node an animation (see docs/scenes.md)");
    return scene;
}

std::vector<std::string> hardMotions(const sandbox::HapticScene& scene) {
    std::vector<std::string> motions;
    for (const NamedMotion& motion : scene.motions)
        if (motion.name.rfind("hard-", 0) == 0) motions.push_back(motion.name);
    return motions;
}

/// The motions to measure: the hard ones; if no motion is hard, the first one.
std::vector<std::string> motionsOf(const std::string& name) {
    const sandbox::HapticScene scene = contentsOf(name);
    std::vector<std::string> motions = hardMotions(scene);
    if (motions.empty()) motions.push_back(scene.motions.front().name);
    return motions;
}

class Planner {
  public:
    Planner(bool quick, bool gpu) : quick_(quick), solvers_(benchSolvers(gpu)) {}

    /// Adds the case unless it is there already.
    void add(BenchCase wanted) {
        if (wanted.mode == "paper" && quick_) wanted.rate = kQuickPaperRate;
        const auto same = [&](const BenchCase& other) { return other.key() == wanted.key(); };
        if (std::none_of(cases_.begin(), cases_.end(), same)) cases_.push_back(std::move(wanted));
    }

    /// Each solver of the table, an approximate one at each of the tolerances.
    void addSolvers(BenchCase wanted, std::span<const double> tolerances) {
        for (const SolverInfo* solver : solvers_) {
            wanted.solver = solver->name;
            wanted.tolerance = 0;
            if (solver->exact) add(wanted);
            for (const double tolerance : tolerances) {
                wanted.tolerance = tolerance;
                if (!solver->exact) add(wanted);
            }
        }
    }

    /// One motion with every choice of settings.
    void addTrade(const BenchCase& motion) {
        BenchCase wanted = motion;
        const std::span<const double> tolerances = quick_ ? std::span<const double>(kQuickTolerances) : kTolerances;
        addSolvers(wanted, tolerances);
        for (const int lin : kLinearizations) {
            wanted.linearizations = lin;
            if (quick_) add(wanted);
            for (const int leaves : kTradeLeaves) {
                wanted.leaves = leaves;
                if (!quick_) addSolvers(wanted, tolerances);
            }
            wanted.leaves = 0;
        }
        wanted = motion;
        for (const int leaves : quick_ ? std::span<const int>(kQuickLeaves) : kCurveLeaves) {
            wanted.leaves = leaves;
            add(wanted);
        }
        wanted = motion;
        wanted.geometry = "mesh";
        for (const int lin : {0, 1, 2, 4, 16}) {
            wanted.linearizations = lin;
            add(wanted);
        }
        wanted = motion;
        wanted.fixedMargin = true;
        add(wanted);
        for (const SolverInfo* solver : solvers_)
            if (!solver->exact) addScreenings(wanted, std::string(solver->name), tolerances);
        wanted = motion;
        wanted.mode = "paper";
        addSolvers(wanted, quick_ ? std::span<const double>(&kUsualTolerance, 1) : kPaperTolerances);
    }

    /// Between meshes: the demonstration, of parts that do not fit together with all hard motions, and each motion that
    /// jumps.
    void addMeshes(const std::string& name) {
        const sandbox::HapticScene scene = contentsOf(name);
        BenchCase wanted;
        wanted.scene = name;
        wanted.geometry = "mesh";
        const auto addBoth = [&] {
            for (const bool listWorker : {false, true}) {
                wanted.listWorker = listWorker;
                add(wanted);
            }
        };
        const std::vector<std::string> hard = hardMotions(scene);
        wanted.motion = scene.motions.front().name;
        if (!scene.roles.clearance && !hard.empty()) {
            wanted.parts = hard;
            wanted.parts.insert(wanted.parts.begin(), wanted.motion);
            wanted.motion = "together";
        }
        addBoth();
        wanted.parts.clear();
        for (const std::string& motion : hard) {
            const auto jumps = [&](const char* word) { return motion.find(word) != std::string::npos; };
            if (std::none_of(std::begin(kJumps), std::end(kJumps), jumps)) continue;
            wanted.motion = motion;
            addBoth();
        }
    }

    /// An approximate solver with every kind of screening.
    void addScreenings(BenchCase wanted, const std::string& solver, std::span<const double> tolerances) {
        wanted.solver = solver;
        for (const char* screening : {"none", "screen", "cluster"}) {
            wanted.screening = screening;
            for (const double tolerance : tolerances) {
                wanted.tolerance = tolerance;
                if (!quick_ || tolerance == kUsualTolerance) add(wanted);
            }
        }
    }

    std::vector<BenchCase> take() { return std::move(cases_); }

  private:
    const bool quick_;
    const std::vector<const SolverInfo*> solvers_;
    std::vector<BenchCase> cases_;
};

}  // namespace

std::vector<const SolverInfo*> benchSolvers(bool gpu) {
    std::vector<const SolverInfo*> solvers;
    for (const SolverInfo& info : solverTable()) {
        if (info.roundTrip && !gpu) continue;
        if (!isUsable(info))
            throw std::runtime_error(std::string(info.name) + " cannot be measured: " + info.roundTrip().trouble);
        solvers.push_back(&info);
    }
    return solvers;
}

std::string BenchCase::key() const {
    const auto part = [](const char* name, double value) { return value > 0 ? name + number(value) : std::string(); };
    return scene + "/" + motion + "/" + mode + "/" + (geometry == "mesh" ? "mesh/" : "") + solver +
           part("/tolerance=", tolerance) + part("/leaves=", leaves) + part("/linearizations=", linearizations) +
           (listWorker ? "/list-worker" : "") + (fixedMargin ? "/fixed-margin" : "") +
           (screening == "none" ? "" : "/" + screening) + part("/rate=", rate);
}

Settings BenchCase::settings(const Settings& sceneSettings) const {
    Settings chosen = sceneSettings;
    const auto set = [&](const char* name, const std::string& value) {
        if (const std::string wrong = setSetting(chosen, name, value); !wrong.empty()) throw UsageError(wrong);
    };
    set("mode", mode);
    set("geometry", geometry);
    set("solver", solver);
    set("shadow", "none");
    set("screening", screening);
    if (fixedMargin) set("adaptive_margin", "false");
    if (tolerance > 0) set("tolerance", number(tolerance));
    if (linearizations > 0) set("linearizations", number(linearizations));
    if (rate > 0) set("rate", number(rate));
    if (const std::string wrong = checkSettings(chosen); !wrong.empty()) throw UsageError(wrong);
    return chosen;
}

BenchPlan BenchPlan::shard(std::size_t k, std::size_t n) const {
    BenchPlan part;
    for (std::size_t i = k - 1; i < size(); i += n) {
        if (i < cases.size())
            part.cases.push_back(cases[i]);
        else
            part.qpRows.push_back(qpRows[i - cases.size()]);
    }
    return part;
}

BenchPlan planBench(const BenchCommand& command) {
    const bool hard = command.suite == "hard", mesh = command.suite == "mesh";
    if (!hard && !mesh && command.suite != "sweep")
        throw UsageError("--suite is sweep, hard or mesh, not '" + command.suite + "'");
    std::vector<std::string> scenes = command.scenes;
    if (scenes.empty() && mesh) scenes.assign(std::begin(kMeshScenes), std::end(kMeshScenes));
    if (scenes.empty()) scenes = {"bunnies", "spline", "wedge", "plate", "pinch"};
    if (hard && command.scenes.empty()) scenes.push_back("spline-05");
    if (!hard && !mesh && !command.quick && command.scenes.empty()) scenes.push_back("spline-01");

    Planner planner(command.quick, command.gpu);
    for (const std::string& scene : scenes) {
        if (mesh) {
            planner.addMeshes(scene);
            continue;
        }
        const std::vector<std::string> motions = motionsOf(scene);
        for (const std::string& motion : motions) {
            BenchCase wanted;
            wanted.scene = scene;
            wanted.motion = motion;
            const bool first = motion == motions.front();
            if (hard) {
                wanted.geometry = "mesh";
                planner.add(wanted);
                wanted.geometry = "spheres";
                planner.addSolvers(wanted, {&kUsualTolerance, 1});
                wanted.mode = "paper";
                planner.addSolvers(wanted, {&kUsualTolerance, 1});
            } else if (first && scene == scenes.front()) {
                planner.addTrade(wanted);
            } else if (first || !command.quick || motion.find("-deep") != std::string::npos) {
                const bool fit = std::find(std::begin(kFits), std::end(kFits), scene) != std::end(kFits);
                for (const char* geometry : {"spheres", "mesh"}) {
                    wanted.geometry = geometry;
                    wanted.listWorker = false;
                    planner.add(wanted);
                    wanted.listWorker = fit;
                    planner.add(wanted);
                }
            }
        }
    }
    BenchPlan plan{planner.take(), {}};
    if (!hard && !mesh) plan.qpRows.assign(qpRowCounts().begin(), qpRowCounts().end());
    // Cases with the same trees are adjacent, so that each scene is opened once.
    std::stable_sort(plan.cases.begin(), plan.cases.end(), [](const BenchCase& a, const BenchCase& b) {
        return std::tie(a.scene, a.leaves) < std::tie(b.scene, b.leaves);
    });
    return plan;
}

}  // namespace touchstone::app
