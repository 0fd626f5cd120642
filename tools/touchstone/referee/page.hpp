#pragma once
// The page on which `touchstone referee` shows what it has measured.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/touchstone/figures.hpp"

namespace touchstone::app {

struct RefereePage {
    std::filesystem::path out;                      ///< folder of table, figures and pictures; the page is beside it
    std::string arguments;                          ///< of the command that writes it, without --out
    double limit = 0;                               ///< s of processor time for a system and a motion
    std::vector<nlohmann::ordered_json> rows;       ///< lines of the table
    std::vector<nlohmann::ordered_json> passivity;  ///< greatestStiffness(); empty: not measured
    std::vector<Figure> figures;
    std::vector<std::string> motions;
};

/// Writes DIR.md. Throws std::runtime_error with one sentence if it cannot be written.
void writeRefereePage(const RefereePage& page);

/// A value as tables show it.
std::string tableCell(const nlohmann::ordered_json& value);
/// The name of the file in the folder.
std::string pictureName(const std::string& motion, const std::string& system);

}  // namespace touchstone::app
