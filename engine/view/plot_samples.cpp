// Reduction of samples to columns, histograms and axis ticks.
#include <algorithm>
#include <cmath>

#include "engine/view/plot_canvas.hpp"

namespace touchstone::engine {

std::array<std::span<const float>, 2> samplesIn(const RingView& samples, Stretch stretch) {
    const std::size_t skip = std::min(stretch.skip, samples.count);
    const std::size_t shown = std::min(samples.count - skip, stretch.window);
    if (shown == 0) return {};
    const std::size_t first = (samples.next + 2 * samples.capacity - skip - shown) % samples.capacity;
    const std::size_t before = std::min(shown, samples.capacity - first);
    return {std::span(samples.data + first, before), std::span(samples.data, shown - before)};
}

std::vector<ColumnRange> minMaxColumns(const RingView& samples, Stretch stretch, std::size_t columns) {
    std::vector<ColumnRange> result(columns);
    const std::size_t window = stretch.window;
    const auto pieces = samplesIn(samples, stretch);
    const std::size_t turn = pieces[0].size(), shown = turn + pieces[1].size(), missing = window - shown;
    for (std::size_t c = 0; c < columns; ++c) {
        // Slots [begin, end) of the window are rounded outwards, so that no sample falls between two columns.
        const std::size_t begin = std::max(c * window / columns, missing);
        const std::size_t end = ((c + 1) * window + columns - 1) / columns;
        for (std::size_t slot = begin; slot < end; ++slot) {
            const std::size_t i = slot - missing;
            include(result[c], i < turn ? pieces[0][i] : pieces[1][i - turn]);
        }
    }
    return result;
}

std::vector<std::size_t> logHistogram(const RingView& samples, Stretch stretch, float low, float high,
                                      std::size_t bins) {
    std::vector<std::size_t> counts(bins);
    const float start = std::log10(low), scale = static_cast<float>(bins) / (std::log10(high) - start);
    for (const auto piece : samplesIn(samples, stretch))
        for (const float value : piece) {
            if (std::isnan(value)) continue;
            const float bin = value > low ? (std::log10(value) - start) * scale : 0;
            ++counts[static_cast<std::size_t>(std::min(bin, static_cast<float>(bins - 1)))];
        }
    return counts;
}

std::vector<float> niceTicks(float low, float high, std::size_t maxCount) {
    if (!std::isfinite(low) || !std::isfinite(high) || !(low < high) || maxCount == 0) return {};
    const double range = static_cast<double>(high) - low;
    const double decade = std::pow(10.0, std::floor(std::log10(range / static_cast<double>(maxCount))));
    constexpr double kSlack = 1e-6;  // of a step: ends that are multiples up to rounding count as multiples
    for (const double multiple : {1.0, 2.0, 5.0, 10.0, 20.0}) {
        const double step = multiple * decade;
        const double first = std::ceil(low / step - kSlack), last = std::floor(high / step + kSlack);
        if (last - first + 1 > static_cast<double>(maxCount)) continue;
        std::vector<float> ticks;
        for (double k = first; k <= last; ++k) ticks.push_back(static_cast<float>(k * step + 0.0));  // no -0
        return ticks;
    }
    return {};
}

}  // namespace touchstone::engine
