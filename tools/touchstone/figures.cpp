#include "tools/touchstone/figures.hpp"

#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <cstdio>
#include <sstream>
#include <stdexcept>

#include "engine/scene/folders.hpp"
#include "haptics/sandbox/session/presets.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;

constexpr int kNoMatplotlib = 3;  // exit code of the script
constexpr int kNoPython = 127;    // exit code of the shell

/// tools/plot: of an installed program beside it or in the share folder of its prefix, else in the source tree.
fs::path plotScript() {
    const fs::path program = engine::programFolder(), share = "share/touchstone/plot";
    std::error_code error;
    for (const fs::path& installed :
         {program / "plot", program.parent_path() / share, program.parent_path().parent_path() / share})
        if (fs::is_regular_file(installed, error)) return installed;
    return TOUCHSTONE_PLOT_SCRIPT;
}

struct ScriptRun {
    int code = -1;
    std::string output;  ///< with the error stream, so that only this program reports a failure
};

ScriptRun runScript(const fs::path& script, const std::string& kind, const fs::path& folder) {
    using sandbox::shellQuoted;
    const std::string line =
        "python3 " + shellQuoted(script.string()) + " " + kind + " " + shellQuoted(folder.string()) + " 2>&1";
    std::fflush(stdout);
    FILE* pipe = popen(line.c_str(), "r");
    if (!pipe) return {};
    ScriptRun run;
    char buffer[4096];
    for (std::size_t n; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;) run.output.append(buffer, n);
    const int status = pclose(pipe);
    run.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return run;
}

/// The last line that a script printed, which holds its error.
std::string lastLine(const std::string& output) {
    std::string last;
    std::istringstream lines(output);
    for (std::string line; std::getline(lines, line);)
        if (!line.empty()) last = line;
    return last;
}

/// Lines of "name<tab>caption".
std::vector<Figure> figuresOf(const std::string& output) {
    std::vector<Figure> figures;
    std::istringstream lines(output);
    for (std::string line; std::getline(lines, line);)
        if (const auto tab = line.find('\t'); tab != std::string::npos)
            figures.push_back({line.substr(0, tab), line.substr(tab + 1)});
    return figures;
}

}  // namespace

std::vector<Figure> drawFigures(const std::string& kind, const fs::path& folder) {
    const fs::path script = plotScript();
    const ScriptRun run = runScript(script, kind, folder);
    if (run.code == 0) return figuresOf(run.output);
    if (run.code != kNoMatplotlib && run.code != kNoPython)
        throw std::runtime_error("the figures in '" + folder.string() +
                                 "' could not be drawn; check the folder and the free space: " + lastLine(run.output));
    spdlog::warn(
        "the tables in '{0}' are complete, but no figures were drawn, because no python3 on PATH has matplotlib: "
        "install it (apt-get install python3-matplotlib) and draw them with '{1} {2} {0}'",
        folder.string(), script.string(), kind);
    return {};
}

}  // namespace touchstone::app
