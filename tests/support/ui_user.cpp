#include "tests/support/ui_user.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <thread>

namespace touchstone::test {

using sandbox::WindowFrame;

namespace {

// The window sees a press or a move in a later frame, because system events are delayed.
constexpr int kSeen = 3;
// Frames after which an item may go on moving, or the mouse be outside the window.
constexpr int kPatience = 60;
// How far the mouse may be behind: it is at whole pixels, and an item that moves does not wait for it.
constexpr float kPixel = 1.5f, kMoving = 20;

/// Reports a key as GLFW does.
void report(WindowFrame& frame, int key, int action, int mods = 0) {
    GLFWwindow* const window = frame.window.handle();
    const GLFWkeyfun callback = glfwSetKeyCallback(window, nullptr);
    glfwSetKeyCallback(window, callback);
    callback(window, key, 0, action, mods);
}

}  // namespace

bool hasDisplay() {
    if (std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY")) return true;
    WARN("skipped: there is no display; run the tests under xvfb-run");
    return false;
}

sandbox::WindowRunOptions optionsFor(const std::filesystem::path& scene) {
    sandbox::WindowRunOptions options;
    options.scene = scene;
    options.session.treeCache.clear();
    options.session.loop.realTime.raise = false;
    options.window.width = 1280;
    options.window.height = 800;
    options.window.vsync = false;
    options.seconds = 90;  // many times the usual time: sanitizers and busy machines are slow
    return options;
}

Place onItem(const std::string& name, float share) {
    return [=](WindowFrame& frame) -> std::optional<glm::vec2> {
        const auto found = frame.items.find(name);
        if (found == frame.items.end()) return std::nullopt;
        const glm::vec4 r = found->second;
        return glm::vec2(r.x + share * (r.z - r.x), 0.5f * (r.y + r.w));
    };
}

std::optional<glm::vec2> inSettings(WindowFrame& frame) { return glm::vec2(100, frame.picture.w - 20); }

User& User::then(Step step) {
    steps_.push_back(std::move(step));
    return *this;
}

User& User::until(const std::function<bool(WindowFrame&)>& holds) {
    return then([=](WindowFrame& frame, int) { return holds(frame); });
}

User& User::doing(const std::function<void(WindowFrame&)>& what) {
    return then([=](WindowFrame& frame, int) {
        what(frame);
        return true;
    });
}

User& User::hold(const Place& place) {
    until([=](WindowFrame& frame) { return place(frame).has_value(); });
    // An item that has just appeared may still move, and a busy machine is late with the mouse.
    then([=, this](WindowFrame& frame, int frames) {
        const glm::vec2 target = place(frame).value_or(cursor_);
        still_ = glm::distance(target, cursor_) < kPixel && seesCursor(kPixel) ? still_ + 1 : 0;
        cursor_ = target;
        return still_ >= kSeen || (frames > kPatience && seesCursor(kMoving));
    });
    return then([this](WindowFrame&, int frames) {
        down_ = true;
        return frames > kSeen && ImGui::GetIO().MouseDown[0];
    });
}

User& User::moveTo(const Place& place, int duration) {
    return then([=, this](WindowFrame& frame, int frames) {
        if (frames == 1) {
            from_ = cursor_;
            to_ = place(frame).value_or(cursor_);
        }
        cursor_ = glm::mix(from_, to_, std::min(static_cast<float>(frames) / static_cast<float>(duration), 1.f));
        return frames >= duration && (seesCursor(kPixel) || frames > kPatience);
    });
}

User& User::moveBy(glm::vec2 pixels) {
    return moveTo([=, this](WindowFrame&) { return cursor_ + pixels; });
}

User& User::release() {
    return then([this](WindowFrame&, int frames) {
        down_ = frames <= kSeen;
        return frames > 2 * kSeen && !ImGui::GetIO().MouseDown[0];
    });
}

User& User::wheel(const Place& place, float lines) {
    return moveTo(place).then([=](WindowFrame& frame, int frames) {
        if (frames == 1) ImGui_ImplGlfw_ScrollCallback(frame.window.handle(), 0, static_cast<double>(lines));
        return frames > kSeen;
    });
}

bool User::seesCursor(float within) const {
    const ImVec2 seen = ImGui::GetIO().MousePos;
    return glm::distance(glm::vec2(seen.x, seen.y), cursor_) < within;
}

User& User::click(const Place& place) { return hold(place).release(); }

User& User::drag(const Place& from, const Place& to) { return hold(from).moveTo(to).release(); }

User& User::key(int key, bool control) {
    return then([=](WindowFrame& frame, int frames) {
        const int action = frames <= kSeen ? GLFW_PRESS : GLFW_RELEASE;
        const int mods = action == GLFW_PRESS && control ? GLFW_MOD_CONTROL : 0;
        if (frames != 1 && frames != kSeen + 1) return frames > 2 * kSeen;
        if (control) report(frame, GLFW_KEY_LEFT_CONTROL, action, mods);
        report(frame, key, action, mods);
        return false;
    });
}

User& User::tap(int key) {
    return then([=](WindowFrame& frame, int frames) {
        if (frames == 1) {
            report(frame, key, GLFW_PRESS);
            std::this_thread::sleep_for(std::chrono::milliseconds(12));
            report(frame, key, GLFW_RELEASE);
        }
        return frames > kSeen;
    });
}

User& User::drop(const std::filesystem::path& file) {
    return doing([=](WindowFrame& frame) {
        // As GLFW passes on a drop.
        const char* paths[] = {file.c_str()};
        const GLFWdropfun callback = glfwSetDropCallback(frame.window.handle(), nullptr);
        glfwSetDropCallback(frame.window.handle(), callback);
        callback(frame.window.handle(), 1, paths);
    });
}

bool User::use(sandbox::WindowRunOptions options) {
    options.onFrame = [this, watch = std::move(options.onFrame)](WindowFrame& frame) {
        if (watch) watch(frame);
        act(frame);
    };
    CHECK(runWindow(options) == 0);
    UNSCOPED_INFO("took " << at_ << " of " << steps_.size() << " steps");
    return at_ == steps_.size();
}

void User::act(WindowFrame& frame) {
    if (at_ < steps_.size() && steps_[at_](frame, ++frames_)) {
        ++at_;
        frames_ = 0;
    }
    if (at_ == steps_.size()) frame.window.close();
    glfwSetCursorPos(frame.window.handle(), static_cast<double>(cursor_.x), static_cast<double>(cursor_.y));
    // The back end forgets a press after a frame unless the system says that the button is still down.
    if (down_) ImGui_ImplGlfw_MouseButtonCallback(frame.window.handle(), GLFW_MOUSE_BUTTON_LEFT, GLFW_PRESS, 0);
}

}  // namespace touchstone::test
