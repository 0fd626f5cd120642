#include "engine/view/plots.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
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

/// Vertical axis: maps values to a fraction of the height.
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
    bool logarithmic_;
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

/// Name, current value and maximum of each series, in its colour, broken into lines as the width demands.
void drawLegend(std::span<const Series> series, std::span<const ColumnRange> ranges, const char* unit) {
    const float right = ImGui::GetCursorScreenPos().x + ImGui::GetContentRegionAvail().x;
    for (std::size_t i = 0; i < series.size(); ++i) {
        const RingView& samples = series[i].samples;
        const float current = samples.count ? samples[samples.count - 1] : std::numeric_limits<float>::quiet_NaN();
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

}  // namespace

std::vector<ColumnRange> minMaxColumns(const RingView& samples, std::size_t window, std::size_t columns) {
    std::vector<ColumnRange> result(columns);
    const std::size_t shown = std::min(samples.count, window);
    const std::size_t missing = window - shown, skipped = samples.count - shown;
    for (std::size_t c = 0; c < columns; ++c) {
        // Slots [begin, end) of the window, rounded outwards: no sample falls between two columns.
        const std::size_t begin = std::max(c * window / columns, missing);
        const std::size_t end = ((c + 1) * window + columns - 1) / columns;
        for (std::size_t slot = begin; slot < end; ++slot) include(result[c], samples[slot - missing + skipped]);
    }
    return result;
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

void drawSeries(const char* label, std::span<const Series> series, const PlotOptions& options) {
    ImGui::PushID(label);
    const float line = ImGui::GetTextLineHeight(), unitLength = line / 16;  // one screen unit at scale 1
    const float height = options.height > 0 ? options.height : 6 * line;
    std::size_t window = options.window;
    if (window == 0)
        for (const Series& s : series) window = std::max(window, s.samples.capacity);

    ImGui::TextUnformatted(label);
    if (*options.unit) {
        ImGui::SameLine();
        ImGui::TextDisabled("[%s]", options.unit);
    }

    // The labels of the vertical axis take a fixed width at the left, so that the plots of a panel line up.
    const float margin = ImGui::CalcTextSize("0.0000").x + 6 * unitLength;
    const float width = std::max(std::floor(ImGui::GetContentRegionAvail().x - margin), 1.f);
    const auto columnCount = static_cast<std::size_t>(width);
    std::vector<std::vector<ColumnRange>> columns;
    std::vector<ColumnRange> ranges;
    ColumnRange all;
    for (const Series& s : series) {
        columns.push_back(minMaxColumns(s.samples, window, columnCount));
        ranges.emplace_back();
        for (const ColumnRange& c : columns.back()) include(ranges.back(), c);
        include(all, ranges.back());
    }
    drawLegend(series, ranges, options.unit);
    const Axis axis(all, options);

    const ImVec2 corner = ImGui::GetCursorScreenPos();
    const ImVec2 topLeft{std::floor(corner.x + margin), std::floor(corner.y)};
    const ImVec2 bottomRight{topLeft.x + width, topLeft.y + height};
    ImGui::InvisibleButton("plot", {margin + width, height + line + 4 * unitLength});
    const bool hovered = ImGui::IsItemHovered();
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImU32 faint = ImGui::GetColorU32(ImGuiCol_Text, 0.10f), weak = ImGui::GetColorU32(ImGuiCol_TextDisabled);
    list.AddRectFilled(topLeft, bottomRight, ImGui::GetColorU32(ImGuiCol_FrameBg, 0.6f));

    for (const float tick : axis.ticks(static_cast<std::size_t>(std::max(height / (1.8f * line), 2.f)))) {
        const float y = std::round(topLeft.y + height * (1 - axis.fraction(tick)));
        const std::string text = number(tick);
        list.AddLine({topLeft.x, y}, {bottomRight.x, y}, faint);
        list.AddText({topLeft.x - ImGui::CalcTextSize(text.c_str()).x - 4 * unitLength, y - 0.5f * line}, weak,
                     text.c_str());
    }
    const float span = static_cast<float>(window) * options.samplePeriodMs;
    for (const float tick : niceTicks(-span, 0, static_cast<std::size_t>(std::clamp(width / (5 * line), 2.f, 11.f)))) {
        const float x = std::round(bottomRight.x + width * tick / std::max(span, 1e-6f));
        const std::string text = timeLabel(tick);
        const float half = 0.5f * ImGui::CalcTextSize(text.c_str()).x;
        list.AddLine({x, topLeft.y}, {x, bottomRight.y}, faint);
        list.AddText({std::clamp(x - half, topLeft.x, bottomRight.x - 2 * half), bottomRight.y + 2 * unitLength}, weak,
                     text.c_str());
    }
    for (std::size_t i = 0; i < series.size(); ++i) {
        const glm::vec4& c = series[i].color;
        drawColumns(list, columns[i], axis, topLeft, height, ImGui::GetColorU32(ImVec4(c.r, c.g, c.b, c.a)),
                    1.5f * unitLength);
    }
    if (options.budget) {
        const float y = std::round(topLeft.y + height * (1 - axis.fraction(*options.budget)));
        const ImU32 warning = ImGui::GetColorU32(ImVec4(0.95f, 0.45f, 0.35f, 0.9f));
        list.AddLine({topLeft.x, y}, {bottomRight.x, y}, warning, unitLength);
        const std::string text = "budget " + withUnit(*options.budget, options.unit);
        list.AddText({topLeft.x + 4 * unitLength, y + unitLength}, warning, text.c_str());
    }

    const float mouse = ImGui::GetIO().MousePos.x - topLeft.x;
    if (hovered && mouse >= 0 && mouse < width) {
        const auto column = static_cast<std::size_t>(mouse);
        list.AddLine({topLeft.x + mouse, topLeft.y}, {topLeft.x + mouse, bottomRight.y}, weak);
        ImGui::BeginTooltip();
        ImGui::TextDisabled("%s", timeLabel(std::round((mouse + 1 - width) / width * span)).c_str());
        for (std::size_t i = 0; i < series.size(); ++i) {
            const ColumnRange& c = columns[i][column];
            if (c.empty()) continue;
            const std::string low = number(c.min), high = withUnit(c.max, options.unit);
            ImGui::Text("%s  %s", series[i].name, (c.min == c.max ? high : low + " to " + high).c_str());
        }
        ImGui::EndTooltip();
    }
    ImGui::PopID();
}

}  // namespace touchstone::engine
