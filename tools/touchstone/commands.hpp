#pragma once
// The commands of the program: plain options in, exit code out. Each throws std::exception with one sentence, and
// BuildCancelled on Ctrl-C.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace touchstone::app {

/// Exit codes of the program.
inline constexpr int kOk = 0, kFailed = 1, kUsage = 2, kOutcomeUnmet = 3;
inline constexpr int kSignalled = 128;  ///< plus the number of the signal that stopped it, as shells have it

/// The command line asks for something that does not exist: exit code kUsage.
struct UsageError : std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct RunOptions {
    std::string scene = "bunnies";
    bool headless = false;
    bool paced = false;
    std::optional<double> seconds;
    std::string device;  ///< empty: the demonstration; in a window without one, the mouse
    std::optional<std::string> mode, solver, shadow, tolerance, rate;        ///< as text, checked like settings
    std::vector<std::string> set;                                            ///< KEY=VALUE
    std::filesystem::path report, ticks, screenshot, dumpQp, sweep, record;  ///< empty: none
    std::string show, view;  ///< of the picture: applyShowList(), checkView()
    std::string plots;       ///< what a window shows first: time, contact or trade
    std::string select;      ///< node that is selected in a window at first, by name
};
int run(const RunOptions& options);
/// The keys of --set, one a line.
void printSettings();

int validate(const std::string& scene);

struct DoctorCommand {
    std::optional<double> stiffness, rate;  ///< N/mm, Hz, of a contact that is to feel passive; none: as by default
};
int doctor(const DoctorCommand& command);

/// The sphere tree that is asked for; what is not given stays as the scene or the default has it.
struct TreeChoice {
    std::optional<int> leaves, levels;  ///< at most one of these two and maxError
    std::string maxError;               ///< as text: 0.02mm, 0.02 or 0.1%
    std::optional<std::string> quality, interior;
    std::optional<std::uint64_t> seed;
    std::optional<int> threads;
};

/// Where triangles come from.
struct PartChoice {
    std::string file;                 ///< .obj, .ply, .stl, .glb or .gltf, or the name of a scene
    std::optional<std::string> unit;  ///< of .obj, .ply and .stl: mm, cm, m or in
    std::string part;                 ///< name of a node; empty: all parts
};

struct TreeCommand {
    PartChoice from;
    TreeChoice tree;
    std::filesystem::path output, exported, imported, picture;  ///< empty: none
    bool json = false, noCache = false;
};
int makeTrees(const TreeCommand& command);

struct TreeCheckCommand {
    std::filesystem::path tree;
    PartChoice of;
    int samples = 200000, poses = 64;
    std::uint64_t seed = 1;
    bool json = false;
};
int checkTree(const TreeCheckCommand& command);

struct QpCommand {
    std::filesystem::path file;
    std::optional<std::string> mode, solver, tolerance;  ///< as text, checked like settings
    bool warm = false;
};
/// Exit code kFailed when a line is broken; the others are answered.
int solveQps(const QpCommand& command);

struct BenchQpCommand {
    std::filesystem::path csv;  ///< empty: none
    bool quick = false;
};
int benchQp(const BenchQpCommand& command);

struct BenchCommand {
    std::vector<std::string> scenes;  ///< empty: those of the suite
    std::string suite = "sweep", shard;
    std::filesystem::path out;
    bool quick = false;
};
/// Exit code kOk also when rows failed: they are part of what was measured.
int bench(const BenchCommand& command);

struct BenchMergeCommand {
    std::vector<std::filesystem::path> shards;
    std::filesystem::path out;
};
int benchMerge(const BenchMergeCommand& command);

struct ExportOptions {
    std::filesystem::path recording, output;  ///< no output: the recording's folder with .csv
    bool fields = false;                      ///< print the table of columns instead
};
int exportRecording(const ExportOptions& options);
int recoverRecording(const std::filesystem::path& folder);

struct SoakOptions {
    std::string scene = "bunnies";
    double seconds = 1800;
    double mostGrowth = 16;        ///< MB
    std::filesystem::path record;  ///< where recordings go; empty: a folder of the system's for such things
};
/// Exit code kFailed when the memory grew by more, a tick was lost and not counted, or an output was not safe.
int soak(const SoakOptions& options);

struct CompareCommand {
    std::string motion;  ///< folder of a recording, or a scene
    std::string device;  ///< of a scene; empty: its demonstration
    std::vector<std::string> solvers, modes{"default"};
    std::optional<double> seconds;
    std::optional<std::string> tolerance;  ///< as text, checked like settings
    std::vector<std::string> set;          ///< KEY=VALUE
    int runs = 5;
    std::filesystem::path out;  ///< empty: the table alone
};
int compare(const CompareCommand& command);

struct PaperCommand {
    std::filesystem::path out;
    bool quick = false;
};
int paper(const PaperCommand& command);

struct TrialsCommand {
    std::filesystem::path protocol, out;
    std::string shard;  ///< K/N; empty: all trials, and their summary
    bool headless = false;
};
/// Runs the trials that `out` does not hold yet.
int trials(const TrialsCommand& command);

struct TrialsSummaryCommand {
    std::vector<std::filesystem::path> folders;  ///< what --out of each shard was
    std::filesystem::path out;
};
int summariseTrials(const TrialsSummaryCommand& command);

struct NewOptions {
    std::filesystem::path tool, obstacle, output;
    std::string unit = "mm";  ///< mm, cm, m or in
    TreeChoice tree;          ///< of both parts
};
int makeScene(const NewOptions& options);

}  // namespace touchstone::app
