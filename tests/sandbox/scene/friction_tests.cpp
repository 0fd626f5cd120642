// Friction of tool and obstacles: from physics materials or extras to the world, and back into the file.
#include "haptics/sandbox/scene/friction.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_read.hpp"
#include "engine/scene/gltf_write.hpp"
#include "engine/scene/rigid_bodies.hpp"
#include "haptics/sandbox/scene/marking.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::friction_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;
using Catch::Matchers::Contains;
using engine::Entity;
using engine::FrictionCombine;
using engine::FrictionMaterial;
using engine::Scene;
using nlohmann::json;

namespace {

const glm::vec3 kSize(0.01f);

int countOf(const std::vector<std::string>& sentences, const std::string& part) {
    return int(std::count_if(sentences.begin(), sentences.end(),
                             [&](const std::string& s) { return s.find(part) != std::string::npos; }));
}

json material(double atRest, double sliding, const char* combine) {
    return {{"staticFriction", atRest}, {"dynamicFriction", sliding}, {"frictionCombine", combine}};
}

/// Cube and slab of pressScene() in KHR_physics_rigid_bodies; both colliders have physics material 0.
Scene roughScene(const json& materials) {
    Scene scene = pressScene();
    for (const Entity node : scene.nodes) setExtras(scene, node, nullptr);
    addPhysics(scene, scene.nodes[0],
               {{"motion", json::object()}, {"collider", {{"geometry", {{"node", 0}}}, {"physicsMaterial", 0}}}});
    addPhysics(scene, scene.nodes[1], {{"collider", {{"geometry", {{"node", 1}}}, {"physicsMaterial", 0}}}});
    (*scene.extensions)[engine::kRigidBodies]["physicsMaterials"] = materials;
    return scene;
}

json& colliderOf(Scene& scene, std::size_t node) {
    return (*scene.registry.get<engine::NodeMarking>(scene.nodes[node]).extensions)[engine::kRigidBodies]["collider"];
}

const std::optional<PartFriction>& frictionOf(const Scene& scene, std::size_t node) {
    return scene.registry.get<BodyMarking>(scene.nodes[node]).friction;
}

BodyMarking marking(double friction, FrictionCombine combine) {
    BodyMarking body;
    body.friction = {{friction, friction / 2, combine}, -1};
    return body;
}

Friction inWorld(Scene& scene) {
    updateWorldTransforms(scene);
    const SceneRoles roles = assignRoles(scene);
    return buildWorld(scene, roles, {}).world->friction(0);
}

}  // namespace

TEST_CASE("friction: of two rules the one of higher precedence combines the coefficients", "[sandbox]") {
    using enum FrictionCombine;
    struct Case {
        FrictionCombine a, b;
        double atRest;
    };
    // The coefficients are 0.2 and 0.8.
    for (const Case& c : {Case{Average, Average, 0.5}, Case{Average, Minimum, 0.5}, Case{Average, Maximum, 0.5},
                          Case{Average, Multiply, 0.5}, Case{Minimum, Minimum, 0.2}, Case{Minimum, Maximum, 0.2},
                          Case{Minimum, Multiply, 0.2}, Case{Maximum, Maximum, 0.8}, Case{Maximum, Multiply, 0.8},
                          Case{Multiply, Multiply, 0.16}}) {
        CAPTURE(name(c.a), name(c.b));
        for (const auto& [first, second] : {std::pair{c.a, c.b}, std::pair{c.b, c.a}}) {
            const Friction pair =
                frictionBetween(sandbox::materialOf(marking(0.2, first)), sandbox::materialOf(marking(0.8, second)));
            CHECK(pair.atRest == Approx(c.atRest));
            CHECK(pair.sliding == Approx(c.a == Multiply ? c.atRest / 4 : c.atRest / 2));
        }
    }
    const BodyMarking smooth, rough = marking(1, Maximum);
    CHECK_FALSE(frictionBetween(sandbox::materialOf(smooth), sandbox::materialOf(rough)).any());
    CHECK_FALSE(frictionBetween(sandbox::materialOf(rough), sandbox::materialOf(smooth)).any());
    CHECK(frictionWords(smooth, rough) == "no friction, since the tool sets none");
    CHECK(frictionWords(rough, smooth) == "no friction, since the obstacle sets none");
    CHECK(frictionWords(smooth, smooth) == "no friction, since neither part sets any");
    CHECK(frictionWords(rough, marking(0.5, Multiply)) ==
          "friction 1 at rest, 0.5 sliding, the maximum of both materials");
    CHECK_THAT(frictionWords(marking(1, Multiply), marking(1, Multiply)), Contains("the product of both materials"));
}

TEST_CASE("friction: physics materials of both colliders reach the world", "[sandbox]") {
    const json rough = json::array({material(0.9, 0.5, "minimum"), material(0.4, 0.3, "multiply")});
    Scene scene = roughScene(rough);
    CHECK(inWorld(scene) == Friction{0.9, 0.5});
    colliderOf(scene, 1)["physicsMaterial"] = 1;
    CHECK(inWorld(scene) == Friction{0.4, 0.3});
    colliderOf(scene, 0).erase("physicsMaterial");
    CHECK(inWorld(scene) == Friction{});
    Scene plain = pressScene();
    CHECK(inWorld(plain) == Friction{});
}

TEST_CASE("friction: without a collider the extras of the node set it", "[sandbox]") {
    Scene scene = pressScene();
    const auto with = [&](std::size_t node, const json& friction) {
        json extras = *scene.registry.get<engine::NodeMarking>(scene.nodes[node]).extras;
        extras["touchstone"].update(friction);
        setExtras(scene, scene.nodes[node], extras);
    };
    with(0, material(0.9, 0.5, "maximum"));
    CHECK(inWorld(scene) == Friction{});
    with(1, material(1.2, 0.2, "maximum"));
    CHECK(inWorld(scene) == Friction{1.2, 0.5});
    const SceneRoles roles = assignRoles(scene);
    CHECK(roles.warnings.empty());
    CHECK(countOf(roles.interpreted, "Friction") == 0);

    scene.file = "rough.glb";
    for (const auto& [wrong, must] : std::vector<std::pair<json, std::string>>{
             {{{"staticFriction", "high"}}, "extras.touchstone.staticFriction must be a number from 0 to 1000"},
             {{{"dynamicFriction", -1}}, "extras.touchstone.dynamicFriction must be a number"},
             {{{"frictionCombine", "mean"}}, "extras.touchstone.frictionCombine must be average, minimum"}}) {
        with(1, material(1.2, 0.2, "maximum"));
        with(1, wrong);
        CHECK_THROWS_WITH(assignRoles(scene), Contains("rough.glb") && Contains("node 1 \"slab\"") && Contains(must));
    }
}

TEST_CASE("friction: invalid physics materials are refused although no part uses them", "[sandbox]") {
    Scene scene = roughScene(json::array({material(0.9, 0.5, "average"), {{"staticFriction", -1}}}));
    scene.file = "rough.glb";
    CHECK_THROWS_WITH(assignRoles(scene), Contains("rough.glb") && Contains("physics material 1"));
}

TEST_CASE("friction: one sentence says which keys of a material are absent and what is used", "[sandbox]") {
    Scene scene = roughScene(json::array({{{"dynamicFriction", 0.3}}, json::object()}));
    SceneRoles roles = assignRoles(scene);
    CHECK(inWorld(scene) == Friction{0.6, 0.3});
    CHECK(roles.warnings.empty());
    CHECK(countOf(roles.interpreted,
                  "physics material 0 sets no staticFriction or frictionCombine, so the defaults are used: 0.6, "
                  "average") == 1);                                // two parts share it
    CHECK(countOf(roles.interpreted, "physics material 1") == 0);  // no part uses it

    Scene marked = pressScene();
    setExtras(marked, marked.nodes[1], {{"touchstone", {{"role", "obstacle"}, {"frictionCombine", "minimum"}}}});
    roles = assignRoles(marked);
    CHECK(countOf(roles.interpreted,
                  "node 1 \"slab\": extras.touchstone sets no staticFriction or dynamicFriction, so the defaults are "
                  "used: 0.6, 0.6") == 1);
}

TEST_CASE("friction: static below dynamic counts as dynamic, with a warning", "[sandbox]") {
    Scene scene = roughScene(json::array({material(0.2, 0.5, "average")}));
    CHECK(inWorld(scene) == Friction{0.5, 0.5});
    CHECK(
        countOf(assignRoles(scene).warnings,
                "physics material 0: staticFriction 0.2 is below dynamicFriction 0.5, so that 0.5 is used for both") ==
        1);
}

TEST_CASE("friction: the colliders below a body with motion are those of the tool", "[sandbox]") {
    Scene scene = roughScene(json::array({material(0.9, 0.5, "average"), material(0.1, 0.1, "average")}));
    const Entity tool = scene.nodes[0];
    addPhysics(scene, tool, {{"motion", json::object()}});
    const Entity part = addBox(scene, "part", kSize, nullptr, {}, tool);
    addPhysics(scene, part, {{"collider", {{"geometry", {{"node", 2}}}, {"physicsMaterial", 1}}}});
    SceneRoles roles = assignRoles(scene);
    CHECK(collidersOf(scene, tool) == std::vector<Entity>{part});
    CHECK(roles.warnings.empty());
    CHECK(inWorld(scene) == Friction{0.5, 0.3});

    const Entity other = addBox(scene, "other", kSize, nullptr, {}, tool);
    addPhysics(scene, other, {{"collider", {{"geometry", {{"node", 3}}}}}});
    roles = assignRoles(scene);
    CHECK(countOf(roles.warnings, "its colliders differ in their physics material; physics material 1 is used") == 1);
    CHECK(frictionOf(scene, 0)->material == 1);
}

TEST_CASE("friction: a collider decides, and a warning says that the extras have no effect", "[sandbox]") {
    Scene scene = roughScene(json::array({material(0.9, 0.5, "average")}));
    setExtras(scene, scene.nodes[1], {{"touchstone", material(0.1, 0.1, "average")}});
    CHECK(countOf(assignRoles(scene).warnings, "node 1 \"slab\": extras.touchstone sets friction, but") == 1);
    CHECK(frictionOf(scene, 1)->material == 0);
    colliderOf(scene, 1).erase("physicsMaterial");
    assignRoles(scene);
    CHECK_FALSE(frictionOf(scene, 1));
}

TEST_CASE("friction: an edit of extras is saved, and removed again", "[edit]") {
    const TempFolder folder;
    const auto file = folder.path() / "press.glb", saved = folder.path() / "saved.glb";
    engine::writeGltf(pressScene(), file);
    Scene scene = engine::readGltf(file);
    assignRoles(scene);
    applyMarking(scene, ChooseFriction{1, FrictionMaterial{0.6, 0.6, FrictionCombine::Average}});
    applyMarking(scene, ChooseFriction{1, FrictionMaterial{.dynamicFriction = 0.25}});
    engine::saveScene(scene, saved);
    Scene again = engine::readGltf(saved);
    assignRoles(again);
    REQUIRE(frictionOf(again, 1));
    CHECK(frictionOf(again, 1)->values == FrictionMaterial{0.6, 0.25, FrictionCombine::Average});
    CHECK(frictionOf(again, 1)->material == -1);
    applyMarking(again, ChooseFriction{1, std::nullopt});
    CHECK(*again.registry.get<engine::NodeMarking>(again.nodes[1]).extras ==
          json({{"touchstone", {{"role", "obstacle"}, {"leaves", 512}}}}));
}

TEST_CASE("friction: an edit of a physics material changes all parts that share it, and is saved", "[edit]") {
    const TempFolder folder;
    const auto file = folder.path() / "rough.glb", saved = folder.path() / "saved.glb";
    json rubber = material(0.9, 0.5, "average");
    rubber["restitution"] = 0.25;
    engine::writeGltf(roughScene(json::array({rubber})), file);
    const auto edited = [&](const std::vector<Marking>& markings) {
        Scene scene = engine::readGltf(file);
        assignRoles(scene);
        // In one list, as in a session that has not opened the earlier edits yet.
        std::vector<engine::SceneEdit> edits;
        for (const Marking& marking : markings) appendMarking(edits, scene, marking);
        engine::applyEdits(scene, edits);
        engine::saveScene(scene, saved);
        Scene again = engine::readGltf(saved);
        assignRoles(again);
        return again;
    };
    const auto materials = [](const Scene& scene) {
        return scene.extensions->at(engine::kRigidBodies).at("physicsMaterials");
    };
    Scene scene = edited({ChooseFriction{1, FrictionMaterial{.staticFriction = 1.5}},
                          ChooseFriction{1, FrictionMaterial{.frictionCombine = FrictionCombine::Minimum}}});
    for (const std::size_t node : {0, 1})
        CHECK(frictionOf(scene, node)->values == FrictionMaterial{1.5, 0.5, FrictionCombine::Minimum});
    CHECK(materials(scene)[0]["restitution"] == 0.25);

    // Removed from one part, the material stays for the other; given again, the part has its own.
    scene = edited({ChooseFriction{1, std::nullopt}});
    CHECK(frictionOf(scene, 0)->material == 0);
    CHECK_FALSE(frictionOf(scene, 1));
    const FrictionMaterial own{0.1, 0.1, FrictionCombine::Maximum};
    scene = edited({ChooseFriction{1, std::nullopt}, ChooseFriction{1, own}});
    CHECK(materials(scene)[0] == rubber);
    CHECK(frictionOf(scene, 1)->material == 1);
    CHECK(frictionOf(scene, 1)->values == own);
}

}  // namespace touchstone::friction_tests
