#pragma once
// Text labels in the picture.
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

/// Moves a label into the picture and below earlier labels that it would cover. `label`: its background, then its
/// glyphs; `taken`: backgrounds of earlier labels, to which its own is added.
void placeLabel(std::span<Glyph> label, std::vector<glm::vec4>& taken, glm::vec2 picture);

/// A font of one size as a coverage texture.
class LabelFont {
  public:
    explicit LabelFont(float pixelScale);

    /// Appends a text on a dark background. `at`: pixel of its left end at half its height.
    void append(std::vector<Glyph>& glyphs, std::string_view text, glm::vec2 at, glm::vec4 color) const;
    void bindTexture(GLenum unit) const;
    float pixelScale() const { return pixelScale_; }

  private:
    float pixelScale_;
    ImFontAtlas atlas_;
    std::optional<Texture> texture_;
};

}  // namespace touchstone::engine
