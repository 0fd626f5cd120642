#include "engine/ui/file_browser.hpp"

#include <algorithm>
#include <utility>

namespace touchstone::engine {

namespace fs = std::filesystem;

void FileBrowser::enter(const fs::path& folder) {
    std::error_code error;
    const fs::path from = folder_;
    folder_ = fs::absolute(folder.empty() ? fs::path(".") : folder, error).lexically_normal();
    if (!folder_.has_filename()) folder_ = folder_.parent_path();  // without the last slash
    while (!fs::is_directory(folder_, error) && folder_.has_relative_path()) folder_ = folder_.parent_path();
    entries_.clear();
    at_ = -1;
    fs::directory_iterator all(folder_, error);
    problem_ = error ? "This folder cannot be read: " + error.message() : "";
    for (; !error && all != fs::directory_iterator(); all.increment(error)) {
        const fs::path& path = all->path();
        if (path.filename().string().starts_with('.')) continue;
        std::error_code ignored;
        const bool isFolder = all->is_directory(ignored);
        if (isFolder || std::find(extensions_.begin(), extensions_.end(), path.extension()) != extensions_.end())
            entries_.push_back({path, isFolder});
    }
    std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) {
        return std::pair(!a.isFolder, a.path) < std::pair(!b.isFolder, b.path);
    });
    for (std::size_t i = 0; i < entries_.size(); ++i)  // on the way up, the folder that was left
        if (entries_[i].path == from) at_ = static_cast<int>(i);
}

fs::path FileBrowser::selected() const {
    if (at_ < 0 || entries_[static_cast<std::size_t>(at_)].isFolder) return {};
    return entries_[static_cast<std::size_t>(at_)].path;
}

/// Returns true when Enter was pressed on the selected entry.
bool FileBrowser::handleKeys(bool& moved) {
    if (ImGui::GetIO().WantTextInput) return false;
    const auto pressed = [](ImGuiKey key) { return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key)); };
    const int last = static_cast<int>(entries_.size()) - 1, before = at_;
    if (pressed(ImGuiKey_DownArrow)) at_ = std::min(at_ + 1, last);
    if (pressed(ImGuiKey_UpArrow)) at_ = std::max(at_ - 1, std::min(0, last));
    moved = at_ != before;
    if (pressed(ImGuiKey_Backspace)) enter(folder_.parent_path());
    return at_ >= 0 && (pressed(ImGuiKey_Enter) || pressed(ImGuiKey_KeyPadEnter));
}

std::optional<fs::path> FileBrowser::draw(ImVec2 size, ItemRects* items) {
    const fs::path* next = nullptr;
    const fs::path above = folder_.parent_path();
    if (ImGui::Button("Up")) next = &above;
    noteItem(items, "folder up");
    tooltip("To the folder above. Key Backspace.");
    ImGui::SameLine();
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(folder_.c_str());

    std::optional<fs::path> chosen;
    bool moved = false;
    const bool enter = handleKeys(moved);
    ImGui::BeginChild("files", size, true);
    if (!problem_.empty())
        ImGui::TextWrapped("%s", problem_.c_str());
    else if (entries_.empty())
        ImGui::TextDisabled("There are no scenes or meshes here.");
    for (int i = 0; i < static_cast<int>(entries_.size()); ++i) {
        const Entry& entry = entries_[static_cast<std::size_t>(i)];
        const std::string name = entry.path.filename().string() + (entry.isFolder ? "/" : "");
        const bool clicked = ImGui::Selectable(
            name.c_str(), i == at_, ImGuiSelectableFlags_DontClosePopups | ImGuiSelectableFlags_AllowDoubleClick);
        noteItem(items, "file " + name);
        if (i == at_ && moved) ImGui::SetScrollHereY();
        if (clicked) at_ = i;
        if (!(clicked || (enter && i == at_))) continue;
        if (entry.isFolder)
            next = &entry.path;
        else if (!clicked || ImGui::IsMouseDoubleClicked(0))
            chosen = entry.path;
    }
    ImGui::EndChild();
    if (next) this->enter(fs::path(*next));
    return chosen;
}

}  // namespace touchstone::engine
