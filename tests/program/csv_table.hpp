#pragma once
// Reads the CSV files of the program.
#include <catch2/catch.hpp>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/program/program.hpp"

namespace touchstone::test {

/// Lines of a CSV file without quotes, by column.
using Table = std::vector<std::map<std::string, std::string>>;

inline std::vector<std::string> fieldsOf(const std::string& line) {
    std::vector<std::string> fields(1);
    for (const char c : line) {
        if (c == ',')
            fields.emplace_back();
        else
            fields.back() += c;
    }
    return fields;
}

inline Table tableOf(const std::string& file) {
    std::istringstream lines(textOf(file));
    std::string line;
    REQUIRE(std::getline(lines, line));
    const std::vector<std::string> header = fieldsOf(line);
    Table table;
    while (std::getline(lines, line)) {
        const std::vector<std::string> fields = fieldsOf(line);
        REQUIRE(fields.size() == header.size());
        auto& row = table.emplace_back();
        for (std::size_t i = 0; i < header.size(); ++i) row[header[i]] = fields[i];
    }
    return table;
}

}  // namespace touchstone::test
