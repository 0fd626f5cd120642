// The real window under a (virtual) display, used like a user does: through GLFW's cursor and its callbacks.
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <set>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>

#include "engine/view/image_file.hpp"
#include "haptics/system/app_window.hpp"
#include "haptics/system/units.hpp"
#include "haptics/system/user_files.hpp"
#include "tests/support/fake_hd/fake_hd_device.hpp"
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

void pressWithControl(engine::Window& window, int key, bool down) {
    for (const int which : {GLFW_KEY_LEFT_CONTROL, key})
        ImGui_ImplGlfw_KeyCallback(window.handle(), which, 0, down ? GLFW_PRESS : GLFW_RELEASE,
                                   down ? GLFW_MOD_CONTROL : 0);
}

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

TEST_CASE("window: motors stop when it loses the focus, and wait for somebody to engage them", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const FakeHd fake;
    constexpr const char* kPhantom = "phantom:,stale=500";
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.session.loop.watchdogMs = 0;
    enum { Start, Engage, Engaged, Away, Back, Anew, Done } phase = Start;
    GLFWwindow* other = nullptr;
    int frames = 0;
    options.onFrame = [&](WindowFrame& frame) {
        LiveSession& session = frame.session;
        const auto focused = [&] { return glfwGetWindowAttrib(frame.window.handle(), GLFW_FOCUSED) != 0; };
        const auto engagement = [&] { return session.snapshot()->engagement; };
        ++frames;
        switch (phase) {
            case Start:
                if (!session.running()) break;
                session.chooseDevice(kPhantom);
                REQUIRE(session.device() == kPhantom);
                phase = Engage;
                break;
            case Engage:
                if (session.snapshot()->session == 0 || session.record()->tick < 5) break;  // the demonstration's
                glfwFocusWindow(frame.window.handle());
                session.engage();
                if (focused() && isEngaged(engagement())) phase = Engaged, frames = 0;
                break;
            case Engaged:  // while it has the focus it goes on
                if (!focused()) frames = 0;
                if (frames < 10) break;
                REQUIRE(isEngaged(engagement()));
                glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
                other = glfwCreateWindow(100, 100, "another", nullptr, nullptr);
                REQUIRE(other);
                phase = Away;
                break;
            case Away:
                glfwFocusWindow(other);
                if (engagement() != Engagement::Stopped) break;
                CHECK_FALSE(focused());
                CHECK(session.record()->wrench_out.force.isZero(0));
                glfwDestroyWindow(other);
                phase = Back, frames = 0;
                break;
            case Back:  // looking again does not start the motors
                glfwFocusWindow(frame.window.handle());
                if (!focused()) frames = 0;
                if (frames < 30) break;
                CHECK(engagement() == Engagement::Stopped);
                session.engage();
                phase = Anew;
                break;
            case Anew:
                if (!isEngaged(engagement())) break;
                phase = Done;
                frame.window.close();
                break;
            case Done:
                break;
        }
    };
    CHECK(runWindow(options) == 0);
    CHECK(phase == Done);
}

TEST_CASE("window: dragging the stiffness slider reaches the loop, and the force follows", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.screenshot = folder.path() / "window.png";

    enum { Wait, Move, Press, Drag, Release, Settle, Undo, Done } phase = Wait;
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
                    phase = Undo, frames = 0;
                break;
            case Undo:  // the whole drag is one step
                pressWithControl(frame.window, GLFW_KEY_Z, frames >= 3 && frames < 7);
                if (session.settings().stiffness == 1) phase = Done;
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

TEST_CASE("window: the space bar takes the force, and gives it back", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    enum { Push, Stop, Stopped, Engage, Pushed, Done } phase = Push;
    int frames = 0;
    options.onFrame = [&](WindowFrame& frame) {
        if (!frame.session.running()) return;
        const LoopSnapshot& s = *frame.session.snapshot();
        const double force = s.record.wrench_out.force.norm();
        const bool pressing = phase == Stop || phase == Engage;
        ImGui_ImplGlfw_KeyCallback(frame.window.handle(), GLFW_KEY_SPACE, 0,
                                   pressing && frames < 3 ? GLFW_PRESS : GLFW_RELEASE, 0);
        const bool next = phase == Push      ? force > 1.5
                          : phase == Stopped ? force == 0 && s.engagement == Engagement::Stopped
                          : phase == Pushed  ? force > 1.5
                                             : frames > 5;
        ++frames;
        if (!next || phase == Done) return;
        phase = static_cast<decltype(phase)>(phase + 1);
        frames = 0;
        if (phase == Done) frame.window.close();
    };
    runWindow(options);
    CHECK(phase == Done);
}

TEST_CASE("window: a body is dragged by its handle while the loop runs, pushes the tool, and goes back", "[ui]") {
    if (!hasDisplay()) return;
    const bool up = GENERATE(false, true);  // away from the tool that lies on it, and into it
    CAPTURE(up);
    const TempFolder folder;
    const auto saved = folder.path() / "moved.glb";
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.configFolder = folder.path() / "config";
    options.screenshot = folder.path() / "selected.png";

    enum { Wait, Click, Selected, Take, Drag, Dropped, Save, Reload, Back, Undo, Undone, Done } phase = Wait;
    UserMouse hand;
    int frames = 0;
    double start = 0, dragged = 0, toolStart = 0;
    std::uint64_t loopSession = 0;
    const auto go = [&](auto next) {
        phase = next;
        frames = 0;
    };
    options.onFrame = [&](WindowFrame& frame) {
        LiveSession& session = frame.session;
        const glm::vec2 corner(frame.picture.x, frame.picture.y),
            viewport(frame.picture.z - corner.x, frame.picture.w - corner.y);
        const auto height = [&] { return session.scene()->world->obstacles[0].X_WO.p.y(); };
        const auto arrived = [&] {
            const engine::Scene& scene = session.scene()->scene;
            return session.scene()->world->obstacles[0].X_WO ==
                   toPose(engine::worldPose(scene.registry, scene.nodes[1]));
        };
        ++frames;
        if (session.running()) CHECK(trueClearance(*session.scene()->world, session.record()->X_WT) >= -1e-3);
        switch (phase) {
            case Wait:
                if (!session.running() || !session.snapshot()->finished) break;
                start = height();
                toolStart = session.record()->X_WT.p.y();
                loopSession = session.snapshot()->session;
                // A corner of the slab's upper face, beside the cube.
                if (const auto at = frame.camera.project({0.022f, 0.005f, 0.022f}, viewport)) hand.at = *at + corner;
                if (frames >= 5) go(Click);
                break;
            case Click:
                hand.down = frames >= 3 && frames < 6;
                if (frames >= 8) go(Selected);
                break;
            case Selected:
                if (!frame.selection.node() || !frame.selection.handles()) break;
                CHECK(frame.selection.node() == session.scene()->roles.obstacles[0]);
                if (const auto at =
                        Gizmo::grip(GizmoHandle::MoveY, frame.camera, viewport, *frame.selection.handles())) {
                    hand.at = *at + corner;
                    go(Take);
                }
                break;
            case Take:
                hand.down = frames >= 3;
                if (frames >= 6 && frame.selection.dragging()) go(Drag);
                break;
            case Drag:
                hand.at.y += up ? -4 : 4;  // along the axis
                if (frames >= 15) go(Dropped);
                break;
            case Dropped:
                hand.down = false;
                if (session.newest().edits.empty() || !arrived() || frames < 5) break;
                dragged = height() - start;
                // Under more load it lies a little deeper in the ripple of the slab's leaves.
                if (up) CHECK(session.record()->X_WT.p.y() == Approx(toolStart + dragged).epsilon(0.02));
                CHECK(session.snapshot()->session == loopSession);  // the loop went on
                CHECK(session.scene()->world->obstacles[0].X_WO.p.head<2>().x() == Approx(0).margin(1e-9));
                go(Save);
                break;
            case Save:
                engine::writeGltf(session.scene()->scene, saved);  // the session's own file stays, and with it undo
                session.reload();
                go(Reload);
                break;
            case Reload:  // opened again, the file is as it was
                if (session.sceneNumber() < 2 || !session.running() || !session.newest().edits.empty()) break;
                CHECK(height() == start);
                if (frames >= 5) go(Back);
                break;
            case Back:
                pressWithControl(frame.window, GLFW_KEY_Z, frames < 4);
                if (frames >= 6 && session.newest().edits.size() == 1 && arrived()) {
                    CHECK(height() == Approx(start + dragged).margin(1e-9));
                    go(Undo);
                }
                break;
            case Undo:
                pressWithControl(frame.window, GLFW_KEY_Z, frames < 4);
                if (frames >= 6) go(Undone);
                break;
            case Undone:
                if (session.newest().edits.empty() && std::abs(height() - start) < 1e-9) go(Done);
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
    CHECK((up ? dragged : -dragged) > 1);  // mm
    const HapticScene again = openScene(saved);
    CHECK(again.world->obstacles[0].X_WO.p.y() == Approx(start + dragged).margin(1e-5));  // the file is in doubles
    // What the next window needs to know is in the configuration folder.
    CHECK(RecentScenes(options.configFolder).list() == std::vector{std::filesystem::path(options.scene)});
    CHECK(std::filesystem::exists(options.configFolder / "window.ini"));
}

TEST_CASE("window: a broken file that is dropped is told in the log, and the scene goes on", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    const auto broken = folder.path() / "broken.glb";
    std::ofstream(broken) << "no scene";
    options.screenshot = folder.path() / "broken.png";
    enum { Wait, Told, Done } phase = Wait;
    options.onFrame = [&](WindowFrame& frame) {
        LiveSession& session = frame.session;
        if (phase == Wait && session.running()) {
            // As GLFW hands on a drop of the system.
            const std::string path = broken.string();
            const char* paths[] = {path.c_str()};
            const GLFWdropfun drop = glfwSetDropCallback(frame.window.handle(), nullptr);
            glfwSetDropCallback(frame.window.handle(), drop);
            drop(frame.window.handle(), 1, paths);
            phase = Told;
        } else if (phase == Told) {
            for (const Message& message : session.messages())
                if (message.kind == Message::Kind::Error && message.text.find("broken.glb") != std::string::npos)
                    phase = Done;
        } else if (phase == Done) {
            CHECK(session.running());
            CHECK(session.scene()->scene.file == options.scene);
            CHECK(frame.items.count("newest message") == 1);
            frame.window.close();
        }
    };
    CHECK(runWindow(options) == 0);
    CHECK(phase == Done);
}

TEST_CASE("window: the scene is saved by a key and a dialog, and opened again it is the same", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    enum { Wait, Dialog, Press, Saved, Again, Done } phase = Wait;
    UserMouse hand;
    int frames = 0;
    Settings tuned;
    std::uint64_t number = 0;
    const auto go = [&](auto next) {
        phase = next;
        frames = 0;
    };
    options.onFrame = [&](WindowFrame& frame) {
        LiveSession& session = frame.session;
        ++frames;
        switch (phase) {
            case Wait: {
                if (!session.running()) break;
                Settings settings = session.settings();
                settings.stiffness = 2.25;
                session.setSettings(settings);
                auto place =
                    session.scene()->scene.registry.get<engine::LocalTransform>(session.scene()->scene.nodes[1]);
                const auto from = place;
                place.translation.y = -0.004;
                session.edit({PlaceNode{1, from, place}});
                go(Dialog);
                break;
            }
            case Dialog: {
                if (frames < 10) break;  // until the new world is there
                const bool down = frames < 14;
                pressWithControl(frame.window, GLFW_KEY_S, down);
                if (const auto button = frame.items.find("Save"); !down && button != frame.items.end()) {
                    hand.at = middle(button->second);
                    go(Press);
                }
                break;
            }
            case Press:
                hand.down = frames >= 4 && frames < 7;
                if (frames >= 10) go(Saved);
                break;
            case Saved:
                if (!session.newest().edits.empty()) break;  // the file has them now
                tuned = session.settings();
                number = session.sceneNumber();
                session.reload();
                go(Again);
                break;
            case Again:
                if (session.sceneNumber() == number || !session.running()) break;
                CHECK(session.settings() == tuned);
                CHECK(session.settings().stiffness == 2.25);
                CHECK(session.scene()->world->obstacles[0].X_WO.p.y() == Approx(-4));
                go(Done);
                break;
            default:
                frame.window.close();
                break;
        }
        hand.act(frame.window);
    };
    CHECK(runWindow(options) == 0);
    CAPTURE(int(phase));
    CHECK(phase == Done);
}

TEST_CASE("window: dragging the tolerance while PQP renders changes its error", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.session.adjust = [](Settings settings) {
        settings.solver = findSolver("pqp");
        settings.shadow = kExactSolver;  // measures the solver that renders
        settings.tolerance = 0.5;
        settings.adaptiveMargin = false;
        return settings;
    };
    enum { Wait, Move, Press, Drag, Release, Settle, Done } phase = Wait;
    UserMouse hand;
    int frames = 0;
    double before = 0, after = 0, tolerance = 0;
    options.onFrame = [&](WindowFrame& frame) {
        LiveSession& session = frame.session;
        const auto slider = frame.items.find("tolerance");
        ++frames;
        switch (phase) {
            case Wait:
                if (!session.running() || !session.snapshot()->finished || session.snapshot()->fade < 1 ||
                    slider == frame.items.end())
                    break;
                before = session.record()->shadowForceError;
                hand.at = {slider->second.x + 0.95f * (slider->second.z - slider->second.x), middle(slider->second).y};
                phase = Move, frames = 0;
                break;
            case Move:
                if (frames >= 3) hand.down = true, phase = Press, frames = 0;
                break;
            case Press:
                if (frames >= 3) phase = Drag, frames = 0;
                break;
            case Drag:  // to the left: a finer answer
                hand.at.x -= 0.8f * (slider->second.z - slider->second.x) / 8;
                if (frames >= 8) phase = Release, frames = 0;
                break;
            case Release:
                hand.down = false;
                tolerance = session.settings().tolerance;
                if (frames >= 3) phase = Settle, frames = 0;
                break;
            case Settle:  // it starts warm, so its answer gets better from tick to tick
                after = session.record()->shadowForceError;
                if (session.snapshot()->settings.tolerance == tolerance && after < 0.1 * before) phase = Done;
                break;
            case Done:
                frame.window.close();
                break;
        }
        hand.act(frame.window);
    };
    CHECK(runWindow(options) == 0);
    CAPTURE(int(phase), before, after, tolerance);
    CHECK(phase == Done);
    CHECK(tolerance < 1e-3);
    CHECK(before > 1e-3);
}

TEST_CASE("window: a contact is swept, the tolerance moves the marker, the plots become a picture", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    const std::filesystem::path picture = folder.path() / "plots.png";

    enum { Wait, Tab, Sweep, Swept, Drag, Export, Picture, Done } phase = Wait;
    UserMouse hand;
    int frames = 0;
    std::size_t points = 0;
    std::optional<SweepPoint> before, after;
    /// Moves, presses and releases in a few frames; true at the end.
    const auto click = [&](const WindowFrame& frame, const char* item) {
        const auto found = frame.items.find(item);
        if (found == frame.items.end()) return false;
        hand.at = middle(found->second);
        hand.down = frames >= 3 && frames < 6;
        return frames >= 9;
    };
    const auto next = [&](auto to) {
        phase = to;
        frames = 0;
    };
    options.onFrame = [&](WindowFrame& frame) {
        LiveSession& session = frame.session;
        const SweepRun& sweeps = frame.measure.sweeps();
        ++frames;
        switch (phase) {
            case Wait:
                if (session.running() && session.snapshot()->finished) next(Tab);
                break;
            case Tab:
                if (click(frame, "tab Speed against error")) next(Sweep);
                break;
            case Sweep:
                if (click(frame, "sweep")) next(Swept);
                break;
            case Swept:
                if (!sweeps.result()) break;
                points = sweeps.result()->points.size();
                before = pointAt(*sweeps.result(), findSolver("pqp"), session.settings().tolerance);
                next(Drag);
                break;
            case Drag: {
                const auto slider = frame.items.find("tolerance");
                if (slider == frame.items.end()) break;
                hand.at = {slider->second.z - 4 - static_cast<float>(frames), middle(slider->second).y};
                hand.down = frames >= 3 && frames < 20;
                if (frames < 23) break;
                after = pointAt(*sweeps.result(), findSolver("pqp"), session.settings().tolerance);
                std::snprintf(frame.measure.panel.exportName.data(), frame.measure.panel.exportName.size(), "%s",
                              (folder.path() / "plots").c_str());
                next(Export);
                break;
            }
            case Export:
                if (frames < 10) {
                    click(frame, "export");
                } else if (frame.items.count("Plots, PNG")) {
                    frames = std::max(frames, 20);
                    hand.at = middle(frame.items.at("Plots, PNG"));
                    hand.down = frames >= 23 && frames < 26;
                }
                if (std::filesystem::exists(picture)) next(Picture);
                break;
            case Picture:
                hand.down = false;
                if (frames >= 3) next(Done);
                break;
            case Done:
                frame.window.close();
                break;
        }
        hand.act(frame.window);
    };
    CHECK(runWindow(options) == 0);
    CAPTURE(int(phase));
    REQUIRE(phase == Done);
    CHECK(points > solverTable().size());
    REQUIRE((before && after));
    CHECK(after->tolerance > before->tolerance);
    CHECK(after->forceError != before->forceError);
    // The plots alone, not the window, and something is drawn there.
    const engine::Image png = engine::readPng(picture);
    CHECK(png.width > 200);
    CHECK(png.width < 640);
    CHECK(png.height > 400);
    std::set<std::uint32_t> colors;
    for (std::size_t i = 0; i + 3 < png.rgba.size(); i += 4)
        colors.insert(std::uint32_t(png.rgba[i]) << 16 | std::uint32_t(png.rgba[i + 1]) << 8 | png.rgba[i + 2]);
    CHECK(colors.size() > 50);
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

TEST_CASE("window: a recording is begun and ended in the menu, and its folder is told", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.recordings = folder.path() / "recordings";
    const std::vector<std::string> clicks{"menu scene", "menu record", "menu scene", "menu record"};
    std::size_t click = 0;
    UserMouse hand;
    int frames = 0;
    bool recorded = false, shown = false;
    std::string told;
    options.onFrame = [&](WindowFrame& frame) {
        const Recorder* recorder = frame.session.recorder();
        recorded |= recorder != nullptr;
        shown |= frame.items.count("health Recording") > 0;
        if (click == clicks.size()) {
            if (recorded && !recorder) {
                told = frame.session.messages().back().text;
                frame.window.close();
            }
        } else {
            const auto item = frame.items.find(clicks[click]);
            const bool ready = frame.session.running() && (click < 2 || (recorder && recorder->rows() > 50));
            if (frames == 0 && ready && item != frame.items.end()) hand.at = middle(item->second), frames = 1;
            if (frames > 0) ++frames;
            hand.down = frames > 4 && frames < 8;
            if (frames == 11) ++click, frames = 0;
        }
        hand.act(frame.window);
    };
    CHECK(runWindow(options) == 0);
    CHECK(shown);
    std::vector<std::filesystem::path> made;
    for (const auto& entry : std::filesystem::directory_iterator(options.recordings)) made.push_back(entry.path());
    REQUIRE(made.size() == 1);
    CHECK(made[0].filename().string().rfind("hold-", 0) == 0);
    CHECK_THAT(told, Catch::Matchers::Contains(made[0].string()));
    CHECK(TickFileReader(made[0] / "ticks.npy").rows() > 50);
}
