#pragma once
// The commands of the program. Each is in the file of its name, which adds the command's options and examples to the
// command line and says what the command does.
#include <functional>
#include <stdexcept>

namespace CLI {
class App;
}

namespace touchstone::app {

/// Exit codes of the program.
inline constexpr int kOk = 0, kFailed = 1, kUsage = 2, kOutcomeUnmet = 3;
inline constexpr int kSignalled = 128;  ///< plus the number of the signal that stopped the program, as in shells

/// The command line names something that does not exist or does not fit: exit code kUsage.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// What the chosen command does; returns the exit code. Throws std::exception with one sentence, and BuildCancelled on
/// Ctrl-C.
using Action = std::function<int()>;
/// Adds a command below the program. Parsing the command line then sets `action`, which must outlive the program.
using AddCommand = void (*)(CLI::App& program, Action& action);

void addRun(CLI::App& program, Action& action);
void addValidate(CLI::App& program, Action& action);
void addFit(CLI::App& program, Action& action);
void addDoctor(CLI::App& program, Action& action);
void addNew(CLI::App& program, Action& action);
void addTree(CLI::App& program, Action& action);
void addQp(CLI::App& program, Action& action);
void addExport(CLI::App& program, Action& action);
void addVerify(CLI::App& program, Action& action);
void addRecover(CLI::App& program, Action& action);
void addSoak(CLI::App& program, Action& action);
void addCompare(CLI::App& program, Action& action);
void addPaper(CLI::App& program, Action& action);
void addTrials(CLI::App& program, Action& action);
void addBench(CLI::App& program, Action& action);
void addReferee(CLI::App& program, Action& action);

}  // namespace touchstone::app
