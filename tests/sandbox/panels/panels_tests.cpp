// Panels drawn and operated in an ImGui context without window or GPU.
#include <imgui.h>
#include <imgui_internal.h>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "engine/scene/rigid_bodies.hpp"
#include "haptics/builder/mesh_words.hpp"
#include "haptics/device/safety.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/sandbox/panels/panel_plots.hpp"
#include "haptics/sandbox/panels/panels.hpp"
#include "haptics/sandbox/panels/status_bar.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "tests/support/ui_scene.hpp"
#include "tests/support/ui_text.hpp"

namespace touchstone::panels_tests {

using namespace touchstone::sandbox;
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
        for (int key = 0; key < ImGuiKey_COUNT; ++key) io.KeyMap[key] = key;
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

    /// Ctrl+clicks a control, types into its text field, and presses Enter.
    template <class Draw>
    void type(const std::string& name, const std::string& text, Draw&& draw, float fraction = 0.5f) {
        ImGuiIO& io = ImGui::GetIO();
        io.KeyCtrl = true;
        click(name, draw, fraction);
        io.KeyCtrl = false;
        for (const char c : text) io.AddInputCharacter(static_cast<unsigned>(c));
        frame(draw);
        io.KeysDown[ImGuiKey_Enter] = true;
        frame(draw);
        io.KeysDown[ImGuiKey_Enter] = false;
        frame(draw);
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

    engine::ItemRects items;
};

HapticScene openWithTrees(engine::Scene scene) {
    return openScene(std::move(scene), {.treeCache = {}, .progress = {}, .allTrees = true});
}

}  // namespace

TEST_CASE("haptics panel: every setting has its own control", "[panels]") {
    Bench bench;
    Settings settings;
    HapticsPanelState state;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel({}, {}, settings, state, requests, &bench.items); };
    bench.click("more", draw);  // opens the remaining settings
    bench.frame(draw);
    for (const SettingInfo& info : settingTable()) {
        CAPTURE(info.key);
        CHECK(bench.items.count(std::string(info.key)) == 1);
    }
}

TEST_CASE("haptics panel: buttons and sliders change their settings", "[panels]") {
    Bench bench;
    Settings settings;
    HapticsPanelState state;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel({}, {}, settings, state, requests, &bench.items); };

    bench.click("swap", draw);
    CHECK(settings.solver == "pqp");
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
    CHECK(settings.trust <= settings.margin);  // lowered together with the margin
    bench.click("trust", draw, 0.9f);
    CHECK(settings.trust > 1);
    CHECK(settings.margin >= settings.trust);
    CHECK(checkSettings(settings).empty());
    CHECK(requests.refusal.empty());
}

TEST_CASE("haptics panel: no knob covers its value, and a factor keeps its decimals", "[panels]") {
    Bench bench;
    Settings settings;
    HapticsPanelState state;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel({}, {}, settings, state, requests, &bench.items); };
    bench.click("more", draw);
    for (const double share : {0.02, 0.5, 0.98})
        for (const SettingInfo& info : settingTable()) {
            const std::string name(info.key);
            if (bench.items.count(name + " value") == 0) continue;  // a name or a switch
            CAPTURE(name, share);
            bench.click(name, draw, static_cast<float>(share));
            const glm::vec4 slider = bench.items.at(name), value = bench.items.at(name + " value");
            CHECK(value.w <= slider.y);
            CHECK(value.z <= slider.z + 1);  // aligned at the right, within the panel
            CHECK(value.w - value.y < 1.5f * ImGui::GetFontSize());
        }
    bench.click("friction_coefficient", draw, 0.4f);
    CHECK(settings.frictionCoefficient == Approx(0.4).margin(0.05));
    bench.click("linearizations", draw, 0.4f);
    CHECK(settings.linearizations == 6);
}

TEST_CASE("haptics panel: a tooltip lies beside what it explains, and geometry is chosen where it has an effect",
          "[panels]") {
    Bench bench;
    Settings settings;
    HapticsPanelState state;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel({}, {}, settings, state, requests, &bench.items); };
    bench.frame(draw);
    for (const char* item : {"stiffness", "stiffness value", "solver", "pause", "swap"}) {
        CAPTURE(item);
        const glm::vec4 r = bench.items.at(item);
        ImGui::GetIO().MousePos = {0.5f * (r.x + r.z), 0.5f * (r.y + r.w)};
        for (int i = 0; i < 3; ++i) bench.frame(draw);
        const ImGuiWindow* tip = ImGui::FindWindowByName("##Tooltip_00");
        REQUIRE(tip);
        REQUIRE(tip->Active);
        const bool beside = tip->Pos.y >= r.w || tip->Pos.y + tip->Size.y <= r.y;
        CHECK(beside);
    }
    const auto chosen = [&] {
        bench.click("geometry", draw);
        return ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopupId | ImGuiPopupFlags_AnyPopupLevel);
    };
    settings.mode = Mode::Penalty;
    CHECK_FALSE(chosen());
    settings.mode = Mode::Default;
    CHECK(chosen());
}

TEST_CASE("haptics panel: a typed value is kept to its last digit, an invalid one is refused with a message",
          "[panels]") {
    Bench bench;
    Settings settings;
    HapticsPanelState state;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel({}, {}, settings, state, requests, &bench.items); };
    bench.type("stiffness", "12.3456", draw);  // beyond the slider, within the setting's range
    CHECK(settings.stiffness == 12.3456);
    CHECK(requests.refusal.empty());
    bench.type("stiffness", "5000", draw);
    CHECK(settings.stiffness == 12.3456);
    CHECK(requests.refusal.find("stiffness") != std::string::npos);
}

TEST_CASE("scene panel: hides nodes, chooses levels and selects", "[panels]") {
    Bench bench;
    HapticScene scene = openWithTrees(holdScene());
    DisplayOptions display;
    ScenePanelState state;
    const auto draw = [&] { drawScenePanel(scene, Geometry::Spheres, display, state, &bench.items); };

    bench.click("visible cube", draw);
    CHECK_FALSE(scene.scene.registry.get<engine::Visibility>(scene.roles.tool).visible);
    bench.click("Spheres", draw, 0.1f);
    bench.click("Tool spheres", draw, 0.99f);
    CHECK(display.toolLevel == 0);
    bench.click("Obstacle spheres", draw, 0.01f);
    CHECK(display.obstacleLevel == -1);
    bench.click("Contacts", draw, 0.1f);
    CHECK_FALSE(display.contacts);
    bench.click("node slab", draw, 0.3f);
    CHECK(state.selected == scene.roles.obstacles[0]);
}

TEST_CASE("inspector: requests a role and another tree", "[panels]") {
    Bench bench;
    HapticScene scene = openWithTrees(holdScene());
    InspectorState state;
    PanelRequests requests;
    const auto draw = [&] {
        drawInspector(scene, Geometry::Spheres, scene.roles.obstacles[0], state, requests, &bench.items);
    };
    bench.click("role", draw);
    bench.click("role goal", draw);
    CHECK(requests.markings == std::vector<Marking>{GiveRole{1, Role::Goal}});
    requests = {};

    bench.click("build tree", draw);
    CHECK(requests.markings.empty());  // choosing its present role changes nothing
    bench.click("tree by", draw);
    bench.click("tree by error", draw);
    bench.click("build tree", draw);
    REQUIRE(requests.markings.size() == 1);
    const auto& chosen = std::get<ChooseTree>(requests.markings[0]);
    CHECK(chosen.node == 1);
    CHECK(chosen.tree.maxError == Approx(scene.world->obstacles[0].part.spheres->certificate.protrusion));
    CHECK(bench.items.count("tree words") == 1);
    CHECK(bench.items.count("material 1") == 1);

    bench.click("shown", draw, 0.1f);
    CHECK_FALSE(scene.scene.registry.get<engine::Visibility>(scene.roles.obstacles[0]).visible);
}

TEST_CASE("panels: between meshes they show trees and their options only of what is touched by its spheres",
          "[panels]") {
    Bench bench;
    engine::Scene made = holdScene();
    const bool open = GENERATE(false, true);
    if (open) {
        // The slab loses two of its faces, more than one cap closes.
        auto& instance = made.registry.get<engine::MeshInstance>(made.nodes[1]);
        auto mesh = std::make_shared<engine::MeshData>(*instance.primitives[0].mesh);
        mesh->indices.resize(mesh->indices.size() - 12);
        instance.primitives[0].mesh = mesh;
    }
    HapticScene scene = openWithTrees(std::move(made));
    ScenePanelState panel;
    InspectorState state;
    PanelRequests requests;
    DisplayOptions display;
    Geometry geometry = Geometry::Mesh;
    const auto draw = [&] { drawScenePanel(scene, geometry, display, panel, &bench.items); };
    const auto inspect = [&] {
        drawInspector(scene, geometry, scene.roles.obstacles[0], state, requests, &bench.items);
    };
    const auto shows = [&](const std::string& item, const std::function<void()>& drawn) {
        bench.items.clear();
        bench.frame(drawn);
        return bench.items.count(item) == 1;
    };
    for (const char* item : {"tree cube", "tree slab", "Spheres"}) CHECK(shows(item, draw) == open);
    CHECK_FALSE(shows("Tool spheres", draw));
    for (const char* item : {"mesh cube", "mesh slab"}) CHECK(shows(item, draw) == !open);
    CHECK(shows("By gap", draw));
    for (const char* item : {"tree by", "build tree", "tree words", "defects"}) CHECK(shows(item, inspect) == open);
    CHECK(shows("mesh words", inspect) == !open);

    Settings settings;
    settings.geometry = geometry;
    const auto sentences = touchedBySpheres(scene, settings);
    REQUIRE(sentences.size() == (open ? 1 : 0));
    if (open) {
        CHECK(sentences[0].find("slab") != std::string::npos);
        CHECK(sentences[0].find("2 holes (8 open edges)") != std::string::npos);
    }
    settings.mode = Mode::Penalty;  // touches spheres only
    CHECK(touchedBySpheres(scene, settings).empty());

    // With spheres as the geometry they are there, and their levels where the user shows them.
    geometry = Geometry::Spheres;
    for (const char* item : {"tree cube", "tree slab", "Spheres"}) CHECK(shows(item, draw));
    CHECK_FALSE(shows("Tool spheres", draw));
    CHECK(shows("tree by", inspect));
    CHECK_FALSE(shows("defects", inspect));
    geometry = Geometry::Mesh;
    display.showTrees(0);
    CHECK(shows("Tool spheres", draw));
}

TEST_CASE("inspector: the page of a part says what was repaired in its mesh", "[panels]") {
    Bench bench;
    engine::Scene made = holdScene();
    const bool twice = GENERATE(false, true);
    if (twice) drawTwice(made, made.nodes[1]);
    HapticScene scene = openScene(std::move(made), {});
    InspectorState state;
    PanelRequests requests;
    bench.frame([&] { drawInspector(scene, Geometry::Mesh, scene.roles.obstacles[0], state, requests, &bench.items); });
    CHECK(bench.items.count("repairs") == (twice ? 1 : 0));
    CHECK(repairSentences(scene).size() == (twice ? 1 : 0));
    CHECK(reshapedSentences(scene).empty());  // copies change no surface, so opening the scene says nothing
}

TEST_CASE("inspector: a typed place moves the node there, in mm and degrees", "[panels]") {
    Bench bench;
    HapticScene scene = openScene(holdScene(), {.treeCache = {}, .progress = {}, .buildWorld = false});
    InspectorState state;
    PanelRequests requests;
    const auto draw = [&] {
        drawInspector(scene, Geometry::Spheres, scene.scene.nodes[1], state, requests, &bench.items);
    };
    const auto type = [&](const std::string& item, float fraction, const std::string& text) {
        requests = {};
        bench.type(item, text, draw, fraction);
        REQUIRE(requests.edits.size() == 1);
        return std::get<engine::PlaceNode>(requests.edits[0]);
    };
    const engine::PlaceNode moved = type("position", 0.1f, "12.5");
    CHECK(moved.node == 1);
    CHECK(moved.to.translation.x == Approx(0.0125).margin(1e-12));
    CHECK(moved.to.translation.y == moved.from.translation.y);
    CHECK(moved.to.rotation == moved.from.rotation);

    const engine::PlaceNode turned = type("rotation", 0.5f, "120");
    CHECK(turned.to.translation == turned.from.translation);
    const glm::dquat wanted = glm::angleAxis(glm::radians(120.0), glm::dvec3(0, 1, 0));
    CHECK(std::abs(glm::dot(turned.to.rotation, wanted)) == Approx(1).margin(1e-12));
}

TEST_CASE("inspector: renames and paints a node", "[panels]") {
    Bench bench;
    HapticScene scene = openScene(holdScene(), {.treeCache = {}, .progress = {}, .buildWorld = false});
    InspectorState state;
    PanelRequests requests;
    const auto draw = [&] {
        drawInspector(scene, Geometry::Spheres, scene.scene.nodes[1], state, requests, &bench.items);
    };
    bench.type("name", "table", draw, 0.9f);
    REQUIRE(requests.edits.size() == 1);
    const engine::RenameNode renamed = std::get<engine::RenameNode>(requests.edits[0]);
    CHECK(renamed.node == 1);
    CHECK(renamed.from == "slab");
    CHECK(renamed.to == "table");

    requests = {};
    bench.click("metallic 1", draw, 0.95f);
    REQUIRE(requests.edits.size() == 1);
    const engine::PaintMaterial metal = std::get<engine::PaintMaterial>(requests.edits[0]);
    CHECK(metal.material == 1);
    CHECK(metal.from == engine::looksOf(scene.scene.materials[1]));
    CHECK(metal.to.metallic > 0.8f);
    CHECK(metal.to.roughness == metal.from.roughness);
    CHECK(metal.to.baseColor == metal.from.baseColor);  // showing a color does not change it
}

TEST_CASE("inspector: gives a part friction, changes its values and takes it away", "[panels]") {
    Bench bench;
    engine::Scene made = holdScene();
    const bool shared = GENERATE(false, true);
    if (shared)
        for (int node = 0; node < 2; ++node)
            addPhysics(made, made.nodes[std::size_t(node)],
                       {{"collider", {{"geometry", {{"node", node}}}, {"physicsMaterial", 0}}}});
    if (shared) {
        (*made.registry.get<engine::NodeMarking>(made.nodes[0]).extensions)[engine::kRigidBodies]["motion"] =
            nlohmann::json::object();
        (*made.extensions)[engine::kRigidBodies]["physicsMaterials"] =
            nlohmann::json::array({{{"staticFriction", 0.7}, {"dynamicFriction", 0.5}}});
    }
    HapticScene scene = openScene(std::move(made), {.treeCache = {}, .progress = {}, .buildWorld = false});
    InspectorState state;
    PanelRequests requests;
    const auto draw = [&] {
        drawInspector(scene, Geometry::Mesh, scene.scene.nodes[1], state, requests, &bench.items);
    };
    const auto chosen = [&] {
        REQUIRE(requests.markings.size() == 1);
        const Marking marking = requests.markings[0];
        const auto& friction = std::get<ChooseFriction>(marking);
        CHECK(friction.node == 1);
        applyMarking(scene.scene, marking);  // as the session does
        scene.roles = assignRoles(scene.scene);
        requests = {};
        return friction.friction;
    };
    using enum engine::FrictionCombine;
    if (!shared) {
        bench.frame(draw);
        CHECK(bench.items.count("static friction") == 0);
        bench.click("friction", draw, 0.1f);
        CHECK(chosen() == engine::FrictionMaterial{0.6, 0.6, Average});
    }
    bench.type("static friction", "1.25", draw);
    CHECK(chosen() == engine::FrictionMaterial{.staticFriction = 1.25});
    bench.type("dynamic friction", "-3", draw);  // values are clamped
    CHECK(chosen() == engine::FrictionMaterial{.dynamicFriction = 0});
    bench.click("combine", draw);
    bench.click("combine multiply", draw);
    CHECK(chosen() == engine::FrictionMaterial{.frictionCombine = Multiply});
    bench.frame(draw);
    CHECK(bench.items.count("friction words") == 1);
    const auto& friction = scene.scene.registry.get<BodyMarking>(scene.scene.nodes[1]).friction;
    REQUIRE(friction);
    CHECK(friction->values == engine::FrictionMaterial{1.25, 0.0, Multiply});
    CHECK(friction->material == (shared ? 0 : -1));
    CHECK(scene.scene.registry.get<BodyMarking>(scene.roles.tool).friction.has_value() == shared);
    bench.click("friction", draw, 0.1f);
    CHECK(chosen() == std::nullopt);
    bench.frame(draw);
    CHECK(bench.items.count("static friction") == 0);
}

TEST_CASE("inspector: the page of a part names the parts that share its friction", "[panels]") {
    engine::Scene made = holdScene();
    for (const int node : {0, 1})
        addPhysics(made, made.nodes[std::size_t(node)],
                   {{"collider", {{"geometry", {{"node", node}}}, {"physicsMaterial", 0}}}});
    (*made.extensions)[engine::kRigidBodies]["physicsMaterials"] = nlohmann::json::array({{{"name", "rubber"}}});
    const HapticScene scene = openScene(std::move(made), {.treeCache = {}, .progress = {}, .buildWorld = false});
    const auto help = [&](std::size_t node) { return frictionHelp(scene, scene.scene.nodes[node]); };
    CHECK(help(0).find("physics material 0 \"rubber\"") != std::string::npos);
    CHECK(help(0).find("changes slab too") != std::string::npos);
    CHECK(help(1).find("changes cube too") != std::string::npos);
}

TEST_CASE("guide: asks for the tool, then for the obstacles of a scene without roles", "[panels]") {
    Bench bench;
    engine::Scene unmarked = holdScene();
    for (const engine::Entity node : unmarked.nodes) setExtras(unmarked, node, nullptr);
    HapticScene scene = openScene(std::move(unmarked));
    PanelRequests requests;
    engine::Entity selected;
    const auto draw = [&] { drawGuide(scene, selected, requests, &bench.items); };
    bench.click("guide cube", draw);
    CHECK(requests.markings == std::vector<Marking>{GiveRole{0, Role::Tool}});
    selected = scene.scene.nodes[1];
    bench.click("guide selected", draw);
    CHECK(requests.markings == std::vector<Marking>{GiveRole{1, Role::Tool}});

    scene.roles.tool = scene.scene.nodes[0];
    bench.click("guide all", draw);
    CHECK(requests.markings == std::vector<Marking>{GiveRole{1, Role::Obstacle}});
}

TEST_CASE("haptics panel: presets and the strength of the mouse's hand", "[panels]") {
    Bench bench;
    Settings scene, settings;
    scene.margin = scene.trust = 0.2;
    settings.stiffness = 3;
    HapticsPanelState state;
    PanelRequests requests;
    const auto draw = [&] { drawHapticsPanel(scene, {}, settings, state, requests, &bench.items); };
    bench.click("preset paper", draw);
    CHECK(settings.mode == Mode::Paper);
    CHECK(settings.margin == 0.2);
    CHECK(settings.trust == 0.2);
    bench.click("preset default", draw);
    CHECK(settings == scene);
    bench.click("strength", draw, 0.95f);
    CHECK(state.strength > 2);
    bench.click("copy command", draw);
    CHECK(requests.copyCommand);
}

TEST_CASE("scene panel: shows the leaves of a tree beside its part, and the details on hover", "[panels]") {
    Bench bench;
    HapticScene scene = openWithTrees(holdScene());
    SphereTree flawed = *scene.world->obstacles[0].part.spheres;
    flawed.certificate.covered = false;
    flawed.certificate.note = "A note for the user.";
    auto world = std::make_shared<World>(*scene.world);
    world->obstacles[0].part.spheres = std::make_shared<const SphereTree>(std::move(flawed));
    scene.world = world;
    DisplayOptions display;
    ScenePanelState state;
    PanelRequests requests;
    const auto draw = [&] { drawScenePanel(scene, Geometry::Spheres, display, state, &bench.items); };
    bench.frame(draw);
    REQUIRE(bench.items.count("tree cube") == 1);
    REQUIRE(bench.items.count("tree slab") == 1);
    CHECK(bench.items.at("tree cube").y < bench.items.at("node cube").w);  // in the same line
    CHECK(bench.items.at("tree cube").w <= bench.items.at("node slab").y);

    // On hover a tooltip window with text appears; before, it draws nothing.
    const auto vertices = [&](const std::string& item) {
        const glm::vec4 r = item.empty() ? glm::vec4(-100) : bench.items.at(item);
        ImGui::GetIO().MousePos = {0.5f * (r.x + r.z), 0.5f * (r.y + r.w)};
        for (int i = 0; i < 3; ++i) bench.frame(draw);
        return ImGui::GetDrawData()->TotalVtxCount;
    };
    const int without = vertices(""), good = vertices("tree cube"), bad = vertices("tree slab");
    CHECK(good > without);
    CHECK(bad > good);  // plus its note

    scene.world = nullptr;
    bench.frame(draw);
    CHECK(bench.items.count("tree cube") == 0);
}

TEST_CASE("tree words: certificate, options and remaining time are written as sentences", "[panels]") {
    TreeCertificate certificate{.protrusion = 0.123, .diagonal = 82, .covered = true, .closed = true, .note = {}};
    CHECK(protrusionWords(certificate) == "0.123 mm (0.15 %)");
    CHECK(surfaceWords(certificate) == "surface proven covered, closed");
    CHECK_FALSE(needsAttention(certificate));
    certificate.hollow = 2.5;
    certificate.closed = false;
    CHECK(surfaceWords(certificate) == "surface proven covered, open, hollow for balls up to 2.5 mm");
    CHECK(needsAttention(certificate));
    certificate = {.covered = true, .closed = true, .note = "Thin."};
    CHECK(needsAttention(certificate));
    CHECK(words(MeshDefects{
              .holes = 2, .largest = {Vec3(1, 2, -4), 3, 0}, .openEdges = 7, .crowdedEdges = 1, .insideOut = 1}) ==
          "2 holes (7 open edges), the widest 3 mm across at (1.0, 2.0, -4.0) mm, and 1 edge of more than two faces, "
          "and 1 "
          "shell partly inside out");
    CHECK(words(TreeOptions{}) == "4096 leaves, fast, shell");
    CHECK(words(TreeOptions{.maxError = 0.02, .quality = TreeQuality::Best, .interior = Interior::Solid}) ==
          "protrusion at most 0.02 mm, best, solid");
    CHECK(timeLeft(-1).empty());
    CHECK(timeLeft(NAN).empty());
    CHECK(timeLeft(0.4) == "almost done");
    CHECK(timeLeft(12.3) == "12 s left");
    CHECK(timeLeft(150) == "3 min left");
}

TEST_CASE("plots panel: says where there is no data, and draws the data where there is", "[panels]") {
    Bench bench;
    TickHistory history;
    const Settings settings;
    PlotsPanelState state;
    PlotsRequests asked;
    const auto draw = [&] { drawPlotsPanel({history, settings, {}, {}, "", false}, state, asked, &bench.items); };
    const auto sayNothing = [&](const std::string& plot) {
        const glm::vec4 r = bench.items.at(plot);
        const glm::vec2 middle{0.5f * (r.x + r.z), 0.5f * (r.y + r.w)}, half{60, 0.2f * (r.w - r.y)};
        return lettersIn({middle - half, middle + half}) == 6;  // "no data"
    };
    const auto check = [&](bool empty) {
        for (const auto& [tab, plots] : std::vector<std::pair<std::string, std::vector<std::string>>>{
                 {"Time", {"Tick time", "Stage times", "Tick-time histogram"}},
                 {"Contact", {"Force", "Iterations", "Distances"}},
                 {"Friction", {"Slip"}},
                 {"Speed vs. error", {"speed against error", "Shadow force error"}}}) {
            bench.click("tab " + tab, draw);
            ImGui::GetIO().MousePos = {-100, -100};
            bench.frame(draw);
            for (const std::string& plot : plots) {
                CAPTURE(tab, plot);
                CHECK(sayNothing("plot " + plot) == empty);
            }
        }
    };
    check(true);
    TickRecord record;
    record.totalUs = 10;
    record.shadowUs = 5;
    for (int i = 0; i < 5000; ++i) history.push(record);
    check(false);
}

TEST_CASE("plots panel: a longer number moves the plots at most once", "[panels]") {
    Bench bench;
    TickHistory history;
    const Settings settings;
    PlotsPanelState state;
    PlotsRequests asked;
    const auto draw = [&] { drawPlotsPanel({history, settings, {}, {}, "", false}, state, asked, &bench.items); };
    const auto placeAfter = [&](float us) {
        TickRecord record;
        record.totalUs = record.collisionUs = record.solveUs = record.shadowUs = us;
        for (int i = 0; i < 5000; ++i) history.push(record);
        ImGui::GetIO().MousePos = {-100, -100};
        for (int i = 0; i < 3; ++i) bench.frame(draw);
        return bench.items.at("plot Tick period");
    };
    const glm::vec4 brief = placeAfter(1), wide = placeAfter(0.00123456f);
    CHECK(wide.w != brief.w);  // the legend of three series needs another line
    CHECK(placeAfter(1) == wide);
    CHECK(placeAfter(0.00123456f) == wide);
}

TEST_CASE("plots panel: the names of a histogram's levels do not cover each other", "[panels]") {
    const float us = GENERATE(0.05f, 10.f, 20000.f);  // beyond the axis, on it, and beyond it
    CAPTURE(us);
    Bench bench;
    TickHistory history;
    const Settings settings;
    PlotsPanelState state;
    PlotsRequests asked;
    TickRecord record;
    record.totalUs = us;  // all levels are here
    for (int i = 0; i < 5000; ++i) history.push(record);
    ImGui::GetIO().MousePos = {-100, -100};
    for (int i = 0; i < 3; ++i)
        bench.frame([&] { drawPlotsPanel({history, settings, {}, {}, "", false}, state, asked, &bench.items); });
    CHECK_THAT(shownText("bench"), Catch::Contains("p50p99max"));
    const TextFaults faults = textFaults();
    CHECK(faults.covered == std::vector<std::string>());
    CHECK(faults.cut == std::vector<std::string>());
}

TEST_CASE("plots panel: the mark of the tolerance names its solver", "[panels]") {
    Bench bench;
    TickHistory history;
    Settings settings;
    settings.tolerance = 0.1;
    Sweep sweep;
    sweep.points = {{.solver = kExactSolver, .us = 1, .onFront = true},
                    {.solver = "pqp", .tolerance = 0.1, .us = 2, .forceError = 0.25},
                    {.solver = "pqp", .tolerance = 0.001, .us = 8, .forceError = 1e-3}};
    PlotsPanelState state;
    PlotsRequests asked;
    state.bring = PlotsTab::Trade;
    const auto draw = [&] { drawPlotsPanel({history, settings, &sweep, {}, "", false}, state, asked, &bench.items); };
    for (int i = 0; i < 3; ++i) bench.frame(draw);
    CHECK_THAT(shownText("bench"), Catch::Contains("pqpatitstolerance:2") && Catch::Contains("0.25N"));
}

TEST_CASE("plots panel: holds, zooms, looks back, and requests exports and sweeps", "[panels]") {
    Bench bench;
    TickHistory history;
    const auto tick = [&] {
        TickRecord record;
        record.tick = history.pushed();
        record.totalUs = 10;
        record.shadowUs = 5;
        record.shadowForceError = 1e-3;
        history.push(record);
    };
    for (int i = 0; i < 5000; ++i) tick();
    const Settings settings;
    Sweep sweep;
    sweep.points = {{.solver = kExactSolver, .us = 1, .onFront = true},
                    {.solver = "pqp", .tolerance = 0.1, .us = 2, .forceError = 0.1},
                    {.solver = "pqp", .tolerance = 0.001, .us = 8, .forceError = 1e-3}};
    const Sweep* swept = nullptr;
    std::optional<double> progress;
    PlotsPanelState state;
    PlotsRequests asked;
    bool friction = false;
    const auto draw = [&] {
        drawPlotsPanel({history, settings, swept, progress, "", friction}, state, asked, &bench.items);
    };

    bench.click("1 s", draw);
    CHECK(state.seconds == 1);
    // The wheel over a plot zooms; while ticks arrive, the newest stays at the edge.
    const auto over = [&](const std::string& item) {
        const glm::vec4 r = bench.items.at(item);
        ImGui::GetIO().MousePos = {0.5f * (r.x + r.z), 0.5f * (r.y + r.w)};
        bench.frame(draw);
    };
    over("plot Stage times");
    ImGui::GetIO().MouseWheel = 1;
    bench.frame(draw);
    ImGui::GetIO().MouseWheel = 0;
    bench.frame(draw);
    CHECK(state.seconds < 1);
    CHECK(state.behind == 0);

    bench.click("hold plots", draw);
    REQUIRE(state.held);
    tick();
    CHECK(state.held->pushed() == 5000);  // new ticks do not move the interval shown
    // Dragged to the right, the plot shows earlier ticks.
    over("plot Stage times");
    ImGui::GetIO().MouseDown[0] = true;
    bench.frame(draw);
    ImGui::GetIO().MousePos.x += 40;
    bench.frame(draw);
    ImGui::GetIO().MouseDown[0] = false;
    bench.frame(draw);
    CHECK(state.behind > 0);
    CHECK(shownStretch(*state.held, state, settings.rate).skip > 0);
    bench.click("hold plots", draw);
    CHECK_FALSE(state.held);
    CHECK(state.behind == 0);
    CHECK(shownStretch(history, state, settings.rate).skip == 0);

    bench.click("export", draw);
    bench.click("Ticks, CSV", draw);
    CHECK(asked.ticksCsv == "plots.csv");
    bench.click("export", draw);
    bench.click("Sweep, CSV", draw);
    CHECK(asked.sweepCsv.empty());  // there is no sweep yet

    ImGui::GetIO().MousePos = {-100, -100};
    bench.click("hold plots", draw);  // closes the popup
    bench.click("tab Friction", draw);
    bench.frame(draw);
    CHECK(bench.items.count("plot Slip") == 1);
    bench.click("tab Contact", draw);
    bench.frame(draw);
    CHECK(bench.items.count("plot Solver residuals") == 1);
    bench.click("tab Speed vs. error", draw);
    bench.click("sweep", draw);
    CHECK(asked.sweep);
    bench.click("all rows", draw, 0.05f);
    CHECK(state.sweep.allRows);
    const int without = ImGui::GetDrawData()->TotalVtxCount;
    swept = &sweep;
    bench.frame(draw);
    CHECK(ImGui::GetDrawData()->TotalVtxCount > without);  // curves, front and marker
    // With friction, one point for each friction solver, without a marker at the tolerance.
    Sweep rubbed;
    rubbed.friction = friction = true;
    swept = nullptr;
    bench.frame(draw);
    const int none = ImGui::GetDrawData()->TotalVtxCount;
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        const double i = double(rubbed.points.size());
        rubbed.points.push_back({.solver = info.name, .us = 1 + i, .forceError = 1e-3 * i, .onFront = i == 0});
    }
    swept = &rubbed;
    bench.frame(draw);
    CHECK(ImGui::GetDrawData()->TotalVtxCount > none);
    swept = &sweep;
    friction = false;
    progress = 0.5;
    bench.click("cancel sweep", draw, 0.5f);
    CHECK(asked.cancelSweep);
}

TEST_CASE("status bar: shows the health of the loop and highlights problems", "[panels]") {
    LoopSnapshot snapshot;
    snapshot.rate = 1000;
    snapshot.ticks = 1000;
    snapshot.fade = 1;
    snapshot.engagement = Engagement::Engaged;
    RealTimeStatus realTime{.scheduled = true, .message = {}};
    const std::string device = "mouse";
    DeviceFacts facts;
    FrameCost frame{.cpuMs = 30, .drawingMs = 28, .drawCalls = 28, .periodMs = 16};
    const auto item = [&](const std::string& name) {
        for (const HealthItem& found : healthItems({&snapshot, &realTime, device, facts, frame}))
            if (found.name == name) return found;
        FAIL("there is no " << name);
        return HealthItem{};
    };
    CHECK(healthItems({nullptr, &realTime, device, facts}).empty());
    for (const HealthItem& all : healthItems({&snapshot, &realTime, device, facts})) {
        CAPTURE(all.name);
        CHECK_FALSE(all.attention);
        CHECK(all.help.size() > 20);
    }
    CHECK(item("Device").value == "mouse");
    // The time that a user waits for a picture, not what the window's thread computes meanwhile.
    CHECK(item("Frame").value == "16 ms");
    frame = {.cpuMs = 30, .drawingMs = 28, .drawCalls = 28, .periodMs = 700, .software = true};
    CHECK(item("Frame").value == "700 ms, drawn by software");
    CHECK(item("Priority").help.find("sysctl") == std::string::npos);
    realTime.share = 0.95;
    CHECK_THAT(item("Priority").help, Catch::Contains("950 ms") && Catch::Contains("the remaining 50 ms") &&
                                          Catch::Contains("kernel.sched_rt_runtime_us=-1"));

    snapshot.rate = 900;
    CHECK(item("Rate").attention);
    snapshot.overruns = 10;
    CHECK_FALSE(item("Late").attention);
    snapshot.overruns = 11;
    CHECK(item("Late").attention);
    snapshot.dropped = 1;
    CHECK(item("Dropped").attention);

    snapshot.trips[int(Trip::StaleReading)] = {2, 9};
    CHECK(item("Safety").value == "ok, 2 trips");
    CHECK_FALSE(item("Safety").attention);
    snapshot.record.trips = bit(Trip::StaleReading);
    CHECK(item("Safety").value == name(Trip::StaleReading));
    CHECK(item("Safety").attention);
    snapshot.engagement = Engagement::Engaging;
    CHECK(item("Safety").value == name(Trip::StaleReading));
    snapshot.record.trips = 0;
    CHECK(item("Safety").value == "engaging, 2 trips");
    snapshot.engagement = Engagement::Stopped;
    CHECK(item("Safety").value == "stopped");
    CHECK(item("Safety").attention);
    snapshot.engagement = Engagement::Faulted;
    snapshot.cause = Trip::Buzz;
    CHECK(item("Safety").value == "fault: buzz");
    CHECK(item("Safety").help.find(info(Trip::Buzz).why) == 0);
    snapshot.engagement = Engagement::Engaged;

    snapshot.record.wrench_o.force = Vec3(11, 0, 0);
    CHECK(item("Load").value == "50 %");
    snapshot.record.wrench_o.torque = Vec3(0, -153, 0);
    CHECK(item("Load").value == "90 %");
    snapshot.record.trips = bit(Trip::ForceClamped);
    CHECK(item("Load").value == "saturated");
    CHECK(item("Load").attention);

    // k T (0.5 + d) at 1 N/mm and 1 kHz: 0.5 N·s/m without delay, 1.5 with the one tick assumed for an unknown delay.
    CHECK(item("Passivity").value == "min 1.5 N·s/m");
    facts.dynamics = DeviceDynamics{.damping = 0.9, .delay = 0};
    CHECK(item("Passivity").value == "+0.4 N·s/m");
    CHECK_FALSE(item("Passivity").attention);
    snapshot.settings.stiffness = 2;
    CHECK(item("Passivity").value == "-0.1 N·s/m");
    CHECK(item("Passivity").attention);
    snapshot.settings.rate = 10'000;
    CHECK_FALSE(item("Passivity").attention);

    // Each item explains itself on hover.
    Bench bench;
    bool pressed = false;
    const auto draw = [&] { pressed |= drawStatusBar({&snapshot, &realTime, device, facts}, &bench.items); };
    bench.frame(draw);
    const int without = ImGui::GetDrawData()->TotalVtxCount;
    for (const HealthItem& all : healthItems({&snapshot, &realTime, device, facts})) {
        CAPTURE(all.name);
        REQUIRE(bench.items.count(std::string("health ") + all.name) == 1);
        const glm::vec4 r = bench.items.at(std::string("health ") + all.name);
        if (r.z > 390) continue;  // outside this narrow window
        ImGui::GetIO().MousePos = {0.5f * (r.x + r.z), 0.5f * (r.y + r.w)};
        for (int i = 0; i < 3; ++i) bench.frame(draw);
        CHECK(ImGui::GetDrawData()->TotalVtxCount > without);
    }
    CHECK_FALSE(pressed);
    bench.click("engage", draw);
    CHECK(pressed);
}

TEST_CASE("panels: each draws without data and with unusual values", "[panels]") {
    Bench bench;
    PlotsPanelState plots;
    PlotsRequests asked;
    TickHistory history(64);
    LoopSnapshot snapshot;
    const RealTimeStatus realTime{.message = "no priority"};
    std::vector<Message> messages;
    const std::string device = "demo";
    PanelRequests requests;
    const auto draw = [&](const LoopSnapshot* shown) {
        bench.frame([&] {
            drawPlotsPanel({history, {}, nullptr, {}, ""}, plots, asked, &bench.items);
            drawLogPanel(messages, &bench.items);
            drawStatusBar({shown, &realTime, device, {}}, &bench.items);
            drawOpening({"bunnies.glb", "gold bunny", 0.4, 12}, requests, &bench.items);
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

TEST_CASE("panels: the device page shows state and errors, and requests what was clicked", "[panels]") {
    struct Control final : DeviceControl {
        Maps follows = Maps::All;
        Maps maps() const override { return follows; }
        Workspace workspace() const override { return {.scale = 2}; }
    } control;
    Bench bench;
    DeviceFacts facts;
    facts.status = DeviceStatus{.state = DeviceStatus::State::Lost, .text = "the cable", .temperature = 0.4};
    const std::string device = "phantom";
    std::string trouble;
    DevicePanelState state;
    PanelRequests requests;
    const auto draw = [&] {
        drawDevicePanel({device, facts, Settings{}, &control, trouble}, state, requests, &bench.items);
    };
    bench.frame(draw);
    CHECK(bench.items.count("device temperature") == 1);
    CHECK(bench.items.count("device trouble") == 0);
    CHECK_FALSE(requests.workspace);
    bench.click("reconnect", draw);
    CHECK(requests.reconnect);
    bench.click("device view axes", draw);
    CHECK(requests.alignWithView);
    bench.click("device scale", draw, 0.9f);
    REQUIRE(requests.workspace);
    CHECK(requests.workspace->scale > 4);
    CHECK_FALSE(state.edited);

    // A device that moves by itself asks twice, and a question that is no longer asked is closed.
    facts.status->consent = "it moves";
    bench.frame(draw);
    CHECK(bench.items.count("initialize now") == 0);
    bench.click("initialize", draw);
    bench.frame(draw);
    CHECK_FALSE(requests.initializeDevice);
    bench.click("initialize now", draw);
    CHECK(requests.initializeDevice);
    bench.click("initialize", draw);
    facts.status->consent.clear();
    bench.items.clear();
    bench.frame(draw);
    CHECK_FALSE(state.asksConsent);
    CHECK(bench.items.count("initialize now") == 0);

    // A device that sets velocities has axes, and no offset.
    control.follows = DeviceControl::Maps::Axes;
    bench.items.clear();
    bench.frame(draw);
    CHECK(bench.items.count("device scale") == 0);
    CHECK(bench.items.count("device view axes") == 1);
    bench.click("device scene axes", draw);
    CHECK(requests.workspace->q_WD.coeffs() == Quat::Identity().coeffs());

    trouble = "no library";
    const auto drawTrouble = [&] {
        drawDevicePanel({device, facts, Settings{}, nullptr, trouble}, state, requests, &bench.items);
    };
    bench.frame(drawTrouble);
    CHECK(bench.items.count("device trouble") == 1);
    CHECK(bench.items.count("reconnect") == 0);

    // The status bar also shows it, with forces as the hand feels them.
    LoopSnapshot snapshot;
    snapshot.record.wrench_o.force = {10, 0, 0};
    facts.limits.peakForce = 10;
    facts.scale = 2;
    for (const HealthItem& item : healthItems({&snapshot, nullptr, device, facts})) {
        if (std::string(item.name) == "Device") CHECK(item.value == "phantom (lost)");
        if (std::string(item.name) == "Load") CHECK(item.value == "50 %");
    }
}

}  // namespace touchstone::panels_tests
