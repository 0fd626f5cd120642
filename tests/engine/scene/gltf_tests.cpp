#include <catch2/catch.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_write.hpp"
#include "engine/scene/transforms.hpp"
#include "tests/engine/scene/gltf_fixture.hpp"

namespace touchstone::gltf_tests {

using namespace touchstone::engine;
using namespace touchstone::engine::test;
using Json = nlohmann::json;

namespace {

const MeshData& firstMesh(const Scene& scene) { return *scene.meshes.at(0).primitives.at(0).mesh; }

const std::vector<glm::vec3> kSquare = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};

std::string dataUri(const Bytes& bytes, const std::string& mimeType) {
    // The writer's own encoding would test nothing, so this is a plain one, by the definition.
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text, bits;
    for (const auto byte : bytes)
        for (int k = 7; k >= 0; --k) bits += (byte >> k & 1) ? '1' : '0';
    while (bits.size() % 6) bits += '0';
    for (std::size_t i = 0; i < bits.size(); i += 6) text += digits[std::stoul(bits.substr(i, 6), nullptr, 2)];
    while (text.size() % 4) text += '=';
    return "data:" + mimeType + ";base64," + text;
}

}  // namespace

TEST_CASE("glTF: a binary file gives nodes, mesh, material and animation", "[gltf]") {
    const TemporaryFolder folder;
    const Scene scene = squareDraft().read(folder);
    REQUIRE(scene.nodes.size() == 2);
    REQUIRE(scene.roots == std::vector<Entity>{scene.nodes[0]});
    CHECK(scene.name == "main");
    CHECK(scene.warnings.empty());
    CHECK(scene.registry.get<Name>(scene.nodes[1]).value == "tool");
    CHECK(scene.registry.get<Hierarchy>(scene.nodes[1]).parent == scene.nodes[0]);
    CHECK(scene.registry.get<WorldTransform>(scene.nodes[1]).matrix[3].z == 1);
    CHECK(scene.registry.get<MeshInstance>(scene.nodes[1]).primitives[0].mesh.get() == &firstMesh(scene));
    CHECK(firstMesh(scene).positions == kSquare);
    CHECK(firstMesh(scene).normals == std::vector<glm::vec3>(4, {0, 0, 1}));
    CHECK(firstMesh(scene).texcoords[1] == glm::vec2(1, 1));
    CHECK(firstMesh(scene).indices == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
    CHECK(scene.materials[0].baseColor == glm::vec4(1, 0.5, 0.25, 1));
    REQUIRE(scene.animations.size() == 1);
    REQUIRE(scene.animations[0].channels.size() == 2);
    CHECK(scene.animations[0].channels[0].target == scene.nodes[1]);
    CHECK(sampleVector(scene.animations[0].channels[0], 1.0) == glm::dvec3(1, 0, 0));
    CHECK(std::abs(sampleRotation(scene.animations[0].channels[1], 1.5).z) == 1);
    CHECK(nodeLabel(scene, scene.nodes[1]) == "node 1 \"tool\"");
}

TEST_CASE("glTF: buffers may be external, below the folder, percent-encoded, padded, or data URIs", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    std::filesystem::create_directories(folder / "sub");
    Bytes padded = draft.bin;
    padded.resize(padded.size() + 3);
    writeFile(folder / "sub/a part.bin", padded);
    for (const std::string& uri :
         {std::string("sub/a%20part.bin"), std::string("sub/a part.bin"), std::string("./sub/../sub/a part.bin"),
          dataUri(draft.bin, "application/octet-stream"), dataUri(draft.bin, "application/gltf-buffer"),
          dataUri(draft.bin, "model/unknown")}) {
        CAPTURE(uri);
        draft.json["buffers"][0]["uri"] = uri;
        writeFile(folder / "scene.gltf", draft.json.dump());
        CHECK(firstMesh(readGltf(folder / "scene.gltf")).positions == kSquare);
    }
}

TEST_CASE("glTF: every index width, and no indices", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    auto& primitive = draft.json["meshes"][0]["primitives"][0];
    primitive["indices"] = draft.add<std::uint8_t>({0, 1, 2, 0, 2, 3}, 5121, "SCALAR", 6);
    CHECK(firstMesh(draft.read(folder)).indices == std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3});
    primitive["indices"] = draft.add<std::uint32_t>({3, 2, 1}, 5125, "SCALAR", 3);
    CHECK(firstMesh(draft.read(folder)).indices == std::vector<std::uint32_t>{3, 2, 1});
    primitive.erase("indices");
    for (const char* array : {"NORMAL", "TEXCOORD_0"}) primitive["attributes"].erase(array);
    primitive["attributes"]["POSITION"] = draft.add<float>({0, 0, 0, 1, 0, 0, 1, 1, 0}, 5126, "VEC3", 3);
    const Scene scene = draft.read(folder);
    CHECK(firstMesh(scene).indices == std::vector<std::uint32_t>{0, 1, 2});
    CHECK(firstMesh(scene).texcoords.empty());
    CHECK(firstMesh(scene).normals == std::vector<glm::vec3>(3, {0, 0, 1}));  // computed
}

TEST_CASE("glTF: strips and fans become triangles with their winding, and other modes are named", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    auto& primitive = draft.json["meshes"][0]["primitives"][0];
    primitive["indices"] = draft.add<std::uint8_t>({0, 1, 3, 2}, 5121, "SCALAR", 4);
    primitive["mode"] = 5;  // strip: (0 1 3), (1 2 3) with the second one flipped
    CHECK(firstMesh(draft.read(folder)).indices == std::vector<std::uint32_t>{0, 1, 3, 1, 2, 3});
    primitive["indices"] = draft.add<std::uint8_t>({0, 1, 2, 3}, 5121, "SCALAR", 4);
    primitive["mode"] = 6;  // fan around 0
    CHECK(firstMesh(draft.read(folder)).indices == std::vector<std::uint32_t>{1, 2, 0, 2, 3, 0});
    primitive["indices"] = draft.add<std::uint8_t>({0, 1, 1, 3, 2}, 5121, "SCALAR", 5);
    primitive["mode"] = 5;  // a stitched strip: the two thin triangles vanish, (1 2 3) is third and keeps its winding
    CHECK(firstMesh(draft.read(folder)).indices == std::vector<std::uint32_t>{1, 3, 2});

    Json points = primitive;
    points["mode"] = 0;
    draft.json["meshes"][0]["primitives"].push_back(points);
    const Scene scene = draft.read(folder);
    CHECK(scene.meshes[0].primitives.size() == 1);
    REQUIRE(scene.warnings.size() == 1);
    CHECK(scene.warnings[0] == "mesh 0 \"square\", primitive 1: is points, not triangles, and is ignored.");
}

TEST_CASE("glTF: interleaved, sparse and normalized accessors", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    auto& json = draft.json;
    auto& attributes = json["meshes"][0]["primitives"][0]["attributes"];
    SECTION("interleaved positions and normals") {
        std::vector<float> mixed;
        for (const glm::vec3& p : kSquare) mixed.insert(mixed.end(), {p.x + 5, p.y, p.z, 0, 0, -2});
        const int positions = draft.add(mixed, 5126, "VEC3", 4);
        json["bufferViews"].back()["byteStride"] = 24;
        json["accessors"].push_back(json["accessors"].back());
        json["accessors"].back()["byteOffset"] = 12;
        attributes["POSITION"] = positions;
        attributes["NORMAL"] = positions + 1;
        const Scene scene = draft.read(folder);
        CHECK(firstMesh(scene).positions[2] == glm::vec3(6, 1, 0));
        CHECK(firstMesh(scene).normals[2] == glm::vec3(0, 0, -1));
    }
    SECTION("sparse over data and sparse over zeros") {
        const int values = draft.add<float>({7, 7, 7, 8, 8, 8}, 5126, "VEC3", 2);
        const int places = draft.add<std::uint8_t>({1, 3}, 5121, "SCALAR", 2);
        json["accessors"][0]["sparse"] = {{"count", 2},
                                          {"indices", {{"bufferView", places}, {"componentType", 5121}}},
                                          {"values", {{"bufferView", values}}}};
        CHECK(firstMesh(draft.read(folder)).positions ==
              std::vector<glm::vec3>{{0, 0, 0}, {7, 7, 7}, {1, 1, 0}, {8, 8, 8}});
        json["accessors"][0].erase("bufferView");
        CHECK(firstMesh(draft.read(folder)).positions ==
              std::vector<glm::vec3>{{0, 0, 0}, {7, 7, 7}, {0, 0, 0}, {8, 8, 8}});
    }
    SECTION("normalized texture coordinates") {
        attributes["TEXCOORD_0"] = draft.add<std::uint8_t>({0, 255, 51, 0, 0, 0, 0, 0}, 5121, "VEC2", 4, true);
        CHECK(firstMesh(draft.read(folder)).texcoords[0] == glm::vec2(0, 1));
        CHECK(firstMesh(draft.read(folder)).texcoords[1].x == Approx(0.2));
        attributes["TEXCOORD_0"] = draft.add<std::uint16_t>({65535, 0, 0, 0, 0, 0, 0, 0}, 5123, "VEC2", 4, true);
        CHECK(firstMesh(draft.read(folder)).texcoords[0] == glm::vec2(1, 0));
    }
    SECTION("quantized positions, if the extension is used") {
        const int positions =
            draft.add<std::int16_t>({-1, 0, 0, 0, 300, 0, 0, 0, 300, 300, 0, 0, 0, 300, 0, 0}, 5122, "VEC3", 4);
        json["bufferViews"].back()["byteStride"] = 8;
        attributes["POSITION"] = positions;
        CHECK_THROWS_AS(draft.read(folder), SceneError);
        json["extensionsUsed"] = json["extensionsRequired"] = {"KHR_mesh_quantization"};
        CHECK(firstMesh(draft.read(folder)).positions[0] == glm::vec3(-1, 0, 0));
        CHECK(firstMesh(draft.read(folder)).positions[2] == glm::vec3(300, 300, 0));
    }
    SECTION("normalized rotations of an animation") {
        json["animations"][0]["samplers"][1]["output"] =
            draft.add<std::int16_t>({0, 0, 0, 32767, 0, 0, 32767, 0}, 5122, "VEC4", 2, true);
        const Scene scene = draft.read(folder);
        CHECK(sampleRotation(scene.animations[0].channels[1], 0).w == 1);
    }
}

TEST_CASE("glTF: normals, colors and alpha modes in any combination are read, and written as they came", "[gltf]") {
    const TemporaryFolder folder;
    for (const bool normals : {false, true})
        for (const int colors : {0, 1, 2, 3})  // none, VEC3 of floats, VEC4 of bytes, VEC4 of floats
            for (const AlphaMode mode : {AlphaMode::Opaque, AlphaMode::Mask, AlphaMode::Blend}) {
                CAPTURE(normals, colors, int(mode));
                GltfDraft draft = squareDraft();
                Json& attributes = draft.json["meshes"][0]["primitives"][0]["attributes"];
                if (!normals) attributes.erase("NORMAL");
                if (colors == 1)
                    attributes["COLOR_0"] = draft.add<float>({1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1}, 5126, "VEC3", 4);
                if (colors == 2)
                    attributes["COLOR_0"] = draft.add<std::uint8_t>(
                        {255, 0, 0, 51, 255, 0, 0, 51, 0, 0, 255, 51, 0, 0, 255, 51}, 5121, "VEC4", 4, true);
                if (colors == 3)
                    attributes["COLOR_0"] =
                        draft.add<float>({1, 0, 0, 0.2f, 1, 0, 0, 0.2f, 0, 0, 1, 0.2f, 0, 0, 1, 0.2f}, 5126, "VEC4", 4);
                Json& material = draft.json["materials"][0];
                if (mode == AlphaMode::Mask) material["alphaMode"] = "MASK", material["alphaCutoff"] = 0.25;
                if (mode == AlphaMode::Blend) material["alphaMode"] = "BLEND";
                const Scene read = draft.read(folder);
                writeGltf(read, folder / "copy.glb");
                const Scene again = readGltf(folder / "copy.glb");
                for (const Scene* scene : {&read, &again}) {
                    const MeshData& mesh = firstMesh(*scene);
                    CHECK(scene->warnings.empty());
                    CHECK(mesh.flat != normals);
                    CHECK(mesh.normals.size() == 4);
                    REQUIRE(mesh.colors.size() == (colors > 0 ? 4 : 0));
                    if (colors > 0) {
                        CHECK(glm::vec3(mesh.colors[0]) == glm::vec3(1, 0, 0));
                        CHECK(glm::vec3(mesh.colors[3]) == glm::vec3(0, 0, 1));
                        CHECK(mesh.colors[2].a == Approx(colors == 1 ? 1 : 0.2));
                    }
                    CHECK(scene->materials.at(0).alphaMode == mode);
                    if (mode == AlphaMode::Mask) CHECK(scene->materials.at(0).alphaCutoff == 0.25f);
                }
            }
}

TEST_CASE("glTF: colors that do not follow the specification are left out with a warning", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
        draft.add<float>({1, 0, 1, 0, 1, 0, 1, 0}, 5126, "VEC2", 4);
    const Scene scene = draft.read(folder);
    CHECK(firstMesh(scene).colors.empty());
    REQUIRE(scene.warnings.size() == 1);
    CHECK(scene.warnings[0].find("COLOR_0 is neither VEC3 nor VEC4") != std::string::npos);
}

TEST_CASE("glTF: normals have unit length, and zero normals are recomputed", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
        draft.add<float>({0, 3, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1}, 5126, "VEC3", 4);
    const Scene scene = draft.read(folder);
    CHECK(firstMesh(scene).normals[0] == glm::vec3(0, 1, 0));
    CHECK(firstMesh(scene).normals[1] == glm::vec3(0, 0, 1));
}

TEST_CASE("glTF: matrix nodes, mirrored and sheared, keep their world matrix", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json.erase("animations");
    draft.json["nodes"][1]["matrix"] = {-2, 0, 0, 0, 1, 3, 0, 0, 0, 0, 1, 0, 4, 5, 6, 1};
    const Scene scene = draft.read(folder);
    const glm::dmat4 world = scene.registry.get<WorldTransform>(scene.nodes[1]).matrix;
    const glm::dvec4 corner = world * glm::dvec4(1, 1, 0, 1);  // (-2 + 1, 3, 0) + (4, 5, 6) + (0, 0, 1)
    CHECK(glm::length(corner - glm::dvec4(3, 8, 7, 1)) < 1e-12);
    const MeshData baked = bakedMesh(firstMesh(scene), world);
    CHECK(baked.indices == std::vector<std::uint32_t>{0, 2, 1, 0, 3, 2});
    CHECK(baked.normals[0] == glm::vec3(0, 0, 1));
    CHECK(smoothNormals(baked)[0] == glm::vec3(0, 0, 1));
}

TEST_CASE("glTF: one of several scenes, by default the named one, else the first", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["nodes"].push_back({{"name", "alone"}, {"mesh", 0}});
    draft.json["scenes"].push_back({{"name", "second"}, {"nodes", {2}}, {"extras", {{"k", 1}}}});
    draft.json["scene"] = 1;
    Scene scene = draft.read(folder);
    CHECK(scene.index == 1);
    CHECK(*scene.extras == Json({{"k", 1}}));
    REQUIRE(scene.nodes.size() == 3);
    CHECK_FALSE(scene.nodes[0]);
    CHECK(scene.registry.get<Name>(scene.nodes[2]).value == "alone");
    CHECK(scene.animations.at(0).channels.empty());  // its node belongs to the other scene
    CHECK(draft.read(folder, 0).name == "main");
    draft.json.erase("scene");
    CHECK(draft.read(folder).name == "main");
    CHECK_THROWS_WITH(draft.read(folder, 2), Catch::Contains("has no scene 2") && Catch::Contains("0 to 1"));
}

TEST_CASE("glTF: nodes that share a mesh share its data, and entities come in file order", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["nodes"] = {{{"mesh", 0}}, {{"children", {0, 2}}}, {{"mesh", 0}}};
    draft.json["scenes"][0]["nodes"] = {1};
    draft.json.erase("animations");
    const Scene scene = draft.read(folder);
    std::vector<int> order;
    scene.registry.each<MeshInstance>([&](Entity node, const MeshInstance& mesh) {
        order.push_back(nodeIndex(scene, node));
        CHECK(mesh.primitives[0].mesh.get() == &firstMesh(scene));
    });
    CHECK(order == std::vector<int>{0, 2});
}

TEST_CASE("glTF: extras and extensions are kept unchanged", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    const Json body = {{"motion", Json::object()}, {"collider", {{"geometry", {{"mesh", 0}}}}}};
    draft.json["nodes"][1]["extensions"]["KHR_physics_rigid_bodies"] = body;
    draft.json["nodes"][1]["extras"]["touchstone"]["role"] = "tool";
    draft.json["extensions"]["KHR_physics_rigid_bodies"]["physicsMaterials"] = {{{"staticFriction", 0.5}}};
    draft.json["extensionsUsed"] = draft.json["extensionsRequired"] = {"KHR_physics_rigid_bodies"};
    const Scene scene = draft.read(folder);
    const NodeMarking& marking = scene.registry.get<NodeMarking>(scene.nodes[1]);
    CHECK((*marking.extras)["touchstone"]["role"] == "tool");
    CHECK((*marking.extensions)["KHR_physics_rigid_bodies"] == body);
    CHECK(*scene.extensions == draft.json["extensions"]);
    CHECK(scene.extensionsRequired == std::vector<std::string>{"KHR_physics_rigid_bodies"});
    CHECK_FALSE(scene.registry.has<NodeMarking>(scene.nodes[0]));
}

TEST_CASE("glTF: reads images from buffer views, data URIs and files, and no others", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    auto& json = draft.json;
    const Bytes png = smallPng();
    draft.add(png, 5121, "SCALAR", 1);
    json["accessors"].erase(json["accessors"].size() - 1);
    const auto view = json["bufferViews"].size() - 1;
    writeFile(folder / "wood.png", png);
    json["images"] = {{{"uri", "missing occlusion map.png"}}, {{"bufferView", view}, {"mimeType", "image/png"}}};
    json["textures"] = {{{"source", 0}}, {{"source", 1}}};
    json["materials"][0]["occlusionTexture"]["index"] = 0;
    json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 1;
    const Bytes pixels = {255, 0, 0, 255, 0, 255, 0, 128};
    for (int form = 0; form < 3; ++form) {
        CAPTURE(form);
        if (form == 1) json["images"][1] = {{"uri", dataUri(png, "image/png")}};
        if (form == 2) json["images"][1] = {{"uri", "wood.png"}};
        const Scene scene = draft.read(folder);
        REQUIRE(scene.images.size() == 1);
        CHECK(scene.materials[0].texture == 0);
        CHECK(scene.images[0].width == 2);
        CHECK(scene.images[0].height == 1);
        CHECK(scene.images[0].rgba == pixels);
    }
}

TEST_CASE("glTF: a texture uses the set of coordinates that it names", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    auto& attributes = draft.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_1"] = draft.add<float>({9, 9, 9, 9, 9, 9, 9, 9}, 5126, "VEC2", 4);
    writeFile(folder / "wood.png", smallPng());
    draft.json["images"] = {{{"uri", "wood.png"}}};
    draft.json["textures"] = {{{"source", 0}}};
    draft.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}, {"texCoord", 1}};
    CHECK(firstMesh(draft.read(folder)).texcoords[0] == glm::vec2(9, 9));
    // A mesh has one set: a texture on another set than the base color's is skipped, and a warning says so.
    draft.json["materials"][0]["normalTexture"] = {{"index", 0}, {"texCoord", 0}};
    const Scene scene = draft.read(folder);
    CHECK(scene.materials[0].texture == 0);
    CHECK(scene.materials[0].normalTexture == -1);
    REQUIRE(scene.warnings.size() == 1);
    CHECK(scene.warnings[0].find("another set of coordinates") != std::string::npos);
}

TEST_CASE("glTF: a scene written and read again is the same scene", "[gltf]") {
    const TemporaryFolder folder;
    Scene scene;
    scene.name = "round trip";
    *scene.extras = {{"touchstone", {{"settings", {{"margin", 0.5}}}}}};
    const int image = addImage(scene, {2, 1, {255, 0, 0, 255, 0, 255, 0, 128}});
    const int worn = addImage(scene, {1, 1, {0, 128, 255, 255}}), bumps = addImage(scene, {1, 1, {128, 128, 255, 255}});
    const int gold =
        addMaterial(scene, {"gold", {1, 0.75, 0.25, 1}, 1, 0.25f, image, worn, bumps, image, 0.5f, {0.25f, 0, 1}});
    const auto mesh = std::make_shared<MeshData>(
        MeshData{kSquare, std::vector<glm::vec3>(4, {0, 0, 1}), {{0, 1}, {1, 1}, {1, 0}, {0, 0}}, {0, 1, 2, 0, 2, 3}});
    LocalTransform turned;
    turned.translation = {0.1, -0.2, 0.3};
    turned.rotation = {0.5, 0.5, -0.5, 0.5};  // of exact unit length, so that normalizing changes no bit
    turned.scale = {1, 2, -3};
    LocalTransform sheared;
    sheared.shear[1][0] = 0.5;
    const Entity base = addNode(scene, "base"), tool = addNode(scene, "tool \"é\"", base, turned),
                 skew = addNode(scene, "", base, sheared);
    addMesh(scene, tool, mesh, gold);
    addMesh(scene, skew, mesh);
    setExtras(scene, tool, {{"touchstone", {{"role", "tool"}}}});
    *scene.registry.get<NodeMarking>(tool).extensions = {{"KHR_physics_rigid_bodies", {{"motion", Json::object()}}}};
    scene.extensionsRequired = {"KHR_physics_rigid_bodies"};
    const AnimationChannel spline{tool,
                                  AnimationPath::Rotation,
                                  Interpolation::CubicSpline,
                                  {0, 0.5},
                                  {{0, 0, 0, 0}, {0, 0, 0, 1}, {0, 1, 0, 0}, {1, 0, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 0}}};
    const AnimationChannel steps{
        tool, AnimationPath::Scale, Interpolation::Step, {0, 0.5}, {{1, 2, 3, 0}, {4, 5, 6, 0}}};
    scene.animations = {{"demo", {spline, steps}}};

    for (const std::string name : {"scene.glb", "scene.gltf"}) {
        CAPTURE(name);
        writeGltf(scene, folder / name);
        const Scene again = readGltf(folder / name);
        CHECK(again.warnings.empty());
        CHECK(again.name == scene.name);
        CHECK(again.extras == scene.extras);
        CHECK(again.extensionsRequired == scene.extensionsRequired);
        REQUIRE(again.nodes.size() == 3);
        for (std::size_t i = 0; i < 3; ++i) {
            const auto &a = scene.registry.get<LocalTransform>(scene.nodes[i]),
                       &b = again.registry.get<LocalTransform>(again.nodes[i]);
            CHECK(again.registry.get<Name>(again.nodes[i]).value == scene.registry.get<Name>(scene.nodes[i]).value);
            const glm::dmat4 ma = localMatrix(a), mb = localMatrix(b);
            for (int k = 0; k < 16; ++k) CHECK(ma[k / 4][k % 4] == Approx(mb[k / 4][k % 4]).margin(1e-14));
        }
        CHECK(again.registry.get<NodeMarking>(again.nodes[1]).extras == scene.registry.get<NodeMarking>(tool).extras);
        CHECK(again.registry.get<NodeMarking>(again.nodes[1]).extensions ==
              scene.registry.get<NodeMarking>(tool).extensions);
        const Primitive& primitive = again.registry.get<MeshInstance>(again.nodes[1]).primitives[0];
        CHECK(primitive.material == gold);
        CHECK(primitive.mesh->positions == mesh->positions);
        CHECK(primitive.mesh->normals == mesh->normals);
        CHECK(primitive.mesh->texcoords == mesh->texcoords);
        CHECK(primitive.mesh->indices == mesh->indices);
        CHECK(again.materials[0].baseColor == scene.materials[0].baseColor);
        CHECK(again.materials[0].roughness == 0.25f);
        CHECK(again.materials[0].textures() == scene.materials[0].textures());
        CHECK(again.materials[0].normalScale == 0.5f);
        CHECK(again.materials[0].emissive == scene.materials[0].emissive);
        CHECK(again.images[0].rgba == scene.images[0].rgba);
        REQUIRE(again.animations.size() == 1);
        REQUIRE(again.animations[0].channels.size() == 2);
        CHECK(again.animations[0].channels[0].interpolation == Interpolation::CubicSpline);
        CHECK(again.animations[0].channels[0].times == spline.times);
        CHECK(again.animations[0].channels[0].values == spline.values);
        CHECK(again.animations[0].channels[1].values == steps.values);
        // Both nodes use the same vertices: one set of accessors for two meshes (positions, normals, coordinates,
        // indices, times, rotations, scales).
        const GltfContainer container = readContainer(folder / name);
        CHECK(parseJson(folder / name, container.json)["accessors"].size() == 7);
        // Writing and reading a second time changes nothing.
        writeGltf(again, folder / ("again-" + name));
        const bool isSame = readBytes(folder / ("again-" + name)) == readBytes(folder / name);
        CHECK(isSame);
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
        CHECK(entry.path().filename().string().find(".part") == std::string::npos);
}

TEST_CASE("glTF: written files keep node indices when some nodes belong to another scene", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["nodes"].insert(draft.json["nodes"].begin(), Json{{"name", "elsewhere"}});
    draft.json["nodes"][1]["children"] = {2};
    for (auto& channel : draft.json["animations"][0]["channels"]) channel["target"]["node"] = 2;
    draft.json["scenes"][0]["nodes"] = {1};
    const Scene scene = draft.read(folder);
    writeGltf(scene, folder / "out.glb");
    const Scene again = readGltf(folder / "out.glb");
    REQUIRE(again.nodes.size() == 3);
    CHECK_FALSE(again.nodes[0]);
    CHECK(again.registry.get<Name>(again.nodes[2]).value == "tool");
    CHECK(animates(again.animations[0], again.nodes[2]));
}

TEST_CASE("glTF: a failed write is reported, and the old file stays", "[gltf]") {
    const TemporaryFolder folder;
    const auto file = folder / "scene.glb";
    writeFile(file, "old");
    const auto check = [&](const Scene& scene, const std::string& words) {
        CHECK_THROWS_WITH(writeGltf(scene, file), Catch::Contains(words));
        CHECK(readBytes(file) == Bytes{'o', 'l', 'd'});
    };
    check(Scene(), "has no nodes");
    const auto withMesh = [&](MeshData mesh, int material = -1) {
        Scene scene;
        addMaterial(scene, {"m", glm::vec4(1), 0, 1, addImage(scene, {1, 1, {1, 2, 3, 4}})});
        addMesh(scene, addNode(scene, "n"), std::make_shared<MeshData>(std::move(mesh)), material);
        return scene;
    };
    check(withMesh({{{0, 0, 0}, {1, 0, 0}, {0, NAN, 0}}, {}, {}, {0, 1, 2}}),
          "node 0 \"n\": its mesh holds a non-finite number");
    check(withMesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {}, {0, 1, 3}}), "beyond its vertices");
    check(withMesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {}, {0, 1, 2}}, 0), "no texture coordinates");
    check(withMesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {}, {0, 1, 2}}, 3), "material 3");
    Scene scene;
    const Entity node = addNode(scene, "n");
    scene.animations = {{"a", {{node, AnimationPath::Translation, Interpolation::Linear, {1, 1 + 1e-12}, {{}, {}}}}}};
    check(scene, "are not increasing");
    CHECK_THROWS_WITH(writeGltf(withMesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {}, {0, 1, 2}}), folder / "scene.obj"),
                      Catch::Contains("must be named .glb or .gltf"));
    CHECK_THROWS_WITH(
        writeGltf(withMesh({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {}, {0, 1, 2}}), folder / "no/such/scene.glb"),
        Catch::Contains("cannot be written"));
}

TEST_CASE("glTF: extras are replaced in place, and the rest is unchanged", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["nodes"][0]["extras"]["old"] = true;
    draft.json["nodes"][1]["extras"]["gone"] = true;
    draft.json["cameras"] = {{{"type", "unknown to the reader"}}};
    const GltfUpdate update{
        {{0, {{"touchstone", {{"role", "obstacle"}}}}}, {1, nullptr}}, {{0, {{"k", 2.5}}}}, {}, {}, {}};

    Json wanted = draft.json;
    wanted["nodes"][0]["extras"] = {{"touchstone", {{"role", "obstacle"}}}};
    wanted["nodes"][1].erase("extras");
    wanted["scenes"][0]["extras"] = {{"k", 2.5}};

    SECTION("in a binary file") {
        const auto file = folder / "scene.glb";
        writeFile(file, draft.glb());
        updateGltf(file, file, update);
        const GltfContainer container = readContainer(file);
        CHECK(parseJson(file, container.json) == wanted);
        CHECK(std::equal(draft.bin.begin(), draft.bin.end(), container.bin.begin()));
        CHECK((*readGltf(file).extras)["k"] == 2.5);
        CHECK_THROWS_WITH(updateGltf(file, folder / "scene.gltf", update), Catch::Contains("must be named .glb"));
    }
    SECTION("in a text file with buffers in a sub-folder, keeping order and indentation") {
        const auto file = folder / "scene.gltf";
        std::filesystem::create_directories(folder / "sub");
        writeFile(folder / "sub/square.bin", draft.bin);
        draft.json["buffers"][0]["uri"] = wanted["buffers"][0]["uri"] = "sub/square.bin";
        nlohmann::ordered_json ordered = {{"scene", 0}, {"nodes", draft.json["nodes"]}};  // not alphabetical
        for (const auto& [key, value] : draft.json.items()) ordered[key] = value;
        writeFile(file, ordered.dump(3) + "\n");
        updateGltf(file, file, update);
        const Bytes bytes = readBytes(file);
        const std::string text(bytes.begin(), bytes.end());
        CHECK(parseJson(file, text) == wanted);
        CHECK(text.starts_with("{\n   \"scene\": 0,\n   \"nodes\": ["));
        CHECK(text.ends_with("}\n"));
        CHECK(readGltf(file).nodes.size() == 2);
        updateGltf(file, folder / "copy.gltf", update);
        CHECK_THROWS_WITH(updateGltf(file, folder / "sub/scene.gltf", update), Catch::Contains("would lose the files"));
    }
    SECTION("not for objects that do not exist") {
        const auto file = folder / "scene.glb";
        writeFile(file, draft.glb());
        CHECK_THROWS_WITH(updateGltf(file, file, {{{2, {{"a", 1}}}}, {}, {}, {}, {}}),
                          Catch::Contains("has no node 2"));
        CHECK_THROWS_WITH(updateGltf(file, file, {{}, {{-1, {{"a", 1}}}}, {}, {}, {}}),
                          Catch::Contains("has no scene -1"));
        CHECK(readBytes(file) == draft.glb());
    }
}

}  // namespace touchstone::gltf_tests
