// touchstone: reads the command line, runs one command, and turns every failure into one sentence.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>

#include "haptics/device/device.hpp"
#include "haptics/qp/solver.hpp"
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

void addRun(CLI::App& program, app::RunOptions& options, std::function<int()>& command) {
    CLI::App* run = program.add_subcommand("run", "Open a scene and push: in a window, or headless with a report");
    run->add_option("SCENE", options.scene, "a .glb or .gltf file, or the name of a scene that came along")
        ->capture_default_str();
    run->add_flag("--headless", options.headless, "without window and clock, as fast as it goes; repeats to the bit");
    run->add_option("--seconds", options.seconds, "how long (default: headless, until the motion ends)")
        ->check(CLI::PositiveNumber);
    run->add_option("--device", options.device, "what holds the tool, NAME or NAME:FILE: " + namesOf(deviceTable()));
    run->add_option("--mode", options.mode,
                    "default, or paper: the published method, with solver pqp at 0.01 and no shadow unless asked for");
    run->add_option("--solver", options.solver, "solver that moves the tool: " + namesOf(solverTable()));
    run->add_option("--shadow", options.shadow, "second solver, measured on the same rows: one of these, or none");
    run->add_option("--tolerance", options.tolerance, "of an approximate solver: N, in paper mode N·mm");
    run->add_option("--rate", options.rate, "ticks per second");
    run->add_option("--set", options.set, "KEY=VALUE, a setting by name; wins over all else")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    run->add_option("--report", options.report, "write what was measured to a JSON file");
    run->add_option("--ticks", options.ticks, "write every tick to a CSV file");
    run->add_option("--screenshot", options.screenshot, "write a picture of the last tick to a PNG file");
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
        "  touchstone run bunnies --mode paper --headless --seconds 2 --ticks paper.csv\n"
        "  touchstone run part.glb --device replay:hand.csv --shadow none --set stiffness=0.5\n");
    run->callback([&] { command = [&] { return app::run(options); }; });
}

void addValidate(CLI::App& program, std::string& scene, std::function<int()>& command) {
    CLI::App* validate = program.add_subcommand("validate", "Say what a scene's nodes were taken for, and why");
    validate->add_option("SCENE", scene, "a .glb or .gltf file, or the name of a scene that came along")->required();
    validate->footer("Example:\n  touchstone validate part.glb\n");
    validate->callback([&] { command = [&] { return app::validate(scene); }; });
}

void addNew(CLI::App& program, app::NewOptions& options, std::function<int()>& command) {
    CLI::App* make = program.add_subcommand("new", "Make a scene from two parts, STL or OBJ");
    make->add_option("--tool", options.tool, "the part that moves with the hand")->required();
    make->add_option("--obstacle", options.obstacle, "the part that is fixed")->required();
    make->add_option("--unit", options.unit, "of the parts' coordinates: mm, cm, m or in")->capture_default_str();
    make->add_option("--leaves", options.leaves, "leaves of each sphere tree (default: 4096)")
        ->check(CLI::Range(8, 262144));
    make->add_option("-o,--output", options.output, "the scene to write, .glb or .gltf")->required();
    make->footer("Example:\n  touchstone new --tool shaft.stl --obstacle hole.stl --unit mm -o fit.glb\n");
    make->callback([&] { command = [&] { return app::makeScene(options); }; });
}

int fail(const std::string& sentence, int code) {
    std::fprintf(stderr, "touchstone: %s\n", sentence.c_str());
    return code;
}

}  // namespace

int main(int argc, char** argv) {
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
        "  touchstone doctor                      what works here, what does not, what to do\n\n"
        "Exit codes: 0 all is well, 1 it failed, 2 wrong usage, 3 the scene's expected outcome was not met.\n");

    std::function<int()> command;
    app::RunOptions runOptions;
    app::NewOptions newOptions;
    std::string scene;
    addRun(program, runOptions, command);
    addValidate(program, scene, command);
    program.add_subcommand("doctor", "Say what works on this machine, what does not, and what to do")->callback([&] {
        command = app::doctor;
    });
    addNew(program, newOptions, command);

    try {
        program.parse(argc, argv);
        return command();
    } catch (const CLI::Success& leave) {
        return program.exit(leave);
    } catch (const CLI::ParseError& error) {
        return fail(std::string(error.what()) + " (see touchstone --help)", app::kUsage);
    } catch (const app::UsageError& error) {
        return fail(error.what(), app::kUsage);
    } catch (const std::exception& error) {
        return fail(error.what(), app::kFailed);
    }
}
