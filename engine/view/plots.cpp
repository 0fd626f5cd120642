#include "engine/view/plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "engine/view/plot_canvas.hpp"

namespace touchstone::engine {
namespace {

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
        if (!previous.empty()) {  // extend to the previous column, so that the curve stays connected
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

/// Draws name, last value and maximum of each series, in their order: beside the title if they fit there, otherwise
/// below it. Without data, only the names.
void drawLegend(std::span<const Series> series, std::size_t skip, std::span<const ColumnRange> ranges) {
    const float spacing = ImGui::GetStyle().ItemSpacing.x;
    // Each has the greatest width that it has had, so that neither the texts nor the plots below jump as values change.
    const float usual = ImGui::CalcTextSize("0.00, max 0.00").x;
    std::vector<std::string> values(series.size());
    std::vector<float> widths(series.size());
    const ImVec2 title = ImGui::GetItemRectMax();
    const float left = ImGui::GetCursorScreenPos().x, right = left + ImGui::GetContentRegionAvail().x;
    float end = title.x;
    for (std::size_t i = 0; i < series.size(); ++i) {
        const RingView& samples = series[i].samples;
        if (samples.count > skip && !ranges[i].empty())
            values[i] = number(samples[samples.count - 1 - skip]) + ", max " + number(ranges[i].max);
        float& widest = *ImGui::GetStateStorage()->GetFloatRef(ImGui::GetID(series[i].name), usual);
        widest = std::max(widest, ImGui::CalcTextSize(values[i].c_str()).x);
        widths[i] = ImGui::CalcTextSize(series[i].name).x + spacing + widest;
        end += 2 * spacing + widths[i];
    }
    const bool beside = end <= right;
    end = title.x;
    for (std::size_t i = 0; i < series.size(); ++i) {
        const float begin = end + 2 * spacing;
        const bool same = i == 0 ? beside : begin + widths[i] <= right;
        if (same) {
            ImGui::SameLine();
            ImGui::SetCursorScreenPos({begin, ImGui::GetCursorScreenPos().y});
        }
        end = (same ? begin : left) + widths[i];
        ImGui::TextColored(vector(series[i].color), "%s", series[i].name);
        if (values[i].empty()) continue;
        ImGui::SameLine();
        ImGui::TextUnformatted(values[i].c_str());
    }
}

}  // namespace

PlotMouse drawSeries(const char* label, std::span<const Series> series, const PlotOptions& options) {
    ImGui::PushID(label);
    Stretch stretch = options.stretch;
    if (stretch.window == 0)
        for (const Series& s : series) stretch.window = std::max(stretch.window, s.samples.capacity);

    drawTitle(label, options.unit);
    const PlotShape shape(options.height);
    const float width = shape.width, height = shape.height, line = shape.line;
    // The range of each series in every pixel column.
    std::vector<std::vector<ColumnRange>> columns;
    std::vector<ColumnRange> ranges;
    ColumnRange all;
    for (const Series& s : series) {
        columns.push_back(minMaxColumns(s.samples, stretch, shape.columns()));
        ranges.emplace_back();
        for (const ColumnRange& c : columns.back()) include(ranges.back(), c);
        include(all, ranges.back());
    }
    drawLegend(series, stretch.skip, ranges);
    const Axis axis(all, options);

    const Canvas canvas(shape);
    ImDrawList& list = canvas.list;
    if (!all.empty()) canvas.drawVerticalAxis(axis);
    // Time axis.
    const float span = static_cast<float>(stretch.window) * options.samplePeriodMs;
    const float behind = static_cast<float>(stretch.skip) * options.samplePeriodMs;
    for (const float tick :
         niceTicks(-behind - span, -behind, static_cast<std::size_t>(std::clamp(width / (5 * line), 2.f, 11.f))))
        canvas.drawTimeTick(1 + (tick + behind) / std::max(span, 1e-6f), timeLabel(tick));
    if (all.empty()) canvas.drawNoData();
    for (std::size_t i = series.size(); i-- > 0;)  // the first of the legend on top
        drawColumns(list, columns[i], axis, canvas.topLeft, height, color(series[i].color), 1.5f * shape.unit);
    // Budget line, and red marks at the top.
    if (options.budget && !all.empty()) {
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

    // What the mouse does, and the values under it.
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
    if (options.showValues)
        if (const std::optional<float> cursor = mouse.cursor ? mouse.cursor : options.cursor) {
            const float x = canvas.topLeft.x + *cursor * width;
            list.AddLine({x, canvas.topLeft.y}, {x, canvas.bottomRight.y}, canvas.weak);
        }
    if (options.showValues && mouse.cursor) {
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
    const PlotShape shape(options.height);
    const auto counts = logHistogram(samples, stretch, options.low, options.high, options.bins);
    const Canvas canvas(shape);
    const Axis across = Axis::decades({options.low, options.high});
    const float most = static_cast<float>(*std::max_element(counts.begin(), counts.end()));
    // The bars end below a line of text with the names of the levels.
    const float named = options.levels.empty() ? 0 : std::min(0.5f, 1.2f * shape.line / shape.height);
    const Axis up = Axis::decades({0.5f, std::max(most, 1.f)}), bars = up.below(1 - named);
    if (most > 0) canvas.drawVerticalAxis(bars);
    canvas.drawHorizontalAxis(across);
    if (most <= 0) canvas.drawNoData();
    const float step = shape.width / static_cast<float>(options.bins);
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts[i] == 0) continue;
        const float x = canvas.topLeft.x + step * static_cast<float>(i);
        canvas.list.AddRectFilled({x, canvas.y(bars.fraction(static_cast<float>(counts[i])))},
                                  {x + std::max(step - 1, 1.f), canvas.bottomRight.y}, color(barColor));
    }
    // Names in one line, each beside its level, moved right past the name before and kept inside the right edge.
    const float between = 4 * shape.unit;
    std::vector<float> left;
    float end = canvas.topLeft.x;
    for (const auto& [name, value] : options.levels) {
        left.push_back(std::max(canvas.x(across.fraction(value)) + 3 * shape.unit, end));
        end = left.back() + ImGui::CalcTextSize(name).x + between;
    }
    end = canvas.bottomRight.x;
    for (std::size_t i = left.size(); i-- > 0;) {
        left[i] = std::min(left[i], end - ImGui::CalcTextSize(options.levels[i].first).x);
        end = left[i] - between;
    }
    for (std::size_t i = 0; i < left.size(); ++i) {
        const auto& [name, value] = options.levels[i];
        if (!(value > 0)) continue;
        const float x = canvas.x(across.fraction(value));
        // Below the names, which stand in the same order: a line would cross the name of another level near by.
        canvas.list.AddLine({x, canvas.topLeft.y + named * shape.height}, {x, canvas.bottomRight.y}, kWarning,
                            shape.unit);
        canvas.list.AddText({left[i], canvas.topLeft.y}, kWarning, name);
    }
    const float at = (ImGui::GetIO().MousePos.x - canvas.topLeft.x) / shape.width;
    if (options.showValues && canvas.hovered && at >= 0 && at < 1) {
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
    ImGui::GetWindowDrawList()->AddRectFilled(corner, {corner.x + width, corner.y + height},
                                              ImGui::GetColorU32(ImGuiCol_FrameBg, 0.6f));
    float x = corner.x;
    for (const Share& share : shares) {
        const float next = x + (sum > 0 ? width * share.value / sum : 0);
        ImGui::GetWindowDrawList()->AddRectFilled({x, corner.y}, {next, corner.y + height}, color(share.color));
        x = next;
    }
    if (!(sum > 0)) ImGui::TextDisabled("no data");
    for (std::size_t i = 0; sum > 0 && i < shares.size(); ++i) {
        const Share& share = shares[i];
        const float percent = 100 * share.value / sum;
        std::array<char, 96> text{};
        std::snprintf(text.data(), text.size(), "%s (%.0f %%)", number(share.value).c_str(),
                      static_cast<double>(percent));
        if (i > 0) sameLineIfFits(ImGui::CalcTextSize(share.name).x + ImGui::CalcTextSize("0.0000 (100 %)").x);
        ImGui::TextColored(vector(share.color), "%s", share.name);
        ImGui::SameLine(0, 0.3f * ImGui::GetTextLineHeight());
        ImGui::TextUnformatted(text.data());
    }
    ImGui::PopID();
}

}  // namespace touchstone::engine
