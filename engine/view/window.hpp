#pragma once
// The application's window: GLFW, an OpenGL 3.3 core context and ImGui on top of it.
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "engine/scene/mesh_data.hpp"

struct GLFWwindow;

namespace touchstone::engine {

struct WindowOptions {
    std::string title = "Touchstone";
    int width = 1280, height = 800;  ///< client area in screen units, before the monitor's scale
    bool vsync = true;
    bool visible = true;
};

/// A window with a current OpenGL 3.3 core context and an ImGui context (dark style, font scaled by the monitor).
/// One window at a time, used from the thread that made it; beginFrame() takes the thread back from a HeadlessContext
/// that was used since. Each frame:
///     while (window.beginFrame()) { renderer.draw(...); ImGui panels; window.endFrame(); }
/// The constructor throws std::runtime_error with one sentence that names the remedy when there is no display or no
/// OpenGL 3.3. ImGui writes no ini file; set ImGui::GetIO().IniFilename to keep its layout.
class Window {
  public:
    using DropHandler = std::function<void(const std::vector<std::filesystem::path>&)>;

    explicit Window(const WindowOptions& options = {});
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    /// Handles pending events and starts an ImGui frame. Returns false, without a frame, once the window is to close.
    /// Exceptions thrown by the drop handler come out here.
    bool beginFrame();

    /// Draws ImGui and swaps. If picture is given it receives the finished frame, read before the swap.
    void endFrame(Image* picture = nullptr);

    int interfaceDrawCalls() const;  ///< of ImGui in the last frame

    void close();  ///< makes the next beginFrame() return false
    /// Called from beginFrame() in place of closing when the user asks the system to close the window.
    void onClose(std::function<void()> handler);
    void setTitle(const std::string& title);
    void setVsync(bool on);
    void onDrop(DropHandler handler);  ///< called from beginFrame() with the files dropped on the window

    glm::ivec2 framebufferSize() const;  ///< pixels; 0 x 0 while minimised
    glm::ivec2 size() const;             ///< screen units, those of ImGui's mouse position
    void setSize(glm::ivec2 size);       ///< likewise; a wish to the system
    float scale() const;                 ///< content scale of the monitor, 1 for 96 dots an inch
    GLFWwindow* handle() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace touchstone::engine
