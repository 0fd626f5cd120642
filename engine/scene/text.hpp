#pragma once
// Values and names as the sentences to the user show them.
#include <span>
#include <string>

namespace touchstone::engine {

/// What printf() would print.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

/// "a, b or c".
std::string anyOf(std::span<const char* const> names);

}  // namespace touchstone::engine
