#include "engine/view/window.hpp"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "engine/view/gl_context.hpp"
#include "engine/view/style.hpp"

namespace touchstone::engine {
namespace {

/// GLFW's description of its last error, e.g. "X11: The DISPLAY environment variable is missing".
std::string glfwReason() {
    const char* text = nullptr;
    glfwGetError(&text);
    return text ? text : "unknown reason";
}

/// Initializes GLFW once for the life of the process. It is never terminated, since graphics drivers leak when they are
/// unloaded and loaded again.
void startGlfw() {
    if (!glfwInit())
        throw std::runtime_error("No window can be opened (" + glfwReason() +
                                 "); set DISPLAY to a running X server, use xvfb-run, or run headless.");
}

/// A size that fits on the monitor.
glm::ivec2 onMonitor(glm::ivec2 size) {
    glm::ivec2 room(0);
    if (GLFWmonitor* monitor = glfwGetPrimaryMonitor())
        glfwGetMonitorWorkarea(monitor, nullptr, nullptr, &room.x, &room.y);
    return room.x > 0 && room.y > 0 ? glm::min(size, room) : size;
}

/// The window's size: with a chosen scale it grows like its text, up to the size of the monitor.
glm::ivec2 sizeOf(const WindowOptions& options) {
    const glm::ivec2 size(options.width, options.height);
    return onMonitor(options.uiScale ? glm::ivec2(glm::vec2(size) * std::max(*options.uiScale, 1.f)) : size);
}

struct GlfwWindow {
    explicit GlfwWindow(const WindowOptions& options) {
        startGlfw();
        glfwDefaultWindowHints();  // hints are global: reset those of another window
        glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
        glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
        glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
        glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
        glfwWindowHint(GLFW_SCALE_TO_MONITOR, options.uiScale ? GLFW_FALSE : GLFW_TRUE);
        glfwWindowHint(GLFW_VISIBLE, options.visible ? GLFW_TRUE : GLFW_FALSE);
        releaseCurrentContext();  // glfwCreateWindow() makes the new context current for a moment
        const glm::ivec2 size = sizeOf(options);
        handle = glfwCreateWindow(size.x, size.y, options.title.c_str(), nullptr, nullptr);
        if (!handle)
            throw std::runtime_error("No window with OpenGL 3.3 can be opened (" + glfwReason() +
                                     "); install a graphics driver (Debian: apt-get install libgl1-mesa-dri) or run "
                                     "headless.");
        makeCurrent();
        glfwSwapInterval(options.vsync ? 1 : 0);
    }
    ~GlfwWindow() { glfwDestroyWindow(handle); }

    /// Makes the context current again if a headless context has replaced it.
    void makeCurrent() {
        if (glfwGetCurrentContext() == handle) return;
        releaseCurrentContext();
        glfwMakeContextCurrent(handle);
    }

    GLFWwindow* handle = nullptr;
};

struct UserInterface {
    explicit UserInterface(GLFWwindow* window, float scale) {
        IMGUI_CHECKVERSION();
        ImGui::CreateContext();
        ImGui::GetIO().IniFilename = nullptr;
        applyStyle(scale);
        ImGui_ImplGlfw_InitForOpenGL(window, true);
        ImGui_ImplOpenGL3_Init("#version 330 core");
    }
    ~UserInterface() {
        ImGui_ImplOpenGL3_Shutdown();
        ImGui_ImplGlfw_Shutdown();
        ImGui::DestroyContext();
    }
};

/// A key or a character that the system has reported.
struct KeyEvent {
    int key = 0, scancode = 0, action = 0, mods = 0;
    unsigned character = 0;  ///< 0: a key
};

bool isModifier(int key) { return key >= GLFW_KEY_LEFT_SHIFT && key <= GLFW_KEY_RIGHT_SUPER; }

/// Scale of the user interface in screen units. Some systems give the monitor's scale to the framebuffer already.
float interfaceScale(GLFWwindow* window, const std::optional<float>& chosen) {
    if (chosen) return *chosen;
    float x = 1, y = 1;
    glfwGetWindowContentScale(window, &x, &y);
    int pixels = 0, units = 0;
    glfwGetFramebufferSize(window, &pixels, nullptr);
    glfwGetWindowSize(window, &units, nullptr);
    if (pixels > 0 && units > 0) x *= static_cast<float>(units) / static_cast<float>(pixels);
    return x > 0 ? x : 1;
}

}  // namespace

struct Window::Impl {
    explicit Impl(const WindowOptions& options)
        : window(options), uiScale(options.uiScale), interface(window.handle, interfaceScale(window.handle, uiScale)) {
        glfwSetWindowUserPointer(window.handle, this);
        glfwSetDropCallback(window.handle, [](GLFWwindow* handle, int count, const char** paths) {
            auto& self = *static_cast<Impl*>(glfwGetWindowUserPointer(handle));
            self.dropped.insert(self.dropped.end(), paths, paths + count);
        });
        glfwSetWindowCloseCallback(window.handle, [](GLFWwindow* handle) {
            auto& self = *static_cast<Impl*>(glfwGetWindowUserPointer(handle));
            self.closeRequested = self.closeHandler != nullptr;
            if (self.closeRequested) glfwSetWindowShouldClose(handle, GLFW_FALSE);
        });
        // Instead of ImGui's own callbacks: they keep only the last state of a key before a frame.
        glfwSetKeyCallback(window.handle, [](GLFWwindow* handle, int key, int scancode, int action, int mods) {
            static_cast<Impl*>(glfwGetWindowUserPointer(handle))->keys.push_back({key, scancode, action, mods});
        });
        glfwSetCharCallback(window.handle, [](GLFWwindow* handle, unsigned character) {
            static_cast<Impl*>(glfwGetWindowUserPointer(handle))->keys.push_back({.character = character});
        });
    }

    /// Hands the reported keys to ImGui. A second event of a key waits for the next frame, and so does a modifier after
    /// another key: a tap shorter than a frame is seen, and with the modifiers that were down.
    void takeKeys() {
        std::vector<int> changed;
        std::size_t taken = 0;
        for (; taken < keys.size(); ++taken) {
            const KeyEvent& event = keys[taken];
            if (event.character != 0) {
                ImGui_ImplGlfw_CharCallback(window.handle, event.character);
                continue;
            }
            const bool again = std::find(changed.begin(), changed.end(), event.key) != changed.end();
            if (event.action != GLFW_REPEAT && (again || (isModifier(event.key) && !changed.empty()))) break;
            ImGui_ImplGlfw_KeyCallback(window.handle, event.key, event.scancode, event.action, event.mods);
            if (!isModifier(event.key)) changed.push_back(event.key);
        }
        keys.erase(keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(taken));
    }

    GlfwWindow window;
    std::optional<float> uiScale;
    UserInterface interface;
    bool software = engine::drawsInSoftware();
    DropHandler dropHandler;
    std::vector<std::filesystem::path> dropped;
    std::vector<KeyEvent> keys;  // not yet seen by ImGui
    std::function<void()> closeHandler;
    bool closeRequested = false;
};

Window::Window(const WindowOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Window::~Window() { impl_->window.makeCurrent(); }  // ImGui deletes its GL objects in this context

bool Window::beginFrame() {
    impl_->window.makeCurrent();
    glfwPollEvents();
    if (glfwWindowShouldClose(handle())) return false;
    // Handled here rather than in GLFW's callbacks, because exceptions must not propagate through C code.
    if (const auto files = std::exchange(impl_->dropped, {}); !files.empty() && impl_->dropHandler)
        impl_->dropHandler(files);
    if (std::exchange(impl_->closeRequested, false)) impl_->closeHandler();

    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glDisable(GL_SCISSOR_TEST);
    glClearColor(0.06f, 0.065f, 0.075f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    impl_->takeKeys();
    ImGui_ImplOpenGL3_NewFrame();
    ImGui_ImplGlfw_NewFrame();
    ImGui::NewFrame();
    return true;
}

void Window::endFrame(Image* picture) {
    ImGui::Render();
    const glm::ivec2 pixels = framebufferSize();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, pixels.x, pixels.y);
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
    if (picture) {
        glReadBuffer(GL_BACK);  // after the swap its content would be undefined
        *picture = readPixels(pixels.x, pixels.y);
    }
    glfwSwapBuffers(handle());
    // Without a card the driver would take several frames before it finishes the first, and an answer comes after them.
    if (impl_->software) glFinish();
}

bool Window::drawsInSoftware() const { return impl_->software; }

int Window::interfaceDrawCalls() const {
    const ImDrawData* data = ImGui::GetDrawData();
    int calls = 0;
    for (int i = 0; data && i < data->CmdListsCount; ++i) calls += data->CmdLists[i]->CmdBuffer.Size;
    return calls;
}

void Window::close() { glfwSetWindowShouldClose(handle(), GLFW_TRUE); }
void Window::setTitle(const std::string& title) { glfwSetWindowTitle(handle(), title.c_str()); }
void Window::setVsync(bool on) { glfwSwapInterval(on ? 1 : 0); }
void Window::onDrop(DropHandler handler) { impl_->dropHandler = std::move(handler); }

void Window::onClose(std::function<void()> handler) { impl_->closeHandler = std::move(handler); }

glm::ivec2 Window::framebufferSize() const {
    glm::ivec2 pixels{0};
    glfwGetFramebufferSize(handle(), &pixels.x, &pixels.y);
    return pixels;
}

glm::ivec2 Window::size() const {
    glm::ivec2 units{0};
    glfwGetWindowSize(handle(), &units.x, &units.y);
    return units;
}

void Window::setSize(glm::ivec2 size) {
    const glm::ivec2 fitting = onMonitor(size);
    glfwSetWindowSize(handle(), fitting.x, fitting.y);
}

float Window::scale() const { return interfaceScale(handle(), impl_->uiScale); }
GLFWwindow* Window::handle() const { return impl_->window.handle; }

}  // namespace touchstone::engine
