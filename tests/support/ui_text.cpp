#include "tests/support/ui_text.hpp"

#include <imgui_internal.h>

#include <cmath>

namespace touchstone::test {

namespace {

struct Letter {
    ImRect box, shown;  // shown: the part inside the clip rectangle
    char text = '?';    // of ASCII
    bool cut = false, halved = false;
};

/// A letter of a font whose picture contains these texture coordinates; null: none.
const ImFontGlyph* glyphAt(ImVec2 low, ImVec2 high) {
    constexpr float kRounding = 1e-5f;
    for (const ImFont* font : ImGui::GetIO().Fonts->Fonts)
        for (const ImFontGlyph& glyph : font->Glyphs)
            if (low.x >= glyph.U0 - kRounding && high.x <= glyph.U1 + kRounding && low.y >= glyph.V0 - kRounding &&
                high.y <= glyph.V1 + kRounding)
                return &glyph;
    return nullptr;
}

std::vector<Letter> lettersOf(const ImDrawList& list) {
    constexpr float kPart = 0.05f;  // of a letter that may be missing: rounding
    std::vector<Letter> letters;
    for (const ImDrawCmd& command : list.CmdBuffer)
        for (unsigned i = 0; i + 6 <= command.ElemCount; i += 3) {
            const ImDrawIdx* index = &list.IdxBuffer[int(command.IdxOffset + i)];
            // A letter is a rectangle of two triangles: a, a + 1, a + 2 and a, a + 2, a + 3.
            if (index[1] != index[0] + 1 || index[2] != index[0] + 2 || index[3] != index[0] || index[4] != index[2] ||
                index[5] != index[0] + 3)
                continue;
            const ImDrawVert& a = list.VtxBuffer[int(command.VtxOffset + index[0])];
            const ImDrawVert& b = list.VtxBuffer[int(command.VtxOffset + index[2])];
            if (a.uv.x >= b.uv.x || a.uv.y >= b.uv.y || (a.col & IM_COL32_A_MASK) == 0) continue;
            const ImFontGlyph* glyph = glyphAt(a.uv, b.uv);
            if (!glyph || !glyph->Visible) continue;
            Letter letter{{a.pos, b.pos}, {a.pos, b.pos}};
            letter.shown.ClipWith(ImRect(command.ClipRect));
            if (letter.shown.GetWidth() < 1 || letter.shown.GetHeight() < 1) continue;  // scrolled away
            const auto part = [](float shown, float whole, float u, float uWhole) {
                return shown / whole * u / uWhole < 1 - kPart;
            };
            letter.cut = part(letter.shown.GetWidth(), letter.box.GetWidth(), b.uv.x - a.uv.x, glyph->U1 - glyph->U0);
            letter.halved =
                part(letter.shown.GetHeight(), letter.box.GetHeight(), b.uv.y - a.uv.y, glyph->V1 - glyph->V0);
            if (glyph->Codepoint < 128) letter.text = static_cast<char>(glyph->Codepoint);
            letters.push_back(letter);
        }
    return letters;
}

}  // namespace

TextFaults textFaults(const std::string& window) {
    constexpr float kTouching = 2.5f;  // screen units that neighboring letters may share
    TextFaults faults;
    const ImDrawData* data = ImGui::GetDrawData();
    for (int i = 0; data && i < data->CmdListsCount; ++i) {
        const ImDrawList& list = *data->CmdLists[i];
        const std::string name = list._OwnerName ? list._OwnerName : "";
        if (name == "##Background" || name.find(window) == std::string::npos) continue;
        const std::vector<Letter> letters = lettersOf(list);
        const auto note = [&](std::vector<std::string>& where, const Letter& letter) {
            where.push_back(name + " at " + std::to_string(std::lround(letter.box.Min.x)) + ", " +
                            std::to_string(std::lround(letter.box.Min.y)));
        };
        for (std::size_t k = 0; k < letters.size(); ++k) {
            if (letters[k].cut) note(faults.cut, letters[k]);
            if (letters[k].halved) note(faults.halved, letters[k]);
            for (std::size_t other = 0; other < k; ++other) {
                ImRect both = letters[k].shown;
                both.ClipWithFull(letters[other].shown);
                if (both.GetWidth() > kTouching && both.GetHeight() > kTouching) note(faults.covered, letters[k]);
            }
        }
    }
    return faults;
}

std::string shownText(const std::string& window) {
    std::string text;
    const ImDrawData* data = ImGui::GetDrawData();
    for (int i = 0; data && i < data->CmdListsCount; ++i) {
        const ImDrawList& list = *data->CmdLists[i];
        if (!list._OwnerName || std::string(list._OwnerName).find(window) == std::string::npos) continue;
        for (const Letter& letter : lettersOf(list)) text += letter.text;
    }
    return text;
}

int lettersIn(const glm::vec4& area) {
    const ImRect inside(area.x, area.y, area.z, area.w);
    int count = 0;
    const ImDrawData* data = ImGui::GetDrawData();
    for (int i = 0; data && i < data->CmdListsCount; ++i)
        for (const Letter& letter : lettersOf(*data->CmdLists[i])) count += inside.Contains(letter.shown);
    return count;
}

}  // namespace touchstone::test
