// The benchmark's plots, and the page that shows them.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/gnuplot.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

using sandbox::kLeastError;
constexpr double kLeastTime = 0.01;  // µs: what is less is drawn here

std::string str(const ordered_json& row, const char* key) { return row.at(key).get<std::string>(); }
bool has(const ordered_json& row, const std::string& key) { return row.contains(key) && row.at(key).is_number(); }
double num(const ordered_json& row, const std::string& key) { return row.at(key).get<double>(); }

/// Without choices of its own: as the scene asks.
bool plain(const ordered_json& row) {
    const std::string key = str(row, "key");
    return row["leaves"] == 0 && key.find("/linearisations=") == std::string::npos &&
           key.find("/fixed-margin") == std::string::npos;
}
bool plainDefault(const ordered_json& row) {
    return plain(row) && str(row, "mode") == "default" && str(row, "solver") == "dual-active-set";
}
std::string motionOf(const ordered_json& row) { return str(row, "scene") + " " + str(row, "motion"); }
std::string labelOf(const ordered_json& row) {
    const std::string motion = str(row, "motion");
    return std::filesystem::path(str(row, "scene")).stem().string() + " " +
           (motion.rfind("hard-", 0) == 0 ? motion.substr(5) : motion);
}
std::string choiceOf(const ordered_json& row) {
    return str(row, "solver") + (has(row, "tolerance") ? " " + text(num(row, "tolerance")) : "") +
           (str(row, "mode") == "paper" ? " paper" : "");
}

Points front(const Points& points) {
    Points best;
    for (const std::size_t i : sandbox::paretoFront(points)) best.push_back(points[i]);
    return best;
}

class Plotter {
  public:
    Plotter(const ordered_json& results, const fs::path& folder) : folder_(folder), qp_(results.at("qp")) {
        std::map<std::string, int> counts;
        for (const ordered_json& row : results.at("rows"))
            if (row.at("valid").get<bool>() && has(row, "step_p50_us")) {
                rows_.push_back(row);
                if (++counts[motionOf(row)] > counts[trade_]) trade_ = motionOf(row);
            }
    }

    std::vector<BenchPlot> draw() {
        pareto();
        stages();
        errors();
        leaves();
        solverRows();
        depth();
        return plots_;
    }

  private:
    void add(const std::string& name, const std::string& caption, const std::string& body) {
        gnuplot(folder_, name, body);
        plots_.push_back({name, caption});
    }

    /// Points of each solver and the front, of one kind of error.
    Lines tradeLines(const std::string& error) const {
        std::map<std::string, Points> series;
        Points all;
        for (const ordered_json& row : rows_) {
            if (motionOf(row) != trade_ || !has(row, error)) continue;
            const std::pair point{num(row, "step_p50_us"), std::max(kLeastError, num(row, error))};
            series[str(row, "solver") + ", " + str(row, "mode")].push_back(point);
            all.push_back(point);
        }
        Lines lines;
        for (const auto& [name, points] : series) lines.add(name, points, "points pointtype 7 pointsize 0.8");
        lines.add("Pareto front", front(all), "steps", "#808890");
        return lines;
    }

    void pareto() {
        const Lines total = tradeLines("error_p50_N"), solver = tradeLines("solver_p50_N");
        if (total.empty()) return;
        add("pareto",
            "Time against force error, " + trade_ +
                ": each point a mode, solver, tolerance, number of leaves and of linearisations. Left the whole error "
                "against the meshes, right the solver's share (what is below 1e-9 N is drawn there).",
            "set multiplot layout 1,2\nset logscale xy\nset xlabel \"step, median, µs\"\nset key off\n" + total.data() +
                "set ylabel \"force error against the meshes, median, N\"\n" + total.plot() + solver.data() +
                "set ylabel \"solver's share, median, N\"\nset format y \"10^{%T}\"\nset key center right\n" +
                solver.plot() + "unset multiplot\n");
    }

    void stages() {
        std::vector<std::pair<std::string, std::vector<double>>> groups;
        for (const ordered_json& row : rows_) {
            if (!plainDefault(row)) continue;
            const double collision = num(row, "collision_p50_us"), solve = num(row, "solve_p50_us");
            std::vector<double> times{collision, solve, num(row, "step_p50_us") - collision - solve};
            for (double& time : times) time = std::max(kLeastTime, time);
            groups.push_back({labelOf(row), times});
        }
        if (groups.empty()) return;
        add("stages", "Time of a tick by stage: medians, default mode with the exact solver.",
            "set logscale y\nset yrange [" + text(kLeastTime / 2) +
                ":*]\nset ylabel \"median, µs\"\nset key outside top horizontal\n" +
                bars(groups, {"collision", "solver", "rest"}));
    }

    void errors() {
        std::vector<std::pair<std::string, std::vector<double>>> groups;
        for (const ordered_json& row : rows_) {
            const bool chosen = plain(row) && motionOf(row) == trade_;
            if (!has(row, "error_p50_N") || !(chosen || plainDefault(row))) continue;
            std::vector<double> shares;
            for (const char* share : {"geometry_p50_N", "linearisation_p50_N", "solver_p50_N"})
                shares.push_back(std::max(kLeastError, num(row, share)));
            groups.push_back({chosen ? choiceOf(row) : labelOf(row), shares});
        }
        if (groups.empty()) return;
        add("errors",
            "Force error split by cause, medians over sampled ticks: each solver on " + trade_ +
                ", then the other motions with the exact solver.",
            "set logscale y\nset yrange [" + text(kLeastError / 2) +
                ":*]\nset ylabel \"force error, median, N\"\nset key outside top horizontal\nset format y "
                "\"10^{%T}\"\n" +
                bars(groups, {"geometry", "linearisation", "solver"}));
    }

    void leaves() {
        Points median, tail, error;
        for (const ordered_json& row : rows_) {
            if (motionOf(row) != trade_ || row["leaves"] == 0 || str(row, "solver") != "dual-active-set" ||
                str(row, "key").find("/linearisations=") != std::string::npos)
                continue;
            median.push_back({num(row, "leaves"), num(row, "step_p50_us")});
            tail.push_back({num(row, "leaves"), num(row, "step_p999_us")});
            if (has(row, "error_p50_N")) error.push_back({num(row, "leaves"), num(row, "error_p50_N")});
        }
        for (Points* points : {&median, &tail, &error}) std::sort(points->begin(), points->end());
        Lines times, errors;
        times.add("median", median);
        times.add("p99.9", tail);
        errors.add("force error, median", error);
        if (times.empty()) return;
        std::string body =
            "set multiplot layout 1,2\nset logscale xy\nset format x \"%.0s%c\"\nset xlabel \"leaves a "
            "part\"\n" +
            times.data() + "set ylabel \"step, µs\"\nset key top left\n" + times.plot();
        if (!errors.empty()) body += errors.data() + "set ylabel \"N\"\nset key top right\n" + errors.plot();
        add("cost_leaves", "Time and force error against leaves, " + trade_ + ", default mode, exact solver.",
            body + "unset multiplot\n");
    }

    void solverRows() {
        std::map<std::string, Points> series;
        for (const ordered_json& row : qp_)
            series[choiceOf({{"solver", row["solver"]},
                             {"tolerance", num(row, "tolerance") > 0 ? row["tolerance"] : ordered_json()},
                             {"mode", row["form"]}}) +
                   " " + str(row, "start")]
                .push_back({num(row, "rows"), num(row, "median_us")});
        Lines lines;
        for (auto& [name, points] : series) {
            std::sort(points.begin(), points.end());
            lines.add(name, points);
        }
        if (lines.empty()) return;
        add("cost_rows", "Time of each solver against rows, medians over made contacts.",
            lines.data() + "set logscale xy\nset xlabel \"rows\"\nset ylabel \"µs\"\nset key outside right\n" +
                lines.plot());
    }

    void depth() {
        Lines lines;
        for (const ordered_json& row : rows_) {
            if (!plainDefault(row)) continue;
            Points points;
            for (const int end : {1, 2, 5, 10, 20, 40})
                if (const std::string key = "depth_" + std::to_string(end) + "mm_us"; has(row, key))
                    points.push_back({end, num(row, key)});
            if (points.size() == 6) lines.add(labelOf(row), points);
        }
        if (lines.empty()) return;
        add("cost_depth",
            "Time against how deep the device is beyond the tool (upper end of each class), medians, default mode, "
            "exact solver.",
            lines.data() +
                "set logscale xy\nset xlabel \"depth, mm\"\nset ylabel \"step, median, µs\"\nset key outside "
                "right\n" +
                lines.plot());
    }

    const fs::path folder_;
    const ordered_json& qp_;
    std::vector<ordered_json> rows_;
    std::string trade_;
    std::vector<BenchPlot> plots_;
};

std::string escaped(const std::string& raw) {
    std::string safe;
    for (const char c : raw) safe += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
    return safe;
}

std::string cell(const ordered_json& value) {
    if (value.is_null()) return "";
    return value.is_string() ? escaped(value.get<std::string>()) : value.is_number() ? text(value) : value.dump();
}

std::string table(const ordered_json& rows, const std::vector<std::string>& columns,
                  bool (*keep)(const ordered_json&)) {
    std::string html = "<div class=scroll><table><tr>";
    for (const std::string& column : columns) html += "<th>" + column + "</th>";
    html += "</tr>\n";
    for (const ordered_json& row : rows) {
        if (!keep(row)) continue;
        html += "<tr>";
        for (const std::string& column : columns) html += "<td>" + cell(row.at(column)) + "</td>";
        html += "</tr>\n";
    }
    return html + "</table></div>\n";
}

}  // namespace

std::vector<BenchPlot> drawPlots(const ordered_json& results, const fs::path& folder) {
    return Plotter(results, folder).draw();
}

std::string benchPage(const ordered_json& results, const std::vector<BenchPlot>& plots, const fs::path& folder) {
    std::ostringstream page;
    page << "<!doctype html>\n<html lang=en><meta charset=utf-8><title>touchstone bench</title>\n<style>"
            "body{font:15px sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color-scheme:light dark}"
            "svg{max-width:100%;height:auto}table{border-collapse:collapse;font-size:12px}"
            "td,th{padding:2px 8px;text-align:right;white-space:nowrap}td:first-child,th:first-child{text-align:left}"
            "tr:nth-child(even){background:#80808020}.scroll{overflow-x:auto}</style>\n<h1>touchstone bench, suite "
         << str(results, "suite") << (results.at("quick").get<bool>() ? ", quick" : "") << "</h1>\n<ul>\n";
    for (const ordered_json& part : results.at("parts"))
        page << "<li>shard " << str(part, "shard") << ": " << escaped(str(part.at("machine"), "processor")) << ", "
             << part.at("machine").at("cores") << " cores; touchstone " << str(part, "version") << ", commit "
             << str(part, "commit") << ", " << escaped(str(part, "compiler")) << ", " << escaped(str(part, "flags"))
             << "</li>\n";
    page << "</ul>\n<p>Times are thread CPU time; medians of the runs' percentiles, and the smallest of their maxima. "
            "constant: the same of an equal constant workload. Errors are against the triangle meshes.</p>\n";
    for (const BenchPlot& plot : plots) {
        std::ifstream in(folder / (plot.name + ".svg"));
        std::string svg{std::istreambuf_iterator<char>(in), {}};
        page << "<figure>" << svg.substr(std::min(svg.find("<svg"), svg.size())) << "<figcaption>"
             << escaped(plot.caption) << "</figcaption></figure>\n";
    }
    const ordered_json& rows = results.at("rows");
    page << "<h2>Rows</h2>\n"
         << table(rows,
                  {"key",
                   "step_p50_us",
                   "step_p99_us",
                   "step_p999_us",
                   "step_worst_us",
                   "constant_p999_us",
                   "constant_worst_us",
                   "collision_p50_us",
                   "solve_p50_us",
                   "rows_p50",
                   "rows_max",
                   "error_p50_mm",
                   "error_p50_rad",
                   "error_p50_N",
                   "error_p50_mNm",
                   "geometry_p50_N",
                   "linearisation_p50_N",
                   "solver_p50_N",
                   "samples",
                   "samples_lost",
                   "penetration_max_mm",
                   "hover_max_mm",
                   "runs",
                   "run_ticks"},
                  [](const ordered_json& row) { return row.at("valid").get<bool>(); });
    page << "<h2>Screening of redundant rows</h2>\n"
         << table(rows,
                  {"key", "valid", "rows_p50", "rows_max", "rows_screened_p50", "rows_screened_max",
                   "screen_inexact_ticks", "solve_p50_us", "solve_p999_us", "solver_p50_N", "solver_max_N"},
                  [](const ordered_json& row) { return str(row, "key").find("/fixed-margin") != std::string::npos; });
    page << "<h2>Failed: status or residuals do not hold, so there is no time</h2>\n"
         << table(rows,
                  {"key", "why", "rows_p50", "error_p50_N", "samples", "samples_lost", "penetration_max_mm",
                   "hover_max_mm", "force_max_N"},
                  [](const ordered_json& row) { return !row.at("valid").get<bool>(); });
    page << "<h2>Solvers on made contacts</h2>\n";
    if (const ordered_json& qp = results.at("qp"); !qp.empty()) {
        std::vector<std::string> columns;
        for (const auto& [key, value] : qp.front().items()) columns.push_back(key);
        page << table(qp, columns, [](const ordered_json&) { return true; });
    }
    page << "</html>\n";
    return page.str();
}

}  // namespace touchstone::app
