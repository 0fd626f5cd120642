#pragma once
// Tables as CSV.
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace touchstone::app {

/// Flat objects with equal keys, one line each below a line of the keys; null is an empty field.
std::string toCsv(const std::vector<nlohmann::ordered_json>& rows);

/// A number with at most six significant digits.
std::string shortNumber(double value);

}  // namespace touchstone::app
