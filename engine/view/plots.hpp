#pragma once
// Plots of time series in which no sample can hide.
#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <vector>

namespace touchstone::engine {

/// A view of the valid part of a ring buffer, oldest sample first.
struct RingView {
    const float* data = nullptr;
    std::size_t capacity = 0;
    std::size_t next = 0;   ///< index that the next sample will take
    std::size_t count = 0;  ///< valid samples, at most capacity

    float operator[](std::size_t i) const { return data[(next + capacity - count + i) % capacity]; }
};

/// The range of the samples behind one pixel column; empty (min > max) where there are none.
struct ColumnRange {
    float min = 1, max = 0;

    bool empty() const { return min > max; }
    bool operator==(const ColumnRange&) const = default;
};

/// Reduces the newest `window` samples to `columns` ranges, right-aligned: the newest sample lies in the last column,
/// and a series shorter than the window leaves columns at the left empty. Every sample falls into at least one column;
/// with fewer samples than columns each repeats over several. NaN and infinite samples are left out.
std::vector<ColumnRange> minMaxColumns(const RingView& samples, std::size_t window, std::size_t columns);

/// Multiples of a round step (1, 2 or 5 times a power of ten) inside [low, high]: as many as fit into maxCount.
/// Empty if low >= high, either is not finite, or maxCount is 0.
std::vector<float> niceTicks(float low, float high, std::size_t maxCount);

struct Series {
    const char* name = "";
    RingView samples;
    glm::vec4 color{1};  ///< as shown, sRGB
};

struct PlotOptions {
    const char* unit = "";
    std::optional<float> yMin, yMax;  ///< automatic where absent: from 0 to a little above the largest sample
    std::optional<float> budget;      ///< a level to compare with, drawn as a line and kept in view
    bool logarithmic = false;         ///< samples of 0 and below are drawn at the bottom
    float height = 0;                 ///< of the plot without its text, screen units; 0 for a default
    std::size_t window = 0;           ///< samples across the width; 0 for the largest capacity
    float samplePeriodMs = 1;         ///< labels the time axis
};

/// An ImGui widget as wide as the space there is: the series over time, newest at the right edge, with current value
/// and maximum of each in text; a tooltip tells the values under the mouse.
void drawSeries(const char* label, std::span<const Series> series, const PlotOptions& options);

}  // namespace touchstone::engine
