#pragma once
// The application's window: GLFW, an OpenGL 3.3 core context and ImGui on top of it.
#include <filesystem>
#include <functional>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/mesh_data.hpp"

struct GLFWwindow;

namespace touchstone::engine {

struct WindowOptions {
    std::string title = "Touchstone";
    int width = 1280, height = 800;  ///< client area in screen units, before the monitor's scale
    std::optional<float> uiScale{};  ///< of text and controls, and so of the window; the monitor's scale if absent
    bool vsync = true;
    bool visible = true;
};

/// A window with a current OpenGL 3.3 core context and an ImGui context (dark style, font scaled by scale()).
/// Only one window at a time, used from the thread that created it. beginFrame() makes its context current again if a
/// HeadlessContext was used in between. Each frame:
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
    /// Exceptions of the drop handler propagate from here.
    bool beginFrame();

    /// Draws ImGui and swaps the buffers. `picture`, if given, receives the finished frame, read before the swap.
    void endFrame(Image* picture = nullptr);

    bool drawsInSoftware() const;    ///< no graphics card draws
    int interfaceDrawCalls() const;  ///< draw calls of ImGui in the last frame

    void close();  ///< makes the next beginFrame() return false
    /// The handler is called from beginFrame() instead of closing when the user requests to close the window.
    void onClose(std::function<void()> handler);
    void setTitle(const std::string& title);
    void setVsync(bool on);
    void onDrop(DropHandler handler);  ///< called from beginFrame() with the files dropped on the window

    glm::ivec2 framebufferSize() const;  ///< pixels; 0 x 0 while minimized
    glm::ivec2 size() const;             ///< screen units, as ImGui's mouse position
    void setSize(glm::ivec2 size);       ///< screen units; the system may choose another size
    float scale() const;                 ///< of text and controls; from the monitor, 1 for 96 dots per inch
    GLFWwindow* handle() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace touchstone::engine
