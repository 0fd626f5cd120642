#pragma once
// A list of folders and files to choose a file from.
#include <imgui.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/ui/widgets.hpp"

namespace touchstone::engine {

class FileBrowser {
  public:
    /// `extensions`: of the files that are listed, as ".glb".
    explicit FileBrowser(std::vector<std::string> extensions) : extensions_(std::move(extensions)) {}

    /// Lists a folder, or its nearest parent that exists; an empty or relative path from the current folder.
    void enter(const std::filesystem::path& folder);
    const std::filesystem::path& folder() const { return folder_; }
    /// The file that is selected; empty if none is.
    std::filesystem::path selected() const;

    /// Draws the folder's name, a button to its parent, and the list. A click enters a folder or selects a file; up,
    /// down, Enter and Backspace do the same unless text is being typed. Returns the file that a double click or Enter
    /// chose. Call enter() before.
    std::optional<std::filesystem::path> draw(ImVec2 size, ItemRects* items);

  private:
    struct Entry {
        std::filesystem::path path;
        bool isFolder = false;
    };
    bool handleKeys(bool& moved);

    std::vector<std::string> extensions_;
    std::filesystem::path folder_;
    std::vector<Entry> entries_;
    int at_ = -1;          ///< selected entry; -1: none
    std::string problem_;  ///< why the folder cannot be read
};

}  // namespace touchstone::engine
