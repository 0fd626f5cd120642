#pragma once
// Runs the program from outside, as a user does.
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "haptics/qp/solver.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::test {

namespace fs = std::filesystem;

struct Answer {
    int code = -1;
    std::string out, err;
};

inline std::string textOf(const fs::path& file) {
    std::ifstream in(file);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// Runs `touchstone ARGS` in a folder of its own, with a tree cache there, and without a display unless `variables`
/// give one.
class Program {
  public:
    Answer operator()(const std::string& args, const std::string& variables = {}) const {
        const fs::path err = folder_.path() / "stderr";
        const std::string command = "cd '" + folder_.path().string() +
                                    "' && env -u DISPLAY -u WAYLAND_DISPLAY TOUCHSTONE_CACHE='" + file("cache") + "' " +
                                    variables + " '" TOUCHSTONE_BINARY_DIR "/touchstone' " + args + " 2>'" +
                                    err.string() + "'";
        Answer answer;
        FILE* pipe = popen(command.c_str(), "r");
        REQUIRE(pipe);
        char buffer[4096];
        for (std::size_t n; (n = fread(buffer, 1, sizeof buffer, pipe)) > 0;) answer.out.append(buffer, n);
        const int status = pclose(pipe);
        answer.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        answer.err = textOf(err);
        return answer;
    }
    std::string file(const std::string& name) const { return (folder_.path() / name).string(); }

  private:
    TempFolder folder_;
};

/// The names of the program's exact solver, and of the solvers of the table that are exact or approximate.
inline const std::string kExactName{kExactSolver};
inline std::vector<std::string> solverNames(bool exact) {
    std::vector<std::string> names;
    for (const SolverInfo& solver : solverTable())
        if (solver.exact == exact) names.emplace_back(solver.name);
    return names;
}

/// One line that begins with the name of the program.
inline bool isOneSentence(const std::string& text) {
    return text.size() > 12 && text.rfind("touchstone: ", 0) == 0 && std::count(text.begin(), text.end(), '\n') == 1;
}

/// The arguments of the command that a sentence offers: "Then touchstone new ... -o FILE writes it so".
inline std::string commandIn(const std::string& text) {
    const std::string before = "Then touchstone ";
    const std::size_t from = text.find(before);
    REQUIRE(from != std::string::npos);
    return text.substr(from + before.size(), text.find(" writes it so", from) - from - before.size());
}

}  // namespace touchstone::test
