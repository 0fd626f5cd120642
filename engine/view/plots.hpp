#pragma once
// Plots of time series in which no sample can hide.
#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
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

/// A stretch of a series: `window` samples that end `skip` samples before the newest.
struct Stretch {
    std::size_t window = 0, skip = 0;
};

/// The samples of a stretch, oldest first; without a copy, as a ring holds them in at most two pieces.
std::array<std::span<const float>, 2> samplesIn(const RingView& samples, Stretch stretch);

/// Reduces a stretch to `columns` ranges, right-aligned: its last sample lies in the last column, and a series shorter
/// than the stretch leaves columns at the left empty. Every sample falls into at least one column; with fewer samples
/// than columns each repeats over several. NaN and infinite samples are left out.
std::vector<ColumnRange> minMaxColumns(const RingView& samples, Stretch stretch, std::size_t columns);

/// How many samples of a stretch fall into each of `bins` equal parts of the decades [low, high], 0 < low < high; what
/// lies outside counts to the first or last. NaN is left out.
std::vector<std::size_t> logHistogram(const RingView& samples, Stretch stretch, float low, float high,
                                      std::size_t bins);

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
    Stretch stretch;                  ///< what is shown; a window of 0: the largest capacity
    float samplePeriodMs = 1;         ///< labels the time axis
    RingView marks;                   ///< samples above 0 are marked at the top
    std::optional<float> cursor;      ///< a line at this fraction of the width, for plots that share a cursor
    bool readOut = true;              ///< tells the values under the mouse
};

/// What the mouse did over a plot in this frame.
struct PlotMouse {
    std::optional<float> cursor;  ///< where it is, fraction of the width
    float zoom = 1;               ///< the wheel: the stretch is to become this many times as long
    float drag = 0;               ///< fraction of the width, to the right positive
    bool dragging = false;
};

/// An ImGui widget as wide as the space there is: the series over time, the stretch's last sample at the right edge,
/// with current value and maximum of each in text; a tooltip tells the values under the mouse.
PlotMouse drawSeries(const char* label, std::span<const Series> series, const PlotOptions& options);

struct HistogramOptions {
    const char* unit = "";
    float low = 1, high = 1000;  ///< ends of the axis, decades
    std::size_t bins = 60;
    float height = 0;                                         ///< as of PlotOptions
    std::span<const std::pair<const char*, float>> levels{};  ///< named values to mark
    bool readOut = true;
};

/// How often values of a stretch occur, both axes logarithmic: a single sample is seen beside thousands.
void drawHistogram(const char* label, const RingView& samples, Stretch stretch, glm::vec4 color,
                   const HistogramOptions& options);

/// Named parts of a whole in one bar.
struct Share {
    const char* name = "";
    float value = 0;  ///< 0 or more
    glm::vec4 color{1};
};
void drawShares(const char* label, std::span<const Share> shares, const char* unit);

/// One layer of a chart of pairs.
struct Layer {
    enum class Style {
        Cloud,   ///< cells as bright as they hold points
        Line,    ///< dots, joined
        Steps,   ///< rings, joined by steps: what is best so far
        Marker,  ///< a ring
    };
    std::string name;  ///< in the legend; empty: not there
    std::vector<glm::vec2> points;
    glm::vec4 color{1};
    Style style = Style::Cloud;
    std::vector<std::string> notes{};  ///< of the points, for the tooltip; empty: none
};

struct ChartOptions {
    const char *xName = "", *xUnit = "", *yName = "", *yUnit = "";
    float xLeast = 1e-3f, yLeast = 1e-9f;  ///< what is less is drawn here
    float height = 0;                      ///< as of PlotOptions
    bool readOut = true;
};

/// Pairs on two logarithmic axes of whole decades that hold every point; no point of a cloud can hide another layer.
/// A tooltip tells the note of the point nearest to the mouse, else where the mouse is.
void drawChart(const char* label, std::span<const Layer> layers, const ChartOptions& options);

}  // namespace touchstone::engine
