// touchstone bench: sweeps, writes what was measured, and joins the parts of a sweep.
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/gnuplot.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

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

void write(const fs::path& folder, ordered_json& results, bool plots) {
    sortRows(results);
    writeFile(folder / "bench.json", "the results", results.dump(1) + "\n");
    writeFile(folder / "rows.csv", "the table", toCsv(results["rows"].get<std::vector<ordered_json>>()));
    writeFile(folder / "qp.csv", "the table", toCsv(results["qp"].get<std::vector<ordered_json>>()));
    if (plots) writeFile(folder / "index.html", "the page", benchPage(results, drawPlots(results, folder), folder));
}

void tell(const ordered_json& results, const fs::path& folder) {
    std::size_t failed = 0;
    for (const ordered_json& row : results["rows"]) {
        if (row["valid"].get<bool>()) continue;
        ++failed;
        std::printf("failed: %s: %s\n", row["key"].get<std::string>().c_str(), row["why"].get<std::string>().c_str());
    }
    std::printf("%zu rows, of which %zu failed and have no time; all of it is in %s\n", results["rows"].size(), failed,
                folder.string().c_str());
}

/// The cases that need the same trees, from `first` on.
std::size_t endOfScene(const std::vector<BenchCase>& cases, std::size_t first) {
    std::size_t end = first;
    while (end < cases.size() && cases[end].scene == cases[first].scene && cases[end].leaves == cases[first].leaves)
        ++end;
    return end;
}

std::string quoted(const std::string& text) {
    std::string field = "\"";
    for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
    return field + "\"";
}

}  // namespace

Shard shardOf(const std::string& text) {
    Shard shard;
    if (text.empty()) return shard;
    const char* const end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, shard.k);
    const auto second = first.ptr < end ? std::from_chars(first.ptr + 1, end, shard.n) : first;
    if (first.ec != std::errc{} || second.ec != std::errc{} || *first.ptr != '/' || second.ptr != end || shard.k < 1 ||
        shard.k > shard.n)
        throw UsageError("--shard takes K/N with K from 1 to N, like 2/8, not '" + text + "'");
    return shard;
}

std::string toCsv(const std::vector<ordered_json>& rows) {
    if (rows.empty()) return {};
    std::string csv;
    const auto line = [&csv](const ordered_json& row, auto&& text) {
        std::string fields;
        for (const auto& [key, value] : row.items()) fields += "," + text(key, value);
        csv += fields.substr(1) + "\n";
    };
    line(rows.front(), [](const std::string& key, const ordered_json&) { return key; });
    for (const ordered_json& row : rows)
        line(row, [](const std::string&, const ordered_json& value) {
            if (value.is_null()) return std::string();
            if (!value.is_string()) return value.dump();
            const std::string text = value.get<std::string>();
            return text.find_first_of(",\"\n") == std::string::npos ? text : quoted(text);
        });
    return csv;
}

int bench(const BenchCommand& command) {
    const Shard shard = shardOf(command.shard);
    const BenchPlan all = planBench(command), plan = all.shard(shard.k, shard.n);
    const bool plots = command.shard.empty();
    if (plots) requireGnuplot();
    makeOutFolder(command.out);

    ordered_json part = sandbox::buildInfo();
    part["shard"] = std::to_string(shard.k) + "/" + std::to_string(shard.n);
    ordered_json results{{"suite", command.suite},        {"quick", command.quick},
                         {"planned", all.size()},         {"parts", ordered_json::array({part})},
                         {"rows", ordered_json::array()}, {"qp", ordered_json::array()}};
    for (const int rows : plan.qpRows)
        for (QpCost& cost : measureQp(rows, command.quick)) results["qp"].push_back(std::move(cost));
    for (std::size_t first = 0, end; first < plan.cases.size(); first = end) {
        end = endOfScene(plan.cases, first);
        const BenchCase& one = plan.cases[first];
        sandbox::SceneOptions options{.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()};
        options.leaves = one.leaves;
        const sandbox::HapticScene scene = sandbox::openScene(findScene(one.scene), options);
        const std::span<const BenchCase> cases(&plan.cases[first], end - first);
        for (BenchRow& row : measureCases(scene, cases, command.quick ? kQuick : kFull))
            results["rows"].push_back(std::move(row));
    }
    write(command.out, results, plots);
    tell(results, command.out);
    return kOk;
}

int benchMerge(const BenchMergeCommand& command) {
    requireGnuplot();
    ordered_json joined;
    std::set<std::string> found;
    std::string n;
    for (const fs::path& folder : command.shards) {
        const fs::path file = folder / "bench.json";
        std::ifstream in(file);
        const ordered_json part = ordered_json::parse(in, nullptr, false);
        const auto fail = [&](const std::string& what) { throw std::runtime_error(file.string() + ": " + what); };
        if (!part.is_object() || !part.contains("parts") || !part.contains("rows") || !part.contains("qp"))
            fail("this is not what `touchstone bench --out` writes: give the folders of a sweep's shards");
        if (part["parts"].size() != 1) fail("it is merged already: give the folders of the shards themselves");
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
                fail("it is of another sweep than the first folder");
        for (const char* key : {"parts", "rows", "qp"})
            joined[key].insert(joined[key].end(), part[key].begin(), part[key].end());
    }
    if (std::to_string(found.size()) != n)
        throw std::runtime_error("only " + std::to_string(found.size()) + " of " + n +
                                 " shards are given: add the folders of the others");
    makeOutFolder(command.out);
    write(command.out, joined, true);
    tell(joined, command.out);
    return kOk;
}

}  // namespace touchstone::app
