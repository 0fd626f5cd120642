#include "engine/view/plots.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>

namespace touchstone::engine {
namespace {

std::string number(float value) {
    if (!std::isfinite(value)) return "-";
    std::array<char, 32> text{};
    const bool plainInteger = std::abs(value) >= 1000 && std::abs(value) < 1e6f;  // %g would write 1e+03
    std::snprintf(text.data(), text.size(), plainInteger ? "%.0f" : "%.3g", static_cast<double>(value));
    return text.data();
}

std::string withUnit(float value, const char* unit) { return number(value) + (*unit ? " " : "") + unit; }

void include(ColumnRange& range, float value) {
    if (!std::isfinite(value)) return;
    if (range.empty())
        range = {value, value};
    else
        range = {std::min(range.min, value), std::max(range.max, value)};
}

void include(ColumnRange& range, const ColumnRange& other) {
    if (other.empty()) return;
    include(range, other.min);
    include(range, other.max);
}

/// Maps values to a fraction of the plot's height or width.
class Axis {
  public:
    Axis(ColumnRange data, const PlotOptions& options) : logarithmic_(options.logarithmic) {
        if (options.budget) include(data, *options.budget);
        float top = options.yMax.value_or(data.empty() ? 1 : data.max);
        if (logarithmic_) {
            constexpr float kDecades = 4;  // shown at most below the top
            if (!(top > 0)) top = 1;
            const float lowest = top * std::pow(10.f, -kDecades);
            bottom_ = std::log10(std::max(options.yMin.value_or(data.empty() ? 0 : data.min * 0.8f), lowest));
            top_ = std::log10(options.yMax ? top : top * 1.3f);
        } else {
            bottom_ = options.yMin.value_or(data.empty() ? 0 : std::min(0.f, data.min * 1.06f));
            top_ = options.yMax ? top : bottom_ + (std::max(top, 0.f) - bottom_) * 1.06f;
        }
        if (!(top_ > bottom_)) top_ = bottom_ + 1;
    }

    /// Whole decades around positive data.
    static Axis decades(const ColumnRange& data) {
        Axis axis;
        if (data.empty() || !(data.min > 0)) return axis;
        axis.bottom_ = std::floor(std::log10(data.min));
        axis.top_ = std::max(std::ceil(std::log10(data.max)), axis.bottom_ + 1);
        return axis;
    }

    float value(float fraction) const {
        const float v = bottom_ + fraction * (top_ - bottom_);
        return logarithmic_ ? std::pow(10.f, v) : v;
    }

    float fraction(float value) const {
        if (logarithmic_) value = value > 0 ? std::log10(value) : bottom_;
        return std::clamp((value - bottom_) / (top_ - bottom_), 0.f, 1.f);
    }

    std::vector<float> ticks(std::size_t maxCount) const {
        std::vector<float> values = niceTicks(bottom_, top_, maxCount);
        if (!logarithmic_) return values;
        // Whole decades where there are two, else round numbers between them.
        std::erase_if(values, [](float v) { return v != std::round(v); });
        if (values.size() < 2) return niceTicks(std::pow(10.f, bottom_), std::pow(10.f, top_), maxCount);
        for (float& v : values) v = std::pow(10.f, v);
        return values;
    }

  private:
    Axis() = default;
    bool logarithmic_ = true;
    float bottom_ = 0, top_ = 1;
};

void drawColumns(ImDrawList& list, std::span<const ColumnRange> columns, const Axis& axis, ImVec2 topLeft, float height,
                 ImU32 color, float thickness) {
    ColumnRange previous;
    for (std::size_t i = 0; i < columns.size(); ++i) {
        ColumnRange c = columns[i];
        const ColumnRange drawn = c;
        if (c.empty()) {
            previous = c;
            continue;
        }
        if (!previous.empty()) {  // reach back to the last column, so that the curve stays connected
            c.min = std::min(c.min, previous.max);
            c.max = std::max(c.max, previous.min);
        }
        previous = drawn;
        const float middle = 0.5f * (axis.fraction(c.min) + axis.fraction(c.max));
        const float half = std::max(0.5f * (axis.fraction(c.max) - axis.fraction(c.min)) * height, 0.5f * thickness);
        const float y = topLeft.y + height * (1 - middle), x = topLeft.x + static_cast<float>(i);
        list.AddRectFilled({x, std::max(y - half, topLeft.y)}, {x + 1, std::min(y + half, topLeft.y + height)}, color);
    }
}

std::string timeLabel(float milliseconds) {
    if (milliseconds == 0) return "now";
    return std::abs(milliseconds) >= 1000 ? number(milliseconds / 1000) + " s" : number(milliseconds) + " ms";
}

/// Name, last value and maximum of each series, in its colour, broken into lines as the width demands.
void drawLegend(std::span<const Series> series, std::size_t skip, std::span<const ColumnRange> ranges,
                const char* unit) {
    const float right = ImGui::GetCursorScreenPos().x + ImGui::GetContentRegionAvail().x;
    for (std::size_t i = 0; i < series.size(); ++i) {
        const RingView& samples = series[i].samples;
        const float current =
            samples.count > skip ? samples[samples.count - 1 - skip] : std::numeric_limits<float>::quiet_NaN();
        const float largest = ranges[i].empty() ? std::numeric_limits<float>::quiet_NaN() : ranges[i].max;
        const std::string values = withUnit(current, unit) + ", max " + number(largest);
        const float spacing = ImGui::GetStyle().ItemSpacing.x;
        const float width = ImGui::CalcTextSize(series[i].name).x + spacing + ImGui::CalcTextSize(values.c_str()).x;
        if (i > 0 && ImGui::GetItemRectMax().x + 2 * spacing + width < right) ImGui::SameLine(0, 2 * spacing);
        const glm::vec4& c = series[i].color;
        ImGui::TextColored({c.r, c.g, c.b, c.a}, "%s", series[i].name);
        ImGui::SameLine();
        ImGui::TextUnformatted(values.c_str());
    }
}

const ImU32 kWarning = IM_COL32(242, 115, 89, 230);

ImVec4 vector(const glm::vec4& c) { return {c.r, c.g, c.b, c.a}; }
ImU32 color(const glm::vec4& c) { return ImGui::GetColorU32(vector(c)); }

void drawTitle(const char* title, const char* unit) {
    ImGui::TextUnformatted(title);
    if (!*unit) return;
    ImGui::SameLine();
    ImGui::TextDisabled("[%s]", unit);
}

/// Sizes of a plot that fills the width there is.
struct Frame {
    float line = 0, unit = 0;  ///< height of text, and one screen unit at scale 1
    float margin = 0;          ///< at the left, for the labels: equal for all, so that the plots of a panel line up
    float width = 0, height = 0;
    std::size_t columns() const { return static_cast<std::size_t>(width); }
};

Frame measureFrame(float height) {
    Frame frame;
    frame.line = ImGui::GetTextLineHeight();
    frame.unit = frame.line / 16;
    frame.margin = ImGui::CalcTextSize("0.0000").x + 6 * frame.unit;
    frame.width = std::max(std::floor(ImGui::GetContentRegionAvail().x - frame.margin), 1.f);
    frame.height = height > 0 ? height : 6 * frame.line;
    return frame;
}

/// A plot's ground, with the labels around it, as one item.
class Canvas {
  public:
    explicit Canvas(const Frame& frame)
        : list(*ImGui::GetWindowDrawList()),
          faint(ImGui::GetColorU32(ImGuiCol_Text, 0.10f)),
          weak(ImGui::GetColorU32(ImGuiCol_TextDisabled)),
          frame_(frame) {
        const ImVec2 corner = ImGui::GetCursorScreenPos();
        topLeft = {std::floor(corner.x + frame.margin), std::floor(corner.y)};
        bottomRight = {topLeft.x + frame.width, topLeft.y + frame.height};
        ImGui::InvisibleButton("plot", {frame.margin + frame.width, frame.height + frame.line + 4 * frame.unit});
        hovered = ImGui::IsItemHovered();
        held = ImGui::IsItemActive();
        list.AddRectFilled(topLeft, bottomRight, ImGui::GetColorU32(ImGuiCol_FrameBg, 0.6f));
    }

    float x(float fraction) const { return std::round(topLeft.x + frame_.width * fraction); }
    float y(float fraction) const { return std::round(topLeft.y + frame_.height * (1 - fraction)); }

    void drawVerticalAxis(const Axis& axis) const {
        const float line = frame_.line;
        for (const float tick : axis.ticks(static_cast<std::size_t>(std::max(frame_.height / (1.8f * line), 2.f)))) {
            const float at = y(axis.fraction(tick));
            const std::string text = number(tick);
            list.AddLine({topLeft.x, at}, {bottomRight.x, at}, faint);
            list.AddText({topLeft.x - ImGui::CalcTextSize(text.c_str()).x - 4 * frame_.unit, at - 0.5f * line}, weak,
                         text.c_str());
        }
    }
    void drawHorizontalAxis(const Axis& axis) const {
        const auto most = static_cast<std::size_t>(std::max(frame_.width / (3.5f * frame_.line), 2.f));
        for (const float tick : axis.ticks(most)) drawTimeTick(axis.fraction(tick), number(tick));
    }
    void drawTimeTick(float fraction, const std::string& text) const {
        const float at = x(fraction), half = 0.5f * ImGui::CalcTextSize(text.c_str()).x;
        list.AddLine({at, topLeft.y}, {at, bottomRight.y}, faint);
        list.AddText({std::clamp(at - half, topLeft.x, bottomRight.x - 2 * half), bottomRight.y + 2 * frame_.unit},
                     weak, text.c_str());
    }

    ImDrawList& list;
    const ImU32 faint, weak;
    ImVec2 topLeft, bottomRight;
    bool hovered = false, held = false;

  private:
    const Frame& frame_;
};

/// A cell of a few pixels is as bright as it holds points, and a single point is seen.
template <class Place>
void drawCloud(const Canvas& canvas, const Layer& layer, const Place& place) {
    const float cell = std::max(2.f, std::round(2 * ImGui::GetTextLineHeight() / 16));
    const auto across = static_cast<std::size_t>((canvas.bottomRight.x - canvas.topLeft.x) / cell) + 1;
    const auto down = static_cast<std::size_t>((canvas.bottomRight.y - canvas.topLeft.y) / cell) + 1;
    std::vector<std::uint32_t> counts(across * down);
    for (const glm::vec2& point : layer.points) {
        const ImVec2 at = place(point);
        const auto column = static_cast<std::size_t>((at.x - canvas.topLeft.x) / cell);
        const auto row = static_cast<std::size_t>((at.y - canvas.topLeft.y) / cell);
        ++counts[std::min(row, down - 1) * across + std::min(column, across - 1)];
    }
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts[i] == 0) continue;
        glm::vec4 ink = layer.color;
        ink.a *= std::min(1.f, 0.4f + 0.12f * std::log2(static_cast<float>(counts[i])));
        const float x = canvas.topLeft.x + cell * static_cast<float>(i % across);
        const float y = canvas.topLeft.y + cell * static_cast<float>(i / across);
        canvas.list.AddRectFilled({x, y}, {x + cell, y + cell}, color(ink));
    }
}

}  // namespace

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
        // Slots [begin, end) of the window, rounded outwards: no sample falls between two columns.
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
    constexpr double kSlack = 1e-6;  // of a step: an end that is a multiple up to float rounding counts
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

PlotMouse drawSeries(const char* label, std::span<const Series> series, const PlotOptions& options) {
    ImGui::PushID(label);
    Stretch stretch = options.stretch;
    if (stretch.window == 0)
        for (const Series& s : series) stretch.window = std::max(stretch.window, s.samples.capacity);

    drawTitle(label, options.unit);
    const Frame shape = measureFrame(options.height);
    const float width = shape.width, height = shape.height, line = shape.line;
    std::vector<std::vector<ColumnRange>> columns;
    std::vector<ColumnRange> ranges;
    ColumnRange all;
    for (const Series& s : series) {
        columns.push_back(minMaxColumns(s.samples, stretch, shape.columns()));
        ranges.emplace_back();
        for (const ColumnRange& c : columns.back()) include(ranges.back(), c);
        include(all, ranges.back());
    }
    drawLegend(series, stretch.skip, ranges, options.unit);
    const Axis axis(all, options);

    const Canvas canvas(shape);
    ImDrawList& list = canvas.list;
    canvas.drawVerticalAxis(axis);
    const float span = static_cast<float>(stretch.window) * options.samplePeriodMs;
    const float behind = static_cast<float>(stretch.skip) * options.samplePeriodMs;
    for (const float tick :
         niceTicks(-behind - span, -behind, static_cast<std::size_t>(std::clamp(width / (5 * line), 2.f, 11.f))))
        canvas.drawTimeTick(1 + (tick + behind) / std::max(span, 1e-6f), timeLabel(tick));
    for (std::size_t i = 0; i < series.size(); ++i)
        drawColumns(list, columns[i], axis, canvas.topLeft, height, color(series[i].color), 1.5f * shape.unit);
    if (options.budget) {
        const float y = canvas.y(axis.fraction(*options.budget));
        list.AddLine({canvas.topLeft.x, y}, {canvas.bottomRight.x, y}, kWarning, shape.unit);
        const std::string text = "budget " + withUnit(*options.budget, options.unit);
        list.AddText({canvas.topLeft.x + 4 * shape.unit, y + shape.unit}, kWarning, text.c_str());
    }
    if (options.marks.count > 0) {
        const auto marks = minMaxColumns(options.marks, stretch, shape.columns());
        for (std::size_t i = 0; i < marks.size(); ++i)
            if (!marks[i].empty() && marks[i].max > 0) {
                const float x = canvas.topLeft.x + static_cast<float>(i);
                list.AddRectFilled({x - shape.unit, canvas.topLeft.y},
                                   {x + 2 * shape.unit, canvas.topLeft.y + 5 * shape.unit}, kWarning);
            }
    }

    PlotMouse mouse;
    const ImGuiIO& io = ImGui::GetIO();
    if (canvas.held) {
        mouse.dragging = true;
        mouse.drag = io.MouseDelta.x / width;
    }
    const float at = io.MousePos.x - canvas.topLeft.x;
    if (canvas.hovered && at >= 0 && at < width) {
        mouse.cursor = at / width;
        if (io.MouseWheel != 0) mouse.zoom = std::pow(0.8f, io.MouseWheel);
    }
    if (options.readOut)
        if (const std::optional<float> cursor = mouse.cursor ? mouse.cursor : options.cursor) {
            const float x = canvas.topLeft.x + *cursor * width;
            list.AddLine({x, canvas.topLeft.y}, {x, canvas.bottomRight.y}, canvas.weak);
        }
    if (options.readOut && mouse.cursor) {
        const auto column = static_cast<std::size_t>(at);
        ImGui::BeginTooltip();
        ImGui::TextDisabled("%s", timeLabel((at + 1 - width) / width * span - behind).c_str());
        for (std::size_t i = 0; i < series.size(); ++i) {
            const ColumnRange& c = columns[i][column];
            if (c.empty()) continue;
            const std::string low = number(c.min), high = withUnit(c.max, options.unit);
            ImGui::Text("%s  %s", series[i].name, (c.min == c.max ? high : low + " to " + high).c_str());
        }
        ImGui::EndTooltip();
    }
    ImGui::PopID();
    return mouse;
}

void drawHistogram(const char* label, const RingView& samples, Stretch stretch, glm::vec4 barColor,
                   const HistogramOptions& options) {
    ImGui::PushID(label);
    drawTitle(label, options.unit);
    const Frame shape = measureFrame(options.height);
    const auto counts = logHistogram(samples, stretch, options.low, options.high, options.bins);
    const Canvas canvas(shape);
    const Axis across = Axis::decades({options.low, options.high});
    const float most = static_cast<float>(*std::max_element(counts.begin(), counts.end()));
    const Axis up = Axis::decades({0.5f, std::max(most, 1.f)});
    canvas.drawVerticalAxis(up);
    canvas.drawHorizontalAxis(across);
    const float step = shape.width / static_cast<float>(options.bins);
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts[i] == 0) continue;
        const float x = canvas.topLeft.x + step * static_cast<float>(i);
        canvas.list.AddRectFilled({x, canvas.y(up.fraction(static_cast<float>(counts[i])))},
                                  {x + std::max(step - 1, 1.f), canvas.bottomRight.y}, color(barColor));
    }
    float textRight = -1e9f;
    int row = 0;
    for (const auto& [name, value] : options.levels) {
        if (!(value > 0)) continue;
        const float x = canvas.x(across.fraction(value));
        canvas.list.AddLine({x, canvas.topLeft.y}, {x, canvas.bottomRight.y}, kWarning, shape.unit);
        // Names of lines that stand close go below each other.
        const float textWidth = ImGui::CalcTextSize(name).x;
        const float left = std::min(x + 3 * shape.unit, canvas.bottomRight.x - textWidth);
        row = left < textRight ? row + 1 : 0;
        textRight = left + textWidth + 4 * shape.unit;
        canvas.list.AddText({left, canvas.topLeft.y + static_cast<float>(row) * shape.line}, kWarning, name);
    }
    const float at = (ImGui::GetIO().MousePos.x - canvas.topLeft.x) / shape.width;
    if (options.readOut && canvas.hovered && at >= 0 && at < 1) {
        const auto bin = static_cast<std::size_t>(at * static_cast<float>(options.bins));
        const auto edge = [&](std::size_t i) {
            return across.value(static_cast<float>(i) / static_cast<float>(options.bins));
        };
        ImGui::BeginTooltip();
        ImGui::Text("%s to %s: %zu", number(edge(bin)).c_str(), withUnit(edge(bin + 1), options.unit).c_str(),
                    counts[bin]);
        ImGui::EndTooltip();
    }
    ImGui::PopID();
}

void drawShares(const char* label, std::span<const Share> shares, const char* unit) {
    ImGui::PushID(label);
    drawTitle(label, unit);
    float sum = 0;
    for (const Share& share : shares) sum += share.value;
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const float width = ImGui::GetContentRegionAvail().x, height = 0.7f * ImGui::GetTextLineHeight();
    ImGui::Dummy({width, height});
    float x = corner.x;
    for (const Share& share : shares) {
        const float next = x + (sum > 0 ? width * share.value / sum : 0);
        ImGui::GetWindowDrawList()->AddRectFilled({x, corner.y}, {next, corner.y + height}, color(share.color));
        x = next;
    }
    for (std::size_t i = 0; i < shares.size(); ++i) {
        const Share& share = shares[i];
        const float percent = sum > 0 ? 100 * share.value / sum : 0;
        std::array<char, 96> text{};
        std::snprintf(text.data(), text.size(), "%s %.0f %%", number(share.value).c_str(),
                      static_cast<double>(percent));
        const float wanted = ImGui::CalcTextSize(share.name).x + ImGui::CalcTextSize(text.data()).x;
        if (i > 0) {
            ImGui::SameLine(0, ImGui::GetTextLineHeight());
            if (ImGui::GetContentRegionAvail().x < wanted) ImGui::NewLine();
        }
        ImGui::TextColored(vector(share.color), "%s", share.name);
        ImGui::SameLine(0, 0.3f * ImGui::GetTextLineHeight());
        ImGui::TextUnformatted(text.data());
    }
    ImGui::PopID();
}

void drawChart(const char* label, std::span<const Layer> layers, const ChartOptions& options) {
    ImGui::PushID(label);
    drawTitle(label, "");
    bool any = false;
    for (const Layer& layer : layers) {
        if (layer.name.empty()) continue;
        if (any) {
            ImGui::SameLine(0, ImGui::GetTextLineHeight());
            if (ImGui::GetContentRegionAvail().x < ImGui::CalcTextSize(layer.name.c_str()).x) ImGui::NewLine();
        }
        ImGui::TextColored(vector(layer.color), "%s", layer.name.c_str());
        any = true;
    }
    const auto kept = [&](glm::vec2 p) { return glm::max(p, glm::vec2(options.xLeast, options.yLeast)); };
    ColumnRange xs, ys;
    for (const Layer& layer : layers)
        for (const glm::vec2& point : layer.points) {
            include(xs, kept(point).x);
            include(ys, kept(point).y);
        }
    const Axis across = Axis::decades(xs), up = Axis::decades(ys);
    const Frame shape = measureFrame(options.height);
    ImGui::TextDisabled("%s [%s]", options.yName, options.yUnit);
    const Canvas canvas(shape);
    canvas.drawVerticalAxis(up);
    canvas.drawHorizontalAxis(across);
    const auto place = [&](glm::vec2 p) -> ImVec2 {
        p = kept(p);
        return {canvas.x(across.fraction(p.x)), canvas.y(up.fraction(p.y))};
    };

    const glm::vec2 mouse{ImGui::GetIO().MousePos.x, ImGui::GetIO().MousePos.y};
    const std::string* nearest = nullptr;
    float distance = 10 * shape.unit;
    canvas.list.PushClipRect({canvas.topLeft.x - 8 * shape.unit, canvas.topLeft.y - 8 * shape.unit},
                             {canvas.bottomRight.x + 8 * shape.unit, canvas.bottomRight.y + 8 * shape.unit}, true);
    for (const Layer& layer : layers) {
        const ImU32 ink = color(layer.color);
        if (layer.style == Layer::Style::Cloud) {
            drawCloud(canvas, layer, place);
            continue;
        }
        for (std::size_t i = 0; i < layer.points.size(); ++i) {
            const ImVec2 at = place(layer.points[i]);
            const bool alone = layer.points.size() == 1;
            const float size = shape.unit * (layer.style == Layer::Style::Marker  ? 7.f
                                             : layer.style == Layer::Style::Steps ? 5.f
                                             : alone                              ? 3.5f
                                                                                  : 2.5f);
            if (i > 0 && layer.style != Layer::Style::Marker) {
                const ImVec2 before = place(layer.points[i - 1]);
                if (layer.style == Layer::Style::Steps) {
                    canvas.list.AddLine(before, {at.x, before.y}, ink, 1.5f * shape.unit);
                    canvas.list.AddLine({at.x, before.y}, at, ink, 1.5f * shape.unit);
                } else {
                    canvas.list.AddLine(before, at, ink, 1.5f * shape.unit);
                }
            }
            if (layer.style == Layer::Style::Line)
                canvas.list.AddCircleFilled(at, size, ink);
            else
                canvas.list.AddCircle(at, size, ink, 0, shape.unit * (layer.style == Layer::Style::Marker ? 2 : 1.2f));
            if (i < layer.notes.size()) {
                const float d = glm::distance(mouse, glm::vec2(at.x, at.y));
                if (d < distance) {
                    distance = d;
                    nearest = &layer.notes[i];
                }
            }
        }
    }
    canvas.list.PopClipRect();
    const std::string xTitle = std::string(options.xName) + " [" + options.xUnit + "]";
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + shape.margin + shape.width - ImGui::CalcTextSize(xTitle.c_str()).x);
    ImGui::TextDisabled("%s", xTitle.c_str());

    const glm::vec2 at{(mouse.x - canvas.topLeft.x) / shape.width, (canvas.bottomRight.y - mouse.y) / shape.height};
    if (options.readOut && canvas.hovered && at.x >= 0 && at.x < 1 && at.y >= 0 && at.y < 1) {
        ImGui::BeginTooltip();
        if (nearest)
            ImGui::TextUnformatted(nearest->c_str());
        else
            ImGui::Text("%s, %s", withUnit(across.value(at.x), options.xUnit).c_str(),
                        withUnit(up.value(at.y), options.yUnit).c_str());
        ImGui::EndTooltip();
    }
    ImGui::PopID();
}

}  // namespace touchstone::engine
