#include "engine/scene/physics_materials.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "engine/edit/scene_edit.hpp"
#include "engine/scene/gltf_write.hpp"
#include "engine/scene/rigid_bodies.hpp"
#include "tests/engine/scene/gltf_fixture.hpp"

namespace touchstone::physics_materials_tests {

using namespace touchstone::engine;
using namespace touchstone::engine::test;
using Catch::Contains;
using Json = nlohmann::json;

namespace {

/// A square whose collider has this physics material, in a file with these materials.
GltfDraft roughDraft(const Json& materials, const Json& index = 0) {
    GltfDraft draft = squareDraft();
    draft.json["nodes"][1]["extensions"][kRigidBodies] = {
        {"collider", {{"geometry", {{"mesh", 0}}}, {"physicsMaterial", index}}}};
    draft.json["extensions"][kRigidBodies]["physicsMaterials"] = materials;
    draft.json["extensionsUsed"] = {kRigidBodies};
    return draft;
}

std::optional<int> materialOf(const Scene& scene, std::size_t node) {
    std::vector<std::string> warnings;
    return readRigidBody(scene, scene.nodes[node], warnings)->material;
}

}  // namespace

TEST_CASE("physics materials: friction and the collider's index are read, with the defaults of the schema", "[gltf]") {
    const TemporaryFolder folder;
    const Json rubber{{"name", "rubber"},     {"staticFriction", 1.1},
                      {"dynamicFriction", 0}, {"frictionCombine", "multiply"},
                      {"restitution", 0.5},   {"restitutionCombine", "maximum"}};
    const Scene scene = roughDraft(Json::array({rubber, Json::object()}), 1).read(folder);
    CHECK(scene.warnings.empty());
    const std::vector<FrictionMaterial> materials = readPhysicsMaterials(scene);
    REQUIRE(materials.size() == 2);
    CHECK(materials[0] == FrictionMaterial{1.1, 0.0, FrictionCombine::Multiply});
    CHECK(physicsMaterialLabel(scene, 0) == "physics material 0 \"rubber\"");
    CHECK(materials[1].empty());
    CHECK(materials[1].staticOr() == 0.6);
    CHECK(materials[1].dynamicOr() == 0.6);
    CHECK(materials[1].combineOr() == FrictionCombine::Average);
    CHECK(materialOf(scene, 1) == 1);
    CHECK(readPhysicsMaterials(squareDraft().read(folder)).empty());
}

TEST_CASE("physics materials: a wrong value is one sentence with file, material and field", "[gltf]") {
    const TemporaryFolder folder;
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    const std::vector<std::pair<Json, std::string>> cases{
        {{{"staticFriction", "high"}}, "staticFriction must be a number from 0 to 1000"},
        {{{"staticFriction", -0.1}}, "staticFriction must be a number from 0 to 1000"},
        {{{"staticFriction", nullptr}}, "staticFriction must be a number"},
        {{{"dynamicFriction", nan}}, "dynamicFriction must be a number from 0 to 1000"},
        {{{"dynamicFriction", infinity}}, "dynamicFriction must be a number"},
        {{{"dynamicFriction", 1001}}, "dynamicFriction must be a number"},
        {{{"frictionCombine", "mean"}}, "frictionCombine must be average, minimum, maximum or multiply"},
        {{{"frictionCombine", 1}}, "frictionCombine must be a text"},
    };
    Scene scene = roughDraft(Json::array({Json::object()})).read(folder);
    Json& materials = (*scene.extensions)[kRigidBodies]["physicsMaterials"];
    for (const auto& [wrong, field] : cases) {
        INFO(wrong.dump());
        materials = Json::array({Json::object(), wrong});
        materials[1]["name"] = "felt";
        CHECK_THROWS_WITH(readPhysicsMaterials(scene), Contains(scene.file.string()) &&
                                                           Contains("physics material 1 \"felt\"") &&
                                                           Contains("physicsMaterials[1]." + field));
    }
    materials = Json::array({"felt"});
    CHECK_THROWS_WITH(readPhysicsMaterials(scene), Contains("physicsMaterials[0] must be an object"));
    materials = Json::object();
    CHECK_THROWS_WITH(readPhysicsMaterials(scene), Contains("physicsMaterials must be a list of materials"));
    *scene.extensions = {{kRigidBodies, 5}};
    CHECK_THROWS_WITH(readPhysicsMaterials(scene), Contains("extensions.KHR_physics_rigid_bodies must be an object"));
}

TEST_CASE("physics materials: a collider's index that does not exist is refused", "[gltf]") {
    const TemporaryFolder folder;
    const Json two = Json::array({Json::object(), Json::object()});
    for (const Json& index : std::vector<Json>{2, -1, 0.5, "0", nullptr}) {
        INFO(index.dump());
        const Scene scene = roughDraft(two, index).read(folder);
        CHECK_THROWS_WITH(
            materialOf(scene, 1),
            Contains("node 1 \"tool\"") && Contains("collider.physicsMaterial must be a whole number from 0 to 1"));
    }
    CHECK_THROWS_WITH(materialOf(roughDraft(Json::array()).read(folder), 1),
                      Contains("physicsMaterial must be left out, since the file has no physics materials"));
}

TEST_CASE("physics materials: they are kept when a scene is saved, and edits are written", "[gltf]") {
    const TemporaryFolder folder;
    const Json rubber{{"name", "rubber"}, {"staticFriction", 1.1}, {"restitution", 0.5}, {"extras", {{"k", 1}}}};
    GltfDraft draft = roughDraft(Json::array({rubber, {{"frictionCombine", "minimum"}}}), 1);
    draft.json["extensionsRequired"] = {kRigidBodies};
    Scene scene = draft.read(folder);
    writeGltf(scene, folder / "new.glb");
    saveScene(scene, folder / "copy.glb");
    for (const char* file : {"new.glb", "copy.glb"}) {
        const Scene again = readGltf(folder / file);
        CHECK(*again.extensions == draft.json["extensions"]);
        CHECK(again.extensionsRequired == scene.extensionsRequired);
        CHECK(materialOf(again, 1) == 1);
    }

    Json root = scene.extensions->at(kRigidBodies), body = draft.json["nodes"][1]["extensions"][kRigidBodies];
    writeFriction(root["physicsMaterials"][0], {.staticFriction = 0.25, .frictionCombine = FrictionCombine::Maximum});
    body["collider"]["physicsMaterial"] = 0;
    applyEdits(scene, {SetRigidBody{-1, root}, SetRigidBody{1, body}, SetRigidBody{99, body}});  // there is no node 99
    saveScene(scene, folder / "edited.glb");
    const Scene edited = readGltf(folder / "edited.glb");
    CHECK(readPhysicsMaterials(edited)[0] == FrictionMaterial{0.25, std::nullopt, FrictionCombine::Maximum});
    CHECK(edited.extensions->at(kRigidBodies)["physicsMaterials"][0]["restitution"] == 0.5);
    CHECK(edited.extensions->at(kRigidBodies)["physicsMaterials"][1] == Json({{"frictionCombine", "minimum"}}));
    CHECK(materialOf(edited, 1) == 0);
}

TEST_CASE("physics materials: a saved edit keeps the other extensions of the node", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = roughDraft(Json::array({Json::object()}));
    const int places = draft.add<float>({0, 0, 0, 10, 0, 0}, 5126, "VEC3", 2);
    const Json instances{{"attributes", {{"TRANSLATION", places}}}};
    draft.json["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"] = instances;
    draft.json["extensionsUsed"].push_back("EXT_mesh_gpu_instancing");
    Scene scene = draft.read(folder);
    const Json body{{"collider", {{"geometry", {{"mesh", 0}}}}}};
    applyEdits(scene, {SetRigidBody{1, body}});
    saveScene(scene, folder / "saved.glb");
    const auto file = folder / "saved.glb";
    const Json saved = parseJson(file, readContainer(file).json)["nodes"][1]["extensions"];
    CHECK(saved["EXT_mesh_gpu_instancing"] == instances);
    CHECK(saved[kRigidBodies] == body);
}

}  // namespace touchstone::physics_materials_tests
