#pragma once
// A simulated user of the real window, who sees what is drawn and acts through GLFW's cursor and callbacks.
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "haptics/sandbox/app/app_window.hpp"

namespace touchstone::test {

/// False, with a warning, if no window can be opened.
bool hasDisplay();

/// Options for a window on the scene that closes by itself after a time limit, so that a test fails instead of hanging.
sandbox::WindowRunOptions optionsFor(const std::filesystem::path& scene);

/// A point of the window; nothing while it is not visible.
using Place = std::function<std::optional<glm::vec2>(sandbox::WindowFrame&)>;
/// A point on a control, at a share of its width.
Place onItem(const std::string& name, float share = 0.5f);
/// A point in the settings, to scroll them.
std::optional<glm::vec2> inSettings(sandbox::WindowFrame& frame);

/// Runs one step after the other; repeats each once a frame until it returns true.
class User {
  public:
    /// `frames`: since the previous step, from 1.
    using Step = std::function<bool(sandbox::WindowFrame&, int frames)>;

    User& then(Step step);
    User& until(const std::function<bool(sandbox::WindowFrame&)>& holds);
    User& doing(const std::function<void(sandbox::WindowFrame&)>& what);

    User& hold(const Place& place);  ///< waits for the place, moves there, and presses the left button
    User& moveTo(const Place& place, int duration = 8);  ///< frames
    User& moveBy(glm::vec2 pixels);
    User& release();
    User& click(const Place& place);
    User& click(const std::string& item) { return click(onItem(item)); }
    User& drag(const Place& from, const Place& to);
    User& wheel(const Place& place, float lines);  ///< up if positive; stops at the ends
    User& key(int key, bool control = false);
    User& tap(int key);                             ///< for 12 ms, within one frame
    User& drop(const std::filesystem::path& file);  ///< on the window

    /// Runs the window until all steps are done, which closes it, or until it closes by itself. Returns whether all
    /// steps were done. The options' onFrame sees each frame first.
    bool use(sandbox::WindowRunOptions options);

  private:
    void act(sandbox::WindowFrame& frame);
    bool seesCursor(float within) const;

    std::vector<Step> steps_;
    std::size_t at_ = 0;
    int frames_ = 0, still_ = 0;
    glm::vec2 cursor_{10, 10}, from_{0}, to_{0};
    bool down_ = false;
};

}  // namespace touchstone::test
