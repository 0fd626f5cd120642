#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_read.hpp"
#include "engine/scene/gltf_write.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/marking.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::roles_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using engine::Entity;
using engine::Scene;
using nlohmann::json;
using sandbox::Role;

namespace {

Role roleOf(const Scene& scene, Entity node) { return scene.registry.get<Role>(node); }

bool anyContains(const std::vector<std::string>& sentences, const std::string& part) {
    return std::any_of(sentences.begin(), sentences.end(),
                       [&](const std::string& s) { return s.find(part) != std::string::npos; });
}

const glm::vec3 kSize(0.01f);

}  // namespace

TEST_CASE("roles: extras define tool, obstacle, goal and visual with their data", "[sandbox]") {
    Scene scene;
    const Entity tool =
        addBox(scene, "peg", kSize,
               {{"role", "tool"}, {"leaves", 100}, {"stiffness_N_per_m", 500}, {"torsion_Nm_per_rad", 0.3}});
    const Entity hole = addBox(scene, "hole", kSize, {{"role", "obstacle"}});
    const Entity decoration = addBox(scene, "lamp", kSize, {{"role", "visual"}});
    const Entity plain = addBox(scene, "floor", kSize);
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    CHECK(roles.tool == tool);
    CHECK(roles.obstacles == std::vector<Entity>{hole});
    CHECK(roleOf(scene, decoration) == Role::Visual);
    CHECK_FALSE(scene.registry.has<Role>(plain));
    CHECK(scene.registry.get<sandbox::BodyMarking>(tool).tree.leaves == 100);
    CHECK(scene.registry.get<sandbox::BodyMarking>(hole).tree.leaves == 4096);
    CHECK_FALSE(scene.registry.has<sandbox::BodyMarking>(decoration));
    // 500 N/m is 0.5 N/mm, and 0.3 N·m/rad is 300 mN·m/rad.
    const Settings settings = sandbox::sceneSettings(scene, roles);
    CHECK(settings.stiffness == 0.5);
    CHECK(settings.torsion == Approx(300));
    CHECK(roles.warnings.empty());
    REQUIRE(roles.interpreted.size() == 3);
    CHECK_THAT(roles.interpreted[0], Contains("node 0 \"peg\" is the tool (100 leaves, fast, shell)"));
}

TEST_CASE("roles: trees and their settings follow from the clearance of the fit, where the file does not say otherwise",
          "[sandbox]") {
    Scene scene;
    scene.file = "fit.glb";
    const Entity peg = addBox(scene, "peg", kSize, {{"role", "tool"}});
    const Entity hole = addBox(scene, "hole", kSize, {{"role", "obstacle"}, {"leaves", 500}});
    const auto read = [&](json fit) {
        *scene.extras = {{"touchstone", std::move(fit)}};
        return sandbox::assignRoles(scene);
    };
    const auto tree = [&](Entity node) { return scene.registry.get<sandbox::BodyMarking>(node).tree; };
    const sandbox::SceneRoles roles = read({{"clearance_mm", 0.2}, {"settings", {{"slack", 0.05}}}});
    CHECK(roles.warnings.empty());
    CHECK(tree(peg).maxError == 0.45 * 0.2);
    CHECK(tree(peg).quality == TreeQuality::Best);
    CHECK(tree(hole) == TreeOptions{.leaves = 500});
    const Settings settings = sandbox::sceneSettings(scene, roles);
    CHECK(settings.margin == 0.4 * 0.2);
    CHECK(settings.trust == 0.4 * 0.2);
    CHECK(settings.slack == 0.05);
    CHECK(checkSettings(sandbox::sceneSettings(scene, read({{"clearance_mm", 5}}))).empty());

    // No tree follows closer fits.
    CHECK(sandbox::sceneSettings(scene, read({{"clearance_mm", 0.02}})) == Settings{});
    CHECK(tree(peg) == TreeOptions{.leaves = 1024});
    CHECK_THROWS_WITH(read({{"clearance_mm", 0}}), Contains("fit.glb") && Contains("clearance_mm"));
}

TEST_CASE("roles: a part may ask to be touched by its spheres", "[sandbox]") {
    Scene scene;
    scene.file = "soft.glb";
    const Entity tool = addBox(scene, "ball", kSize, {{"role", "tool"}, {"geometry", "mesh"}});
    const Entity wall = addBox(scene, "wall", kSize, {{"role", "obstacle"}, {"geometry", "spheres"}});
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    CHECK_FALSE(scene.registry.get<sandbox::BodyMarking>(tool).spheres);
    CHECK(scene.registry.get<sandbox::BodyMarking>(wall).spheres);
    CHECK_THAT(roles.interpreted[1], Contains("(4096 leaves, fast, shell, touched by it)"));
    addBox(scene, "post", kSize, {{"role", "obstacle"}, {"geometry", "voxels"}});
    CHECK_THROWS_WITH(sandbox::assignRoles(scene), Contains("soft.glb") && Contains("geometry") && Contains("spheres"));
}

TEST_CASE("roles: of two tools the first in the file is used, and a warning names the other", "[sandbox]") {
    Scene scene;
    addBox(scene, "wall", kSize, {{"role", "obstacle"}});
    const Entity first = addBox(scene, "first", kSize, {{"role", "tool"}});
    const Entity second = addBox(scene, "second", kSize, {{"role", "tool"}});
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    CHECK(roles.tool == first);
    CHECK(roleOf(scene, second) == Role::Visual);
    CHECK(anyContains(roles.warnings, "\"second\""));
}

TEST_CASE("roles: KHR_physics_rigid_bodies makes motion a tool, a lone collider an obstacle and a trigger a goal",
          "[sandbox]") {
    Scene scene;
    const Entity tool = addBox(scene, "body", kSize);
    const Entity part = addBox(scene, "part of body", kSize, nullptr, {}, tool);
    const Entity wall = addBox(scene, "wall", kSize);
    const Entity region = addBox(scene, "region", {0.02f, 0.01f, 0.01f}, nullptr, {.translation = {0, 0.05, 0}});
    addPhysics(scene, tool, {{"motion", {{"mass", 1}}}});
    addPhysics(scene, part, {{"collider", {{"geometry", {{"node", 1}}}}}});
    addPhysics(scene, wall, {{"collider", {{"geometry", {{"mesh", 0}}}}}});
    addPhysics(scene, region, {{"trigger", {{"geometry", {{"node", 3}}}}}});
    scene.meshes.push_back(scene.registry.get<engine::MeshInstance>(wall));
    updateWorldTransforms(scene);
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    CHECK(roles.tool == tool);
    CHECK_FALSE(scene.registry.has<Role>(part));
    CHECK(sandbox::roleOwner(scene.registry, part) == tool);
    CHECK(roles.obstacles == std::vector<Entity>{wall});
    CHECK(roleOf(scene, region) == Role::Goal);
    REQUIRE(roles.goal);
    CHECK(roles.goal->X_WT.p.isApprox(Vec3(0, 50, 0)));
    CHECK(roles.goal->tolerance == Approx(10));  // half of its size of 20 mm
    CHECK(anyContains(roles.interpreted, "gives it a motion"));
}

TEST_CASE("roles: a hidden node collides like any other", "[sandbox]") {
    Scene scene;
    const Entity proxy = addBox(scene, "proxy", kSize, {{"role", "tool"}});
    scene.registry.get<engine::Visibility>(proxy).visible = false;  // as KHR_node_visibility sets it
    updateWorldTransforms(scene);
    CHECK(sandbox::assignRoles(scene).tool == proxy);
    CHECK(sandbox::bakedTriangles(scene, proxy).triangles.size() == 12);
}

TEST_CASE("roles: the physics extension overrides the role of extras, which still give the other data", "[sandbox]") {
    Scene scene;
    const Entity node = addBox(scene, "wall", kSize, {{"role", "tool"}, {"leaves", 200}});
    scene.meshes.push_back(scene.registry.get<engine::MeshInstance>(node));
    addPhysics(scene, node, {{"collider", {{"geometry", {{"node", 0}}}}}});
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    CHECK(roleOf(scene, node) == Role::Obstacle);
    CHECK(scene.registry.get<sandbox::BodyMarking>(node).tree.leaves == 200);
    CHECK(anyContains(roles.warnings, "extras.touchstone.role says tool"));
    CHECK_THROWS_WITH(sandbox::applyMarking(scene, sandbox::GiveRole{nodeIndex(scene, node), Role::Tool}),
                      Contains("KHR_physics_rigid_bodies"));
}

TEST_CASE("roles: unsupported features of the physics extension are named", "[sandbox]") {
    Scene scene;
    const Entity body = addBox(scene, "body", kSize);
    addPhysics(scene, body,
               {{"collider", {{"geometry", {{"shape", 0}, {"convexHull", true}}}}}, {"joint", {{"joint", 0}}}});
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    for (const char* word : {"implicit shapes", "convexHull", "joints"}) CHECK(anyContains(roles.warnings, word));
    CHECK(sandbox::bakedTriangles(scene, body).triangles.size() == 12);
}

TEST_CASE("roles: unknown keys are named as warnings", "[sandbox]") {
    Scene scene;
    *scene.extras = {{"touchstone", {{"setings", json::object()}}}};
    addBox(scene, "peg", kSize, {{"role", "tool"}, {"colour", "red"}, {"goal", {{"tolerance_mm", 1}}}});
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    for (const char* key : {"extras.touchstone.setings", "extras.touchstone.colour", "goal.tolerance_mm"})
        CHECK(anyContains(roles.warnings, key));
}

TEST_CASE("roles: a wrong type or range is one sentence with file, node and field", "[sandbox]") {
    struct Case {
        json mark;
        std::string field;
    };
    const std::vector<Case> cases{
        {{{"role", 5}}, "extras.touchstone.role"},
        {{{"role", "hammer"}}, "extras.touchstone.role must be tool, obstacle, goal, visual or gauge"},
        {{{"role", "tool"}, {"leaves", "many"}}, "extras.touchstone.leaves must be a whole number"},
        {{{"role", "tool"}, {"leaves", 0}}, "extras.touchstone.leaves"},
        {{{"role", "tool"}, {"leaves", 100.5}}, "extras.touchstone.leaves"},
        {{{"role", "tool"}, {"max_error_mm", 0}}, "extras.touchstone.max_error_mm must be a number from 1e-06 to 1000"},
        {{{"role", "tool"}, {"max_error_mm", "0.1mm"}}, "extras.touchstone.max_error_mm must be a number"},
        {{{"role", "tool"}, {"max_error_mm", 0.1}, {"leaves", 64}}, "max_error_mm must be given without leaves"},
        {{{"role", "tool"}, {"quality", "finest"}}, "extras.touchstone.quality must be fast or best"},
        {{{"role", "tool"}, {"quality", 2}}, "extras.touchstone.quality must be a text"},
        {{{"role", "tool"}, {"interior", "hollow"}}, "extras.touchstone.interior must be shell or solid"},
        {{{"role", "tool"}, {"stiffness_N_per_m", -1}}, "extras.touchstone.stiffness_N_per_m"},
        {{{"role", "tool"}, {"torsion_Nm_per_rad", json::array()}}, "extras.touchstone.torsion_Nm_per_rad"},
        {{{"role", "tool"}, {"goal", 1}}, "extras.touchstone.goal must be an object"},
        {{{"role", "tool"}, {"goal", {{"translation", {0, 1}}}}},
         "extras.touchstone.goal.translation must be three numbers"},
        {{{"role", "tool"}, {"goal", {{"rotation", {0, 0, 0, 2}}}}}, "extras.touchstone.goal.rotation"},
        {{{"role", "tool"}, {"goal", {{"fold", -1}}}}, "extras.touchstone.goal.fold must be a whole number from 0"},
        {{{"role", "tool"}, {"goal", {{"lead_m", "2 mm"}}}}, "extras.touchstone.goal.lead_m must be a number"},
        {{{"role", "tool"}, {"goal", {{"way", 3}}}}, "extras.touchstone.goal.way must be the name of a motion"},
        {{{"role", "tool"}, {"goal", {{"way", json::array()}}}}, "extras.touchstone.goal.way must be"},
        {{{"role", "tool"}, {"goal", {{"way", {{{"rotation", {0, 0, 0, 1}}}}}}}},
         "extras.touchstone.goal.way[0].translation must be three numbers"},
        {{{"role", "tool"}, {"goal", {{"way", {{{"translation", {0, 0, 0}}}, 7}}}}},
         "extras.touchstone.goal.way[1] must be an object"},
        {{{"role", "tool"}, {"goal", {{"way", "out"}}}}, "there is no motion 'out'"},
        {{{"role", "tool"}, {"goal", {{"lead_m", 0.001}, {"way", {{{"translation", {0, 0, 0}}}}}}}},
         "extras.touchstone.goal.lead_m must be given without way"},
        {{{"role", "tool"}, {"outcome", "fine"}}, "extras.touchstone.outcome must be an object"},
        {json("tool"), "extras.touchstone must be an object"},
    };
    for (const Case& c : cases) {
        INFO(c.mark.dump());
        Scene scene;
        scene.file = "some/where.glb";
        addBox(scene, "peg", kSize, c.mark);
        CHECK_THROWS_WITH(sandbox::assignRoles(scene),
                          Contains("where.glb") && Contains("node 0 \"peg\"") && Contains(c.field));
    }
}

TEST_CASE("roles: a broken physics extension is also one sentence", "[sandbox]") {
    for (const json& body : std::vector<json>{json("box"),
                                              {{"motion", 3}},
                                              {{"collider", {{"geometry", {{"node", 7}}}}}},
                                              {{"collider", {{"geometry", {{"mesh", -1}}}}}},
                                              {{"collider", {{"geometry", 0}}}}}) {
        INFO(body.dump());
        Scene scene;
        scene.file = "some/where.glb";
        addPhysics(scene, addBox(scene, "peg", kSize), body);
        CHECK_THROWS_WITH(sandbox::assignRoles(scene),
                          Contains("node 0 \"peg\"") && Contains("KHR_physics_rigid_bodies"));
    }
}

TEST_CASE("roles: settings of the scene have the keys of the command line, and wrong ones are refused", "[sandbox]") {
    Scene scene;
    scene.file = "tight.glb";
    addBox(scene, "peg", kSize, {{"role", "tool"}, {"stiffness_N_per_m", 500}});
    const auto with = [&](const json& settings) {
        *scene.extras = {{"touchstone", {{"settings", settings}}}};
        return sandbox::sceneSettings(scene, sandbox::assignRoles(scene));
    };
    const Settings settings = with({{"margin", 0.375},
                                    {"trust", 0.375},
                                    {"slack", "0.1"},
                                    {"adaptive_margin", false},
                                    {"shadow", "none"},
                                    {"linearisations", 3}});
    CHECK(settings.margin == 0.375);
    CHECK(settings.slack == 0.1);
    CHECK_FALSE(settings.adaptiveMargin);
    CHECK(settings.shadow == kNoSolver);
    CHECK(settings.linearizations == 3);  // by the key of an earlier version, which saving replaces
    {
        const auto roles = sandbox::assignRoles(scene);
        Settings changed = settings;
        changed.linearizations = 5;
        sandbox::setSettings(scene, roles, changed);
        const json& stored = (*scene.extras)["touchstone"]["settings"];
        CHECK(stored.at("linearizations") == 5);
        CHECK_FALSE(stored.contains("linearisations"));
    }
    CHECK(settings.stiffness == 0.5);
    CHECK(with({{"stiffness", 2}}).stiffness == 2);
    CHECK_THROWS_WITH(with({{"magin", 1}}), Contains("tight.glb") && Contains("did you mean 'margin'"));
    CHECK_THROWS_WITH(with({{"margin", "wide"}}), Contains("margin must be a number"));
    CHECK_THROWS_WITH(with({{"margin", json::array()}}), Contains("margin"));
    CHECK_THROWS_WITH(with({{"trust", 2}}), Contains("trust"));  // larger than the margin
}

TEST_CASE("roles: a goal node defines the goal by its pose, a goal on the tool by its values", "[sandbox]") {
    Scene scene;
    const Entity parent = addNode(scene, "frame", {}, {.translation = {1, 0, 0}});
    addNode(scene, "seat", parent, {.translation = {0, 0.02, 0}});
    setExtras(scene, scene.nodes.back(),
              {{"touchstone",
                {{"role", "goal"}, {"goal", {{"tolerance_m", 0.0005}, {"tolerance_rad", 0.05}, {"hold_s", 0.5}}}}}});
    const Entity tool = addBox(scene, "peg", kSize, {{"role", "tool"}});
    updateWorldTransforms(scene);
    sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    REQUIRE(roles.goal);
    CHECK(roles.goal->X_WT.p.isApprox(Vec3(1000, 20, 0)));
    CHECK(roles.goal->tolerance == 0.5);
    CHECK(roles.goal->toleranceAngle == 0.05);
    CHECK(roles.goal->hold == 500);

    setExtras(
        scene, tool,
        {{"touchstone", {{"role", "tool"}, {"goal", {{"translation", {0, 0.1, 0}}, {"rotation", {0, 0, 1, 0}}}}}}});
    roles = sandbox::assignRoles(scene);
    REQUIRE(roles.goal);
    CHECK(roles.goal->X_WT.p.isApprox(Vec3(0, 100, 0)));
    CHECK(roles.goal->X_WT.q.isApprox(Quat(0, 0, 0, 1)));
    CHECK(anyContains(roles.warnings, "\"seat\" is also a goal"));
}

TEST_CASE("roles: a goal knows the thread, equivalent orientations and the way", "[sandbox]") {
    Scene scene;
    const Entity tool = addBox(scene, "peg", kSize, {{"role", "tool"}});
    const auto goal = [&](const json& more) {
        json mark{{"role", "tool"}, {"goal", {{"translation", {0, 0.1, 0}}, {"tolerance_rad", 0.05}}}};
        mark["goal"].update(more);
        setExtras(scene, tool, {{"touchstone", mark}});
        const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
        CHECK_FALSE(anyContains(roles.warnings, "goal"));
        return roles.goal.value();
    };
    CHECK(goal({{"lead_m", -0.0015}}).lead == -1.5);
    const Pose turned{{0, 100, 0}, expRotation({0, 1, 0})}, leaning{{0, 100, 0}, expRotation({0.1, 0, 0})};
    CHECK_FALSE(goal(json::object()).contains(turned));
    CHECK(goal({{"fold", 0}}).contains(turned));
    CHECK_FALSE(goal({{"fold", 0}}).contains(leaning));

    const GoalRegion given =
        goal({{"way", {{{"translation", {0, 0.05, 0}}}, {{"translation", {0, 0.01, 0}}, {"rotation", {0, 1, 0, 0}}}}}});
    REQUIRE(given.way.size() == 2);
    CHECK(given.way[0].p.isApprox(Vec3(0, 50, 0)));
    CHECK(given.way[1].q.isApprox(Quat(0, 0, 1, 0)));

    // The reverse of a motion that leads out: up by 30 mm, then aside by 20.
    scene.animations.push_back(translation(tool, {0, 1, 2}, {{0, 0.1, 0, 0}, {0, 0.13, 0, 0}, {0.02, 0.13, 0, 0}}));
    scene.animations.back().name = "out";
    const GoalRegion found = goal({{"way", "out"}});
    REQUIRE(found.way.size() >= 2);
    CHECK(found.way.front().p.isApprox(Vec3(20, 30, 0), 1e-6));
    CHECK((found.way[1].p - Vec3(0, 30, 0)).norm() < 0.2);

    scene.animations.push_back(translation(tool, {0, 1}, {{0, 0.05, 0, 0}, {0, 0.13, 0, 0}}));
    scene.animations.back().name = "elsewhere";
    CHECK_THROWS_WITH(goal({{"way", "elsewhere"}}), Contains("begins 50 mm from it"));
}

TEST_CASE("roles: roles that the user chose are saved into the file and read back", "[sandbox]") {
    const TempFolder folder;
    Scene made = pressScene();
    addBox(made, "third", kSize, {{"role", "visual"}, {"leaves", 50}});
    engine::writeGltf(made, folder.path() / "a.glb");

    Scene scene = engine::readGltf(folder.path() / "a.glb");
    sandbox::assignRoles(scene);
    sandbox::applyMarking(scene, sandbox::GiveRole{nodeIndex(scene, scene.nodes[2]), Role::Tool});
    sandbox::SceneRoles roles = sandbox::assignRoles(scene);
    CHECK(roles.tool == scene.nodes[2]);
    CHECK(roleOf(scene, scene.nodes[0]) == Role::Visual);
    sandbox::applyMarking(scene, sandbox::GiveRole{nodeIndex(scene, scene.nodes[1]), std::nullopt});
    engine::saveScene(scene, folder.path() / "b.glb");

    Scene again = engine::readGltf(folder.path() / "b.glb");
    roles = sandbox::assignRoles(again);
    CHECK(roles.tool == again.nodes[2]);
    CHECK(roles.obstacles.empty());
    CHECK(again.registry.get<sandbox::BodyMarking>(again.nodes[2]).tree.leaves == 50);
    // Other keys of the marks are kept.
    CHECK(again.registry.get<engine::NodeMarking>(again.nodes[0]).extras->at("touchstone").contains("outcome"));
    CHECK_THROWS_AS(engine::saveScene(made, folder.path() / "c.glb"), engine::SceneError);
}

TEST_CASE("roles: flat keys are read like nested ones, and edits nest them", "[sandbox]") {
    const TempFolder folder;
    Scene made;
    const auto box = [&](const char* name, const nlohmann::json& extras) {
        setExtras(made, addBox(made, name, kSize), extras);
    };
    box("tool", {{"touchstone_role", "tool"},
                 {"touchstone_leaves", 64.0},
                 {"touchstone_outcome_seated", 1},  // custom properties have no true
                 {"touchstone", {{"stiffness_N_per_m", 500}}},
                 {"color", "blue"}});
    box("plate", {{"touchstone_role", "obstacle"}});
    box("end", {{"touchstone_role", "goal"}, {"touchstone_goal_tolerance_m", 0.002}, {"touchstone_goal_hold_s", 2}});
    *made.extras = {{"touchstone_settings_margin", 0.3}, {"touchstone_clearance_mm", 0.2}};
    engine::updateWorldTransforms(made);
    engine::writeGltf(made, folder.path() / "a.glb");

    const auto check = [](Scene& scene) {
        const sandbox::SceneRoles roles = sandbox::assignRoles(scene);
        CHECK(roles.warnings.empty());
        REQUIRE(roles.tool == scene.nodes[0]);
        CHECK(roles.obstacles == std::vector{scene.nodes[1]});
        CHECK(scene.registry.get<sandbox::BodyMarking>(roles.tool).tree.leaves == 64);
        CHECK(scene.registry.get<sandbox::BodyMarking>(roles.tool).stiffness == 0.5);
        REQUIRE(roles.goal);
        CHECK(roles.goal->tolerance == Approx(2));
        CHECK(roles.goal->hold == 2000);
        CHECK(roles.clearance == 0.2);
        CHECK(sandbox::sceneSettings(scene, roles).margin == 0.3);
        std::vector<std::string> warnings;
        CHECK(sandbox::readOutcome(scene, roles, warnings).seated);
        CHECK(warnings.empty());
        return roles;
    };
    Scene scene = engine::readGltf(folder.path() / "a.glb");
    check(scene);
    // An edit of one key keeps the others.
    sandbox::applyMarking(scene, sandbox::GiveRole{1, Role::Visual});
    sandbox::applyMarking(scene, sandbox::GiveRole{1, Role::Obstacle});
    sandbox::applyMarking(scene, sandbox::GiveRole{0, Role::Tool});
    engine::saveScene(scene, folder.path() / "b.glb");
    Scene again = engine::readGltf(folder.path() / "b.glb");
    check(again);
    const nlohmann::json extras = *again.registry.get<engine::NodeMarking>(again.nodes[0]).extras;
    CHECK(extras.at("color") == "blue");
    CHECK_FALSE(extras.contains("touchstone_role"));

    setExtras(scene, scene.nodes[1], {{"touchstone_role", "obstacle"}, {"touchstone", {{"role", "tool"}}}});
    CHECK_THROWS_WITH(sandbox::assignRoles(scene), Contains("node 1 \"plate\": extras.touchstone_role says again"));
    setExtras(scene, scene.nodes[1], {{"touchstone_role", "obstacle"}, {"touchstone", "tool"}});
    CHECK_THROWS_WITH(sandbox::assignRoles(scene), Contains("remove one of them"));
}

TEST_CASE("roles: a scene without tool or obstacle opens, names what is missing and has no world", "[sandbox]") {
    Scene scene;
    const Entity box = addBox(scene, "box", kSize);
    sandbox::HapticScene opened = sandbox::openScene(std::move(scene));
    CHECK_THAT(opened.missing, Contains("tool"));
    CHECK(opened.world == nullptr);
    sandbox::applyMarking(opened.scene, sandbox::GiveRole{nodeIndex(opened.scene, box), Role::Tool});
    opened = sandbox::openScene(std::move(opened.scene));
    CHECK_THAT(opened.missing, Contains("obstacle"));
    CHECK_THROWS_AS(sandbox::buildWorld(opened.scene, opened.roles, opened.settings), engine::SceneError);
}

}  // namespace touchstone::roles_tests
