// The benchmark's page of HTML.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/csv.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

std::string str(const ordered_json& row, const char* key) { return row.at(key).get<std::string>(); }

std::string escaped(const std::string& raw) {
    std::string safe;
    for (const char c : raw) safe += c == '<' ? "&lt;" : c == '&' ? "&amp;" : std::string(1, c);
    return safe;
}

std::string cell(const ordered_json& value) {
    if (value.is_null()) return "";
    return value.is_string()   ? escaped(value.get<std::string>())
           : value.is_number() ? shortNumber(value)
                               : value.dump();
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

std::string benchPage(const ordered_json& results, const std::vector<Figure>& figures, const fs::path& folder) {
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
    page << "</ul>\n<p>Times are thread CPU times: the median of the runs' percentiles, and the smallest of their "
            "maxima. "
            "constant: the same for a constant workload of equal duration. Errors are relative to the triangle "
            "meshes.</p>\n";
    for (const Figure& figure : figures) {
        std::ifstream in(folder / (figure.name + ".svg"));
        std::string svg{std::istreambuf_iterator<char>(in), {}};
        page << "<figure>" << svg.substr(std::min(svg.find("<svg"), svg.size())) << "<figcaption>"
             << escaped(figure.caption) << "</figcaption></figure>\n";
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
                   "linearization_p50_N",
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
    page << "<h2>Failed rows: the status or the residuals violate their limits, so no time is reported</h2>\n"
         << table(rows,
                  {"key", "why", "rows_p50", "error_p50_N", "samples", "samples_lost", "penetration_max_mm",
                   "hover_max_mm", "force_max_N"},
                  [](const ordered_json& row) { return !row.at("valid").get<bool>(); });
    page << "<h2>Solvers on generated contacts</h2>\n";
    if (const ordered_json& qp = results.at("qp"); !qp.empty()) {
        std::vector<std::string> columns;
        for (const auto& [key, value] : qp.front().items()) columns.push_back(key);
        page << table(qp, columns, [](const ordered_json&) { return true; });
    }
    page << "</html>\n";
    return page.str();
}

}  // namespace touchstone::app
