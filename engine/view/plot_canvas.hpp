#pragma once
// Shared by all plots: number formatting, axes and the drawing area.
#include <imgui.h>

#include <string>
#include <vector>

#include "engine/view/plots.hpp"

namespace touchstone::engine {

std::string number(float value);
std::string withUnit(float value, const char* unit);

/// Widens a range to include a value. Non-finite values are ignored.
void include(ColumnRange& range, float value);
void include(ColumnRange& range, const ColumnRange& other);

/// Maps values to a fraction of the plot's height or width.
class Axis {
  public:
    Axis(ColumnRange data, const PlotOptions& options);
    /// Whole decades around positive data.
    static Axis decades(const ColumnRange& data);
    /// The axis that has this one in its lower part, of this share.
    Axis below(float share) const;

    float value(float fraction) const;
    float fraction(float value) const;
    std::vector<float> ticks(std::size_t maxCount) const;

  private:
    Axis() = default;
    bool logarithmic_ = true;
    float bottom_ = 0, top_ = 1;
};

inline constexpr ImU32 kWarning = IM_COL32(242, 115, 89, 230);

inline ImVec4 vector(const glm::vec4& c) { return {c.r, c.g, c.b, c.a}; }
inline ImU32 color(const glm::vec4& c) { return ImGui::GetColorU32(vector(c)); }

void drawTitle(const char* title, const char* unit);
/// Continues the line of ImGui if an item of this width fits there; otherwise begins a line.
void sameLineIfFits(float width);

/// Sizes of a plot that fills the available width.
struct PlotShape {
    explicit PlotShape(float height);

    float line = 0, unit = 0;  ///< text height; one screen unit at scale 1
    float margin = 0;          ///< left margin for the labels, equal for all plots so that they align
    float width = 0, height = 0;
    std::size_t columns() const { return static_cast<std::size_t>(width); }
};

/// The drawing area of a plot with its labels, as one ImGui item.
class Canvas {
  public:
    explicit Canvas(const PlotShape& shape);

    float x(float fraction) const;
    float y(float fraction) const;

    void drawVerticalAxis(const Axis& axis) const;
    void drawHorizontalAxis(const Axis& axis) const;
    void drawNoData() const;
    void drawTimeTick(float fraction, const std::string& text) const;

    ImDrawList& list;
    const ImU32 faint, weak;
    ImVec2 topLeft, bottomRight;
    bool hovered = false, held = false;

  private:
    const PlotShape& shape_;
};

}  // namespace touchstone::engine
