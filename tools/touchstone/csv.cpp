#include "tools/touchstone/csv.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>

namespace touchstone::app {
namespace {

using nlohmann::ordered_json;

std::string quoted(const std::string& text) {
    std::string field = "\"";
    for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
    return field + "\"";
}

}  // namespace

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

std::string shortNumber(double value) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.6g", value);
    return buffer;
}

}  // namespace touchstone::app
