// What a study amounts to: rates, means and medians of each condition with 95 % confidence intervals, and plots.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "haptics/files/output_file.hpp"
#include "haptics/math/statistics.hpp"
#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/gnuplot.hpp"
#include "tools/touchstone/trials.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using Values = std::vector<double>;

struct Measure {
    const char* column;
    bool ofSeated;  ///< else of all trials
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

/// A line of the summary; null where too few trials tell nothing.
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

/// The means of one measure, a bar with its interval for each condition.
std::string panel(const std::vector<ordered_json>& lines, const std::string& measure, const std::string& title,
                  std::size_t number) {
    std::string data = "$d" + std::to_string(number) + " << EOD\n";
    for (const ordered_json& line : lines) {
        if (line.at("measure") != measure || line.at("mean").is_null()) continue;
        const double mean = line.at("mean").get<double>();
        const auto or_mean = [&](const char* key) {
            return line.at(key).is_null() ? mean : line.at(key).get<double>();
        };
        data += '"' + line.at("condition").get<std::string>() + "\" " + text(mean) + " " + text(or_mean("mean_low")) +
                " " + text(or_mean("mean_high")) + "\n";
    }
    const std::string name = "$d" + std::to_string(number);
    return data + "EOD\nset title \"" + title + "\"\nif (|" + name + "| > 0) plot " + name +
           " using 0:2:3:4:(0.5):xtic(1) with boxerrorbars fill solid 0.8 linecolor rgb \"" + colour(number) +
           "\" notitle\n";
}

void draw(const fs::path& folder, const std::vector<ordered_json>& lines, const std::vector<std::string>& conditions) {
    const std::string style = "set yrange [0:*]\nset xtics rotate by 25 right noenhanced\nset xrange [-0.6:" +
                              text(static_cast<double>(conditions.size()) - 0.4) + "]\nunset key\n";
    gnuplot(folder, "summary",
            style + "set bars 2\nset multiplot layout 1,3 margins 0.07,0.98,0.24,0.9 spacing 0.08\n" +
                panel(lines, "seated_rate", "share of trials seated", 0) +
                panel(lines, "time_s of seated", "time to be seated, s", 1) +
                panel(lines, "torque_peak_mNm", "peak torque, mN·m", 2) + "unset multiplot\n");
    std::string data = "$d << EOD\n";
    for (const std::string& condition : conditions) {
        data += '"' + condition + '"';
        for (const char* phase : {"approach_s", "search_s", "align_s", "insert_s"})
            for (const ordered_json& line : lines)
                if (line.at("condition") == condition && line.at("measure") == phase)
                    data += " " + text(line.at("mean").is_null() ? 0 : line.at("mean").get<double>());
        data += "\n";
    }
    data += "EOD\nset style data histograms\nset style histogram rowstacked\nset style fill solid 0.85\n";
    std::string plot =
        "set key outside right\nset boxwidth 0.6\nset xtics noenhanced\nset ylabel \"mean time in each phase, "
        "s\"\nplot ";
    const char* phases[] = {"approach", "search", "align", "insert"};
    for (std::size_t i = 0; i < 4; ++i)
        plot += std::string(i ? ", " : "") + "$d using " + std::to_string(i + 2) + (i ? "" : ":xtic(1)") +
                " linecolor rgb \"" + colour(i) + "\" title \"" + phases[i] + "\"";
    gnuplot(folder, "phases", style + data + plot + "\n");
}

}  // namespace

void summarise(const fs::path& folder, const std::vector<TrialRow>& rows, const sandbox::Protocol& protocol) {
    std::vector<ordered_json> lines;
    std::vector<std::string> conditions;
    std::printf("%-28s %7s %22s %26s %26s\n", "condition", "trials", "seated", "time s, mean of seated",
                "peak N, mean");
    for (const sandbox::Condition& condition : protocol.conditions) {
        const std::vector<TrialRow> own = rowsOf(rows, condition.name);
        if (own.empty()) continue;
        conditions.push_back(condition.name);
        lines.push_back(successOf(condition.name, own));
        for (const Measure& measure : kMeasures) lines.push_back(measured(condition.name, own, measure));
        std::printf("%-28s %7zu", condition.name.c_str(), own.size());
        const std::size_t first = lines.size() - std::size(kMeasures) - 1;
        for (const std::size_t i : {first, first + 1, first + 6}) {
            const auto at = [&](const char* key) { return lines[i].at(key).get<double>(); };
            if (lines[i].at("mean_low").is_null())
                std::printf("%25s", lines[i].at("mean").is_null() ? "" : text(at("mean")).c_str());
            else
                std::printf("   %6.2f [%5.2f, %6.2f]", at("mean"), at("mean_low"), at("mean_high"));
        }
        std::printf("\n");
    }
    for (ordered_json& line : lines)
        for (ordered_json& value : line)
            if (value.is_number_float()) value = std::stod(text(value.get<double>()));
    writeFile(folder / "summary.csv", "the summary", toCsv(lines));
    draw(folder, lines, conditions);
}

}  // namespace touchstone::app
