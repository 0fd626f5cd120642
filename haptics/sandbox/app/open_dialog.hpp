#pragma once
// The dialog that opens a scene: the bundled scenes with pictures, the recent ones, and a file browser.
#include <filesystem>
#include <map>

#include "engine/ui/file_browser.hpp"
#include "engine/view/gl_objects.hpp"
#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/picture/scene_cards.hpp"

namespace touchstone::sandbox {

class OpenDialog {
  public:
    /// `configFolder` keeps the last folder, `cacheFolder` the pictures; either may be empty.
    OpenDialog(std::filesystem::path configFolder, std::filesystem::path cacheFolder);

    /// Draws the dialog requested in `state`. Call it where drawDialogs() is called.
    void draw(const MenuView& view, MenuState& state, PanelRequests& requests, engine::ItemRects* items);

  private:
    void drawBundled(const MenuView& view, ImVec2 size, engine::ItemRects* items);
    void drawFiles(const MenuView& view, MenuState& state, ImVec2 size, engine::ItemRects* items);
    /// Draws the picture of a scene, as far as it is made.
    void drawPicture(const std::filesystem::path& scene, const SceneCard& card, ImVec2 low, ImVec2 size);
    void choose(std::filesystem::path scene) { chosen_ = std::move(scene); }

    const std::filesystem::path configFolder_;
    SceneCards cards_;
    engine::FileBrowser browser_;
    std::map<std::filesystem::path, engine::Texture> textures_;
    std::filesystem::path chosen_, shown_;  ///< shown_: the file whose path the text field has
};

}  // namespace touchstone::sandbox
