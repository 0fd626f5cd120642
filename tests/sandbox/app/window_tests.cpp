// The real window under a (virtual) display, operated as a user does.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <imgui_internal.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <fstream>
#include <set>

#include "engine/ui/user_files.hpp"
#include "engine/view/image_file.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "haptics/sandbox/trials/protocol.hpp"
#include "tests/support/fake_hd/fake_hd_device.hpp"
#include "tests/support/ui_scene.hpp"
#include "tests/support/ui_text.hpp"
#include "tests/support/ui_user.hpp"

namespace touchstone::window_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

bool isRunning(WindowFrame& frame) { return frame.session.running(); }
/// Whether the demonstration rests in contact.
bool isAtRest(WindowFrame& frame) { return isRunning(frame) && frame.session.snapshot()->finished; }
std::size_t editsOf(WindowFrame& frame) { return frame.session.newest().edits.size(); }

void lower(LiveSession& session) {
    const auto place = session.scene()->scene.registry.get<engine::LocalTransform>(session.scene()->scene.nodes[1]);
    auto lowered = place;
    lowered.translation.y = -0.004;
    session.edit({engine::PlaceNode{1, place, lowered}});
}

}  // namespace

TEST_CASE("window: motors stop when it loses the focus, and wait until the user engages them", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const FakeHd fake;
    constexpr const char* kPhantom = "phantom:,stale=500";
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.session.loop.watchdogMs = 0;
    enum { Start, Engage, Engaged, Away, Back, Again, Done } phase = Start;
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
                REQUIRE(session.device().choice == kPhantom);
                phase = Engage;
                break;
            case Engage:
                if (session.snapshot()->session == 0 || session.record()->tick < 5) break;  // the demonstration's
                glfwFocusWindow(frame.window.handle());
                session.engage();
                if (focused() && isEngaged(engagement())) phase = Engaged, frames = 0;
                break;
            case Engaged:  // it continues while it has the focus
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
            case Back:  // returning focus does not start the motors
                glfwFocusWindow(frame.window.handle());
                if (!focused()) frames = 0;
                if (frames < 30) break;
                CHECK(engagement() == Engagement::Stopped);
                session.engage();
                phase = Again;
                break;
            case Again:
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
    /// Force per separation of tool and device, N/mm: the cube is pressed down without turning.
    const auto felt = [](WindowFrame& frame) {
        const TickRecord& record = *frame.session.record();
        const double apart = (record.X_WT.p - record.X_WT_device.p).norm();
        return apart > 0.5 ? record.wrench_C.force.norm() / apart : 0;
    };
    double before = 0, set = 0;
    User user;
    user.until(isAtRest)
        .doing([&](WindowFrame& frame) { before = felt(frame); })
        .drag(onItem("stiffness"), onItem("stiffness", 0.8f))
        .doing([&](WindowFrame& frame) { set = frame.session.settings().stiffness; })
        .until([&](WindowFrame& frame) {  // stiffness ramps over 200 ms
            return frame.session.snapshot()->settings.stiffness == set && std::abs(felt(frame) - set) < 1e-3 * set;
        })
        .key(GLFW_KEY_Z, true)  // the whole drag is one step
        .until([](WindowFrame& frame) { return frame.session.settings().stiffness == 1; });
    REQUIRE(user.use(options));
    // Before: the default. The force is k times the separation, up to rounding of the depth at which the leaves touch.
    CHECK(before == Approx(1).epsilon(1e-3));
    CHECK(set > 1.3);
    const engine::Image picture = engine::readPng(options.screenshot);
    CHECK(picture.width >= 1280);
    CHECK(picture.height >= 800);
}

TEST_CASE("window: a hint says what to do when the motion has ended", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const auto hint = [](WindowFrame&) {
        return shownText("##Background").find("Themotionhasended:Rrunsitagain,ordragthetool.") != std::string::npos;
    };
    User user;
    user.until(isAtRest)
        .until(hint)
        .key(GLFW_KEY_R)
        .until([&](WindowFrame& frame) { return !hint(frame); })
        .until(hint);
    CHECK(user.use(optionsFor(holdFile(folder))));
}

TEST_CASE("window: no key changes the settings of a study", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.study = true;
    Settings set;
    const auto isSet = [&](WindowFrame& frame) { return frame.session.settings() == set; };
    User user;
    user.until(isAtRest)
        .doing([&](WindowFrame& frame) {
            set = frame.session.settings();
            set.stiffness = 0.7;
            frame.session.setSettings(set);
            REQUIRE(withSolversSwapped(set) != set);
        })
        .key(GLFW_KEY_S)
        .doing([&](WindowFrame& frame) { CHECK(isSet(frame)); })
        .key(GLFW_KEY_Z, true)
        .doing([&](WindowFrame& frame) { CHECK(isSet(frame)); })
        .key(GLFW_KEY_Y, true)
        .doing([&](WindowFrame& frame) { CHECK(isSet(frame)); });
    CHECK(user.use(options));
}

TEST_CASE("window: dragging the tool with the mouse moves it", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    double start = 0;
    User user;
    user.until(isAtRest)
        .doing([&](WindowFrame& frame) { start = frame.session.record()->X_WT.p.y(); })
        .hold([](WindowFrame& frame) { return frame.toolOnScreen; })
        .until([](WindowFrame& frame) { return frame.session.device().choice == "mouse"; })
        .moveBy({0, -100})  // up: away from the slab
        .until([&](WindowFrame& frame) { return frame.session.record()->X_WT.p.y() > start + 2; });
    CHECK(user.use(optionsFor(holdFile(folder))));
}

TEST_CASE("window: the space bar removes the force and restores it", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const auto force = [](WindowFrame& frame) { return frame.session.snapshot()->record.wrench_out.force.norm(); };
    const auto pushes = [&](WindowFrame& frame) { return isRunning(frame) && force(frame) > 1.5; };
    User user;
    user.until(pushes)
        .key(GLFW_KEY_SPACE)
        .until([&](WindowFrame& frame) {
            return force(frame) == 0 && frame.session.snapshot()->engagement == Engagement::Stopped;
        })
        .key(GLFW_KEY_SPACE)
        .until(pushes);
    CHECK(user.use(optionsFor(holdFile(folder))));
}

TEST_CASE("window: a key pressed and released within a slow frame acts, once, and F1 shows and hides the help",
          "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.select = 1;
    const auto helps = [](WindowFrame& frame) { return frame.items.count("close help") > 0; };
    const auto selects = [](WindowFrame& frame) { return bool(frame.selection.node()); };
    const auto lists = [](WindowFrame& frame) { return frame.items.count("role goal") > 0; };
    User user;
    user.until([&](WindowFrame& frame) { return isRunning(frame) && selects(frame); });
    for (int twice = 0; twice < 2; ++twice)
        user.doing([&](WindowFrame& frame) { CHECK_FALSE(helps(frame)); })
            .tap(GLFW_KEY_F1)
            .doing([&](WindowFrame& frame) { CHECK(helps(frame)); })
            .tap(GLFW_KEY_F1);
    user.tap(GLFW_KEY_F1)
        .tap(GLFW_KEY_ESCAPE)
        .doing([&](WindowFrame& frame) {
            CHECK_FALSE(helps(frame));
            CHECK(selects(frame));  // the key was the dialog's
        })
        .click("role")
        .doing([&](WindowFrame& frame) { CHECK(lists(frame)); })
        .tap(GLFW_KEY_ESCAPE)
        .doing([&](WindowFrame& frame) {
            CHECK_FALSE(lists(frame));
            CHECK(selects(frame));  // the key was the list's
        })
        .tap(GLFW_KEY_ESCAPE)
        .doing([&](WindowFrame& frame) { CHECK_FALSE(selects(frame)); })
        .doing([](WindowFrame& frame) { CHECK_FALSE(frame.display.section); })
        .tap(GLFW_KEY_X)
        .doing([](WindowFrame& frame) { CHECK(frame.display.section); })
        .tap(GLFW_KEY_X)
        .doing([](WindowFrame& frame) { CHECK_FALSE(frame.display.section); });
    CHECK(user.use(options));
}

TEST_CASE("window: the 3D view has more than half of the width, and panels that were folded stay folded", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.configFolder = folder.path() / "config";
    const auto view = [](WindowFrame& frame) {
        return glm::vec2(frame.picture.z - frame.picture.x, frame.picture.w - frame.picture.y);
    };
    glm::vec2 open{0}, folded{0};
    User user;
    user.until([](WindowFrame& frame) { return isRunning(frame) && frame.items.count("plot Tick time") > 0; })
        .doing([&](WindowFrame& frame) { open = view(frame); })
        .click("fold plots")
        .until([](WindowFrame& frame) { return frame.items.count("plot Tick time") == 0; })
        .tap(GLFW_KEY_F2)
        .tap(GLFW_KEY_F4)
        .until([](WindowFrame& frame) { return frame.items.count("stiffness") + frame.items.count("copy log") == 0; })
        .doing([&](WindowFrame& frame) { folded = view(frame); });
    REQUIRE(user.use(options));
    CHECK(open.x > 640);
    CHECK(folded.x > 1200);
    CHECK(folded.y > open.y + 80);
    User another;
    another.until([&](WindowFrame& frame) { return isRunning(frame) && view(frame) == folded; })
        .click("unfold plots")
        .click("unfold log")
        .tap(GLFW_KEY_F2)
        .until([&](WindowFrame& frame) { return view(frame) == open; });
    CHECK(another.use(options));
}

TEST_CASE("window: the log shows whole lines, also when it is scrolled", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const auto check = [](WindowFrame&) {
        const TextFaults faults = textFaults("Log");
        CHECK(faults.cut.empty());
        CHECK(faults.halved.empty());
        CHECK(faults.covered.empty());
    };
    User user;
    user.until(isRunning)
        .doing([](WindowFrame& frame) {
            for (int i = 0; i < 30; ++i)
                frame.session.log().say(Message::Kind::Warning, "A message " + std::string(std::size_t(7 * i), 'm') +
                                                                    " of " + std::to_string(i) +
                                                                    " words that breaks into lines if it is long");
        })
        .moveTo(onItem("messages"))
        .doing(check);
    for (const double wheel : {0.3, 0.45, 2.0, -0.2})
        user.doing([=](WindowFrame& frame) { ImGui_ImplGlfw_ScrollCallback(frame.window.handle(), 0, wheel); })
            .then([](WindowFrame&, int frames) { return frames > 3; })
            .doing(check);
    CHECK(user.use(optionsFor(holdFile(folder))));
}

TEST_CASE("window: no text of the panels is cut off or covered at 1280 x 800", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.select = 1;
    User user;
    user.until([](WindowFrame& frame) { return isAtRest(frame) && frame.items.count("page selected") > 0; });
    for (const char* item : {"tab Contact", "tab Friction", "tab Speed vs. error", "hold plots", "tab Time",
                             "page settings", "more", "Section"}) {
        if (item == std::string_view("more")) user.wheel(inSettings, -200);
        user.click(item)
            .moveTo([](WindowFrame& frame) { return glm::vec2(frame.picture.x + 20, frame.picture.y + 200); })
            .then([](WindowFrame&, int frames) { return frames > 3; })
            .doing([=](WindowFrame&) {
                CAPTURE(item);
                const TextFaults faults = textFaults();
                CHECK(faults.cut == std::vector<std::string>());
                CHECK(faults.covered == std::vector<std::string>());
                CHECK(ImGui::FindWindowByName("Scene")->ScrollMax.y == 0);  // all switches are in view
            });
    }
    user.doing([](WindowFrame& frame) { CHECK(frame.display.section); });
    CHECK(user.use(options));
}

TEST_CASE("window: a scene is found with mouse and keys in the file browser, whose folder is remembered", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const auto file = holdFile(folder), parts = folder.path() / "parts";
    std::filesystem::create_directories(parts);
    engine::Scene other = holdScene();
    (*other.extras)["touchstone"]["description"] = "Another cube.";
    writeGltf(other, parts / "other.glb");
    std::ofstream(parts / "mesh.stl") << "solid";
    std::ofstream(parts / "notes.txt") << "no scene";
    WindowRunOptions options = optionsFor(file);
    options.configFolder = folder.path() / "config";
    options.sceneFolders = {parts};
    engine::keepFolder(options.configFolder, folder.path());
    User user;
    user.until(isRunning)
        .key(GLFW_KEY_O, true)
        .until([](WindowFrame& frame) { return frame.items.contains("open other"); })  // as a bundled scene
        .click("file parts/")
        .until([](WindowFrame& frame) { return frame.items.contains("file other.glb"); })
        .doing([](WindowFrame& frame) { CHECK_FALSE(frame.items.contains("file notes.txt")); })
        .key(GLFW_KEY_BACKSPACE)  // up, with the folder selected
        .until([](WindowFrame& frame) { return frame.items.contains("file parts/"); })
        .key(GLFW_KEY_ENTER)
        .until([](WindowFrame& frame) { return frame.items.contains("file other.glb"); })
        .click("file mesh.stl")
        .until([](WindowFrame& frame) { return frame.items.contains("file text"); })
        .key(GLFW_KEY_ENTER)  // a mesh is no scene: the dialog stays
        .key(GLFW_KEY_DOWN)
        .until([](WindowFrame& frame) { return frame.items.contains("file other.glb"); })
        .doing([](WindowFrame& frame) { CHECK(frame.session.request().file.stem() == "hold"); })
        .key(GLFW_KEY_ENTER)
        .until(
            [&](WindowFrame& frame) { return isRunning(frame) && frame.session.request().file == parts / "other.glb"; })
        .doing([](WindowFrame& frame) { CHECK_FALSE(frame.items.contains("file other.glb")); })
        .key(GLFW_KEY_O, true)
        .until([](WindowFrame& frame) { return frame.items.contains("file other.glb"); })
        .key(GLFW_KEY_ESCAPE)
        .until([](WindowFrame& frame) { return !frame.items.contains("file other.glb"); });
    REQUIRE(user.use(options));
    CHECK(engine::browsedFolder(options.configFolder) == parts);
}

TEST_CASE("window: a demonstration is recorded by hand, replayed, undone, and saved with the goal", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const auto file = holdFile(folder);
    const auto duration = [](WindowFrame& frame) { return frame.session.scene()->demonstration->duration(); };
    double recorded = 0;
    Pose end;
    User user;
    user.until(isAtRest)
        .doing([&](WindowFrame& frame) { CHECK(duration(frame) == 200); })
        .click("record demonstration")
        .until([](WindowFrame& frame) { return frame.session.demonstration() != nullptr; })
        .hold([](WindowFrame& frame) { return frame.toolOnScreen; })
        .moveBy({60, -100})
        .until([](WindowFrame& frame) { return frame.session.demonstration()->duration() > 800; })
        .moveBy({0, 300})  // down, into the slab
        .until([](WindowFrame& frame) {
            return frame.session.demonstration()->duration() > 2000 &&
                   frame.session.record()->wrench_C.force.norm() > 0.3;
        })
        .release()
        .click("record demonstration")
        .until([](WindowFrame& frame) { return !frame.session.demonstration() && editsOf(frame) == 1; })
        .doing([&](WindowFrame& frame) {
            recorded = duration(frame);
            end = frame.session.record()->X_WT;
        })
        .click("set goal")
        .until([](WindowFrame& frame) { return frame.session.scene()->roles.goal.has_value(); })
        .doing(
            [](WindowFrame& frame) { CHECK(frame.session.scene()->roles.goal->depth == 0); })  // on the slab, not in it
        .click("replay demonstration")
        .until([](WindowFrame& frame) {
            return frame.session.device().choice == "demo" && frame.session.running() &&
                   frame.session.record()->tick > 100;
        })
        .until(isAtRest)
        .doing([&](WindowFrame& frame) {
            CHECK(frame.session.scene()->roles.goal->contains(frame.session.record()->X_WT));
            CHECK((frame.session.record()->X_WT.p - end.p).norm() < 0.1);
        })
        .key(GLFW_KEY_S, true)
        .click("Save")
        .until([](WindowFrame& frame) { return editsOf(frame) == 0; })
        .key(GLFW_KEY_Z, true)  // would add the goal to a file that has it
        .doing([](WindowFrame& frame) { CHECK(editsOf(frame) == 0); });
    REQUIRE(user.use(optionsFor(file)));
    const HapticScene again = openScene(file);
    CHECK(again.warnings.empty());
    CHECK(again.demonstration->duration() == recorded);
    CHECK(recorded > 1900);
    REQUIRE(again.roles.goal);
    CHECK((again.roles.goal->X_WT.p - end.p).norm() < 0.1);
}

TEST_CASE("window: a demonstration that presses on its way is not called stuck, unless it ends so", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    engine::Scene scene = holdScene();
    scene.animations[0] =
        translation(scene.nodes[0], {0, 0.2, 3}, {{0, 0.015, 0, 0}, {0, 0.008, 0, 0}, {0, 0.008, 0, 0}});
    setExtras(scene, addNode(scene, "elsewhere", {}, {.translation = {0.05, 0, 0}}),
              {{"touchstone", {{"role", "goal"}, {"goal", {{"tolerance_m", 0.001}}}}}});
    updateWorldTransforms(scene);
    writeGltf(scene, folder.path() / "press.glb");
    const auto isCalledStuck = [](WindowFrame& frame) {
        const auto& messages = frame.session.log().messages();
        return std::any_of(messages.begin(), messages.end(),
                           [](const Message& m) { return m.text.find("stuck") != std::string::npos; });
    };
    User user;
    user.until(isAtRest).doing([&](WindowFrame& frame) { CHECK_FALSE(isCalledStuck(frame)); }).until(isCalledStuck);
    CHECK(user.use(optionsFor(folder.path() / "press.glb")));
}

TEST_CASE("window: the whole demonstration is in the picture", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    engine::Scene scene = holdScene();
    scene.animations[0] = translation(scene.nodes[0], {0, 0.5}, {{0, 0.015, 0, 0}, {0.3, 0.015, 0, 0}});
    writeGltf(scene, folder.path() / "far.glb");
    const auto isInPicture = [](WindowFrame& frame) {
        const std::optional<glm::vec2> at = frame.toolOnScreen;
        const glm::vec4& p = frame.picture;
        return at && at->x > p.x && at->y > p.y && at->x < p.z && at->y < p.w;
    };
    User user;
    user.until(isAtRest).doing([&](WindowFrame& frame) { CHECK(isInPicture(frame)); });
    CHECK(user.use(optionsFor(folder.path() / "far.glb")));
}

TEST_CASE("window: the guide to the roles covers no part of the scene", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    engine::Scene scene;
    addBox(scene, "peg", glm::vec3(0.01f), {}, {.translation = {0, 0.02, 0}});
    addBox(scene, "plate", {0.08f, 0.01f, 0.08f}, {});
    updateWorldTransforms(scene);
    writeGltf(scene, folder.path() / "unmarked.glb");
    User user;
    user.until([](WindowFrame& frame) { return frame.items.count("guide peg") > 0; })
        .then([](WindowFrame&, int frames) { return frames > 2; })
        .doing([](WindowFrame& frame) {
            const glm::vec4 p = frame.picture, guide = frame.items.at("guide peg");
            const glm::vec2 size(p.z - p.x, p.w - p.y);
            for (const float x : {-0.04f, 0.04f})
                for (const float z : {-0.04f, 0.04f}) {
                    const auto at = frame.camera.project({x, 0.005f, z}, size);
                    REQUIRE(at);
                    CHECK(p.x + at->x > guide.z);
                    CHECK(at->x < size.x);
                }
        });
    CHECK(user.use(optionsFor(folder.path() / "unmarked.glb")));
}

TEST_CASE("window: undo takes back a recorded demonstration, and the page of the goal edits its tolerance", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    User user;
    user.until(isAtRest)
        .click("record demonstration")
        .hold([](WindowFrame& frame) { return frame.toolOnScreen; })
        .moveBy({60, -100})
        .until([](WindowFrame& frame) { return frame.session.demonstration()->duration() > 500; })
        .release()
        .click("record demonstration")
        .until([](WindowFrame& frame) { return editsOf(frame) == 1 && frame.session.running(); })
        .key(GLFW_KEY_Z, true)
        .until([](WindowFrame& frame) {
            return editsOf(frame) == 0 && frame.session.scene()->demonstration->duration() == 200;
        })
        .click("set goal")
        .until([](WindowFrame& frame) { return frame.session.scene()->roles.goal.has_value(); })
        .drag(onItem("goal tolerance", 0.3f), onItem("goal tolerance", 0.9f))
        .until([](WindowFrame& frame) { return frame.session.scene()->roles.goal->tolerance > 1.05; })
        .key(GLFW_KEY_Z, true)
        .until([](WindowFrame& frame) { return frame.session.scene()->roles.goal->tolerance == 1; })
        .key(GLFW_KEY_Z, true)
        .until([](WindowFrame& frame) { return isRunning(frame) && !frame.session.scene()->roles.goal; });
    CHECK(user.use(optionsFor(holdFile(folder))));
}

TEST_CASE("window: a body dragged while the loop runs pushes the tool, and undo moves it back", "[ui]") {
    if (!hasDisplay()) return;
    const bool up = GENERATE(false, true);  // away from the tool that lies on it, and into the tool
    CAPTURE(up);
    const TempFolder folder;
    const auto saved = folder.path() / "moved.glb";
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.configFolder = folder.path() / "config";
    options.onFrame = [](WindowFrame& frame) {
        if (!isRunning(frame)) return;
        CHECK(trueClearance(*worldNow(*frame.session.scene()), frame.session.record()->X_WT) >= -1e-3);
    };

    const auto corner = [](WindowFrame& frame) { return glm::vec2(frame.picture.x, frame.picture.y); };
    const auto viewport = [](WindowFrame& frame) {
        return glm::vec2(frame.picture.z - frame.picture.x, frame.picture.w - frame.picture.y);
    };
    const auto height = [](WindowFrame& frame) { return obstaclePose(*frame.session.scene(), 0).p.y(); };
    const auto arrived = [](WindowFrame& frame) {
        const engine::Scene& scene = frame.session.scene()->scene;
        return obstaclePose(*frame.session.scene(), 0) == toPose(engine::worldPose(scene.registry, scene.nodes[1]));
    };
    const auto onSlab = [&](WindowFrame& frame) -> std::optional<glm::vec2> {
        // A corner of its upper face, beside the cube.
        const auto at = frame.camera.project({0.022f, 0.005f, 0.022f}, viewport(frame));
        return at ? std::optional(*at + corner(frame)) : std::nullopt;
    };
    const auto onHandle = [&](WindowFrame& frame) -> std::optional<glm::vec2> {
        if (!frame.selection.handles()) return std::nullopt;
        const auto at =
            engine::Gizmo::grip(engine::GizmoHandle::MoveY, frame.camera, viewport(frame), *frame.selection.handles());
        return at ? std::optional(*at + corner(frame)) : std::nullopt;
    };
    double start = 0, dragged = 0, toolStart = 0;
    std::uint64_t loopSession = 0;
    User user;
    user.until(isAtRest)
        .doing([&](WindowFrame& frame) {
            start = height(frame);
            toolStart = frame.session.record()->X_WT.p.y();
            loopSession = frame.session.snapshot()->session;
        })
        .click(onSlab)
        .hold(onHandle)
        .doing([&](WindowFrame& frame) {
            CHECK(frame.selection.node() == frame.session.scene()->roles.obstacles[0]);
            CHECK(frame.selection.dragging());
        })
        .moveBy({0, up ? -60 : 60})  // along the axis
        .release()
        .until([&](WindowFrame& frame) { return editsOf(frame) == 1 && arrived(frame); })
        .doing([&](WindowFrame& frame) {
            const LiveSession& session = frame.session;
            dragged = height(frame) - start;
            // Under more load the tool is slightly deeper in the ripple of the slab's leaves.
            if (up) CHECK(session.record()->X_WT.p.y() == Approx(toolStart + dragged).epsilon(0.02));
            CHECK(session.snapshot()->session == loopSession);  // the loop continued
            CHECK(obstaclePose(*session.scene(), 0).p.head<2>().x() == Approx(0).margin(1e-9));
            engine::writeGltf(session.scene()->scene,
                              saved);  // the session's own file is unchanged, so undo still works
        })
        .click("menu scene")
        .click("menu reload")  // asks, because the change is not saved
        .click("Cancel")
        .doing([&](WindowFrame& frame) {
            CHECK(editsOf(frame) == 1);
            CHECK(frame.session.sceneNumber() == 1);
        })
        .click("menu scene")
        .click("menu reload")
        .click("Discard changes")
        .until([](WindowFrame& frame) {
            return frame.session.sceneNumber() == 2 && isRunning(frame) && editsOf(frame) == 0;
        })
        .doing([&](WindowFrame& frame) { CHECK(height(frame) == start); })  // as in its file
        .key(GLFW_KEY_Z, true)
        .until([&](WindowFrame& frame) { return editsOf(frame) == 1 && arrived(frame); })
        .doing([&](WindowFrame& frame) { CHECK(height(frame) == Approx(start + dragged).margin(1e-9)); })
        .key(GLFW_KEY_Z, true)
        .until([&](WindowFrame& frame) { return editsOf(frame) == 0 && std::abs(height(frame) - start) < 1e-9; });
    REQUIRE(user.use(options));
    CHECK((up ? dragged : -dragged) > 1);  // mm
    const HapticScene again = openScene(saved);
    CHECK(again.world->obstacles[0].X_WO.p.y() == Approx(start + dragged).margin(1e-5));  // the file stores doubles
    // The configuration folder holds the state for the next window.
    CHECK(engine::RecentScenes(options.configFolder).list() == std::vector{std::filesystem::path(options.scene)});
    CHECK(std::filesystem::exists(options.configFolder / "window.ini"));
}

TEST_CASE("window: opens a scene from the list and a dropped file, and reports a broken file meanwhile", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const WindowRunOptions first = optionsFor(holdFile(folder));
    const auto listed = folder.path() / "listed.glb", dropped = folder.path() / "dropped.glb",
               broken = folder.path() / "broken.glb";
    for (const auto& copy : {listed, dropped}) std::filesystem::copy_file(first.scene, copy);
    std::ofstream(broken) << "no scene";
    WindowRunOptions options = first;
    options.sceneFolders = {folder.path()};
    const auto shows = [](const std::filesystem::path& file) {
        return [=](WindowFrame& frame) { return isRunning(frame) && frame.session.scene()->scene.file == file; };
    };
    User user;
    user.until(isRunning)
        .key(GLFW_KEY_O, true)
        .click("open listed")
        .until(shows(listed))
        .drop(dropped)
        .until(shows(dropped))
        .drop(broken)
        .until([](WindowFrame& frame) {
            const Message& newest = frame.session.log().messages().back();
            return newest.kind == Message::Kind::Error && newest.text.find("broken.glb") != std::string::npos &&
                   frame.items.count("newest message") == 1;
        })
        .until(shows(dropped));
    CHECK(user.use(options));
}

TEST_CASE("window: a scene saved by key and dialog is the same after a reload", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    Settings tuned;
    std::uint64_t number = 0;
    User user;
    user.until(isRunning)
        .doing([&](WindowFrame& frame) {
            tuned = frame.session.settings();
            tuned.stiffness = 2.25;
            frame.session.setSettings(tuned);
            lower(frame.session);
        })
        .key(GLFW_KEY_S, true)
        .click("Save")
        .until([](WindowFrame& frame) { return editsOf(frame) == 0; })  // the file contains them now
        .doing([&](WindowFrame& frame) { number = frame.session.sceneNumber(); })
        .click("menu scene")
        .click("menu reload")  // nothing unsaved, so it does not ask
        .until([&](WindowFrame& frame) { return frame.session.sceneNumber() != number && isRunning(frame); })
        .doing([&](WindowFrame& frame) {
            CHECK(frame.session.settings() == tuned);
            CHECK(obstaclePose(*frame.session.scene(), 0).p.y() == Approx(-4));
        });
    CHECK(user.use(optionsFor(holdFile(folder))));
}

TEST_CASE("window: closing with unsaved changes asks first", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    bool asked = false;
    User user;
    user.until(isRunning)
        .doing([](WindowFrame& frame) { lower(frame.session); })
        .doing([](WindowFrame& frame) {  // as GLFW passes on a close request
            GLFWwindow* const window = frame.window.handle();
            const GLFWwindowclosefun callback = glfwSetWindowCloseCallback(window, nullptr);
            glfwSetWindowCloseCallback(window, callback);
            glfwSetWindowShouldClose(window, GLFW_TRUE);
            callback(window);
        })
        .until([&](WindowFrame& frame) { return asked = frame.items.count("Cancel") > 0; })
        .click("Discard changes")
        .then([](WindowFrame&, int frames) { return frames > 100; });
    CHECK_FALSE(user.use(optionsFor(holdFile(folder))));  // it closed before its time limit
    CHECK(asked);
}

TEST_CASE("window: the menu makes a study of the open scene, once it has a goal", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const auto file = holdFile(folder), study = folder.path() / "hold-study";
    const std::filesystem::path before = std::filesystem::current_path();
    std::filesystem::current_path(folder.path());  // where the dialog proposes the study
    const auto newest = [](WindowFrame& frame) { return frame.session.log().messages().back(); };
    const auto says = [&](Message::Kind kind, const char* words) {
        return [=](WindowFrame& frame) {
            return newest(frame).kind == kind && newest(frame).text.find(words) != std::string::npos;
        };
    };
    User user;
    user.until(isAtRest)
        .click("menu scene")
        .click("menu study")
        .click("Make")
        .until(says(Message::Kind::Error, "A study needs a goal"))
        .click("set goal")
        .until([](WindowFrame& frame) { return frame.session.scene()->roles.goal.has_value(); })
        .click("menu scene")
        .click("menu study")
        .click("Make")
        .until(says(Message::Kind::Note, "touchstone trials"))
        .doing([&](WindowFrame& frame) {
            CHECK_THAT(newest(frame).text, Catch::Contains(shellQuoted((study / kStudyFile).string()) +
                                                           " --headless --out " + shellQuoted(study.string()) + " "));
            CHECK(editsOf(frame) == 1);  // the goal is still to be saved
        })
        .click("menu scene")
        .click("menu study")
        .click("Make")
        .until(says(Message::Kind::Error, "holds a study already"));
    const bool used = user.use(optionsFor(file));
    std::filesystem::current_path(before);
    REQUIRE(used);
    const Protocol protocol = readProtocol(study / kStudyFile);
    CHECK(protocol.trials().size() == 5);
    REQUIRE(protocol.conditions.size() == 1);
    CHECK(openScene(study / protocol.conditions[0].scene).roles.goal);
    CHECK_FALSE(openScene(file).roles.goal);
}

TEST_CASE("window: dragging the tolerance while PQP renders changes its error", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.session.adjust = [](Settings settings) {
        settings.solver = "pqp";
        settings.shadow = kExactSolver;  // measures the solver that renders
        settings.tolerance = 0.5;
        settings.adaptiveMargin = false;
        settings.geometry = Geometry::Spheres;  // many rows: of a hold between meshes PQP finds the answer in time
        return settings;
    };
    double before = 0, after = 0, tolerance = 0;
    User user;
    user.until([](WindowFrame& frame) { return isAtRest(frame) && frame.session.snapshot()->fade == 1; })
        .doing([&](WindowFrame& frame) { before = frame.session.record()->shadowForceError; })
        .drag(onItem("tolerance", 0.95f), onItem("tolerance", 0.15f))  // a finer answer
        .doing([&](WindowFrame& frame) { tolerance = frame.session.settings().tolerance; })
        .until([&](WindowFrame& frame) {  // it starts warm, so its answer improves from tick to tick
            after = frame.session.record()->shadowForceError;
            return frame.session.snapshot()->settings.tolerance == tolerance && after < 0.1 * before;
        });
    const bool used = user.use(options);
    CAPTURE(before, after, tolerance);
    CHECK(used);
    CHECK(tolerance < 1e-3);
    CHECK(before > 1e-3);
}

TEST_CASE("window: asks about a scene in millimeters, scales it, and saves that", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    engine::Scene scene;
    addBox(scene, "peg", glm::vec3(10), {{"role", "tool"}}, {.translation = {0, 20, 0}});
    addBox(scene, "plate", {40, 10, 40}, {{"role", "obstacle"}});
    updateWorldTransforms(scene);
    writeGltf(scene, folder.path() / "mm.glb");
    const auto reach = [](WindowFrame& frame) { return frame.session.scene()->world->reach(); };
    double before = 0, after = 0;
    User user;
    user.until(isRunning)
        .doing([&](WindowFrame& frame) { before = reach(frame); })
        .click("scale scene")
        .until([&](WindowFrame& frame) { return isRunning(frame) && reach(frame) < 100; })
        .doing([&](WindowFrame& frame) {
            after = reach(frame);
            CHECK_FALSE(frame.session.scene()->unit);
            CHECK(frame.session.save(folder.path() / "m.glb", false));
        })
        .until([](WindowFrame& frame) { return frame.items.count("scale scene") == 0; });
    REQUIRE(user.use(optionsFor(folder.path() / "mm.glb")));
    CHECK(after == Approx(before / 1000));
    CHECK(openScene(folder.path() / "m.glb").world->reach() == Approx(after));
}

TEST_CASE("window: checks the fit, and takes the settings that mend it", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    engine::Scene scene;  // a cube between walls that leave it 0.1 mm on each side
    addBox(scene, "cube", glm::vec3(0.01f), {{"role", "tool"}, {"leaves", 64}}, {.translation = {0, 0.02, 0}});
    for (const double side : {-1.0, 1.0})
        addBox(scene, "wall", {0.01f, 0.02f, 0.02f}, {{"role", "obstacle"}, {"leaves", 64}},
               {.translation = {side * 0.0101, 0, 0}});
    setExtras(scene, addNode(scene, "seat", {}, {}),
              {{"touchstone", {{"role", "goal"}, {"goal", {{"tolerance_m", 0.001}, {"depth_m", 0.01}}}}}});
    updateWorldTransforms(scene);
    writeGltf(scene, folder.path() / "between.glb");
    WindowRunOptions options = optionsFor(folder.path() / "between.glb");
    options.session.adjust = [](Settings settings) {
        settings.geometry = Geometry::Spheres;
        return settings;
    };
    const auto verdict = [](WindowFrame& frame) {
        const FitCheck* fit = frame.measure.fit(frame.session).result();
        return fit && frame.items.count("fit verdict") ? fit->verdict : "";
    };
    std::string before, after;
    User user;
    user.until(isRunning)
        .click("check fit")
        .until([&](WindowFrame& frame) { return !(before = verdict(frame)).empty(); })
        .click("take fit settings")
        .until([&](WindowFrame& frame) { return (after = verdict(frame)) != before && !after.empty(); })
        .doing([](WindowFrame& frame) { CHECK(frame.session.settings().geometry == Geometry::Mesh); });
    REQUIRE(user.use(options));
    CHECK_THAT(before, Catch::Contains("sphere trees reach out") && Catch::Contains("a clearance of 0.100 mm"));
    CHECK(after == "goes in with 0.0980 mm to spare");
}

TEST_CASE("window: sweeps a contact, the tolerance moves the marker, and the plots are exported", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const std::filesystem::path picture = folder.path() / "plots.png";
    std::size_t points = 0;
    std::optional<SweepPoint> before, after;
    const auto marker = [](WindowFrame& frame) {
        return pointAt(*frame.measure.sweeps().result(), "pqp", frame.session.settings().tolerance);
    };
    User user;
    user.until(isAtRest)
        .click("tab Speed vs. error")
        .click("sweep")
        .until([](WindowFrame& frame) { return frame.measure.sweeps().result() != nullptr; })
        .doing([&](WindowFrame& frame) {
            points = frame.measure.sweeps().result()->points.size();
            before = marker(frame);
        })
        .drag(onItem("tolerance", 0.97f), onItem("tolerance", 0.9f))
        .doing([&](WindowFrame& frame) {
            after = marker(frame);
            std::snprintf(frame.measure.panel.exportName.data(), frame.measure.panel.exportName.size(), "%s",
                          (folder.path() / "plots").c_str());
        })
        .click("export")
        .click("Plots, PNG")
        .until([&](WindowFrame&) { return std::filesystem::exists(picture); });
    REQUIRE(user.use(optionsFor(holdFile(folder))));
    CHECK(points > solverTable().size());
    REQUIRE((before && after));
    CHECK(after->tolerance > before->tolerance);
    CHECK(after->forceError != before->forceError);
    // The picture shows only the plots, and something is drawn in it.
    const engine::Image png = engine::readPng(picture);
    CHECK(png.width > 200);
    CHECK(png.width < 640);
    CHECK(png.height > 400);
    std::set<std::uint32_t> colors;
    for (std::size_t i = 0; i + 3 < png.rgba.size(); i += 4)
        colors.insert(std::uint32_t(png.rgba[i]) << 16 | std::uint32_t(png.rgba[i + 1]) << 8 | png.rgba[i + 2]);
    CHECK(colors.size() > 50);
}

TEST_CASE("window: reports a scene that cannot be opened, and then ends a run of limited time", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(folder.path() / "missing.glb");
    std::string told;
    options.onEnd = [&](LiveSession& session) {
        for (const Message& message : session.log().messages()) told += message.text;
    };
    CHECK(runWindow(options) == 1);
    CHECK(told.find("missing.glb") != std::string::npos);
}

TEST_CASE("window: the menu starts and stops a recording and shows its folder", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    WindowRunOptions options = optionsFor(holdFile(folder));
    options.recordings = folder.path() / "recordings";
    std::string told;
    User user;
    user.until(isRunning)
        .click("menu scene")
        .click("menu record")
        .until([](WindowFrame& frame) {
            const Recorder* recorder = frame.session.recording().recorder();
            return recorder && recorder->rows() > 50 && frame.items.count("health Recording") > 0;
        })
        .click("menu scene")
        .click("menu record")
        .until([](WindowFrame& frame) { return !frame.session.recording().recorder(); })
        .doing([&](WindowFrame& frame) { told = frame.session.log().messages().back().text; });
    REQUIRE(user.use(options));
    std::vector<std::filesystem::path> made;
    for (const auto& entry : std::filesystem::directory_iterator(options.recordings)) made.push_back(entry.path());
    REQUIRE(made.size() == 1);
    CHECK(made[0].filename().string().rfind("hold-", 0) == 0);
    CHECK_THAT(told, Catch::Matchers::Contains(made[0].string()));
    CHECK(TickFileReader(made[0] / "ticks.npy").rows() > 50);
}

}  // namespace touchstone::window_tests
