#include "haptics/sandbox/app/open_dialog.hpp"

#include <imgui.h>

#include <algorithm>

namespace touchstone::sandbox {

void drawOpenDialog(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    if (!beginDialog("Open a scene", state.openDialog)) return;
    const auto rows =
        static_cast<float>(std::clamp(view.scenes.size() + view.recent.size(), std::size_t{2}, std::size_t{16}));
    ImGui::BeginChild("scenes", {36 * ImGui::GetFontSize(), (rows + 1) * ImGui::GetTextLineHeightWithSpacing()}, true);
    for (const std::filesystem::path& scene : view.scenes) {
        ImGui::PushID(scene.c_str());
        if (ImGui::Selectable(scene.stem().c_str())) {
            requests.open = scene;
            ImGui::CloseCurrentPopup();
        }
        engine::noteItem(items, "open " + scene.stem().string());
        engine::tooltip(scene.string());
        ImGui::PopID();
    }
    if (!view.recent.empty()) ImGui::TextDisabled("Recent");
    for (const std::filesystem::path& scene : view.recent) {
        ImGui::PushID(("recent " + scene.string()).c_str());
        if (ImGui::Selectable(scene.c_str())) {
            requests.open = scene;
            ImGui::CloseCurrentPopup();
        }
        engine::noteItem(items, "recent " + scene.stem().string());
        ImGui::PopID();
    }
    if (view.scenes.empty() && view.recent.empty()) ImGui::TextDisabled("No scenes were found.");
    ImGui::EndChild();
    ImGui::TextDisabled("Or type the path of a .glb or .gltf file, or drop a file on the window.");
    if (drawPathInput("##open path", state.openPath, "Open", items)) requests.open = state.openPath.data();
    ImGui::EndPopup();
}

}  // namespace touchstone::sandbox
