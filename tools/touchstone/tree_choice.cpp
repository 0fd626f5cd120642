#include "tools/touchstone/tree_choice.hpp"

#include <algorithm>
#include <cmath>

#include "engine/scene/text.hpp"
#include "haptics/math/numbers.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "tools/touchstone/command_line.hpp"

namespace touchstone::app {
namespace {

constexpr int kMaxLevels = 7;  // 8^6 leaves are TreeOptions::kMaxLeaves
constexpr int kMaxThreads = 256;

/// "0.02mm", "0.02" or "0.1%" as mm.
double errorInMm(std::string_view text, double diagonal) {
    const bool share = text.ends_with('%');
    std::string_view digits = text;
    digits.remove_suffix(share ? 1 : text.ends_with("mm") ? 2 : 0);
    while (digits.ends_with(' ')) digits.remove_suffix(1);
    const auto value = readNumber(digits, 0, 1e9);
    if (!value || *value == 0)
        throw UsageError(
            "--max-error takes a length like 0.02mm, or a share of the diagonal like 0.1%, above zero, not '" +
            std::string(text) + "'");
    return share ? *value / 100 * diagonal : *value;
}

template <class Enum>
void set(Enum& value, const std::optional<std::string>& given, std::span<const char* const> names,
         const std::string& option) {
    if (!given) return;
    const auto known = std::find(names.begin(), names.end(), *given);
    if (known == names.end()) throw UsageError(option + " is " + engine::anyOf(names) + ", not '" + *given + "'");
    value = static_cast<Enum>(known - names.begin());
}

void requireRange(const std::string& option, int value, int most) {
    if (value < 1 || value > most)
        throw UsageError(option + " is from 1 to " + std::to_string(most) + ", not " + std::to_string(value));
}

}  // namespace

void addTreeChoice(CLI::App& command, TreeChoice& choice) {
    command.add_option("--leaves", choice.leaves, "maximum leaf count of the sphere tree (default: 4096)");
    command.add_option("--max-error", choice.maxError,
                       "use the fewest leaves that protrude at most this far from the part: 0.02mm, or 0.1% of its "
                       "diagonal");
    command.add_option("--quality", choice.quality, "fast, or best: tighter, takes several times longer");
    command.add_option("--interior", choice.interior, "shell, or solid: the inside is filled with leaves as well");
}

TreeOptions withChoice(TreeOptions options, const TreeChoice& choice, double diagonal) {
    if (choice.leaves.has_value() + choice.levels.has_value() + !choice.maxError.empty() > 1)
        throw UsageError("give one of --leaves, --levels and --max-error: each of them sets the number of leaves");
    if (choice.leaves || choice.levels) options.maxError = 0;
    if (choice.leaves) {
        requireRange("--leaves", *choice.leaves, TreeOptions::kMaxLeaves);
        options.leaves = *choice.leaves;
    }
    if (choice.levels) {
        requireRange("--levels", *choice.levels, kMaxLevels);
        options.leaves = 1 << 3 * (*choice.levels - 1);  // the root alone is the first level
    }
    if (!choice.maxError.empty()) options.maxError = errorInMm(choice.maxError, diagonal);
    set(options.quality, choice.quality, sandbox::kQualityNames, "--quality");
    set(options.interior, choice.interior, sandbox::kInteriorNames, "--interior");
    options.seed = choice.seed.value_or(options.seed);
    if (choice.threads) {
        requireRange("--threads", *choice.threads, kMaxThreads);
        options.threads = *choice.threads;
    }
    return options;
}

void checkChoice(const TreeChoice& choice) { withChoice({}, choice, 1); }

}  // namespace touchstone::app
