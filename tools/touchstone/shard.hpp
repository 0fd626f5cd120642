#pragma once
// One of several parts of a study or a sweep, for several machines.
#include <cstddef>
#include <string>

namespace touchstone::app {

/// The k-th of n parts, k from 1.
struct Shard {
    std::size_t k = 1, n = 1;
};

/// Reads --shard K/N; the whole for an empty text. Throws UsageError for any other text.
Shard shardOf(const std::string& text);

}  // namespace touchstone::app
