#include "haptics/sandbox/app/open_dialog.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "engine/scene/mesh_file.hpp"
#include "engine/scene/step_file.hpp"
#include "engine/ui/user_files.hpp"
#include "haptics/sandbox/session/presets.hpp"

namespace touchstone::sandbox {
namespace {

namespace fs = std::filesystem;

/// The files that the dialog lists: scenes and parts.
std::vector<std::string> extensions() {
    std::vector<std::string> all{".glb", ".gltf", ".step", ".stp"};
    for (const std::string_view mesh : engine::meshExtensions()) all.emplace_back(mesh);
    return all;
}

}  // namespace

OpenDialog::OpenDialog(fs::path configFolder, fs::path cacheFolder)
    : configFolder_(std::move(configFolder)), cards_(std::move(cacheFolder)), browser_(extensions()) {}

void OpenDialog::drawPicture(const fs::path& scene, const SceneCard& card, ImVec2 low, ImVec2 size) {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const ImVec2 high{low.x + size.x, low.y + size.y};
    list.AddRectFilled(low, high, ImGui::GetColorU32(ImGuiCol_FrameBg), 3);
    if (card.picture.rgba.empty()) return;
    auto texture = textures_.find(scene);
    if (texture == textures_.end()) texture = textures_.try_emplace(scene, card.picture, false).first;
    list.AddImageRounded(reinterpret_cast<ImTextureID>(static_cast<std::uintptr_t>(texture->second.id())), low, high,
                         {0, 0}, {1, 1}, IM_COL32_WHITE, 3);
}

void OpenDialog::drawBundled(const MenuView& view, ImVec2 size, engine::ItemRects* items) {
    const float em = ImGui::GetFontSize();
    const ImVec2 picture{8 * em, 5 * em};
    ImGui::BeginChild("scenes", size, true);
    if (view.scenes.empty()) ImGui::TextDisabled("No scenes were found.");
    for (const fs::path& scene : view.scenes) {
        ImGui::PushID(scene.c_str());
        const ImVec2 low = ImGui::GetCursorScreenPos();
        if (ImGui::Selectable("##scene", false, 0, {0, picture.y + 0.4f * em})) choose(scene);
        engine::noteItem(items, "open " + scene.stem().string());
        if (ImGui::IsItemVisible()) {
            const auto card = cards_.find(scene);
            drawPicture(scene, *card, {low.x, low.y + 0.2f * em}, picture);
            ImDrawList& list = *ImGui::GetWindowDrawList();
            const ImVec2 text{low.x + picture.x + 0.7f * em, low.y + 0.3f * em};
            const float width = ImGui::GetWindowPos().x + ImGui::GetWindowContentRegionMax().x - text.x;
            list.AddText(text, ImGui::GetColorU32(ImGuiCol_Text), scene.stem().c_str());
            list.AddText(nullptr, 0, {text.x, text.y + 1.2f * em}, ImGui::GetColorU32(ImGuiCol_TextDisabled),
                         card->text.c_str(), nullptr, width);
        }
        ImGui::PopID();
    }
    ImGui::EndChild();
}

void OpenDialog::drawFiles(const MenuView& view, MenuState& state, ImVec2 size, engine::ItemRects* items) {
    const float em = ImGui::GetFontSize(), line = ImGui::GetTextLineHeightWithSpacing();
    ImGui::BeginChild("own", size);
    if (!view.recent.empty()) {
        ImGui::TextDisabled("Recent");
        const auto rows = static_cast<float>(std::min<std::size_t>(view.recent.size(), 4));
        ImGui::BeginChild("recent", {0, (rows + 0.6f) * line}, true);
        for (const fs::path& scene : view.recent) {
            ImGui::PushID(scene.c_str());
            if (ImGui::Selectable(scene.filename().c_str())) choose(scene);
            engine::noteItem(items, "recent " + scene.stem().string());
            engine::tooltip(scene.string());
            ImGui::PopID();
        }
        ImGui::EndChild();
    }
    ImGui::TextDisabled("Files");
    const float below = 5.4f * em + ImGui::GetFrameHeightWithSpacing();
    const float list = ImGui::GetContentRegionAvail().y - ImGui::GetFrameHeightWithSpacing() - below;
    if (const auto file = browser_.draw({0, std::max(list, 4 * line)}, items)) choose(*file);

    const fs::path file = browser_.selected();
    if (file != shown_) {
        shown_ = file;
        if (!file.empty()) std::snprintf(state.openPath.data(), state.openPath.size(), "%s", file.c_str());
    }
    if (!file.empty() && engine::isStepFile(file)) {
        ImGui::TextWrapped("The parts of a STEP file open as a scene, in which you choose the tool and its obstacles.");
        engine::noteItem(items, "file text");
    } else if (!file.empty() && !engine::isMeshFile(file)) {
        const ImVec2 low = ImGui::GetCursorScreenPos(), picture{8 * em, 5 * em};
        const auto card = cards_.find(file);
        drawPicture(file, *card, low, picture);
        ImGui::SetCursorPosX(ImGui::GetCursorPosX() + picture.x + 0.7f * em);
        ImGui::TextWrapped("%s", card->text.c_str());
        engine::noteItem(items, "file text");
    } else if (!file.empty()) {
        ImGui::TextWrapped(
            "A mesh is one part: touchstone new --tool %s --obstacle OTHER -o SCENE.glb makes a scene of two.",
            shellQuoted(file.string()).c_str());
        engine::noteItem(items, "file text");
    }
    ImGui::SetCursorPosY(ImGui::GetWindowHeight() - ImGui::GetFrameHeight());
    ImGui::SetNextItemWidth(-9 * em);
    bool confirmed = ImGui::InputText("##open path", state.openPath.data(), state.openPath.size(),
                                      ImGuiInputTextFlags_EnterReturnsTrue);
    engine::noteItem(items, "##open path");
    engine::tooltip(
        "Path of a .glb, .gltf or .step file, or of a folder to list. You can also drop a file on the window.");
    ImGui::SameLine();
    confirmed |= ImGui::Button("Open");
    engine::noteItem(items, "Open");
    ImGui::SameLine();
    if (ImGui::Button("Cancel")) ImGui::CloseCurrentPopup();
    if (confirmed && state.openPath[0] != '\0') {
        std::error_code error;
        if (const fs::path path = state.openPath.data(); fs::is_directory(path, error))
            browser_.enter(path);
        else
            choose(path);
    }
    ImGui::EndChild();
}

void OpenDialog::draw(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items) {
    if (state.openDialog) {  // lists the folder again
        browser_.enter(browser_.folder().empty() ? engine::browsedFolder(configFolder_) : browser_.folder());
        shown_.clear();
    }
    if (!beginDialog("Open a scene", state.openDialog)) return;
    const float em = ImGui::GetFontSize();
    const ImVec2 window = ImGui::GetMainViewport()->WorkSize;
    const float height = std::min(32 * em, window.y - 8 * em), width = std::min(30 * em, 0.5f * window.x - 3 * em);
    drawBundled(view, {width, height}, items);
    ImGui::SameLine();
    drawFiles(view, state, {width, height}, items);
    if (const fs::path scene = std::exchange(chosen_, {}); !scene.empty() && !engine::isMeshFile(scene)) {
        requests.open = scene;
        if (scene.parent_path() == browser_.folder()) engine::keepFolder(configFolder_, browser_.folder());
        ImGui::CloseCurrentPopup();
    }
    ImGui::EndPopup();
}

}  // namespace touchstone::sandbox
