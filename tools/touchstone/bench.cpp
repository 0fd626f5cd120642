// touchstone bench: measures a sweep, writes the results, and merges the shards of a sweep.
#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/scene_path.hpp"
#include "tools/touchstone/shard.hpp"
#include "tools/touchstone/stopwatch.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct BenchMergeCommand {
    std::vector<fs::path> shards;
    fs::path out;
};

void makeOutFolder(const fs::path& folder) {
    if (folder.empty()) throw UsageError("touchstone bench needs --out DIR, a folder to write to");
    makeFolder(folder, "the benchmark");
}

void sortRows(ordered_json& results) {
    const auto by = [](const char* key) {
        return [key](const ordered_json& a, const ordered_json& b) { return a.at(key) < b.at(key); };
    };
    std::stable_sort(results["rows"].begin(), results["rows"].end(), by("key"));
    std::stable_sort(results["qp"].begin(), results["qp"].end(), by("rows"));
}

void write(const fs::path& folder, ordered_json& results, bool page) {
    sortRows(results);
    writeFile(folder / "bench.json", "the results", results.dump(1) + "\n");
    writeFile(folder / "rows.csv", "the table", toCsv(results["rows"].get<std::vector<ordered_json>>()));
    writeFile(folder / "qp.csv", "the table", toCsv(results["qp"].get<std::vector<ordered_json>>()));
    if (page) writeFile(folder / "index.html", "the page", benchPage(results, drawFigures("bench", folder), folder));
}

void printSummary(const ordered_json& results, const fs::path& folder) {
    std::size_t failed = 0;
    for (const ordered_json& row : results["rows"]) {
        if (row["valid"].get<bool>()) continue;
        ++failed;
        std::printf("failed: %s: %s\n", row["key"].get<std::string>().c_str(), row["why"].get<std::string>().c_str());
    }
    std::printf("%zu rows, of which %zu failed and have no time; the results are in %s\n", results["rows"].size(),
                failed, folder.string().c_str());
}

/// The cases that need the same trees, from `first` on.
std::size_t endOfScene(const std::vector<BenchCase>& cases, std::size_t first) {
    std::size_t end = first;
    while (end < cases.size() && cases[end].scene == cases[first].scene && cases[end].leaves == cases[first].leaves)
        ++end;
    return end;
}

/// Returns kOk even if rows failed: failures are also results.
int bench(const BenchCommand& command) {
    const Shard shard = shardOf(command.shard);
    const BenchPlan all = planBench(command), plan = all.shard(shard.k, shard.n);
    makeOutFolder(command.out);

    ordered_json part = sandbox::buildInfo();
    part["shard"] = std::to_string(shard.k) + "/" + std::to_string(shard.n);
    ordered_json results{{"suite", command.suite},       {"quick", command.quick},
                         {"planned", all.size()},        {"parts", ordered_json::array({part})},
                         {"exact_solver", kExactSolver}, {"rows", ordered_json::array()},
                         {"qp", ordered_json::array()}};
    BenchEffort effort = command.quick ? kQuick : kFull;
    if (command.suite == "mesh") effort.samples = 0;
    for (const int rows : plan.qpRows)
        for (QpCost& cost : measureQp(rows, command.quick, command.gpu)) results["qp"].push_back(std::move(cost));
    for (std::size_t first = 0, end; first < plan.cases.size(); first = end) {
        end = endOfScene(plan.cases, first);
        const BenchCase& one = plan.cases[first];
        sandbox::SceneOptions options{.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()};
        options.leaves = one.leaves;
        const std::span<const BenchCase> cases(&plan.cases[first], end - first);
        options.allTrees = std::any_of(cases.begin(), cases.end(), [](const BenchCase& c) { return c.needsTrees(); });
        const Stopwatch watch;
        const sandbox::HapticScene scene = sandbox::openScene(findScene(one.scene), options);
        const double opening = watch.cpu();
        for (BenchRow& row : measureCases(scene, cases, effort)) {
            row["open_cpu_s"] = options.allTrees ? nullptr : ordered_json(opening);  // trees may be in the cache
            results["rows"].push_back(std::move(row));
        }
    }
    write(command.out, results, command.shard.empty());
    printSummary(results, command.out);
    return kOk;
}

int benchMerge(const BenchMergeCommand& command) {
    ordered_json joined;
    std::set<std::string> found;
    std::string n;
    for (const fs::path& folder : command.shards) {
        const fs::path file = folder / "bench.json";
        std::ifstream in(file);
        const ordered_json part = ordered_json::parse(in, nullptr, false);
        const auto fail = [&](const std::string& what) { throw std::runtime_error(file.string() + ": " + what); };
        if (!part.is_object() || !part.contains("parts") || !part.contains("rows") || !part.contains("qp"))
            fail("this is not a file of `touchstone bench --out`: give the folders of a sweep's shards");
        if (part["parts"].size() != 1) fail("this sweep is merged already: give the folders of the shards themselves");
        const std::string shard = part["parts"][0].value("shard", "");
        if (!found.insert(shard).second) fail("shard " + shard + " is given twice");
        const std::string of = shard.substr(shard.find('/') + 1);
        if (joined.is_null()) {
            joined = part;
            n = of;
            continue;
        }
        for (const char* key : {"suite", "quick", "planned"})
            if (part.value(key, ordered_json()) != joined[key] || of != n)
                fail("this shard is of another sweep than the first folder");
        for (const char* key : {"parts", "rows", "qp"})
            joined[key].insert(joined[key].end(), part[key].begin(), part[key].end());
    }
    if (std::to_string(found.size()) != n)
        throw std::runtime_error("only " + std::to_string(found.size()) + " of " + n +
                                 " shards are given: add the folders of the others");
    makeOutFolder(command.out);
    write(command.out, joined, true);
    printSummary(joined, command.out);
    return kOk;
}

constexpr const char* kBenchFooter =
    "Figures need python3-matplotlib; a shard draws none. A row whose status or residuals violate their limits has no\n"
    "time.\n\n"
    "Examples:\n"
    "  touchstone bench --quick --out quick\n"
    "  touchstone bench --suite hard --shard 2/8 --out part-2\n"
    "  touchstone bench merge part-* --out hard\n"
    "  touchstone bench qp --csv qp.csv\n"
    "  touchstone bench friction --csv friction.csv\n"
    "  touchstone bench gpu --out gpu\n";

const CLI::App* addBenchMerge(CLI::App& bench, Action& action) {
    const auto options = std::make_shared<BenchMergeCommand>();
    CLI::App* merge = addCommand(bench, "merge", "Merge the shards of a sweep",
                                 "Example:\n  touchstone bench merge part-* --out hard\n");
    merge->add_option("DIR", options->shards, "the --out folder of each shard")->required();
    merge->add_option("--out", options->out, "folder for the merged results, as of `touchstone bench`")->required();
    merge->callback([options, &action] { action = [options] { return benchMerge(*options); }; });
    return merge;
}

}  // namespace

void addBench(CLI::App& program, Action& action) {
    const auto options = std::make_shared<BenchCommand>();
    CLI::App* command =
        addCommand(program, "bench", "Measure speed against error over scenes, modes and solvers", kBenchFooter);
    command->add_option("SCENE", options->scenes, "scenes to measure (default: those of the suite)");
    command->add_option("--out", options->out, "folder for tables, JSON, figures and a page that shows them");
    command->add_flag("--quick", options->quick,
                      "fewer cases, ticks and leaves: about two minutes if the trees are in the cache");
    command
        ->add_option("--suite", options->suite,
                     "sweep: mode x solver x tolerance x leaves x linearizations; hard: all hard motions in both modes "
                     "with each solver; mesh: contact between meshes, with and without the list worker")
        ->capture_default_str();
    command->add_flag("--gpu", options->gpu, kGpuHelp);
    command->add_option("--shard", options->shard, "K/N: measure the K-th of N parts, for `touchstone bench merge`");
    const std::array parts{addBenchQp(*command, action), addBenchFriction(*command, action),
                           addBenchGpu(*command, action), addBenchMerge(*command, action)};
    command->callback([options, parts, &action] {
        if (std::none_of(parts.begin(), parts.end(), [](const CLI::App* part) { return part->parsed(); }))
            action = [options] { return bench(*options); };
    });
}

}  // namespace touchstone::app
