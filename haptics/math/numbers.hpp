#pragma once
// Checks of numbers that come from outside: from files, options and settings.
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

namespace touchstone {

/// Whether min <= value <= max. False for NaN, and for infinity because both bounds are finite.
constexpr bool isWithin(double value, double min, double max) { return value >= min && value <= max; }

/// Reads the whole text as a number from min to max, independent of the locale. Returns no value for any other text.
inline std::optional<double> readNumber(std::string_view text, double min, double max) {
    if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);  // from_chars accepts no plus
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !isWithin(value, min, max)) return {};
    return value;
}

/// Text for messages: "a number from 1 to 10 mm" or "a whole number from 1 to 10".
inline std::string rangeWords(double min, double max, std::string_view unit = {}, bool whole = false) {
    const auto text = [](double number) {
        char buffer[32];
        return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, number).ptr);
    };
    return std::string(whole ? "a whole number" : "a number") + " from " + text(min) + " to " + text(max) +
           (unit.empty() ? "" : " ") + std::string(unit);
}

}  // namespace touchstone
