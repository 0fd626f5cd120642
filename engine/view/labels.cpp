#include "engine/view/labels.hpp"

#include <algorithm>
#include <cmath>

#include "engine/view/style.hpp"

namespace touchstone::engine {

void placeLabel(std::span<Glyph> label, std::vector<glm::vec4>& taken, glm::vec2 picture) {
    glm::vec4 ground = label[0].pixels;
    const auto move = [&](glm::vec2 by) { ground += glm::vec4(by, by); };
    move({std::min(picture.x - ground.z, 0.f), 0});
    move({std::max(-ground.x, 0.f), 0});
    const auto below = [](const glm::vec4& a, const glm::vec4& b) { return a.y < b.y; };
    std::sort(taken.begin(), taken.end(), below);
    for (const glm::vec4& other : taken)
        if (ground.x < other.z && other.x < ground.z && ground.y < other.w && other.y < ground.w)
            move({0, other.w - ground.y});
    const glm::vec4 by = glm::round(ground - label[0].pixels);
    for (Glyph& glyph : label) glyph.pixels += by;
    taken.push_back(label[0].pixels);
}

LabelFont::LabelFont(float pixelScale) : pixelScale_(pixelScale) {
    constexpr float kSize = 15;
    addSansFont(atlas_, kSize * pixelScale);
    unsigned char* pixels = nullptr;
    int width = 0, height = 0;
    atlas_.GetTexDataAsRGBA32(&pixels, &width, &height);
    texture_.emplace(Image{width, height, {pixels, pixels + 4 * static_cast<std::size_t>(width) * height}}, false);
    // The texels are narrower than pixels, so mipmaps would blur.
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    atlas_.ClearTexData();
}

void LabelFont::append(std::vector<Glyph>& glyphs, std::string_view text, glm::vec2 at, glm::vec4 color) const {
    const ImFont& font = *atlas_.Fonts[0];
    const float size = font.FontSize, pad = 0.3f * size;
    at = glm::round(glm::vec2(at.x, at.y - 0.5f * size));
    const std::size_t ground = glyphs.size();
    glyphs.push_back({});
    float x = at.x;
    for (std::size_t i = 0; i < text.size();) {
        // UTF-8 of one or two bytes, which covers Latin-1.
        const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(k < text.size() ? text[k] : 0); };
        const bool two = byte(i) >= 0xc0;
        const unsigned code = two ? (byte(i) & 0x1fu) << 6 | (byte(i + 1) & 0x3fu) : byte(i);
        i += two ? 2 : 1;
        const ImFontGlyph* g = font.FindGlyph(static_cast<ImWchar>(code));
        if (!g) continue;
        if (g->Visible)
            glyphs.push_back({{x + g->X0, at.y + g->Y0, x + g->X1, at.y + g->Y1}, {g->U0, g->V0, g->U1, g->V1}, color});
        x += g->AdvanceX;
    }
    const glm::vec2 white(atlas_.TexUvWhitePixel.x, atlas_.TexUvWhitePixel.y);
    glyphs[ground] = {{at.x - pad, at.y - 0.4f * pad, x + pad, at.y + size + 0.4f * pad},
                      {white, white},
                      {0.05f, 0.055f, 0.065f, 0.72f * color.a}};
}

void LabelFont::bindTexture(GLenum unit) const {
    glActiveTexture(unit);
    glBindTexture(GL_TEXTURE_2D, texture_->id());
}

}  // namespace touchstone::engine
