#include "engine/view/style.hpp"

#include <imgui.h>

#include <array>
#include <cmath>
#include <filesystem>

namespace touchstone::engine {
namespace {

ImVec4 mix(const ImVec4& a, const ImVec4& b, float t) {
    return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z), a.w + t * (b.w - a.w)};
}

}  // namespace

void addSansFont(ImFontAtlas& fonts, float pixels) {
    constexpr std::array kFonts{
        "/usr/share/fonts/truetype/noto/NotoSans-Regular.ttf", "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
        "/usr/share/fonts/truetype/liberation/LiberationSans-Regular.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf",
        "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf"};
    // Latin-1 with µ, ·, ° and ², Greek, dashes and quotation marks.
    static constexpr std::array<ImWchar, 7> kGlyphs{0x20, 0xff, 0x370, 0x3ff, 0x2010, 0x2026, 0};
    std::error_code ignored;
    for (const char* file : kFonts)
        if (std::filesystem::exists(file, ignored) &&
            fonts.AddFontFromFileTTF(file, std::round(pixels), nullptr, kGlyphs.data()))
            return;
    constexpr float kOwnShare = 13.f / 16;  // the built-in font of ImGui is designed for 13 pixels
    ImFontConfig own;
    own.SizePixels = std::round(kOwnShare * pixels);
    fonts.AddFontDefault(&own);
}

void applyStyle(float scale) {
    ImGuiStyle style;
    style.WindowRounding = 6;
    style.ChildRounding = style.FrameRounding = style.PopupRounding = style.GrabRounding = style.TabRounding = 4;
    style.ScrollbarRounding = 8;
    style.WindowPadding = {12, 10};
    style.FramePadding = {8, 4};
    style.ItemSpacing = {8, 7};
    style.ItemInnerSpacing = {7, 5};
    style.IndentSpacing = 18;
    style.GrabMinSize = 12;
    style.ScrollbarSize = 13;
    style.WindowTitleAlign = {0.02f, 0.5f};
    style.ScaleAllSizes(scale);

    // One neutral background in steps of brightness, and one accent color for interactive and active elements.
    const ImVec4 ground{0.090f, 0.098f, 0.112f, 1}, text{0.90f, 0.91f, 0.93f, 1}, accent{0.36f, 0.62f, 0.92f, 1};
    const auto step = [&](float t) { return mix(ground, text, t); };
    const auto tinted = [&](float t) { return mix(ground, accent, t); };
    const auto faded = [](ImVec4 color, float alpha) { return ImVec4(color.x, color.y, color.z, alpha); };
    ImGui::StyleColorsDark(&style);
    ImVec4* c = style.Colors;
    c[ImGuiCol_Text] = text;
    c[ImGuiCol_TextDisabled] = step(0.52f);
    c[ImGuiCol_WindowBg] = faded(ground, 0.94f);
    c[ImGuiCol_PopupBg] = faded(step(0.04f), 0.98f);
    c[ImGuiCol_Border] = faded(text, 0.12f);
    c[ImGuiCol_TitleBg] = c[ImGuiCol_TitleBgCollapsed] = c[ImGuiCol_MenuBarBg] = step(0.04f);
    c[ImGuiCol_TitleBgActive] = step(0.08f);
    c[ImGuiCol_FrameBg] = step(0.08f);
    c[ImGuiCol_FrameBgHovered] = step(0.13f);
    c[ImGuiCol_FrameBgActive] = step(0.17f);
    c[ImGuiCol_ScrollbarBg] = faded(ground, 0);
    c[ImGuiCol_ScrollbarGrab] = step(0.2f);
    c[ImGuiCol_ScrollbarGrabHovered] = step(0.28f);
    c[ImGuiCol_ScrollbarGrabActive] = step(0.36f);
    c[ImGuiCol_CheckMark] = c[ImGuiCol_SliderGrabActive] = accent;
    c[ImGuiCol_SliderGrab] = tinted(0.8f);
    c[ImGuiCol_Button] = c[ImGuiCol_Header] = c[ImGuiCol_Tab] = tinted(0.3f);
    c[ImGuiCol_ButtonHovered] = c[ImGuiCol_HeaderHovered] = c[ImGuiCol_TabHovered] = tinted(0.45f);
    c[ImGuiCol_ButtonActive] = c[ImGuiCol_HeaderActive] = c[ImGuiCol_TabActive] = tinted(0.58f);
    c[ImGuiCol_Separator] = faded(text, 0.12f);
    c[ImGuiCol_ResizeGrip] = faded(accent, 0.15f);
    c[ImGuiCol_PlotHistogram] = accent;  // also used for progress bars
    c[ImGuiCol_TextSelectedBg] = faded(accent, 0.4f);
    c[ImGuiCol_NavHighlight] = accent;
    ImGui::GetStyle() = style;
    constexpr float kFontSize = 16;  // pixels
    addSansFont(*ImGui::GetIO().Fonts, kFontSize * scale);
}

}  // namespace touchstone::engine
