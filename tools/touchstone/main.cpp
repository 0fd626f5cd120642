// touchstone: reads the command line, runs one command, and turns every failure into one sentence.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <functional>
#include <iostream>
#include <system_error>

#include "engine/scene/scene.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/device/device.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/math/numbers.hpp"
#include "haptics/qp/solver.hpp"
#include "haptics/sandbox/picture/display_options.hpp"
#include "tools/touchstone/commands.hpp"

namespace {

using namespace touchstone;

/// "a, b or c" of a table's names.
template <class Table>
std::string namesOf(const Table& table) {
    std::string names;
    for (const auto& row : table) names += (names.empty() ? "" : ", ") + std::string(row.name);
    return names;
}

/// The check of every number of an option; settings have theirs in settingTable().
CLI::Validator within(double min, double max, const char* unit = "") {
    const std::string must = rangeWords(min, max, unit);
    return CLI::Validator(
        [=](const std::string& text) {
            return readNumber(text, min, max) ? "" : "must be " + must + ", not '" + text + "'";
        },
        "");
}

/// Of a run: from a tick at the greatest rate to more than anybody waits for.
CLI::Validator seconds() { return within(1e-4, 1e6, "s"); }

void addRun(CLI::App& program, app::RunOptions& options, std::function<int()>& command) {
    CLI::App* run = program.add_subcommand("run", "Open a scene and push: in a window, or headless with a report");
    run->add_option("SCENE", options.scene, "a .glb or .gltf file, or the name of a scene that came along")
        ->capture_default_str();
    run->add_flag("--headless", options.headless, "without window and clock, as fast as it goes; repeats to the bit");
    run->add_flag("--paced", options.paced,
                  "headless: times are taken by the clock, with the thread that finds lists ahead, as in a window");
    run->add_option("--seconds", options.seconds,
                    "how long, headless in simulated time (default: headless, until the motion ends, or 60 s where the "
                    "device has no end within a day)")
        ->check(seconds());
    run->add_option("--device", options.device, "what holds the tool, NAME or NAME:FILE: " + namesOf(deviceTable()));
    run->add_option("--mode", options.mode,
                    "default; paper: the published method, with solver pqp at 0.01 and no shadow unless asked for; or "
                    "penalty: springs against overlaps, to compare with");
    run->add_option("--solver", options.solver, "solver that moves the tool: " + namesOf(solverTable()));
    run->add_option("--shadow", options.shadow, "second solver, measured on the same rows: one of these, or none");
    run->add_option("--tolerance", options.tolerance, "of an approximate solver: N, in paper mode N·mm");
    run->add_option("--rate", options.rate, "ticks per second");
    run->add_option("--set", options.set, "KEY=VALUE, a setting by name; wins over all else")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    run->add_option("--report", options.report, "write what was measured to a JSON file");
    run->add_option("--ticks", options.ticks, "write every tick to a CSV file");
    run->add_option("--record", options.record,
                    "write every tick whole to a folder that --device replay:FOLDER repeats and NumPy reads");
    run->add_option("--dump-qp", options.dumpQp, "headless: write every problem that was solved, for `touchstone qp`");
    run->add_option(
        "--sweep", options.sweep,
        "every solver over its tolerances on the rows of one tick, to a CSV file: headless the last tick, in "
        "a window, which shows it, the one at three fifths of --seconds");
    run->add_option("--plots", options.plots, "what the window's plots show first: time, contact or trade")
        ->check(CLI::IsMember({"time", "contact", "trade"}));
    run->add_option("--select", options.select, "a part, by its name, that is selected in the window at first");
    run->add_option("--screenshot", options.screenshot, "write a picture of the last tick to a PNG file");
    run->add_option("--show", options.show,
                    "what to draw besides, with commas between: " + namesOf(sandbox::displaySwitches()) +
                        "; no-NAME hides, trees:LEVEL, section:x");
    run->add_option("--view", options.view, "from where: front, back, left, right, top, bottom, or contact: near it");
    run->add_flag_callback(
        "--help-settings",
        [] {
            app::printSettings();
            throw CLI::Success();
        },
        "list the keys of --set and leave");
    run->footer(
        "Settings come from the defaults, then the scene, then --mode and the options like it, then --set.\n\n"
        "Examples:\n"
        "  touchstone run bunnies\n"
        "  touchstone run spline --headless --report spline.json\n"
        "  touchstone run spline --headless --screenshot in.png --show section,clearance --view contact\n"
        "  touchstone run bunnies --mode paper --headless --seconds 2 --ticks paper.csv\n"
        "  touchstone run part.glb --device replay:hand.csv --shadow none --set stiffness=0.5\n"
        "  touchstone run bunnies --record push\n"
        "  touchstone run bunnies --headless --device replay:push\n");
    run->callback([&] { command = [&] { return app::run(options); }; });
}

void addValidate(CLI::App& program, std::string& scene, std::function<int()>& command) {
    CLI::App* validate = program.add_subcommand("validate", "Say what a scene's nodes were taken for, and why");
    validate->add_option("SCENE", scene, "a .glb or .gltf file, or the name of a scene that came along")->required();
    validate->footer("Example:\n  touchstone validate part.glb\n");
    validate->callback([&] { command = [&] { return app::validate(scene); }; });
}

/// What `tree` and `new` both ask of a sphere tree.
void addTreeChoice(CLI::App& command, app::TreeChoice& choice) {
    command.add_option("--leaves", choice.leaves, "most leaves of a sphere tree (default: 4096)");
    command.add_option("--max-error", choice.maxError,
                       "as few leaves as reach no further out of the part: 0.02mm, or 0.1% of its diagonal");
    command.add_option("--quality", choice.quality, "fast, or best: tighter, takes several times longer");
    command.add_option("--interior", choice.interior, "shell, or solid: filled, so that nothing hides inside");
}

void addPart(CLI::App& command, app::PartChoice& part) {
    command.add_option("--unit", part.unit, "of .obj, .ply and .stl coordinates: mm (default), cm, m or in");
    command.add_option("--part", part.part, "node of a scene, by name");
}

void addTree(CLI::App& program, app::TreeCommand& options, app::TreeCheckCommand& checkOptions,
             std::function<int()>& command) {
    CLI::App* tree = program.add_subcommand("tree", "Build the sphere tree of a mesh, or of each part of a scene");
    tree->add_option("MESH", options.from.file, "an .obj, .ply, .stl, .glb or .gltf file, or the name of a scene");
    tree->add_option("-o,--output", options.output, "write the tree to a file");
    addTreeChoice(*tree, options.tree);
    tree->add_option("--levels", options.tree.levels,
                     "levels counting the root, in place of --leaves: 5 are 4096 leaves");
    tree->add_option("--seed", options.tree.seed, "another tree, equally good")->check(within(0, 9e15));
    tree->add_option("--threads", options.tree.threads, "to build with; the tree is the same (default: 2)");
    addPart(*tree, options.from);
    tree->add_option("--export", options.exported, "write a .sph file, in frame and unit of the mesh (scenes: metres)");
    tree->add_option("--import", options.imported, "take the leaves of a .sph file in place of building");
    tree->add_option("--picture", options.picture, "draw the leaves over the mesh, 800 x 800, to a PNG file");
    tree->add_flag("--json", options.json, "print a JSON object a line, with units in the names");
    tree->add_flag("--no-cache", options.noCache, "build anew, and keep nothing");
    tree->footer(
        "A scene's parts are built as it says; the options win over it. Without roles it is one mesh.\n\n"
        "Examples:\n"
        "  touchstone tree bunny.obj --leaves 4096 --quality best -o bunny.spheres\n"
        "  touchstone tree shaft.stl --unit mm --max-error 0.02mm --json\n"
        "  touchstone tree bunny.obj --max-error 0.1% --export bunny.sph\n"
        "  touchstone tree spline --part shaft --picture shaft.png\n"
        "  touchstone tree bunny.obj --import other.sph -o other.spheres\n"
        "  touchstone tree check bunny.spheres bunny.obj\n");

    CLI::App* check = tree->add_subcommand("check", "Measure how well a tree, ours or another's, follows a mesh");
    check->add_option("FILE", checkOptions.tree, "a .sph file, or what -o wrote")->required();
    check->add_option("MESH", checkOptions.of.file, "an .obj, .ply, .stl, .glb or .gltf file, or the name of a scene")
        ->required();
    addPart(*check, checkOptions.of);
    check->add_option("--samples", checkOptions.samples, "of the surface, and of the leaves' outside")
        ->check(within(100, 1e8))
        ->capture_default_str();
    check->add_option("--poses", checkOptions.poses, "touching poses of the tree against itself")
        ->check(within(1, 1e5))
        ->capture_default_str();
    check->add_option("--seed", checkOptions.seed, "of samples and poses")
        ->check(within(0, 9e15))
        ->capture_default_str();
    check->add_flag("--json", checkOptions.json, "print a JSON object, with units in the names");
    check->footer(
        "Lengths of a .sph file are in the unit of the mesh.\n\n"
        "Example:\n"
        "  touchstone tree check other.sph bunny.obj --json\n");
    check->callback([&] { command = [&] { return app::checkTree(checkOptions); }; });
    tree->callback([&, check] {
        if (!check->parsed()) command = [&] { return app::makeTrees(options); };
    });
}

void addQp(CLI::App& program, app::QpCommand& options, std::function<int()>& command) {
    CLI::App* qp = program.add_subcommand("qp", "Solve quadratic programs of contact, a JSON object a line");
    qp->add_option("FILE", options.file, "lines of {\"G\":[6],\"J\":[[6],…],\"g\":[…],\"h\":[6],\"ids\":[…]}")
        ->required();
    qp->add_option("--solver", options.solver, "one of " + namesOf(solverTable()) + " (default: the first)");
    qp->add_option("--tolerance", options.tolerance, "of an approximate solver: N, in paper mode N·mm");
    qp->add_option("--mode", options.mode, "default, or paper: pqp as published, on the rows as they are");
    qp->add_flag("--warm", options.warm, "start each line from the one before, by ids");
    qp->footer(
        "A line is min ½(x-h)'G(x-h) s.t. J x >= -g: G a diagonal, mm, N, mN·m and rad. The answers come in the same\n"
        "order, an object a line; what cannot be solved is answered 'invalid' and why.\n\n"
        "Examples:\n"
        "  touchstone qp problems.jsonl --solver pqp --tolerance 1e-3\n"
        "  touchstone run bunnies --headless --dump-qp bunnies.jsonl\n"
        "  touchstone qp bunnies.jsonl --warm\n");
    qp->callback([&] { command = [&] { return app::solveQps(options); }; });
}

void addBench(CLI::App& program, app::BenchCommand& options, app::BenchQpCommand& qpOptions,
              app::BenchMergeCommand& mergeOptions, std::function<int()>& command) {
    CLI::App* bench = program.add_subcommand("bench", "Measure speed against error over scenes, modes and solvers");
    bench->add_option("SCENE", options.scenes, "scenes to measure (default: those of the suite)");
    bench->add_option("--out", options.out, "folder for tables, JSON, plots and a page that shows them all");
    bench->add_flag("--quick", options.quick, "fewer cases and ticks: about two minutes, once the trees are built");
    bench
        ->add_option("--suite", options.suite,
                     "sweep: mode x solver x tolerance x leaves x linearisations; hard: all hard motions, both modes, "
                     "each solver")
        ->capture_default_str();
    bench->add_option("--shard", options.shard, "K/N: the K-th of N parts, for `touchstone bench merge`");
    bench->footer(
        "Plots need gnuplot; a shard draws none. A row whose status or residuals do not hold has no time.\n\n"
        "Examples:\n"
        "  touchstone bench --quick --out quick\n"
        "  touchstone bench --suite hard --shard 2/8 --out part-2\n"
        "  touchstone bench merge part-* --out hard\n"
        "  touchstone bench qp --csv qp.csv\n");

    CLI::App* qp = bench->add_subcommand("qp", "Of the solvers, on made contacts of 10 to 4,000 rows");
    qp->add_option("--csv", qpOptions.csv, "write the table to a CSV file");
    qp->add_flag("--quick", qpOptions.quick, "fewer problems");
    qp->footer("Example:\n  touchstone bench qp --csv qp.csv\n");
    qp->callback([&] { command = [&] { return app::benchQp(qpOptions); }; });

    CLI::App* merge = bench->add_subcommand("merge", "Join the shards of a sweep");
    merge->add_option("DIR", mergeOptions.shards, "what --out of each shard was")->required();
    merge->add_option("--out", mergeOptions.out, "as of `touchstone bench`")->required();
    merge->footer("Example:\n  touchstone bench merge part-* --out hard\n");
    merge->callback([&] { command = [&] { return app::benchMerge(mergeOptions); }; });

    bench->callback([&, qp, merge] {
        if (!qp->parsed() && !merge->parsed()) command = [&] { return app::bench(options); };
    });
}

void addCompare(CLI::App& program, app::CompareCommand& options, std::function<int()>& command) {
    CLI::App* compare = program.add_subcommand("compare", "Feed one motion of the device to one solver after another");
    compare->add_option("RECORDING|SCENE", options.motion, "what --record of `touchstone run` was, or a scene")
        ->required();
    for (const SolverInfo& solver : solverTable()) options.solvers.emplace_back(solver.name);
    compare->add_option("--solvers", options.solvers, "with commas between, of " + namesOf(solverTable()))
        ->delimiter(',')
        ->capture_default_str();
    compare->add_option("--mode", options.modes, "with commas between: default, paper, penalty (which has no solver)")
        ->delimiter(',')
        ->capture_default_str();
    compare->add_option("--device", options.device, "what moves the tool of a scene: demo:NAME, replay:FILE");
    compare->add_option("--seconds", options.seconds, "how long (default: until the motion ends)")->check(seconds());
    compare->add_option("--tolerance", options.tolerance, "of an approximate solver: N, in paper mode N·mm");
    compare->add_option("--set", options.set, "KEY=VALUE, a setting by name, for all of them")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    compare->add_option("--runs", options.runs, "timed runs of each, of which every tick's median is taken")
        ->check(within(1, 1000))
        ->capture_default_str();
    compare->add_option("--out", options.out, "folder for the table, every tick and plots, which need gnuplot");
    compare->footer(
        "Examples:\n"
        "  touchstone compare bunnies --device demo:figure-5 --mode paper,default --out compared\n"
        "  touchstone run spline --record push && touchstone compare push --mode default,penalty\n");
    compare->callback([&] { command = [&] { return app::compare(options); }; });
}

void addPaper(CLI::App& program, app::PaperCommand& options, std::function<int()>& command) {
    CLI::App* paper = program.add_subcommand("paper", "Repeat the published experiments, figures 5 to 7");
    paper->add_option("--out", options.out, "folder for tables, plots, pictures and paper.json")->required();
    paper->add_flag("--quick", options.quick, "coarse trees and short motions, to see that it works");
    paper->footer("tools/document_paper makes docs/paper.md of it.\n\nExample:\n  touchstone paper --out paper\n");
    paper->callback([&] { command = [&] { return app::paper(options); }; });
}

void addTrials(CLI::App& program, app::TrialsCommand& options, app::TrialsSummaryCommand& summaryOptions,
               std::function<int()>& command) {
    CLI::App* trials = program.add_subcommand("trials", "Run a study: who assembles what, how often, and how it went");
    CLI::Option* protocol = trials->add_option("PROTOCOL", options.protocol, "a JSON file, see docs/trials.md");
    CLI::Option* out = trials->add_option("--out", options.out,
                                          "folder for a recording of each trial, trials.csv and the summary; what "
                                          "it holds of this protocol already is not repeated");
    trials->add_option("--shard", options.shard,
                       "K/N: the K-th of N parts and no summary, for `touchstone trials summary`");
    trials->add_flag("--headless", options.headless,
                     "without window and clock, as fast as it goes; else a panel of the window says what is next");
    trials->footer(
        "Trials are interrupted and resumed at will: the same command goes on where it was.\n\n"
        "Examples:\n"
        "  touchstone trials study.json --headless --out study\n"
        "  touchstone trials study.json --headless --shard 2/8 --out part-2\n"
        "  touchstone trials summary part-* --out study\n");

    CLI::App* summary = trials->add_subcommand("summary", "Join shards: one table, means with their confidence, plots");
    summary->add_option("DIR", summaryOptions.folders, "what --out of each shard was")->required();
    summary->add_option("--out", summaryOptions.out, "folder for the table, the summary and its plots")->required();
    summary->footer("Plots need gnuplot.\n\nExample:\n  touchstone trials summary part-* --out study\n");
    summary->callback([&] { command = [&] { return app::summariseTrials(summaryOptions); }; });

    trials->callback([&, summary, protocol, out] {
        if (summary->parsed()) return;
        if (protocol->empty() || out->empty()) throw CLI::RequiredError("PROTOCOL and --out");
        command = [&] { return app::trials(options); };
    });
}

void addDoctor(CLI::App& program, app::DoctorCommand& options, std::function<int()>& command) {
    CLI::App* doctor =
        program.add_subcommand("doctor", "Say what works on this machine, what does not, and what to do");
    doctor->add_option("--stiffness", options.stiffness, "of the contact that is to feel passive, N/mm")
        ->check(within(1e-3, 1e6, "N/mm"));
    doctor->add_option("--rate", options.rate, "of its ticks, Hz")->check(within(1, 1e6, "Hz"));
    doctor->callback([&] { command = [&] { return app::doctor(options); }; });
}

void addNew(CLI::App& program, app::NewOptions& options, std::function<int()>& command) {
    CLI::App* make = program.add_subcommand("new", "Make a scene from two parts: STL, OBJ or PLY");
    make->add_option("--tool", options.tool, "the part that moves with the hand")->required();
    make->add_option("--obstacle", options.obstacle, "the part that is fixed")->required();
    make->add_option("--unit", options.unit, "of the parts' coordinates: mm, cm, m or in")->capture_default_str();
    addTreeChoice(*make, options.tree);
    make->add_option("-o,--output", options.output, "the scene to write, .glb or .gltf")->required();
    make->footer("Example:\n  touchstone new --tool shaft.stl --obstacle hole.stl --unit mm -o fit.glb\n");
    make->callback([&] { command = [&] { return app::makeScene(options); }; });
}

void addRecordings(CLI::App& program, app::ExportOptions& exported, std::filesystem::path& recovered,
                   std::function<int()>& command) {
    CLI::App* csv = program.add_subcommand("export", "Write the ticks of a recording as CSV");
    csv->add_option("DIR", exported.recording, "what --record of `touchstone run` was");
    csv->add_option("--out", exported.output, "CSV file (default: DIR.csv)");
    csv->add_flag("--fields", exported.fields, "print what the columns are, as a Markdown table, and leave");
    csv->footer("Example:\n  touchstone export push --out push.csv\n");
    csv->callback([&] { command = [&] { return app::exportRecording(exported); }; });

    CLI::App* recover = program.add_subcommand("recover", "Make whole what a crash has left of a recording");
    recover->add_option("DIR", recovered, "what --record of `touchstone run` was")->required();
    recover->footer("Example:\n  touchstone recover push\n");
    recover->callback([&] { command = [&] { return app::recoverRecording(recovered); }; });
}

void addSoak(CLI::App& program, app::SoakOptions& options, std::function<int()>& command) {
    CLI::App* soak = program.add_subcommand(
        "soak", "Run the loop long, recording half of the time, while scenes, devices and settings change");
    soak->add_option("SCENE", options.scene, "a .glb or .gltf file, or the name of a scene that came along")
        ->capture_default_str();
    soak->add_option("--seconds", options.seconds, "how long")->check(within(4, 1e6, "s"))->capture_default_str();
    soak->add_option("--most-growth", options.mostGrowth, "of memory after the first quarter of the time, MB")
        ->check(within(0, 1e6, "MB"))
        ->capture_default_str();
    soak->add_option("--record", options.record, "folder for its recordings, each removed once it is checked");
    soak->footer(
        "Exit code 1 when memory grew by more, a tick was lost and not counted, a recording does not replay, or an\n"
        "output was not finite or above the device's limits.\n\n"
        "Example:\n  touchstone soak bunnies --seconds 60\n");
    soak->callback([&] { command = [&] { return app::soak(options); }; });
}

int fail(const std::string& sentence, int code) {
    std::fprintf(stderr, "touchstone: %s\n", engine::escaped(sentence).c_str());  // it may quote names out of files
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    endWithZeroForce();
    // Reports go to the output stream, everything else to the other.
    spdlog::set_default_logger(spdlog::stderr_color_st("touchstone"));
    spdlog::set_pattern("%^%l%$: %v");

    CLI::App program{"Push virtual parts against each other, feel it, see it, measure it."};
    program.name("touchstone");
    program.set_version_flag("--version", "touchstone " TOUCHSTONE_VERSION);
    program.require_subcommand(1);
    program.footer(
        "Examples:\n"
        "  touchstone run bunnies                 push one bunny against another\n"
        "  touchstone run spline --headless       measure the splined shaft's demonstration\n"
        "  touchstone tree part.stl --max-error 0.02mm   its sphere tree, as coarse as may be\n"
        "  touchstone bench --quick --out bench   speed against error, as tables, plots and a page\n"
        "  touchstone doctor                      what works here, what does not, what to do\n\n"
        "Exit codes: 0 all is well, 1 it failed, 2 wrong usage, 3 the scene's expected outcome was not met,\n"
        "130 stopped by Ctrl-C, 143 by SIGTERM.\n");

    std::function<int()> command;
    app::RunOptions runOptions;
    app::NewOptions newOptions;
    app::DoctorCommand doctorCommand;
    app::TreeCommand treeCommand;
    app::TreeCheckCommand treeCheckCommand;
    app::QpCommand qpCommand;
    app::BenchCommand benchCommand;
    app::BenchQpCommand benchQpCommand;
    app::BenchMergeCommand benchMergeCommand;
    app::ExportOptions exportOptions;
    app::SoakOptions soakOptions;
    app::CompareCommand compareCommand;
    app::PaperCommand paperCommand;
    app::TrialsCommand trialsCommand;
    app::TrialsSummaryCommand trialsSummaryCommand;
    std::filesystem::path recovered;
    std::string scene;
    addRun(program, runOptions, command);
    addValidate(program, scene, command);
    addDoctor(program, doctorCommand, command);
    addNew(program, newOptions, command);
    addTree(program, treeCommand, treeCheckCommand, command);
    addQp(program, qpCommand, command);
    addRecordings(program, exportOptions, recovered, command);
    addSoak(program, soakOptions, command);
    addCompare(program, compareCommand, command);
    addPaper(program, paperCommand, command);
    addTrials(program, trialsCommand, trialsSummaryCommand, command);
    addBench(program, benchCommand, benchQpCommand, benchMergeCommand, command);

    try {
        int code = app::kOk;
        try {
            program.parse(argc, argv);
            code = command();
        } catch (const CLI::Success& leave) {
            code = program.exit(leave);
        }
        // What was printed counts as an output, too.
        std::cout.flush();
        if (std::fflush(stdout) != 0 || std::ferror(stdout) || !std::cout)
            throw std::runtime_error("cannot write to the output stream: " + std::generic_category().message(errno));
        return code;
    } catch (const CLI::ParseError& error) {
        return fail(std::string(error.what()) + " (see touchstone --help)", app::kUsage);
    } catch (const app::UsageError& error) {
        return fail(error.what(), app::kUsage);
    } catch (const BuildCancelled&) {
        return fail("cancelled", app::kSignalled + StopRequest::signal());
    } catch (const std::exception& error) {
        return fail(error.what(), app::kFailed);
    }
}
