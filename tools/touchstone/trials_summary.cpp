// The summary of a study: rates, means and medians of each condition with 95 % confidence intervals.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "haptics/files/output_file.hpp"
#include "haptics/math/statistics.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/figures.hpp"
#include "tools/touchstone/trials.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using Values = std::vector<double>;

struct Measure {
    const char* column;
    bool ofSeated;  ///< of the seated trials only, otherwise of all
};
constexpr Measure kMeasures[] = {
    {"time_s", true},
    {"approach_s", false},
    {"search_s", false},
    {"align_s", false},
    {"insert_s", false},
    {"force_peak_N", false},
    {"force_rms_N", false},
    {"torque_peak_mNm", false},
    {"torque_rms_mNm", false},
    {"impulse_Ns", false},
    {"path_mm", false},
    {"rotation_rad", false},
    {"contacts_mean", false},
    {"jams", false},
    {"residual_penetration_mm", false},
};

bool seated(const TrialRow& row) { return row.at("outcome") == "seated"; }

Values valuesOf(const std::vector<TrialRow>& rows, const Measure& measure) {
    Values values;
    for (const TrialRow& row : rows)
        if (!measure.ofSeated || seated(row)) values.push_back(row.at(measure.column).get<double>());
    return values;
}

std::vector<TrialRow> rowsOf(const std::vector<TrialRow>& rows, const std::string& condition) {
    std::vector<TrialRow> found;
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(found),
                 [&](const TrialRow& row) { return row.at("condition") == condition; });
    return found;
}

/// A line of the summary, in which every statistic is null: too few trials leave some undefined.
ordered_json lineOf(const std::string& condition, const std::string& measure, std::size_t trials) {
    ordered_json line{{"condition", condition}, {"measure", measure}, {"trials", trials}};
    for (const char* key : {"mean", "mean_low", "mean_high", "median", "median_low", "median_high"})
        line[key] = nullptr;
    return line;
}

ordered_json successOf(const std::string& condition, const std::vector<TrialRow>& rows) {
    ordered_json line = lineOf(condition, "seated_rate", rows.size());
    if (rows.empty()) return line;
    const int count = static_cast<int>(std::count_if(rows.begin(), rows.end(), seated));
    const Interval interval = wilsonInterval(count, static_cast<int>(rows.size()));
    line["mean"] = count / static_cast<double>(rows.size());
    line["mean_low"] = interval.low;
    line["mean_high"] = interval.high;
    return line;
}

ordered_json measured(const std::string& condition, const std::vector<TrialRow>& rows, const Measure& measure) {
    const Values values = valuesOf(rows, measure);
    ordered_json line =
        lineOf(condition, std::string(measure.column) + (measure.ofSeated ? " of seated" : ""), values.size());
    if (values.empty()) return line;
    line["mean"] = mean(values);
    line["median"] = median(values);
    if (values.size() < 2) return line;
    const Interval ofMean = bootstrapInterval(values, [](Values drawn) { return mean(drawn); });
    const Interval ofMedian = bootstrapInterval(values, median);
    line["mean_low"] = ofMean.low;
    line["mean_high"] = ofMean.high;
    line["median_low"] = ofMedian.low;
    line["median_high"] = ofMedian.high;
    return line;
}

}  // namespace

void summarize(const fs::path& folder, const std::vector<TrialRow>& rows, const sandbox::Protocol& protocol) {
    std::vector<ordered_json> lines;
    std::printf("%-28s %7s %22s %26s %26s\n", "condition", "trials", "seated", "time s, mean of seated",
                "peak N, mean");
    for (const sandbox::Condition& condition : protocol.conditions) {
        const std::vector<TrialRow> own = rowsOf(rows, condition.name);
        if (own.empty()) continue;
        lines.push_back(successOf(condition.name, own));
        for (const Measure& measure : kMeasures) lines.push_back(measured(condition.name, own, measure));
        std::printf("%-28s %7zu", condition.name.c_str(), own.size());
        const std::size_t first = lines.size() - std::size(kMeasures) - 1;
        for (const std::size_t i : {first, first + 1, first + 6}) {
            const auto at = [&](const char* key) { return lines[i].at(key).get<double>(); };
            if (lines[i].at("mean_low").is_null())
                std::printf("%25s", lines[i].at("mean").is_null() ? "" : shortNumber(at("mean")).c_str());
            else
                std::printf("   %6.2f [%5.2f, %6.2f]", at("mean"), at("mean_low"), at("mean_high"));
        }
        std::printf("\n");
    }
    for (ordered_json& line : lines)
        for (ordered_json& value : line)
            if (value.is_number_float()) value = std::stod(shortNumber(value.get<double>()));
    writeFile(folder / "summary.csv", "the summary", toCsv(lines));
    drawFigures("trials", folder);
}

}  // namespace touchstone::app
