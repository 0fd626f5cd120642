#include "engine/view/plot_canvas.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace touchstone::engine {

std::string number(float value) {
    if (!std::isfinite(value)) return "-";
    std::array<char, 32> text{};
    const bool plainInteger = std::abs(value) >= 999.5f && std::abs(value) < 1e6f;  // %g would print 1e+03
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

Axis::Axis(ColumnRange data, const PlotOptions& options) : logarithmic_(options.logarithmic) {
    if (options.budget) include(data, *options.budget);
    float top = options.yMax.value_or(data.empty() ? 1 : data.max);
    if (logarithmic_) {
        constexpr float kDecades = 4;  // maximum number of decades shown below the top
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

Axis Axis::decades(const ColumnRange& data) {
    Axis axis;
    if (data.empty() || !(data.min > 0)) return axis;
    axis.bottom_ = std::floor(std::log10(data.min));
    axis.top_ = std::max(std::ceil(std::log10(data.max)), axis.bottom_ + 1);
    return axis;
}

Axis Axis::below(float share) const {
    Axis axis = *this;
    axis.top_ = bottom_ + (top_ - bottom_) / share;
    return axis;
}

float Axis::value(float fraction) const {
    const float v = bottom_ + fraction * (top_ - bottom_);
    return logarithmic_ ? std::pow(10.f, v) : v;
}

float Axis::fraction(float value) const {
    if (logarithmic_) value = value > 0 ? std::log10(value) : bottom_;
    return std::clamp((value - bottom_) / (top_ - bottom_), 0.f, 1.f);
}

std::vector<float> Axis::ticks(std::size_t maxCount) const {
    std::vector<float> values = niceTicks(bottom_, top_, maxCount);
    if (!logarithmic_) return values;
    // Ticks at whole decades if there are at least two, else at round numbers.
    std::erase_if(values, [](float v) { return v != std::round(v); });
    if (values.size() < 2) return niceTicks(std::pow(10.f, bottom_), std::pow(10.f, top_), maxCount);
    for (float& v : values) v = std::pow(10.f, v);
    return values;
}

void drawTitle(const char* title, const char* unit) {
    ImGui::TextUnformatted(title);
    if (!*unit) return;
    ImGui::SameLine();
    ImGui::TextDisabled("[%s]", unit);
}

void sameLineIfFits(float width) {
    const ImGuiStyle& style = ImGui::GetStyle();
    ImGui::SameLine(0, 2 * style.ItemSpacing.x);
    if (ImGui::GetContentRegionAvail().x < width) ImGui::NewLine();
}

PlotShape::PlotShape(float wanted) {
    line = ImGui::GetTextLineHeight();
    unit = line / 16;
    margin = ImGui::CalcTextSize("0.0000").x + 6 * unit;
    width = std::max(std::floor(ImGui::GetContentRegionAvail().x - margin), 1.f);
    height = wanted > 0 ? wanted : 6 * line;
}

Canvas::Canvas(const PlotShape& shape)
    : list(*ImGui::GetWindowDrawList()),
      faint(ImGui::GetColorU32(ImGuiCol_Text, 0.10f)),
      weak(ImGui::GetColorU32(ImGuiCol_TextDisabled)),
      shape_(shape) {
    const ImVec2 corner = ImGui::GetCursorScreenPos();
    topLeft = {std::floor(corner.x + shape.margin), std::floor(corner.y)};
    bottomRight = {topLeft.x + shape.width, topLeft.y + shape.height};
    ImGui::InvisibleButton("plot", {shape.margin + shape.width, shape.height + shape.line + 4 * shape.unit});
    hovered = ImGui::IsItemHovered();
    held = ImGui::IsItemActive();
    list.AddRectFilled(topLeft, bottomRight, ImGui::GetColorU32(ImGuiCol_FrameBg, 0.6f));
}

float Canvas::x(float fraction) const { return std::round(topLeft.x + shape_.width * fraction); }
float Canvas::y(float fraction) const { return std::round(topLeft.y + shape_.height * (1 - fraction)); }

void Canvas::drawVerticalAxis(const Axis& axis) const {
    const float line = shape_.line;
    float free = bottomRight.y;  // the labels below end here
    for (const float tick : axis.ticks(static_cast<std::size_t>(std::max(shape_.height / (1.8f * line), 3.f)))) {
        const float at = y(axis.fraction(tick));
        list.AddLine({topLeft.x, at}, {bottomRight.x, at}, faint);
        // Labels stay beside the plot, clear of its title and of the time axis.
        const float top = std::clamp(at - 0.5f * line, topLeft.y, std::max(bottomRight.y - line, topLeft.y));
        if (top + 0.75f * line > free) continue;  // figures are lower than a line
        free = top;
        const std::string text = number(tick);
        list.AddText({topLeft.x - ImGui::CalcTextSize(text.c_str()).x - 4 * shape_.unit, top}, weak, text.c_str());
    }
}
void Canvas::drawNoData() const {
    constexpr const char* kText = "no data";
    const ImVec2 size = ImGui::CalcTextSize(kText);
    const ImVec2 at{std::round(0.5f * (topLeft.x + bottomRight.x - size.x)),
                    std::round(0.5f * (topLeft.y + bottomRight.y - size.y))};
    const float margin = 4 * shape_.unit;  // clear of the lines of the axes
    list.AddRectFilled({at.x - margin, at.y}, {at.x + size.x + margin, at.y + size.y},
                       ImGui::GetColorU32(ImGuiCol_WindowBg));
    list.AddText(at, weak, kText);
}
void Canvas::drawHorizontalAxis(const Axis& axis) const {
    const auto most = static_cast<std::size_t>(std::max(shape_.width / (3.5f * shape_.line), 2.f));
    for (const float tick : axis.ticks(most)) drawTimeTick(axis.fraction(tick), number(tick));
}
void Canvas::drawTimeTick(float fraction, const std::string& text) const {
    const float at = x(fraction), half = 0.5f * ImGui::CalcTextSize(text.c_str()).x;
    list.AddLine({at, topLeft.y}, {at, bottomRight.y}, faint);
    list.AddText({std::clamp(at - half, topLeft.x, bottomRight.x - 2 * half), bottomRight.y + 2 * shape_.unit}, weak,
                 text.c_str());
}

}  // namespace touchstone::engine
