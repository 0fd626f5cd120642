// Changes of a scene by the user, without a window: edits, undo, saving, presets and the command line.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/edit/pick.hpp"
#include "engine/edit/scene_edit.hpp"
#include "engine/scene/gltf_read.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/marking.hpp"
#include "haptics/sandbox/scene/placement.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/program/program.hpp"
#include "tests/support/ui_scene.hpp"

namespace touchstone::edit_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

const SceneOptions kNoTrees{.treeCache = {}, .progress = {}, .buildWorld = false};

engine::LocalTransform at(double x, double y, double z) {
    engine::LocalTransform local;
    local.translation = {x, y, z};
    return local;
}

glm::dvec3 placeIn(const engine::Scene& scene, std::size_t node) {
    return scene.registry.get<engine::LocalTransform>(scene.nodes[node]).translation;
}

engine::Entity pick(const HapticScene& scene, const Pose* X_WT, const engine::Ray& ray) {
    return engine::pickNode(
        scene.scene.registry, [&](engine::Entity node) { return placeOf(scene, node, X_WT); }, ray);
}

}  // namespace

TEST_CASE("edits: changes of one object are merged, and the difference of two lists can be applied", "[edit]") {
    std::vector<engine::SceneEdit> edits;
    append(edits, engine::PlaceNode{1, at(0, 0, 0), at(1, 0, 0)});
    append(edits, engine::PlaceNode{1, at(1, 0, 0), at(2, 0, 0)});
    REQUIRE(edits.size() == 1);
    CHECK(std::get<engine::PlaceNode>(edits[0]).from == at(0, 0, 0));
    CHECK(std::get<engine::PlaceNode>(edits[0]).to == at(2, 0, 0));

    const std::vector<engine::SceneEdit> none;
    const auto back = engine::reversibleChange(edits, none);
    REQUIRE(back.has_value());
    REQUIRE(back->size() == 1);
    CHECK(std::get<engine::PlaceNode>(back->front()).to == at(0, 0, 0));
    append(edits, engine::SetExtras{0, nlohmann::json({{"touchstone", {{"role", "goal"}}}})});
    CHECK_FALSE(engine::reversibleChange(edits, none).has_value());
    std::vector<engine::SceneEdit> moved = edits;
    append(moved, engine::PlaceNode{1, at(2, 0, 0), at(9, 0, 0)});
    const auto on = engine::reversibleChange(edits, moved);
    REQUIRE(on.has_value());
    CHECK(std::get<engine::PlaceNode>(on->front()).to == at(9, 0, 0));
}

TEST_CASE("edits: looks and names change an open scene and can be undone", "[edit]") {
    engine::Scene scene = holdScene();
    const engine::Looks before = engine::looksOf(scene.materials[0]), gold{{1, 0.8f, 0.3f, 1}, 1, 0.25f};
    std::vector<engine::SceneEdit> edits;
    append(edits, engine::PaintMaterial{0, before, {{1, 1, 1, 1}, 0.5f, 0.5f}});
    append(edits, engine::PaintMaterial{0, {{1, 1, 1, 1}, 0.5f, 0.5f}, gold});
    append(edits, engine::RenameNode{1, "slab", "table"});
    REQUIRE(edits.size() == 2);
    const auto there = engine::reversibleChange({}, edits);
    REQUIRE(there.has_value());
    engine::applyEdits(scene, *there);
    CHECK(engine::looksOf(scene.materials[0]) == gold);
    CHECK(scene.registry.get<engine::Name>(scene.nodes[1]).value == "table");
    const auto back = engine::reversibleChange(edits, {});
    REQUIRE(back.has_value());
    engine::applyEdits(scene, *back);
    CHECK(engine::looksOf(scene.materials[0]) == before);
    CHECK(scene.registry.get<engine::Name>(scene.nodes[1]).value == "slab");
    engine::applyEdits(scene,
                       {engine::PaintMaterial{99, before, gold}, engine::RenameNode{99, "", "nobody"}});  // no effect
}

TEST_CASE("edits: a node gets the given world pose under any parents, and its scale stays", "[edit]") {
    engine::Scene scene;
    const engine::Entity above = addNode(
        scene, "above", {}, {.translation = {0.1, 0.2, 0.3}, .rotation = glm::dquat(glm::dvec3(0.3, -0.8, 0.4))});
    const engine::Entity node =
        addBox(scene, "box", glm::vec3(0.01f), nullptr, {.translation = {0.05, 0, 0}, .scale = {2, 1, 0.5}}, above);
    updateWorldTransforms(scene);
    const Pose wanted{{12, -7, 30}, expRotation({0.5, 0.1, -0.9})};
    scene.registry.get<engine::LocalTransform>(node) = engine::placedAt(scene.registry, node, toRigidPart(wanted));
    updateWorldTransforms(scene);
    const Pose found = toPose(engine::worldPose(scene.registry, node));
    CHECK((found.p - wanted.p).norm() < 1e-9);
    CHECK(logRotation(found.q * wanted.q.conjugate()).norm() < 1e-9);
    CHECK(scene.registry.get<engine::LocalTransform>(node).scale == glm::dvec3(2, 1, 0.5));
}

TEST_CASE("edits: changes are saved and read back, and the rest of the file is kept", "[edit]") {
    const TempFolder folder;
    const auto file = holdFile(folder), saved = folder.path() / "saved.glb";
    HapticScene scene = openScene(file, kNoTrees);
    TreeOptions tree{.leaves = 99, .quality = TreeQuality::Best, .interior = Interior::Solid};
    const engine::Looks gold{{1, 0.8f, 0.3f, 1}, 1, 0.25f};
    applyMarking(scene.scene, ChooseTree{1, tree});
    applyMarking(scene.scene, GiveRole{0, Role::Tool});
    engine::applyEdits(scene.scene,
                       {engine::PlaceNode{1, {}, at(0.001, 0.002, 0.003)}, engine::PaintMaterial{1, {}, gold},
                        engine::RenameNode{1, "slab", "Tisch, größer"}});
    Settings settings = scene.settings;
    settings.stiffness = 2.5;
    settings.solver = "pqp";
    settings.pause = true;
    sandbox::setSettings(scene.scene, scene.roles, settings);
    engine::saveScene(scene.scene, saved);

    const HapticScene again = openScene(saved, kNoTrees);
    CHECK(engine::looksOf(again.scene.materials[1]) == gold);
    CHECK(engine::looksOf(again.scene.materials[0]) == engine::looksOf(scene.scene.materials[0]));
    CHECK(again.scene.registry.get<engine::Name>(again.scene.nodes[1]).value == "Tisch, größer");
    CHECK(placeIn(again.scene, 1) == glm::dvec3(0.001, 0.002, 0.003));
    CHECK(again.scene.registry.get<BodyMarking>(again.scene.nodes[1]).tree == tree);
    settings.pause = false;  // a saved scene does not start paused
    CHECK(again.settings == settings);
    CHECK(again.scene.animations.size() == scene.scene.animations.size());

    // With a maximum error instead of a leaf count, and into the same file again.
    engine::Scene third = engine::readGltf(saved);
    applyMarking(third, ChooseTree{1, {.maxError = 0.125}});
    engine::saveScene(third, saved);
    CHECK(openScene(saved, kNoTrees).scene.registry.get<BodyMarking>(third.nodes[1]).tree ==
          TreeOptions{.maxError = 0.125});
}

TEST_CASE("edits: shapes of another file become an obstacle with their looks, and are saved", "[edit]") {
    const TempFolder folder;
    const auto file = holdFile(folder), part = folder.path() / "part.glb", saved = folder.path() / "both.glb";
    writeGltf(holdScene(), part);
    engine::Scene scene = engine::readGltf(file);
    const std::size_t nodes = scene.nodes.size(), materials = scene.materials.size();
    applyMarking(scene, AddBody{part, Role::Obstacle});
    engine::applyEdits(scene, {engine::PlaceNode{int(nodes), {}, at(0, -0.1, 0)}});
    REQUIRE(scene.nodes.size() == nodes + 3);  // a root for the part, its cube and its slab
    CHECK(scene.materials.size() == 2 * materials);
    engine::saveScene(scene, saved);

    const HapticScene again = openScene(saved, kNoTrees);
    REQUIRE(again.roles.obstacles.size() == 2);
    const engine::Entity added = again.roles.obstacles[1];
    CHECK(again.scene.registry.get<engine::Name>(added).value == "part");
    CHECK(placeIn(again.scene, nodes) == glm::dvec3(0, -0.1, 0));
    // The part's own file marks a tool, which is only a shape here: 12 triangles of each box.
    CHECK(bakedTriangles(again.scene, added).triangles.size() == 24);
    const auto& slab = again.scene.registry.get<engine::MeshInstance>(again.scene.nodes[nodes + 2]);
    const int material = slab.primitives[0].material;
    REQUIRE(material >= int(materials));
    CHECK(again.scene.materials[std::size_t(material)].baseColor.b == Approx(0.8f));

    CHECK_THROWS_AS(applyMarking(scene, AddBody{folder.path() / "missing.glb", Role::Obstacle}), engine::SceneError);
}

TEST_CASE("picking: a click selects the nearest visible mesh, with the tool at its present pose", "[edit]") {
    HapticScene scene = openScene(holdScene(), kNoTrees);
    const engine::Entity cube = scene.scene.nodes[0], slab = scene.scene.nodes[1];
    const engine::Ray down{{0, 1, 0}, {0, -1, 0}}, aside{{0.02f, 1, 0}, {0, -1, 0}};
    CHECK(pick(scene, nullptr, down) == cube);
    CHECK(pick(scene, nullptr, aside) == slab);
    const Pose X_WT{{20, 30, 0}, Quat::Identity()};
    CHECK(pick(scene, &X_WT, aside) == cube);
    CHECK(pick(scene, &X_WT, down) == slab);
    CHECK_FALSE(pick(scene, nullptr, {{1, 1, 0}, {0, -1, 0}}));
    CHECK_FALSE(pick(scene, nullptr, {{0, 1, 0}, {0, 1, 0}}));  // behind the eye
    scene.scene.registry.get<engine::Visibility>(cube).visible = false;
    CHECK(pick(scene, nullptr, down) == slab);

    const engine::NodeBox box = engine::boxOf(scene.scene.registry, slab);
    CHECK(box.high == glm::vec3(0.03f, 0.005f, 0.03f));
    CHECK(box.center() == glm::vec3(0));
}

TEST_CASE("presets: each preset gives valid settings, and paper equals the publication", "[edit]") {
    Settings scene;
    scene.margin = scene.trust = 0.1;
    for (const Preset& preset : presetTable()) {
        CAPTURE(preset.name);
        const Settings settings = preset.apply(scene);
        CHECK(checkSettings(settings).empty());
        CHECK(settings.margin == scene.margin);  // the margin that the scene's clearances need is kept
    }
    CHECK(presetTable()[0].apply(scene) == scene);
    CHECK(presetTable()[1].apply(scene).mode == Mode::Paper);
    CHECK(presetTable()[2].apply(scene).rate == 10'000);
    CHECK(presetTable()[3].apply(scene).geometry == Geometry::Spheres);
}

TEST_CASE("command line: the copied command runs without a window with the same settings", "[edit]") {
    const Program program;
    const std::filesystem::path file = program.file("it's a scene.glb");
    writeGltf(holdScene(), file);
    const Settings scene = openScene(file, kNoTrees).settings;
    Settings settings = scene;
    settings.stiffness = 1.0 / 3;
    settings.solver = "pqp";
    settings.shadow = kNoSolver;
    settings.adaptiveMargin = false;
    settings.pause = true;
    const std::string line = commandLine(file, "demo", scene, settings);
    CHECK(line.find("pause") == std::string::npos);
    const std::string start = "touchstone ";
    REQUIRE(line.rfind(start, 0) == 0);
    const Answer answer = program(line.substr(start.size()) + " --report '" + program.file("report.json") + "'");
    REQUIRE(answer.code == 0);
    const auto report = nlohmann::json::parse(textOf(program.file("report.json")));
    settings.pause = false;
    for (const SettingInfo& info : settingTable()) {
        CAPTURE(info.key);
        CHECK(report.at("settings").at(std::string(info.key)) == getSetting(settings, info.key));
    }
}

}  // namespace touchstone::edit_tests
