// A study in the window: Start is pressed, the trial ends by itself or is aborted, and the next one is there.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <map>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>

#include "haptics/system/app_window.hpp"
#include "haptics/system/trials/live_trials.hpp"
#include "tests/system/ui_scene.hpp"

using namespace touchstone;
using namespace touchstone::system;
using namespace touchstone::test;
using nlohmann::ordered_json;

TEST_CASE("window: trials are started, end, are aborted, and are recorded", "[ui]") {
    if (!std::getenv("DISPLAY") && !std::getenv("WAYLAND_DISPLAY")) {
        WARN("skipped: there is no display; run the tests under xvfb-run");
        return;
    }
    const TempFolder folder;
    engine::Scene scene = pressScene();
    const engine::Entity goal = addNode(scene, "down", {}, {.translation = {0, 0.010, 0}});
    setExtras(scene, goal,
              {{"touchstone",
                {{"role", "goal"}, {"goal", {{"tolerance_m", 0.003}, {"tolerance_rad", 0.5}, {"hold_s", 0.3}}}}}});
    updateWorldTransforms(scene);
    const std::filesystem::path file = folder.path() / "down.glb";
    engine::writeGltf(scene, file);

    const Protocol protocol =
        readProtocol(ordered_json{{"format", "touchstone trials"},
                                  {"participants", 2},
                                  {"conditions", {{{"scene", file.string()}, {"stiffness", 0.7}}}}},
                     "study");
    const std::vector<Trial> trials = protocol.trials();
    std::map<int, ordered_json> rows;
    LiveTrials live(protocol,
                    {.queue = {trials.begin(), trials.end()},
                     .sceneFile = [](const std::string& name) { return std::filesystem::path(name); },
                     .folder = [&](const Trial& trial) { return folder.path() / std::to_string(trial.number); },
                     .done = [&](const Trial& trial, const ordered_json& row) { rows[trial.number] = row; }});

    WindowRunOptions options;
    options.scene = file;
    options.seconds = 60;  // a test that fails does not hang
    options.session.treeCache.clear();
    options.session.loop.realTime.raise = false;
    options.session.device = live.restingDevice();
    CHECK(options.session.device == "mouse");
    LiveSession* session = nullptr;
    options.session.adjust = [&](const Settings& settings) { return live.settings(settings); };
    options.session.onTick = [&](const TickRecord& tick) {
        if (session) live.add(tick, *session);
    };
    options.panel = [&](LiveSession& shown, const glm::vec4& picture, ItemRects& items) {
        live.draw(shown, picture, &items);
    };
    double stiffness = 0;
    bool down = false;
    long pause = 0;
    options.onFrame = [&](WindowFrame& frame) {
        session = &frame.session;
        live.update(frame.session);
        if (live.left() == 0) glfwSetWindowShouldClose(frame.window.handle(), GLFW_TRUE);
        if (live.running()) stiffness = frame.session.settings().stiffness;
        // The second trial is aborted once it touches something; all else is a press of Start.
        const bool abort = live.running() && live.left() == 1 && frame.session.record() &&
                           frame.session.record()->wrench_C.force.norm() > 0.1;
        const auto item = frame.items.find(abort ? "trial abort" : "trial start");
        const bool wanted = item != frame.items.end() && (abort || live.ready(frame.session));
        if (!wanted || ++pause < 10) return;  // the cursor needs a few frames to be there
        const glm::vec4& r = item->second;
        glfwSetCursorPos(frame.window.handle(), (r.x + r.z) / 2.0, (r.y + r.w) / 2.0);
        down = pause % 10 == 5;
        if (down) ImGui_ImplGlfw_MouseButtonCallback(frame.window.handle(), GLFW_MOUSE_BUTTON_LEFT, GLFW_PRESS, 0);
    };
    runWindow(options);

    REQUIRE(rows.size() == 2);
    CHECK(rows[1].at("outcome") == "seated");
    CHECK(rows[2].at("outcome") == "abort");
    CHECK(stiffness == 0.7);
    for (const auto& [number, row] : rows) {
        INFO(row);
        CHECK(row.at("force_peak_N").get<double>() > 0.1);
        CHECK_FALSE(row.at("deadline_misses").is_null());
        CHECK(isRecording(folder.path() / std::to_string(number)));
    }
    CHECK(rows[1].size() == rows[2].size());
}
