#pragma once
// The commands of the program: plain options in, exit code out. Each throws std::exception with one sentence.
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace touchstone::app {

/// Exit codes of the program.
inline constexpr int kOk = 0, kFailed = 1, kUsage = 2, kOutcomeUnmet = 3;

/// The command line asks for something that does not exist: exit code kUsage.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct RunOptions {
    std::string scene = "bunnies";
    bool headless = false;
    std::optional<double> seconds;
    std::string device;  ///< empty: the demonstration; in a window without one, the mouse
    std::optional<std::string> mode, solver, shadow, tolerance, rate;  ///< as text, checked like settings
    std::vector<std::string> set;                                      ///< KEY=VALUE
    std::filesystem::path report, ticks, screenshot;                   ///< empty: none
};
int run(const RunOptions& options);
/// The keys of --set, one a line.
void printSettings();

int validate(const std::string& scene);

int doctor();

struct NewOptions {
    std::filesystem::path tool, obstacle, output;
    std::string unit = "mm";  ///< mm, cm, m or in
    int leaves = 0;           ///< 0: the default
};
int makeScene(const NewOptions& options);

}  // namespace touchstone::app
