// Panels drawn and used in an ImGui context without window or GPU.
#include <imgui.h>

#include <catch2/catch.hpp>

#include "haptics/system/panels.hpp"
#include "tests/system/ui_scene.hpp"

using namespace touchstone;
using namespace touchstone::system;
using namespace touchstone::test;

namespace {

/// An ImGui window of 400 x 2000 in which one panel is drawn, and a mouse.
class Bench {
  public:
    Bench() {
        ImGui::CreateContext();
        ImGuiIO& io = ImGui::GetIO();
        io.IniFilename = nullptr;
        io.DisplaySize = {400, 2000};
        io.DeltaTime = 1 / 60.f;
        unsigned char* pixels = nullptr;
        int width = 0, height = 0;
        io.Fonts->GetTexDataAsRGBA32(&pixels, &width, &height);
    }
    ~Bench() { ImGui::DestroyContext(); }
    Bench(const Bench&) = delete;
    Bench& operator=(const Bench&) = delete;

    template <class Draw>
    void frame(Draw&& draw) {
        ImGui::NewFrame();
        ImGui::SetNextWindowPos({0, 0});
        ImGui::SetNextWindowSize({400, 2000});
        ImGui::Begin("bench");
        items.clear();
        draw();
        ImGui::End();
        ImGui::Render();
    }

    /// Presses and releases the left button at a fraction of an item's width; frames in between.
    template <class Draw>
    void click(const std::string& name, Draw&& draw, float fraction = 0.5f) {
        frame(draw);
        REQUIRE(items.count(name) == 1);
        const glm::vec4 r = items.at(name);
        ImGuiIO& io = ImGui::GetIO();
        io.MousePos = {r.x + fraction * (r.z - r.x), 0.5f * (r.y + r.w)};
        frame(draw);
        io.MouseDown[0] = true;
        frame(draw);
        frame(draw);
        io.MouseDown[0] = false;
        frame(draw);
        frame(draw);
    }

    ItemRects items;
};

}  // namespace

TEST_CASE("haptics panel: every setting has a control of its own", "[panels]") {
    Bench bench;
    Settings settings;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel(settings, requests, &bench.items); };
    bench.click("more", draw);  // opens the rest
    bench.frame(draw);
    for (const SettingInfo& info : settingTable()) {
        CAPTURE(info.key);
        CHECK(bench.items.count(std::string(info.key)) == 1);
    }
}

TEST_CASE("haptics panel: buttons and sliders do what they say", "[panels]") {
    Bench bench;
    Settings settings;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel(settings, requests, &bench.items); };

    bench.click("swap", draw);
    CHECK(settings.solver == findSolver("pqp"));
    CHECK(settings.shadow == kExactSolver);
    bench.click("swap", draw);
    CHECK(settings.solver == kExactSolver);

    bench.click("pause", draw);
    CHECK(settings.pause);
    bench.click("reset", draw);
    CHECK(requests.restart);

    bench.click("stiffness", draw, 0.9f);
    CHECK(settings.stiffness > 2);
    bench.click("margin", draw, 0.05f);
    CHECK(settings.margin < 0.1);
    CHECK(settings.trust <= settings.margin);  // was taken along
    bench.click("trust", draw, 0.9f);
    CHECK(settings.trust > 1);
    CHECK(settings.margin >= settings.trust);
    CHECK(checkSettings(settings).empty());
    CHECK(requests.refusal.empty());
}

TEST_CASE("haptics panel: a value that is typed is kept to its last digit, one that is not accepted is told",
          "[panels]") {
    Bench bench;
    Settings settings;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel(settings, requests, &bench.items); };
    ImGuiIO& io = ImGui::GetIO();
    for (int key = 0; key < ImGuiKey_COUNT; ++key) io.KeyMap[key] = key;
    const auto type = [&](const std::string& text) {
        io.KeyCtrl = true;
        bench.click("stiffness", draw);
        io.KeyCtrl = false;
        for (const char c : text) io.AddInputCharacter(static_cast<unsigned>(c));
        bench.frame(draw);
        io.KeysDown[ImGuiKey_Enter] = true;
        bench.frame(draw);
        io.KeysDown[ImGuiKey_Enter] = false;
        bench.frame(draw);
    };
    type("12.3456");  // beyond the slider, within the setting's range
    CHECK(settings.stiffness == 12.3456);
    CHECK(requests.refusal.empty());
    type("5000");
    CHECK(settings.stiffness == 12.3456);
    CHECK(requests.refusal.find("stiffness") != std::string::npos);
}

TEST_CASE("scene panel: hides nodes, chooses levels and asks for roles", "[panels]") {
    Bench bench;
    HapticScene scene = openScene(holdScene());
    DisplayOptions display;
    ScenePanelState state;
    PanelRequests requests;
    const auto draw = [&] { drawScenePanel(scene, true, display, state, requests, &bench.items); };

    bench.click("visible cube", draw);
    CHECK_FALSE(scene.scene.registry.get<engine::Visibility>(scene.roles.tool).visible);
    bench.click("Tool spheres", draw, 0.99f);
    CHECK(display.toolLevel == 0);
    bench.click("Obstacle spheres", draw, 0.01f);
    CHECK(display.obstacleLevel == -1);
    bench.click("Contacts", draw, 0.1f);
    CHECK_FALSE(display.contacts);

    bench.click("node slab", draw, 0.3f);
    CHECK(state.selected == scene.roles.obstacles[0]);
    bench.click("role", draw);
    bench.click("role goal", draw);
    REQUIRE(requests.role);
    CHECK(requests.role->first == scene.roles.obstacles[0]);
    CHECK(requests.role->second == Role::Goal);
}

TEST_CASE("panels: each draws with nothing to show, and with odd values", "[panels]") {
    Bench bench;
    PlotsPanelState plots;
    TickHistory history(64);
    LoopSnapshot snapshot;
    const RealTimeStatus realTime{.message = "no priority"};
    std::vector<Message> messages;
    const std::string device = "demo";
    PanelRequests requests;
    const auto draw = [&](const LoopSnapshot* shown) {
        bench.frame([&] {
            drawPlotsPanel(history, {}, plots, &bench.items);
            drawStatusPanel({shown, &realTime, device, messages});
            drawOpening({"bunnies.glb", "gold bunny", 0.4}, requests, &bench.items);
        });
    };
    draw(nullptr);
    draw(&snapshot);
    snapshot.record.flags = ~0u;
    snapshot.trips[0] = {3, 7};
    messages = {{Message::Kind::Error, "100 % of this %s is text.", 1}, {Message::Kind::Note, "", 2}};
    for (int i = 0; i < 100; ++i) {
        TickRecord record;
        record.totalUs = i;
        record.wrench_C.force = Vec3(1e300, 0, 0);
        history.push(record);
    }
    draw(&snapshot);
    CHECK(ImGui::GetDrawData()->TotalVtxCount > 0);
    CHECK(bench.items.count("cancel opening") == 1);
}
