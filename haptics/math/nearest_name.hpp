#pragma once
// What a misspelled name was probably meant to be.
#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace touchstone {

/// Number of insertions, deletions, replacements and exchanges of neighbors between two words (optimal string
/// alignment).
inline std::size_t editDistance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before = std::exchange(last, row);
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] = std::min({last[j - 1] + (a[i - 1] != b[j - 1]), row[j - 1] + 1, last[j] + 1});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                row[j] = std::min(row[j], before[j - 2] + 1);
        }
    }
    return row.back();
}

/// The first of the names that are nearest to the word, if it is as near as a misspelling; otherwise empty. `names`: a
/// range of std::string or std::string_view.
template <class Names>
std::string nearestName(std::string_view word, const Names& names) {
    std::string nearest;
    std::size_t least = 2 + word.size() / 4;
    for (const auto& name : names)
        if (const std::size_t distance = editDistance(word, name); distance < least) {
            least = distance;
            nearest = name;
        }
    return nearest;
}

}  // namespace touchstone
