// A tour of the window: every panel, menu, dialog and message is opened, and no text may be cut off or covered. With
// TOUCHSTONE_WINDOW_PICTURES=FOLDER it writes a picture of each, at two sizes: tools/window_pictures.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "haptics/sandbox/trials/live_trials.hpp"
#include "tests/support/fake_dhd/fake_dhd_device.hpp"
#include "tests/support/fake_hd/fake_hd_device.hpp"
#include "tests/support/fake_inverse/fake_inverse.hpp"
#include "tests/support/ui_scene.hpp"
#include "tests/support/ui_text.hpp"
#include "tests/support/ui_user.hpp"

namespace touchstone::window_tour_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

std::filesystem::path bundled(const char* scene) { return TOUCHSTONE_BINARY_DIR "/scenes/" + std::string(scene); }

/// A user who looks at the window at one size.
class Tour : public User {
  public:
    explicit Tour(glm::ivec2 size) : size_(size) {
        if (const char* folder = std::getenv("TOUCHSTONE_WINDOW_PICTURES"))
            pictures_ = std::filesystem::path(folder) / (std::to_string(size.x) + "x" + std::to_string(size.y));
        if (!pictures_.empty()) std::filesystem::create_directories(pictures_);
    }

    WindowRunOptions options(const std::filesystem::path& scene) const {
        WindowRunOptions options = optionsFor(scene);
        options.window.width = size_.x;
        options.window.height = size_.y;
        options.seconds = 600;
        return options;
    }

    /// Waits until the frame is at rest, and looks at it.
    Tour& look(const std::string& name) {
        then([](WindowFrame&, int frames) { return frames > 4; });
        if (!pictures_.empty())
            doing([this, name](WindowFrame& frame) { frame.screenshot = pictures_ / (name + ".png"); });
        doing([name](WindowFrame&) {
            CAPTURE(name);
            const TextFaults faults = textFaults();
            CHECK(faults.cut == std::vector<std::string>());
            CHECK(faults.covered == std::vector<std::string>());
        });
        return *this;
    }
    /// Moves the mouse off all controls.
    Tour& aside() {
        moveTo([](WindowFrame& frame) { return glm::vec2(frame.picture.x + 30, frame.picture.w - 120); }, 1);
        return *this;
    }

  private:
    glm::ivec2 size_;
    std::filesystem::path pictures_;
};

/// Text is cut off first where there is the least room; pictures also show a large window.
glm::ivec2 anySize() {
    const int sizes = std::getenv("TOUCHSTONE_WINDOW_PICTURES") ? 2 : 1;
    return GENERATE_COPY(range(0, sizes)) ? glm::ivec2(1920, 1080) : glm::ivec2(1280, 800);
}
bool isRunning(WindowFrame& frame) { return frame.session.running(); }

}  // namespace

TEST_CASE("window tour: panels, menus and dialogs", "[ui][long]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    Tour tour(anySize());
    WindowRunOptions options = tour.options(bundled("spline.glb"));
    options.sceneFolders = {bundled("")};
    options.configFolder = folder.path() / "config";
    const auto broken = folder.path() / "broken.glb";
    std::ofstream(broken) << "no scene";

    tour.until([](WindowFrame& frame) { return isRunning(frame) && frame.session.record()->tick > 2800; });
    tour.aside().look("window");
    tour.tap(GLFW_KEY_F2).tap(GLFW_KEY_F3).tap(GLFW_KEY_F4), tour.aside().look("folded");
    tour.tap(GLFW_KEY_F2).tap(GLFW_KEY_F3).tap(GLFW_KEY_F4);
    for (const auto& [tab, name] :
         {std::pair{"tab Contact", "plots-contact"}, std::pair{"tab Friction", "plots-friction"}})
        tour.click(tab), tour.aside().look(name);
    tour.click("tab Speed vs. error").click("sweep");
    tour.until([](WindowFrame& frame) { return frame.measure.sweeps().result() != nullptr; });
    tour.aside().look("plots-speed-error");
    tour.click("export"), tour.look("plots-export");
    tour.key(GLFW_KEY_ESCAPE).click("hold plots"), tour.aside().look("plots-held");
    tour.click("hold plots").click("tab Time");
    for (const char* menu : {"menu scene", "menu edit", "menu device", "menu view"}) {
        std::string name = menu;
        name[4] = '-';
        tour.click(menu), tour.look(name);
        tour.click(menu);
    }
    tour.aside().tap(GLFW_KEY_F1), tour.look("help");
    tour.tap(GLFW_KEY_F1).key(GLFW_KEY_O, true), tour.look("dialog-open");
    tour.tap(GLFW_KEY_ESCAPE).key(GLFW_KEY_S, true), tour.look("dialog-save");
    tour.tap(GLFW_KEY_ESCAPE).click("menu scene").click("menu add"), tour.look("dialog-add");
    tour.tap(GLFW_KEY_ESCAPE).click("menu scene").click("menu study"), tour.look("dialog-study");
    tour.tap(GLFW_KEY_ESCAPE).click("menu device").click("device replay"), tour.look("dialog-replay");
    tour.tap(GLFW_KEY_ESCAPE).wheel(inSettings, -200).click("more").wheel(inSettings, -200);
    tour.aside().look("settings-more");
    tour.wheel(inSettings, 200).click("check fit");
    tour.until([](WindowFrame& frame) { return frame.items.count("fit verdict") > 0; });
    tour.aside().look("fit");
    tour.click("node hole"), tour.aside().look("selected");
    tour.click("role"), tour.look("selected-role");
    tour.click("node shaft").click("node shaft").click("Section"), tour.aside().look("selected-tool");
    tour.doing([](WindowFrame& frame) {
        const auto place =
            frame.session.scene()->scene.registry.get<engine::LocalTransform>(frame.session.scene()->scene.nodes[1]);
        auto moved = place;
        moved.translation.x += 1e-4;
        frame.session.edit({engine::PlaceNode{1, place, moved}});
    });
    tour.click("menu scene").click("menu reload"), tour.look("dialog-unsaved");
    tour.click("Cancel").key(GLFW_KEY_Z, true);
    tour.until([](WindowFrame& frame) { return frame.session.newest().edits.empty(); }).drop(broken);
    tour.until([](WindowFrame& frame) {
        const auto& messages = frame.session.log().messages();
        return std::any_of(messages.begin(), messages.end(), [](const Message& message) {
            return message.kind == Message::Kind::Error && message.text.find("broken.glb") != std::string::npos;
        });
    });
    tour.aside().look("error");
    CHECK(tour.use(options));
}

TEST_CASE("window tour: an unmarked scene, and one that opens slowly", "[ui][long]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    engine::Scene scene;
    addBox(scene, "peg", glm::vec3(10), {}, {.translation = {0, 20, 0}});
    addBox(scene, "plate", {40, 10, 40}, {});
    updateWorldTransforms(scene);
    writeGltf(scene, folder.path() / "unmarked.glb");
    Tour tour(anySize());
    WindowRunOptions options = tour.options({});
    options.sceneFolders = {bundled("")};
    options.session.treeCache.clear();  // so that trees take their time
    options.session.adjust = [](Settings settings) {
        settings.geometry = Geometry::Spheres;
        return settings;
    };
    tour.look("start");
    tour.tap(GLFW_KEY_ESCAPE), tour.aside().look("empty");
    tour.drop(folder.path() / "unmarked.glb");
    tour.until([](WindowFrame& frame) { return frame.items.count("guide peg") > 0; });
    tour.aside().look("guide-tool");
    tour.click("guide peg");
    tour.until([](WindowFrame& frame) { return frame.items.count("guide all") > 0; });
    tour.aside().look("guide-obstacles");
    tour.drop(bundled("bunnies.glb")).click("Discard changes");
    tour.until([](WindowFrame& frame) { return frame.items.count("cancel opening") > 0; });
    tour.look("opening");
    tour.click("cancel opening");
    CHECK(tour.use(options));
}

TEST_CASE("window tour: an assembly in a STEP file", "[ui][long]") {
    if (!hasDisplay() || !std::filesystem::exists(TOUCHSTONE_BINARY_DIR "/touchstone-step")) return;
    const TempFolder folder;
    const auto file = folder.path() / "housing.step";
    REQUIRE(std::system(
                ("'" TOUCHSTONE_BINARY_DIR "/make_step_parts' housing-with-screws '" + file.string() + "'").c_str()) ==
            0);
    Tour tour(anySize());
    WindowRunOptions options = tour.options(file);
    options.session.treeCache = folder.path();
    tour.until([](WindowFrame& frame) { return frame.items.count("guide housing") > 0; });
    tour.aside().look("step-assembly");
    tour.click("guide screw 3");
    tour.until([](WindowFrame& frame) { return frame.items.count("guide all") > 0; });
    tour.aside().look("step-tool");
    tour.click("guide all").until(isRunning);
    tour.aside().look("step-running");
    CHECK(tour.use(options));
}

TEST_CASE("window tour: a device with motors", "[ui][long]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const FakeHd fake;
    Tour tour(anySize());
    tour.until(isRunning);
    tour.doing([](WindowFrame& frame) { frame.session.chooseDevice("phantom:,stale=500"); });
    tour.until([](WindowFrame& frame) { return frame.items.count("device state") > 0; });
    tour.aside().look("device");
    FakeInverse service("no-grip");
    tour.doing([&](WindowFrame& frame) { frame.session.chooseDevice("inverse3:" + service.options()); });
    tour.until([](WindowFrame& frame) { return frame.session.device().choice.rfind("inverse3", 0) == 0; });
    tour.aside().look("device-force-only");
    tour.doing([&](WindowFrame&) { service.event("device-safety-triggered", "error", "stall_detected"); });
    tour.until([](WindowFrame& frame) {
        return frame.session.device().facts.status &&
               frame.session.device().facts.status->state == DeviceStatus::State::Fault;
    });
    tour.aside().look("device-fault");
    tour.doing([](WindowFrame& frame) { frame.session.chooseDevice("spacemouse"); });
    tour.aside().look("device-trouble");
    CHECK(tour.use(tour.options(holdFile(folder))));
}

TEST_CASE("window tour: an arm that moves only after consent, and an arm over the network", "[ui]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const FakeDhd fake("uncalibrated,omega6");
    Tour tour(anySize());
    tour.until(isRunning).click("menu device").click("device forcedimension");
    tour.until([](WindowFrame& frame) { return frame.items.count("initialize") > 0; });
    tour.aside().look("device-uninitialized").click("initialize");
    tour.aside().look("device-consent");
    tour.click("initialize cancel").click("initialize");
    tour.doing([&](WindowFrame&) { CHECK(fake.state().moves == 0); }).click("initialize now");
    tour.until([](WindowFrame& frame) {
        return frame.session.device().facts.status->state == DeviceStatus::State::Running &&
               frame.items.count("initialize") == 0;
    });
    tour.doing([&](WindowFrame&) { CHECK(fake.state().moves == 1); });
    tour.aside().look("device-initialized");
    tour.click("menu device").click("device lab");
    tour.until([](WindowFrame& frame) { return frame.session.device().choice == "lab"; });
    tour.aside().look("device-lab");
    CHECK(tour.use(tour.options(holdFile(folder))));
}

TEST_CASE("window tour: a study", "[ui][long]") {
    if (!hasDisplay()) return;
    const TempFolder folder;
    const auto file = folder.path() / "down.glb";
    engine::writeGltf(downScene(4), file);
    const Protocol protocol = readProtocol(
        nlohmann::ordered_json{
            {"format", "touchstone trials"},
            {"participants", {"ada", "bob"}},
            {"device", "insert"},
            {"conditions",
             {{{"name", "stiff hand"}, {"scene", file.string()}},
              {{"name", "soft hand, 0.2 mm of clearance"}, {"scene", file.string()}, {"stiffness", 0.5}}}}},
        "study");
    const std::vector<Trial> trials = protocol.trials();
    LiveTrials live(protocol,
                    {.queue = {trials.begin(), trials.end()},
                     .sceneFile = [](const std::string& name) { return std::filesystem::path(name); },
                     .folder = [&](const Trial& trial) { return folder.path() / std::to_string(trial.number); },
                     .done = [](const Trial&, const nlohmann::ordered_json&) {}});
    Tour tour(anySize());
    WindowRunOptions options = tour.options(file);
    LiveSession* session = nullptr;
    options.session.device = live.restingDevice();
    options.session.adjust = [&](const Settings& settings) { return live.settings(settings); };
    options.session.onTick = [&](const TickRecord& tick) {
        if (session) live.add(tick, *session);
    };
    options.study = true;
    options.panel = [&](LiveSession& shown, const glm::vec4& picture, engine::ItemRects& items) {
        live.draw(shown, picture, &items);
    };
    options.onFrame = [&](WindowFrame& frame) {
        session = &frame.session;
        live.update(frame.session);
    };
    const auto ready = [&](WindowFrame& frame) { return live.ready(frame.session); };
    tour.until(ready).tap(GLFW_KEY_F4);
    tour.aside().look("trials-ready");
    tour.doing([](WindowFrame& frame) {  // what the study has is not there to be changed
        for (const char* item : {"set goal", "record demonstration", "stiffness", "preset default"})
            CHECK(frame.items.count(item) == 0);
    });
    tour.click("trial start").until([&](WindowFrame&) { return live.running(); });
    tour.aside().look("trials-running");
    tour.until(ready);
    tour.aside().look("trials-next");
    for (std::size_t left = trials.size() - 1; left > 0; --left)
        tour.until(ready).click("trial start").until([&](WindowFrame&) { return live.running(); }).click("trial abort");
    tour.until([&](WindowFrame&) { return live.left() == 0; });
    tour.aside().look("trials-done");
    CHECK(tour.use(options));
}

}  // namespace touchstone::window_tour_tests
