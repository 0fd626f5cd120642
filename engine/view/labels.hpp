#pragma once
// Words in the picture.
#include <imgui.h>

#include <optional>
#include <string_view>

#include "engine/view/gl_objects.hpp"

namespace touchstone::engine {

/// A rectangle of the picture filled from the font's texture, as label.vert takes it.
struct Glyph {
    glm::vec4 pixels;  ///< left, top, right, bottom, y down from the upper-left corner
    glm::vec4 texels;  ///< likewise, 0 to 1
    glm::vec4 color;   ///< sRGB
};

/// Moves a label, its ground first, into a picture and down off those that are there, whose grounds are `taken`; its
/// own is added to them.
void settle(std::span<Glyph> label, std::vector<glm::vec4>& taken, glm::vec2 picture);

/// A font at one size as a texture of coverage.
class LabelFont {
  public:
    explicit LabelFont(float pixelScale);

    /// Appends a text on a dark ground, its left end in the middle of its height at a pixel.
    void append(std::vector<Glyph>& glyphs, std::string_view text, glm::vec2 at, glm::vec4 color) const;
    void bindTexture(GLenum unit) const;
    float pixelScale() const { return pixelScale_; }

  private:
    float pixelScale_;
    ImFontAtlas atlas_;
    std::optional<Texture> texture_;
};

}  // namespace touchstone::engine
