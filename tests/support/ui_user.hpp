#pragma once
// A user of the real window, who sees what is drawn and acts through GLFW's cursor and its callbacks.
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "haptics/sandbox/app/app_window.hpp"

namespace touchstone::test {

/// False, with a warning, where no window can be opened.
bool hasDisplay();

/// Options for a window on the scene that fails rather than hangs: it closes by itself after a while.
sandbox::WindowRunOptions optionsFor(const std::filesystem::path& scene);

/// A point of the window, nothing while it is not to be seen.
using Place = std::function<std::optional<glm::vec2>(sandbox::WindowFrame&)>;
/// On a control, at a share of its width.
Place onItem(const std::string& name, float share = 0.5f);

/// Takes one step after the other, each as often as it says no, once a frame.
class User {
  public:
    /// `frames`: since the step before, from 1.
    using Step = std::function<bool(sandbox::WindowFrame&, int frames)>;

    User& then(Step step);
    User& until(const std::function<bool(sandbox::WindowFrame&)>& holds);
    User& doing(const std::function<void(sandbox::WindowFrame&)>& what);

    User& hold(const Place& place);  ///< waits for the place, moves there, and presses the left button
    User& moveTo(const Place& place);
    User& moveBy(glm::vec2 pixels);
    User& release();
    User& click(const Place& place);
    User& click(const std::string& item) { return click(onItem(item)); }
    User& drag(const Place& from, const Place& to);
    User& key(int key, bool control = false);
    User& drop(const std::filesystem::path& file);  ///< on the window

    /// Runs the window until all steps are taken, which closes it, or it closes by itself. Whether all were taken.
    /// Of the options, onFrame sees each frame first.
    bool use(sandbox::WindowRunOptions options);

  private:
    void act(sandbox::WindowFrame& frame);

    std::vector<Step> steps_;
    std::size_t at_ = 0;
    int frames_ = 0;
    glm::vec2 cursor_{10, 10}, from_{0}, to_{0};
    bool down_ = false;
};

}  // namespace touchstone::test
