// The real window under a (virtual) display, used like a user does: through GLFW's cursor and its callbacks.
#include <catch2/catch.hpp>
#include <cstdlib>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>

#include "engine/view/image_file.hpp"
#include "haptics/system/app_window.hpp"
#include "tests/system/ui_scene.hpp"

using namespace touchstone;
using namespace touchstone::system;
using namespace touchstone::test;

namespace {

bool hasDisplay() {
    if (std::getenv("DISPLAY") || std::getenv("WAYLAND_DISPLAY")) return true;
    WARN("skipped: there is no display; run the tests under xvfb-run");
    return false;
}

/// A user's mouse: where the cursor is to be and whether the button is down, told to GLFW once a frame.
struct UserMouse {
    glm::vec2 at{10, 10};
    bool down = false;
    double wheel = 0;

    void act(engine::Window& window) {
        glfwSetCursorPos(window.handle(), static_cast<double>(at.x), static_cast<double>(at.y));
        // The back end forgets a press after a frame unless the system says that the button is still down.
        if (down) ImGui_ImplGlfw_MouseButtonCallback(window.handle(), GLFW_MOUSE_BUTTON_LEFT, GLFW_PRESS, 0);
        if (wheel != 0) ImGui_ImplGlfw_ScrollCallback(window.handle(), 0, wheel);
        wheel = 0;
    }
};

glm::vec2 middle(const glm::vec4& r) { return {0.5f * (r.x + r.z), 0.5f * (r.y + r.w)}; }

/// Options for a window on the scene that fails rather than hangs: it closes by itself after a while.
WindowRunOptions optionsFor(const std::filesystem::path& scene) {
    WindowRunOptions options;
    options.scene = scene;
    options.session.treeCache.clear();
    options.session.loop.realTime.raise = false;
    options.window.width = 1280;
    options.window.height = 800;
    options.window.vsync = false;
    options.seconds = 30;
    return options;
}

}  // namespace

TEST_CASE("window: dragging the stiffness slider reaches the loop, and the force follows", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.screenshot = folder.path() / "window.png";

    enum { Wait, Move, Press, Drag, Release, Settle, Done } phase = Wait;
    UserMouse hand;
    int frames = 0;
    double before = 0, set = 0;
    /// Force per separation of tool and device, N/mm: the cube is pressed down without turning.
    const auto felt = [](const TickRecord& record) {
        const double apart = (record.X_WT.p - record.X_WT_device.p).norm();
        return apart > 0.5 ? record.wrench_C.force.norm() / apart : 0;
    };
    options.onFrame = [&](WindowFrame& frame) {
        LiveSession& session = frame.session;
        const auto slider = frame.items.find("stiffness");
        ++frames;
        switch (phase) {
            case Wait:  // until the demonstration has come to rest in the contact
                if (!session.running() || !session.snapshot()->finished || slider == frame.items.end()) break;
                before = felt(*session.record());
                hand.at = middle(slider->second);
                phase = Move, frames = 0;
                break;
            case Move:
                if (frames >= 3) hand.down = true, phase = Press, frames = 0;
                break;
            case Press:
                if (frames >= 3) phase = Drag;
                break;
            case Drag:  // eight steps to the right, towards 80 percent of the slider
                hand.at.x += 0.3f * (slider->second.z - slider->second.x) / 8;
                if (frames >= 11) phase = Release, frames = 0;
                break;
            case Release:
                hand.down = false;
                set = session.settings().stiffness;
                if (frames >= 3) phase = Settle, frames = 0;
                break;
            case Settle:  // the stiffness ramps over 200 ms
                if (session.snapshot()->settings.stiffness == set &&
                    std::abs(felt(*session.record()) - set) < 1e-3 * set)
                    phase = Done;
                break;
            case Done:
                frame.window.close();
                break;
        }
        hand.act(frame.window);
    };
    CHECK(runWindow(options) == 0);
    CAPTURE(int(phase));
    CHECK(phase == Done);
    // Before: the default. To rounding of the depth at which the leaves touch, the force is k times the separation.
    CHECK(before == Approx(1).epsilon(1e-3));
    CHECK(set > 1.3);
    const engine::Image picture = engine::readPng(options.screenshot);
    CHECK(picture.width >= 1280);
    CHECK(picture.height >= 800);
}

TEST_CASE("window: taking hold of the tool with the mouse moves it", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));

    enum { Wait, Aim, Press, Drag, Follow, Done } phase = Wait;
    UserMouse hand;
    int frames = 0;
    Pose start;
    options.onFrame = [&](WindowFrame& frame) {
        LiveSession& session = frame.session;
        ++frames;
        switch (phase) {
            case Wait:
                if (!session.running() || !session.snapshot()->finished) break;
                phase = Aim, frames = 0;
                break;
            case Aim:  // the picture shows tool and slab; the cursor goes to the tool
                hand.at = frame.toolOnScreen.value_or(hand.at);
                if (frames >= 5 && frame.toolOnScreen) {
                    start = session.record()->X_WT;
                    hand.down = true;
                    phase = Press, frames = 0;
                }
                break;
            case Press:
                if (session.device() == "mouse" && frames >= 3) phase = Drag, frames = 0;
                break;
            case Drag:
                hand.at.y -= 10;  // up: away from the slab
                if (frames >= 10) phase = Follow;
                break;
            case Follow:
                if (session.record()->X_WT.p.y() > start.p.y() + 2) phase = Done;
                break;
            case Done:
                hand.down = false;
                frame.window.close();
                break;
        }
        hand.act(frame.window);
    };
    CHECK(runWindow(options) == 0);
    CAPTURE(int(phase));
    CHECK(phase == Done);
}

TEST_CASE("window: a scene that cannot be opened is told, and ends a run that has an end", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(folder.path() / "missing.glb");
    std::string told;
    options.onEnd = [&](LiveSession& session) {
        for (const Message& message : session.messages()) told += message.text;
    };
    CHECK(runWindow(options) == 1);
    CHECK(told.find("missing.glb") != std::string::npos);
}
