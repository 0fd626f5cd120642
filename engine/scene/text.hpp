#pragma once
// Formatting of values and names for messages.
#include <span>
#include <string>

namespace touchstone::engine {

/// Formats like printf().
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

/// "a, b or c".
std::string anyOf(std::span<const char* const> names);

/// Quotes a word for a POSIX shell where that is necessary.
std::string shellQuoted(const std::string& word);

}  // namespace touchstone::engine
