#include "tools/touchstone/shard.hpp"

#include <charconv>

#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

Shard shardOf(const std::string& text) {
    Shard shard;
    if (text.empty()) return shard;
    const char* const end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, shard.k);
    const auto second = first.ptr < end ? std::from_chars(first.ptr + 1, end, shard.n) : first;
    if (first.ec != std::errc{} || second.ec != std::errc{} || *first.ptr != '/' || second.ptr != end || shard.k < 1 ||
        shard.k > shard.n)
        throw UsageError("--shard takes K/N with K from 1 to N, like 2/8, not '" + text + "'");
    return shard;
}

}  // namespace touchstone::app
