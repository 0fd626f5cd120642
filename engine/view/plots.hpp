#pragma once
// Plots of time series in which every sample stays visible.
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
    std::size_t next = 0;   ///< index of the next sample to be written
    std::size_t count = 0;  ///< valid samples, at most capacity

    float operator[](std::size_t i) const { return data[(next + capacity - count + i) % capacity]; }
};

/// Range of the samples in one pixel column; empty (min > max) without samples.
struct ColumnRange {
    float min = 1, max = 0;

    bool empty() const { return min > max; }
    bool operator==(const ColumnRange&) const = default;
};

/// A stretch of a series: `window` samples that end `skip` samples before the newest.
struct Stretch {
    std::size_t window = 0, skip = 0;
};

/// The samples of a stretch, oldest first. They are not copied, so a ring gives up to two pieces.
std::array<std::span<const float>, 2> samplesIn(const RingView& samples, Stretch stretch);

/// Reduces a stretch to `columns` ranges, right-aligned: the last sample is in the last column, and a series shorter
/// than the stretch leaves columns at the left empty. Every sample is in at least one column; with fewer samples than
/// columns, each sample is in several. Non-finite samples are ignored.
std::vector<ColumnRange> minMaxColumns(const RingView& samples, Stretch stretch, std::size_t columns);

/// Counts the samples of a stretch in `bins` bins of equal logarithmic width on [low, high], 0 < low < high. Samples
/// outside count in the first or last bin. NaN is ignored.
std::vector<std::size_t> logHistogram(const RingView& samples, Stretch stretch, float low, float high,
                                      std::size_t bins);

/// Multiples of a round step (1, 2 or 5 times a power of ten) in [low, high], at most maxCount of them. Empty if
/// low >= high, if either is non-finite, or if maxCount is 0.
std::vector<float> niceTicks(float low, float high, std::size_t maxCount);

struct Series {
    const char* name = "";
    RingView samples;
    glm::vec4 color{1};  ///< sRGB
};

struct PlotOptions {
    const char* unit = "";
    std::optional<float> yMin, yMax;  ///< automatic if absent: from 0 to slightly above the largest sample
    std::optional<float> budget;      ///< a reference level, drawn as a line and kept in view
    bool logarithmic = false;         ///< logarithmic axis; samples <= 0 are drawn at the bottom
    float height = 0;                 ///< height of the plot without text, screen units; 0: default
    Stretch stretch;                  ///< samples shown; a window of 0 means the largest capacity
    float samplePeriodMs = 1;         ///< scale of the time axis
    RingView marks;                   ///< positive samples are marked at the top of the plot
    std::optional<float> cursor;      ///< shared cursor line at this fraction of the width
    bool showValues = true;           ///< show the values under the mouse
};

/// Mouse input over a plot in this frame.
struct PlotMouse {
    std::optional<float> cursor;  ///< position, fraction of the width
    float zoom = 1;               ///< factor on the length of the stretch, from the wheel
    float drag = 0;               ///< fraction of the width, to the right positive
    bool dragging = false;
};

/// An ImGui widget of the available width: plots the series over time with the last sample of the stretch at the right
/// edge. A legend shows the last value and the maximum of each series; a tooltip shows the values under the mouse.
PlotMouse drawSeries(const char* label, std::span<const Series> series, const PlotOptions& options);

struct HistogramOptions {
    const char* unit = "";
    float low = 1, high = 1000;  ///< ends of the logarithmic axis
    std::size_t bins = 60;
    float height = 0;                                         ///< as in PlotOptions
    std::span<const std::pair<const char*, float>> levels{};  ///< named values to mark
    bool showValues = true;
};

/// Histogram of the samples of a stretch. Both axes are logarithmic, so that a single sample is visible next to
/// thousands.
void drawHistogram(const char* label, const RingView& samples, Stretch stretch, glm::vec4 color,
                   const HistogramOptions& options);

/// A named part of a whole.
struct Share {
    const char* name = "";
    float value = 0;  ///< 0 or more
    glm::vec4 color{1};
};
/// Draws the shares as parts of one bar, with values and percentages.
void drawShares(const char* label, std::span<const Share> shares, const char* unit);

/// One layer of a chart of pairs.
struct Layer {
    enum class Style {
        Cloud,   ///< cells whose opacity grows with the number of points
        Line,    ///< dots joined by lines
        Steps,   ///< rings joined by steps, for a Pareto front
        Marker,  ///< a ring
    };
    std::string name;  ///< name in the legend; empty: no entry
    std::vector<glm::vec2> points;
    glm::vec4 color{1};
    Style style = Style::Cloud;
    std::vector<std::string> notes{};  ///< tooltip of each point; empty: none
};

struct ChartOptions {
    const char *xName = "", *xUnit = "", *yName = "", *yUnit = "";
    float xFloor = 1e-3f, yFloor = 1e-9f;  ///< lower bounds: smaller values are drawn here
    float height = 0;                      ///< as in PlotOptions
    bool showValues = true;
};

/// Plots pairs on two logarithmic axes of whole decades that contain every point. Layers are drawn in
/// order, so a cloud must come first to hide no other layer. A tooltip shows the note of the point nearest to the
/// mouse, or the coordinates of the mouse.
void drawChart(const char* label, std::span<const Layer> layers, const ChartOptions& options);

}  // namespace touchstone::engine
