// Charts of pairs on two axes.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/view/plot_canvas.hpp"

namespace touchstone::engine {
namespace {

/// Draws points as cells of a few pixels whose opacity grows with their count. A single point remains visible.
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

void drawChart(const char* label, std::span<const Layer> layers, const ChartOptions& options) {
    ImGui::PushID(label);
    drawTitle(label, "");
    // Legend.
    bool any = false;
    for (const Layer& layer : layers) {
        if (layer.name.empty()) continue;
        if (any) sameLineIfFits(ImGui::CalcTextSize(layer.name.c_str()).x);
        ImGui::TextColored(vector(layer.color), "%s", layer.name.c_str());
        any = true;
    }
    // Axes over all points, in decades.
    const auto kept = [&](glm::vec2 p) { return glm::max(p, glm::vec2(options.xFloor, options.yFloor)); };
    ColumnRange xs, ys;
    for (const Layer& layer : layers)
        for (const glm::vec2& point : layer.points) {
            include(xs, kept(point).x);
            include(ys, kept(point).y);
        }
    const Axis across = Axis::decades(xs), up = Axis::decades(ys);
    const PlotShape shape(options.height);
    ImGui::TextDisabled("%s [%s]", options.yName, options.yUnit);
    const Canvas canvas(shape);
    if (xs.empty()) {
        canvas.drawNoData();
    } else {
        canvas.drawVerticalAxis(up);
        canvas.drawHorizontalAxis(across);
    }
    const auto place = [&](glm::vec2 p) -> ImVec2 {
        p = kept(p);
        return {canvas.x(across.fraction(p.x)), canvas.y(up.fraction(p.y))};
    };

    // Layers, and the note of the point nearest to the mouse.
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
    // Title of the horizontal axis, and the values under the mouse.
    const std::string xTitle = std::string(options.xName) + " [" + options.xUnit + "]";
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + shape.margin + shape.width - ImGui::CalcTextSize(xTitle.c_str()).x);
    ImGui::TextDisabled("%s", xTitle.c_str());

    const glm::vec2 at{(mouse.x - canvas.topLeft.x) / shape.width, (canvas.bottomRight.y - mouse.y) / shape.height};
    if (options.showValues && canvas.hovered && at.x >= 0 && at.x < 1 && at.y >= 0 && at.y < 1) {
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
