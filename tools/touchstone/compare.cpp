// touchstone compare: renders the same device motion with every solver.
#include "tools/touchstone/compare.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "haptics/device/device_table.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/qp/contact_forces.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/figures.hpp"
#include "tools/touchstone/scene_path.hpp"
#include "tools/touchstone/settings_choice.hpp"
#include "tools/touchstone/tick_table.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct CompareCommand {
    std::string motion;  ///< folder of a recording, or a scene
    std::string device;  ///< of a scene; empty: its demonstration
    std::vector<std::string> solvers, modes{"default"};
    std::vector<std::string> frictionSolvers;  ///< instead of solvers and modes; empty: not compared
    std::filesystem::path scene;               ///< of a recording; empty: it is found
    std::optional<double> seconds;
    std::optional<std::string> tolerance;  ///< as text, checked like settings
    std::vector<std::string> set;          ///< KEY=VALUE
    int runs = 5;
    std::filesystem::path out;  ///< empty: only print the table
};

constexpr int kMaxRows = 1 << 15;  // maximum row count of a tick

Settings settingsFor(const ComparedMotion& motion, const CompareCase& what, const Settings& usual) {
    SettingsChoice choice;
    choice.mode = what.mode;
    if (!what.solver.empty()) choice.solver = what.solver;
    choice.shadow = "none";
    choice.tolerance = motion.tolerance;
    if (!what.friction.empty()) choice.set.push_back("friction_solver=" + what.friction);
    choice.set.insert(choice.set.end(), motion.set.begin(), motion.set.end());
    return checkedWithCommandLine(usual, choice);
}

/// A case while it is run.
class Comparing {
  public:
    Comparing(const ComparedMotion& motion, const CompareCase& what) : motion_(motion) {
        run.what = what;
        run.settings = settingsFor(motion, what, motion.scene.settings);
        options_.device = motion.device;
        options_.seconds = motion.seconds;
        options_.timing = false;
        options_.adjust = [motion, what](const Settings& recorded) { return settingsFor(motion, what, recorded); };
    }

    void judge() {
        const auto exact = findSolver(kExactSolver)->make(kMaxRows);
        double error = -1;
        options_.onSolve = [&](const QpProblem& problem, const SolveResult& result) {
            const SolveResult truth = exact->solve(problem, solverSettings(run.settings));
            if (truth.status == SolveStatus::Solved)
                error = std::max(error, wrenchError(problem, result.x, truth.x).force_N);
        };
        ConeNewton exactFriction(ContactForces::kMaxContacts);
        options_.onFrictionSolve = [&](const FrictionProblem& problem, const FrictionResult& result) {
            if (result.status == FrictionStatus::None) return;
            const FrictionResult truth = exactFriction.solve(problem, Vec6::Zero());
            if (truth.status == FrictionStatus::Exact)
                error = std::max(error,
                                 wrenchError({problem.stiffness, problem.wanted, nullptr}, result.x, truth.x).force_N);
        };
        options_.onTick = [&](const TickRecord& record, double penetration) {
            run.ticks.push_back(record);
            run.penetration.push_back(penetration);
            run.forceError.push_back(std::exchange(error, -1));
            TickRecord input;
            input.X_WT_device = record.X_WT_device;
            run.deviceHash = run.ticks.size() == 1 ? hashTick(input) : hashTick(input, run.deviceHash);
        };
        const sandbox::HeadlessRun judged = sandbox::runHeadless(motion_.scene, run.settings, options_);
        run.settings = judged.settings;
        run.hash = judged.report.hash;
        options_.onSolve = nullptr;
        options_.onFrictionSolve = nullptr;
        options_.onTick = nullptr;
    }

    void time() {
        timed_.push_back(sandbox::timeHeadless(motion_.scene, run.settings, options_));
        if (timed_.back().hash != run.hash)
            throw std::runtime_error(run.what.name() +
                                     ": a repeated run gave different results, which is a bug in the program: please "
                                     "report it");
    }

    void finish() {
        std::vector<double> values;
        const auto medianOf = [&](std::size_t tick, double sandbox::TickTimes::*stage) {
            values.clear();
            for (const sandbox::TimedRun& timed : timed_) values.push_back(timed.ticks[tick].*stage);
            return percentile(values, 50).value_or(0);
        };
        for (std::size_t i = 0; i < run.ticks.size(); ++i) {
            run.ticks[i].totalUs = medianOf(i, &sandbox::TickTimes::step);
            run.ticks[i].collisionUs = medianOf(i, &sandbox::TickTimes::collision);
            run.ticks[i].solveUs = medianOf(i, &sandbox::TickTimes::solve);
        }
        timed_.clear();
    }

    ComparedRun run;

  private:
    const ComparedMotion& motion_;
    sandbox::HeadlessOptions options_;
    std::vector<sandbox::TimedRun> timed_;
};

ordered_json orNull(const std::optional<double>& value) { return value ? ordered_json(*value) : ordered_json(); }

ordered_json meanOrNull(const std::vector<double>& values) {
    return values.empty() ? ordered_json() : ordered_json(mean(values));
}

/// Lengths of the difference of two runs' forces, tick by tick.
std::vector<double> forceDifferences(const ComparedRun& a, const ComparedRun& b) {
    std::vector<double> lengths;
    for (std::size_t i = 0; i < std::min(a.ticks.size(), b.ticks.size()); ++i)
        lengths.push_back((a.ticks[i].wrench_C.force - b.ticks[i].wrench_C.force).norm());
    return lengths;
}

ordered_json rowOf(const ComparedRun& run, const ComparedRun* exact) {
    // Values of all ticks.
    std::vector<double> step, collision, solve, rows, iterations, hover, force, errors;
    std::array<int, 4> statuses{};
    int over = 0, pairs = 0;
    std::int64_t truncated = 0;
    CoulombResiduals coulomb;
    for (const TickRecord& tick : run.ticks) {
        coulomb = worstOf(coulomb, tick.coulomb);
        step.push_back(tick.totalUs);
        collision.push_back(tick.collisionUs);
        solve.push_back(tick.solveUs);
        rows.push_back(tick.rows);
        if (tick.rows > 0) iterations.push_back(tick.iterations);
        hover.push_back(tick.hover);
        force.push_back(tick.wrench_C.force.norm());
        pairs = std::max(pairs, tick.pairs);
        truncated += tick.rowsTruncated;
        ++statuses[static_cast<std::size_t>(tick.status)];
        over += tick.totalUs > 1000;
    }
    std::copy_if(run.forceError.begin(), run.forceError.end(), std::back_inserter(errors),
                 [](double error) { return error >= 0; });
    const bool approximate = !run.what.solver.empty() && !findSolver(run.settings.solver)->exact;
    ordered_json row{{"case", run.what.name()},
                     {"mode", run.what.mode},
                     {"solver", run.what.solver},
                     {"friction_solver", run.what.friction},
                     {"tolerance", approximate ? ordered_json(run.settings.tolerance) : nullptr},
                     {"ticks", run.ticks.size()},
                     {"device_hash", hexadecimal(run.deviceHash)},
                     {"hash", hexadecimal(run.hash)}};
    for (const auto& [name, values] :
         {std::pair{"step", step}, std::pair{"collision", collision}, std::pair{"solve", solve}}) {
        const Percentiles p = percentiles(values);
        const std::string stage = name;
        row[stage + "_mean_us"] = meanOrNull(values);
        row[stage + "_p50_us"] = orNull(p.p50);
        row[stage + "_p99_us"] = orNull(p.p99);
        row[stage + "_p999_us"] = orNull(p.p999);
        row[stage + "_max_us"] = orNull(p.max);
    }
    // Counts, errors, and what a hand would feel.
    row["ticks_over_1ms"] = over;
    row["pairs_max"] = pairs;
    row["rows_p50"] = orNull(percentile(rows, 50));
    row["rows_max"] = orNull(percentile(rows, 100));
    row["rows_truncated"] = truncated;
    row["iterations_mean"] = meanOrNull(iterations);
    row["iterations_max"] = orNull(percentile(iterations, 100));
    row["force_error_p50_N"] = orNull(percentile(errors, 50));
    row["force_error_max_N"] = orNull(percentile(errors, 100));
    std::vector<double> differences = exact ? forceDifferences(run, *exact) : std::vector<double>();
    row["force_difference_p50_N"] = orNull(percentile(differences, 50));
    row["force_difference_max_N"] = orNull(percentile(differences, 100));
    const Percentiles depth = percentiles(run.penetration);
    row["penetration_p50_mm"] = orNull(depth.p50);
    row["penetration_max_mm"] = orNull(depth.max);
    row["hover_p99_mm"] = orNull(percentile(hover, 99));
    row["hover_max_mm"] = orNull(percentile(hover, 100));
    row["force_max_N"] = orNull(percentile(force, 100));
    row["cone_max_N"] = coulomb.cone_N;
    row["complementarity_max_mJ"] = coulomb.complementarity_mJ;
    row["direction_max_mJ"] = coulomb.direction_mJ;
    for (const SolveStatus status :
         {SolveStatus::Solved, SolveStatus::Elastic, SolveStatus::IterationLimit, SolveStatus::Invalid}) {
        std::string column = std::string("ticks_") + name(status);
        std::replace(column.begin(), column.end(), '-', '_');
        row[column] = statuses[static_cast<std::size_t>(status)];
    }
    return row;
}

double cellOf(const ordered_json& row, const char* key) {
    return row.at(key).is_null() ? 0 : row.at(key).get<double>();
}

void printTable(const std::vector<ordered_json>& rows) {
    std::printf("%-26s %24s %16s %13s %11s %17s %17s %11s %10s  %s\n", "", "step us", "mean us", "iterations", "rows",
                "force error N", "from exact N", "deepest", "hover", "ticks");
    std::printf("%-26s %24s %16s %13s %11s %17s %17s %11s %10s  %s\n", "", "p50 / p99 / p99.9", "collision, solve",
                "mean / max", "p50 / max", "p50 / max", "p50 / max", "mm", "p99 mm", "solved, elastic, limit, invalid");
    for (const ordered_json& row : rows) {
        const auto at = [&](const char* key) { return cellOf(row, key); };
        std::printf(
            "%-26s %8.1f %7.1f %7.1f %8.1f %7.1f %6.1f %6.0f %5.0f %5.0f %8.2g %8.2g %8.2g %8.2g %11.2g %10.2g  %.0f, "
            "%.0f, %.0f, %.0f\n",
            row.at("case").get<std::string>().c_str(), at("step_p50_us"), at("step_p99_us"), at("step_p999_us"),
            at("collision_mean_us"), at("solve_mean_us"), at("iterations_mean"), at("iterations_max"), at("rows_p50"),
            at("rows_max"), at("force_error_p50_N"), at("force_error_max_N"), at("force_difference_p50_N"),
            at("force_difference_max_N"), at("penetration_max_mm"), at("hover_p99_mm"), at("ticks_solved"),
            at("ticks_elastic"), at("ticks_iteration_limit"), at("ticks_invalid"));
    }
}

void printFrictionTable(const std::vector<ordered_json>& rows) {
    std::printf("%-21s %24s %9s %17s %8s %10s %10s %19s %11s %6s\n", "", "step us", "solve us", "force error N",
                "cone N", "compl. mJ", "direct. mJ", "hover mm", "deepest mm", "ticks");
    std::printf("%-21s %24s %9s %17s %8s %10s %10s %19s %11s %6s\n", "", "p50 / p99 / p99.9", "mean", "p50 / max",
                "max", "max", "max", "p99 / max", "max", "none");
    for (const ordered_json& row : rows) {
        const auto at = [&](const char* key) { return cellOf(row, key); };
        std::printf("%-21s %8.1f %7.1f %7.1f %9.1f %8.2g %8.2g %8.2g %10.2g %10.2g %9.2g %9.2g %11.2g %6.0f\n",
                    row.at("friction_solver").get<std::string>().c_str(), at("step_p50_us"), at("step_p99_us"),
                    at("step_p999_us"), at("solve_mean_us"), at("force_error_p50_N"), at("force_error_max_N"),
                    at("cone_max_N"), at("complementarity_max_mJ"), at("direction_max_mJ"), at("hover_p99_mm"),
                    at("hover_max_mm"), at("penetration_max_mm"), at("ticks_iteration_limit"));
    }
    std::printf("ticks none: those for which the solver had no answer, so that the exact solver took over\n");
}

}  // namespace

std::vector<CompareCase> casesOf(const std::vector<std::string>& modes, const std::vector<std::string>& solvers) {
    std::vector<CompareCase> cases;
    for (const std::string& mode : modes) {
        SettingsChoice choice;
        choice.mode = mode;
        const bool solves = withCommandLine({}, choice).mode != Mode::Penalty;
        for (const std::string& solver : solvers) {
            choice.solver = solver;
            const SolverInfo& info = *findSolver(withCommandLine({}, choice).solver);
            if (!isUsable(info)) throw std::runtime_error(solver + " cannot be used: " + info.roundTrip().trouble);
            if (solves) cases.push_back({mode, solver});
        }
        if (!solves) cases.push_back({mode, ""});
    }
    return cases;
}

std::vector<CompareCase> frictionCasesOf(const std::vector<std::string>& solvers) {
    std::vector<CompareCase> cases;
    for (const std::string& solver : solvers) {
        cases.push_back({"default", std::string(kExactSolver), solver});
        SettingsChoice choice;
        choice.set = {"friction_solver=" + solver};
        withCommandLine({}, choice);  // throws for a name that does not exist
    }
    return cases;
}

std::vector<ComparedRun> compareMotion(const ComparedMotion& motion, const std::vector<CompareCase>& cases, int runs) {
    std::vector<Comparing> all;
    for (const CompareCase& what : cases) all.emplace_back(motion, what);
    for (Comparing& one : all) {
        std::fprintf(stderr, "%s %s: %s\n", sceneName(motion.scene).c_str(), motion.device.c_str(),
                     one.run.what.name().c_str());
        one.judge();
        if (one.run.deviceHash != all.front().run.deviceHash)
            throw std::runtime_error(
                "the device's poses with " + one.run.what.name() + " differ from those with " +
                all.front().run.what.name() +
                ", so it reacts to the force: record its motion with `touchstone run --record DIR` and compare that");
    }
    for (int run = 0; run < runs; ++run)
        for (Comparing& one : all) one.time();
    std::vector<ComparedRun> done;
    for (Comparing& one : all) {
        one.finish();
        done.push_back(std::move(one.run));
    }
    return done;
}

std::vector<ordered_json> comparisonRows(const std::vector<ComparedRun>& runs) {
    std::vector<ordered_json> rows;
    for (const ComparedRun& run : runs) {
        const auto exact = std::find_if(runs.begin(), runs.end(), [&](const ComparedRun& other) {
            const std::string_view exactFriction = run.what.friction.empty() ? "" : kExactFrictionSolver;
            return other.what.mode == run.what.mode && other.what.solver == kExactSolver &&
                   other.what.friction == exactFriction;
        });
        rows.push_back(rowOf(run, exact == runs.end() ? nullptr : &*exact));
    }
    return rows;
}

void writeComparison(const std::vector<ComparedRun>& runs, const fs::path& folder, const std::string& prefix) {
    writeFile(folder / (prefix + "compare.csv"), "the table", toCsv(comparisonRows(runs)));
    for (const ComparedRun& run : runs) {
        std::string file = prefix + "ticks-" + run.what.name() + ".csv";
        std::replace(file.begin(), file.end(), ' ', '-');
        TickTable table(folder / file);
        for (std::size_t i = 0; i < run.ticks.size(); ++i)
            table.add(run.ticks[i], run.penetration[i], run.settings.rate);
        table.close();
    }
}

namespace {

int compare(const CompareCommand& command) {
    const bool friction = !command.frictionSolvers.empty();
    const std::vector<CompareCase> cases =
        friction ? frictionCasesOf(command.frictionSolvers) : casesOf(command.modes, command.solvers);
    if (!command.out.empty()) makeFolder(command.out, "the comparison");
    const bool recorded = sandbox::isRecording(command.motion);
    if (recorded && !command.device.empty())
        throw UsageError("--device needs a scene: a recording contains its own motion");
    if (!recorded && !command.scene.empty())
        throw UsageError("--scene is the scene of a recording: name a folder that `touchstone run --record` wrote");
    if (sandbox::moverOf(command.device) == Mover::Person)
        throw UsageError(
            "nobody moves a device twice in the same way: record the motion with `touchstone run --record DIR` and "
            "compare that");
    const fs::path file = recorded ? sceneOfRecording(command.motion, command.scene) : findScene(command.motion);
    const sandbox::HapticScene scene = sandbox::openScene(
        file, {.treeCache = sandbox::treeCacheFolder(), .progress = progressBar(), .allTrees = true});
    if (!scene.missing.empty()) throw std::runtime_error(file.string() + ": " + scene.missing);
    ComparedMotion motion{scene};
    if (recorded)
        motion.device = "replay:" + command.motion;
    else if (!command.device.empty())
        motion.device = command.device;
    motion.seconds = command.seconds;
    motion.tolerance = command.tolerance;
    motion.set = command.set;
    if (friction && !hasFriction(*scene.world, settingsFor(motion, cases.front(), scene.settings)))
        throw std::runtime_error(file.string() +
                                 ": nothing has friction, so --friction-solvers has nothing to compare: give the tool "
                                 "and a part a physics material, or leave the option out");
    if (!friction && hasFriction(*scene.world, settingsFor(motion, cases.front(), scene.settings)))
        std::printf(
            "Parts of this scene have friction, which friction_solver solves in default mode, so --solvers "
            "makes no difference there: give --friction-solvers, or --set friction=off\n");
    const std::vector<ComparedRun> runs = compareMotion(motion, cases, command.runs);
    const std::vector<ordered_json> rows = comparisonRows(runs);
    friction ? printFrictionTable(rows) : printTable(rows);
    std::printf("%.0f ticks each, of the same device poses: %s\n", cellOf(rows.front(), "ticks"),
                rows.front().at("device_hash").get<std::string>().c_str());
    if (command.out.empty()) return kOk;
    writeComparison(runs, command.out);
    drawFigures("compare", command.out);
    return kOk;
}

constexpr const char* kCompareFooter =
    "Examples:\n"
    "  touchstone compare bunnies --device demo:figure-5 --mode paper,default --out compared\n"
    "  touchstone run spline --record push && touchstone compare push --mode default,penalty\n"
    "  touchstone compare part.glb --friction-solvers cone-newton,lemke-8,gauss-seidel\n";

}  // namespace

void addCompare(CLI::App& program, Action& action) {
    const auto options = std::make_shared<CompareCommand>();
    CLI::App* command =
        addCommand(program, "compare", "Render the same device motion with one solver after another", kCompareFooter);
    command->add_option("RECORDING|SCENE", options->motion, "folder that `touchstone run --record` wrote, or a scene")
        ->required();
    options->solvers = processorSolvers();
    CLI::Option* solvers =
        command->add_option("--solvers", options->solvers, "comma-separated, of " + namesOf(solverTable()))
            ->delimiter(',')
            ->capture_default_str();
    CLI::Option* modes = command
                             ->add_option("--mode", options->modes,
                                          "comma-separated: default, paper, god-object, penalty (which has no solver)")
                             ->delimiter(',')
                             ->capture_default_str();
    command
        ->add_option("--friction-solvers", options->frictionSolvers,
                     "instead of solvers and modes: default mode with each of these, comma-separated, of " +
                         namesOf(frictionSolverTable()))
        ->delimiter(',')
        ->excludes(solvers)
        ->excludes(modes);
    command->add_option("--device", options->device,
                        "the device that moves the tool of a scene: demo:NAME, replay:FILE");
    addRecordedScene(*command, options->scene);
    command->add_option("--seconds", options->seconds, "duration (default: until the motion ends)")
        ->check(durationInSeconds());
    command->add_option("--tolerance", options->tolerance, kToleranceHelp);
    addSet(*command, options->set, "KEY=VALUE: set one setting by name, as --KEY VALUE does, in every run");
    command->add_option("--runs", options->runs, "timed runs of each case; the median of each tick is reported")
        ->check(within(1, 1000))
        ->capture_default_str();
    command->add_option("--out", options->out, "folder for the table, every tick and figures (python3-matplotlib)");
    command->callback([options, &action] { action = [options] { return compare(*options); }; });
}

}  // namespace touchstone::app
