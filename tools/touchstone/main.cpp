// touchstone: reads the command line, runs one command, and reports every failure in one sentence.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <iostream>
#include <string>
#include <system_error>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/math/nearest_name.hpp"
#include "haptics/sandbox/gpu/gpu_solver.hpp"
#include "tools/touchstone/commands.hpp"

namespace {

using namespace touchstone;

/// The commands, in the order of --help. A new command is a file with its add function, and a row here.
constexpr app::AddCommand kCommands[] = {
    app::addRun,   app::addValidate, app::addFit,    app::addDoctor,  app::addNew,  app::addTree,
    app::addQp,    app::addExport,   app::addVerify, app::addRecover, app::addSoak, app::addCompare,
    app::addPaper, app::addTrials,   app::addBench,  app::addReferee,
};

constexpr const char* kFooter =
    "`touchstone COMMAND --help` lists a command's options and examples.\n\n"
    "Examples:\n"
    "  touchstone run bunnies                 push one bunny against another\n"
    "  touchstone run spline --headless       measure the demonstration of the splined shaft\n"
    "  touchstone tree part.stl --max-error 0.02mm   build the coarsest sphere tree within this error\n"
    "  touchstone bench --quick --out bench   speed against error, as tables, plots and a page\n"
    "  touchstone fit peg-h7                  measure whether the tool fits, and what to set if not\n"
    "  touchstone doctor                      check this machine\n\n"
    "Exit codes: 0 success, 1 failure, 2 wrong usage, 3 the scene's expected outcome was not met,\n"
    "or its tool does not fit, 130 stopped by Ctrl-C, 143 stopped by SIGTERM.\n";

/// Throws UsageError if the first argument is neither an option nor a command. CLI11 only says that one is required.
void checkCommand(const CLI::App& program, int argc, const char* const* argv) {
    if (argc < 2 || *argv[1] == '-') return;
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands({})) names.push_back(command->get_name());
    if (std::find(names.begin(), names.end(), argv[1]) != names.end()) return;
    const std::string nearest = nearestName(argv[1], names);
    throw app::UsageError("there is no command '" + std::string(argv[1]) + "'" +
                          (nearest.empty() ? " (see touchstone --help)" : ": did you mean '" + nearest + "'?"));
}

int fail(const std::string& sentence, int code) {
    std::fprintf(stderr, "touchstone: %s\n", engine::escaped(sentence).c_str());  // it may quote names out of files
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    installEmergencyStop();
    sandbox::addGpuSolver();
    // Reports go to the output stream, everything else to the error stream.
    spdlog::set_default_logger(spdlog::stderr_color_st("touchstone"));
    spdlog::set_pattern("%^%l%$: %v");

    app::Action action;
    CLI::App program{
        "Six-degree-of-freedom haptic rendering of rigid contact: feel, see and measure parts in contact."};
    program.name("touchstone");
    program.set_version_flag("--version", "touchstone " TOUCHSTONE_VERSION);
    program.require_subcommand(1);
    program.footer(kFooter);
    for (const app::AddCommand add : kCommands) add(program, action);

    try {
        int code = app::kOk;
        try {
            checkCommand(program, argc, argv);
            program.parse(argc, argv);
            code = action();
        } catch (const CLI::Success& success) {  // --help and its like
            code = program.exit(success);
        }
        // What was printed is an output of the command: a failure to write it is a failure of the command.
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
