// glTF as other programs write it: valid or harmless oddities load, with a warning if something is skipped.
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <functional>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_write.hpp"
#include "engine/scene/transforms.hpp"
#include "tests/engine/scene/gltf_fixture.hpp"

namespace touchstone::gltf_foreign_tests {

using namespace touchstone::engine;
using namespace touchstone::engine::test;
using nlohmann::json;

namespace {

const MeshData& meshOf(const Scene& scene, std::size_t node) {
    return *scene.registry.get<MeshInstance>(scene.nodes.at(node)).primitives.at(0).mesh;
}

/// The only warning of a scene.
std::string warningOf(const Scene& scene) {
    REQUIRE(scene.warnings.size() == 1);
    return scene.warnings[0];
}

std::string sentenceOf(const std::filesystem::path& file) {
    try {
        readGltf(file);
    } catch (const SceneError& error) {
        return error.what();
    }
    return "";
}

/// Positions and triangles of all nodes in the world, one corner after the other.
std::vector<glm::vec3> cornersOf(const Scene& scene) {
    std::vector<glm::vec3> corners;
    scene.registry.each<MeshInstance, WorldTransform>(
        [&](Entity, const MeshInstance& instance, const WorldTransform& world) {
            for (const Primitive& primitive : instance.primitives) {
                const MeshData baked = bakedMesh(*primitive.mesh, world.matrix);
                for (const auto index : baked.indices) corners.push_back(baked.positions[index]);
            }
        });
    return corners;
}

void doubleIntegers(json& value) {
    if (value.is_number_integer()) value = value.get<double>();
    if (value.is_structured())
        for (json& item : value) doubleIntegers(item);
}

}  // namespace

TEST_CASE("foreign glTF: integers may be written as 4.0", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["accessors"][0]["sparse"] = {
        {"count", 1},
        {"indices", {{"bufferView", 3}, {"componentType", 5123}, {"byteOffset", 2}}},
        {"values", {{"bufferView", 1}, {"byteOffset", 0}}}};
    const Scene plain = draft.read(folder);
    doubleIntegers(draft.json);
    CHECK(draft.json.dump().find("5126.0") != std::string::npos);
    const Scene scene = draft.read(folder);
    CHECK(scene.warnings.empty());
    CHECK(cornersOf(scene) == cornersOf(plain));
    CHECK(scene.animations.at(0).channels.size() == 2);
    draft.json["nodes"][1]["mesh"] = 0.5;
    CHECK(sentenceOf((writeFile(folder / "half.glb", draft.glb()), folder / "half.glb"))
              .find("\"mesh\" must be an index") != std::string::npos);
}

TEST_CASE("foreign glTF: objects that the scene does not use may be broken", "[gltf]") {
    struct Case {
        const char* name;
        std::function<void(json&)> damage;
        std::string warning;  ///< its beginning; empty for no warning, because the file is valid
    };
    const std::vector<Case> cases = {
        {"buffer without uri",
         [](json& j) {
             j["buffers"].push_back({{"byteLength", 4}});
         },
         ""},
        {"buffer of a missing file",
         [](json& j) {
             j["buffers"].push_back({{"byteLength", 4}, {"uri", "gone.bin"}});
         },
         ""},
        {"buffer without length", [](json& j) { j["buffers"].push_back(json::object()); },
         "buffer 1: \"byteLength\" is missing, but nothing in the scene uses it."},
        {"view behind its buffer",
         [](json& j) {
             j["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 100000}});
         },
         "buffer view 7: ends at byte 100000 of a buffer of 204, but nothing"},
        {"view of an odd stride",
         [](json& j) {
             j["bufferViews"].push_back({{"buffer", 0}, {"byteLength", 8}, {"byteStride", 5}});
         },
         "buffer view 7: has a byteStride"},
        {"accessor behind its view",
         [](json& j) {
             j["accessors"].push_back({{"bufferView", 0}, {"componentType", 5126}, {"count", 900}, {"type", "VEC3"}});
         },
         "accessor 7: ends at byte 10800"},
        {"accessor of a broken view",
         [](json& j) {
             j["bufferViews"].push_back(json::object());
             j["accessors"].push_back({{"bufferView", 7}, {"componentType", 5126}, {"count", 1}, {"type", "VEC3"}});
         },
         ""},
        {"accessor as text", [](json& j) { j["accessors"].push_back("none"); }, "accessor 7: must be an object, but"},
        {"vertex colors", [](json& j) { j["meshes"][0]["primitives"][0]["attributes"]["COLOR_1"] = 99; }, ""},
        {"mesh",
         [](json& j) {
             j["meshes"].push_back({{"name", "m"}, {"primitives", 5}});
         },
         "mesh 1 \"m\": \"primitives\" must be a list, but"},
        {"node",
         [](json& j) {
             j["nodes"].push_back({{"mesh", 9}});
         },
         "node 2: \"mesh\" is 9 but the file has 1 meshes, but"},
        {"cycle",
         [](json& j) {
             j["nodes"].push_back({{"children", {3}}});
             j["nodes"].push_back({{"children", {2}}});
         },
         "node 2, node 3: is its own ancestor, but nothing in the scene uses it."},
        {"second parent",
         [](json& j) {
             j["nodes"].push_back({{"children", {1}}});
         },
         "node 1 \"tool\": is a child of node 2 as well, which is not in the scene; that parent is ignored."},
        {"scene",
         [](json& j) {
             j["scenes"].push_back({{"nodes", {0, 0, 77}}});
         },
         "scene 1: \"nodes\" is 77"},
        {"texture of no image",
         [](json& j) {
             j["textures"] = {{{"source", 2}}};
         },
         "texture 0: \"source\" is 2"},
        {"image",
         [](json& j) {
             j["images"] = {{{"uri", 5}}};
         },
         "image 0: \"uri\" must be text, but"},
        {"materials",
         [](json& j) {
             j["materials"].push_back({{"emissiveFactor", {1}}});
         },
         "material 1: \"emissiveFactor\""},
        {"images as text", [](json& j) { j["images"] = "many"; }, "\"images\": must be a list, but"},
        {"cameras and skins",
         [](json& j) {
             j["cameras"] = j["skins"] = {5, nullptr};
         },
         ""},
        {"animation of no node",
         [](json& j) {
             j["animations"].push_back({{"channels", {{{"sampler", 5}, {"target", {{"path", "pointer"}}}}}}});
         },
         "animation 1: \"samplers\" is missing, but"},
    };
    const TemporaryFolder folder;
    const Scene plain = squareDraft().read(folder);
    for (const Case& harmless : cases) {
        DYNAMIC_SECTION(harmless.name) {
            GltfDraft draft = squareDraft();
            harmless.damage(draft.json);
            const Scene scene = draft.read(folder);
            CHECK(cornersOf(scene) == cornersOf(plain));
            CHECK(scene.animations.at(0).channels.size() == 2);
            std::string all;
            for (const std::string& warning : scene.warnings) all += warning + "\n";
            CAPTURE(all);
            if (std::string(harmless.name) == "accessor of a broken view") {
                CHECK(scene.warnings.size() == 2);
            } else {
                CHECK(scene.warnings.size() == (harmless.warning.empty() ? 0 : 1));
                CHECK(all.starts_with(harmless.warning));
            }
            // The scene can also be marked.
            updateGltf(folder / "draft.glb", folder / "marked.glb", {{{1, {{"k", 1}}}}, {}, {}, {}, {}});
            CHECK(cornersOf(readGltf(folder / "marked.glb")) == cornersOf(plain));
        }
    }
}

TEST_CASE("foreign glTF: skipped features that change the geometry are named", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    json& j = draft.json;
    SECTION("a rotation that is not of unit length") {
        j["nodes"][0]["rotation"] = {0, 0, 3, 3};
        const Scene scene = draft.read(folder);
        CHECK(warningOf(scene) == "node 0 \"base\": its rotation is not of unit length and was normalized.");
        const auto local = scene.registry.get<LocalTransform>(scene.nodes[0]);
        CHECK(glm::length(local.rotation) == Approx(1));
        CHECK(local.rotation.z == Approx(std::sqrt(0.5)));
    }
    SECTION("a rotation rounded to a few digits is accepted") {
        j["nodes"][0]["rotation"] = {0, 0, 0.707, 0.707};
        CHECK(draft.read(folder).warnings.empty());
    }
    SECTION("rotations of an animation") {
        j["animations"][0]["samplers"][1]["output"] = draft.add<float>({0, 0, 0, 2, 0, 0, 1, 0}, 5126, "VEC4", 2);
        CHECK(warningOf(draft.read(folder)) ==
              "animation 0 \"demo\", rotation of node 1 \"tool\": has rotations that are not of unit length; they were "
              "normalized.");
    }
    SECTION("a skin") {
        j["nodes"][1]["skin"] = 0;
        CHECK(warningOf(draft.read(folder)) ==
              "node 1 \"tool\": its skin is ignored: the mesh keeps its bind pose and is placed by this node.");
    }
    SECTION("morph targets, with weights or without") {
        j["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 0}}};
        CHECK(warningOf(draft.read(folder)) == "mesh 0 \"square\": morph targets are ignored.");
        j["meshes"][0]["weights"] = {0.5};
        CHECK(warningOf(draft.read(folder)) ==
              "mesh 0 \"square\": morph targets are ignored although their weights are not zero: the mesh keeps its "
              "shape "
              "without them.");
    }
    SECTION("unsupported extensions, except those of looks") {
        j["extensionsUsed"] = {"KHR_materials_clearcoat", "KHR_texture_transform", "MSFT_lod"};
        CHECK(warningOf(draft.read(folder)) == "extension MSFT_lod: is not supported and is ignored.");
    }
    SECTION("compressed vertices without plain ones are refused") {
        j["accessors"][0].erase("bufferView");
        j["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = 0;
        CHECK_THROWS_WITH(draft.read(folder), Catch::Contains("has its vertices in KHR_draco_mesh_compression"));
    }
    SECTION("a buffer that exists only in compressed form") {
        j["buffers"].push_back(
            {{"byteLength", 48}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
        j["bufferViews"][0]["buffer"] = 1;
        CHECK_THROWS_WITH(draft.read(folder),
                          Catch::Contains("only present in the compressed form of EXT_meshopt_compression"));
    }
    SECTION("an animated property that does not belong to a node") {
        j["animations"][0]["channels"].push_back({{"sampler", 0}, {"target", {{"path", "pointer"}}}});
        const Scene scene = draft.read(folder);
        CHECK(warningOf(scene) == "animation 0 \"demo\": has channels without a target node; they are ignored.");
        CHECK(scene.animations[0].channels.size() == 2);
    }
}

TEST_CASE("foreign glTF: the same fault of many objects is one warning", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    for (int i = 0; i < 20; ++i) draft.json["accessors"].push_back(json::object());
    CHECK(warningOf(draft.read(folder)) ==
          "accessor 7, accessor 8, accessor 9 and 17 more: \"componentType\" is missing, but nothing in the scene uses "
          "it.");
    for (int i = 0; i < 300; ++i)
        draft.json["meshes"].push_back({{"primitives", {{{"attributes", {{"NORMAL", 100 + i}}}}}}});
    const Scene scene = draft.read(folder);
    REQUIRE(scene.warnings.size() == 101);
    CHECK(scene.warnings.back() == "201 more problems of this file are not listed.");
}

TEST_CASE("foreign glTF: instances become part of the node's mesh", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    json& j = draft.json;
    j.erase("animations");
    const int places = draft.add<float>({0, 0, 0, 10, 0, 0, 0, 20, 0}, 5126, "VEC3", 3);
    const int scales = draft.add<float>({1, 1, 1, 2, 2, 2, -1, 1, 1}, 5126, "VEC3", 3);
    // Half a turn about z for the second one, as normalized bytes.
    const int turns = draft.add<std::int8_t>({0, 0, 0, 127, 0, 0, 127, 0, 0, 0, 0, 127}, 5120, "VEC4", 3, true);
    json& attributes = j["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
    attributes = {{"TRANSLATION", places}, {"ROTATION", turns}, {"SCALE", scales}, {"_ID", 99}};
    j["extensionsUsed"] = j["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
    SECTION("with all three attributes") {
        const Scene scene = draft.read(folder);
        CHECK(scene.warnings.empty());
        CHECK(scene.nodes.size() == 2);
        const MeshData& mesh = meshOf(scene, 1);
        REQUIRE(mesh.positions.size() == 12);
        REQUIRE(mesh.normals.size() == 12);
        CHECK(mesh.positions[2] == glm::vec3(1, 1, 0));
        CHECK(glm::length(mesh.positions[6] - glm::vec3(8, -2, 0)) < 1e-6f);    // rotated and twice as large
        CHECK(glm::length(mesh.positions[10] - glm::vec3(-1, 21, 0)) < 1e-6f);  // mirrored
        CHECK(smoothNormals(mesh)[10] == glm::vec3(0, 0, 1));                   // and its triangles are flipped
        CHECK(mesh.normals[10] == glm::vec3(0, 0, 1));
        // The mesh itself is unchanged for other nodes, and a written copy contains no instances.
        CHECK(scene.meshes[0].primitives[0].mesh->positions.size() == 4);
        writeGltf(scene, folder / "copy.glb");
        CHECK(cornersOf(readGltf(folder / "copy.glb")) == cornersOf(scene));
        // Saved markings keep the extension.
        updateGltf(folder / "draft.glb", folder / "marked.glb", {{{1, {{"k", 1}}}}, {}, {}, {}, {}});
        CHECK(cornersOf(readGltf(folder / "marked.glb")) == cornersOf(scene));
    }
    SECTION("different numbers of elements") {
        j["accessors"][std::size_t(scales)]["count"] = 2;
        CHECK_THROWS_WITH(draft.read(folder),
                          Catch::Contains("node 1 \"tool\": instance attribute SCALE has 2 elements"));
    }
    SECTION("rotations of unsigned integers") {
        j["accessors"][std::size_t(turns)]["componentType"] = 5121;
        CHECK_THROWS_WITH(draft.read(folder), Catch::Contains("VEC4 of floats or signed normalized integers"));
    }
    SECTION("rotations that are not of unit length") {
        attributes["ROTATION"] = draft.add<float>({0, 0, 0, 1, 0, 0, 0, 5, 0, 0, 0, 1}, 5126, "VEC4", 3);
        CHECK(warningOf(draft.read(folder)) ==
              "node 1 \"tool\": has instances whose rotations are not of unit length; they were normalized.");
        attributes["ROTATION"] = draft.add<float>({0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1}, 5126, "VEC4", 3);
        CHECK_THROWS_WITH(draft.read(folder), Catch::Contains("instance 1 has a rotation of length zero"));
    }
    SECTION("more instances than fit into memory") {
        j["accessors"].push_back({{"componentType", 5126}, {"count", 1 << 24}, {"type", "VEC3"}});
        attributes = {{"TRANSLATION", j["accessors"].size() - 1}};
        CHECK_THROWS_WITH(draft.read(folder), Catch::Contains("above 67 million vertices"));
    }
}

TEST_CASE("foreign glTF: hidden nodes hide all nodes below them, and are named", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["extensionsUsed"] = draft.json["extensionsRequired"] = {"KHR_node_visibility"};
    draft.json["nodes"][0]["extensions"]["KHR_node_visibility"]["visible"] = false;
    draft.json["nodes"][1]["extensions"]["KHR_node_visibility"]["visible"] = true;
    const Scene scene = draft.read(folder);
    CHECK_FALSE(isVisible(scene.registry, scene.nodes[1]));
    CHECK(cornersOf(scene).size() == 6);
    CHECK(warningOf(scene) ==
          "node 0 \"base\": is hidden by KHR_node_visibility: it is not drawn, but it collides if it has a role.");
    Scene other;
    appendScene(other, scene, "part");  // hidden parts add nothing
    CHECK(cornersOf(other).empty());
    writeGltf(scene, folder / "copy.glb");
    const Scene again = readGltf(folder / "copy.glb");
    CHECK_FALSE(isVisible(again.registry, again.nodes[1]));
}

TEST_CASE("foreign glTF: a written file keeps the indices of meshes, to which colliders refer", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    json& meshes = draft.json["meshes"];
    meshes.push_back(meshes[0]);  // equal to the first
    meshes.push_back(meshes[0]);
    meshes[2]["primitives"][0]["mode"] = 0;  // points: empty for this program
    meshes.push_back(meshes[0]);
    meshes[3]["primitives"][0].erase("material");
    for (const int mesh : {1, 2, 3})
        draft.json["nodes"].push_back(
            {{"extensions", {{"KHR_physics_rigid_bodies", {{"collider", {{"geometry", {{"mesh", mesh}}}}}}}}}});
    draft.json["scenes"][0]["nodes"] = {0, 2, 3, 4};
    const Scene scene = draft.read(folder);
    writeGltf(scene, folder / "copy.glb");
    const Scene again = readGltf(folder / "copy.glb");
    REQUIRE(again.meshes.size() == 4);
    CHECK(again.meshes[0].primitives.size() == 1);
    CHECK(again.meshes[1].primitives.at(0).material == 0);
    CHECK(again.meshes[2].primitives.empty());
    CHECK(again.meshes[3].primitives.at(0).material == -1);
}

TEST_CASE("foreign glTF: files of other formats are recognized and named", "[gltf]") {
    const TemporaryFolder folder;
    const auto check = [&](const Bytes& contents, const std::string& words) {
        writeFile(folder / "file.glb", contents);
        CAPTURE(words);
        CHECK(sentenceOf(folder / "file.glb").find((folder / "file.glb").string() + ": is " + words) == 0);
    };
    const auto text = [&](const std::string& contents, const std::string& words) {
        check(Bytes(contents.begin(), contents.end()), words);
    };
    check(smallPng(), "a PNG picture, not glTF");
    text("PK\x03\x04 and more", "a ZIP archive, not glTF; unpack it");
    text("solid cube\nfacet normal 0 0 1", "an STL mesh, not glTF; create a scene from it with touchstone new");
    Bytes stl(84 + 2 * 50);
    stl[80] = 2;
    check(stl, "an STL mesh");
    text("# made by hand\r\n\r\nmtllib a.mtl\nv 0 0 0\n", "an OBJ mesh");
    text("ply\nformat ascii 1.0\n", "a PLY mesh");
    text("<!DOCTYPE html><html>", "a web page, not glTF; download the file itself");
    text("version https://git-lfs.github.com/spec/v1\n", "the pointer that Git LFS keeps");
    text("ISO-10303-21;\nHEADER;\n", "a STEP file, not glTF; create a scene of its parts with touchstone new");
    text(std::string(72, ' ') + "S      1\n", "an IGES file, not glTF; it holds exact surfaces");
    text("DBRep_DrawableShape\n", "a BREP file of Open Cascade, not glTF; it holds exact surfaces");
    text("**ABCDEFGHIJKLMNOPQRSTUVWXYZabc", "a Parasolid file, not glTF; it holds exact surfaces");
    text("3D Geometry File Format 70", "a Rhino file, not glTF; export each part from Rhino");
    text(std::string("PK\x03\x04...[Content_Types].xml"), "a 3MF or office file, not glTF; convert a 3MF part to STL");
    text(std::string("PK\x03\x04...Document.xml"), "a FreeCAD document, not glTF; export each part from FreeCAD");
    text("Dear reader,\n", "a text file of another kind");
    check(Bytes{1, 2, 3, 0, 0}, "a file of another kind");
    // Text with a UTF-8 byte order mark is still glTF.
    const std::string marked = "\xef\xbb\xbf" + squareDraft().json.dump();
    writeFile(folder / "file.gltf", marked);
    CHECK(sentenceOf(folder / "file.gltf").find("buffer 0: has no \"uri\"") != std::string::npos);
    for (const char* old : {R"({"asset":{"version":"1.0"},"meshes":{"a":{}}})", R"({"meshes":{"a":{}},"scene":"s"})"}) {
        writeFile(folder / "old.gltf", std::string(old));
        CHECK(sentenceOf(folder / "old.gltf").find("asset: is glTF 1.0; convert it to glTF 2.0") != std::string::npos);
    }
    ::mkfifo((folder / "pipe.glb").c_str(), 0600);
    CHECK(sentenceOf(folder / "pipe.glb").find("is a pipe; name a file") != std::string::npos);
    CHECK(sentenceOf("/dev/zero").find("is a device; name a file") != std::string::npos);
}

TEST_CASE("foreign glTF: names appear in messages without control characters", "[gltf]") {
    CHECK(printable("a\nb\tc\x1b[31m") == "a\\nb\\tc\\x1b[31m");
    CHECK(printable("\xc2\x9b"
                    "31m") == "\\x9b31m");  // the one-character form of ESC [
    CHECK(printable("a\xe2\x80\xae"
                    "b") == "a\\u202eb");  // right-to-left override
    CHECK(printable("Zahnr\xc3\xa4"
                    "der \xe6\xad\xaf\xe8\xbd\xae") ==
          "Zahnr\xc3\xa4"
          "der \xe6\xad\xaf\xe8\xbd\xae");
    CHECK(printable("\xff\xfe\xc3") == "\\xff\\xfe\\xc3");
    CHECK(printable(std::string(59, 'x') + "\xc3\xa4y") == std::string(59, 'x') + "…");
    CHECK(escaped(std::string(70, 'x') + "\n") == std::string(70, 'x') + "\\n");
    CHECK(sentenceOf("no\x1b[2Jfile\n.glb").starts_with("no\\x1b[2Jfile\\n.glb: the file does not exist"));
}

TEST_CASE("foreign glTF: four hundred thousand empty objects are read in linear time", "[gltf]") {
    // With quadratic time this count would take minutes; the time limit of the tests bounds it.
    constexpr std::size_t kCount = 400000;
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["extras"] = draft.json["images"] = json(kCount, json::object());
    Scene scene = draft.read(folder);
    CHECK(cornersOf(scene).size() == 6);
    // Nodes below one node, and nodes below each other: the depth is bounded by memory, not by the call stack.
    draft = squareDraft();
    draft.json.erase("animations");
    for (std::size_t i = 2; i < kCount / 4; ++i) {
        draft.json["nodes"].push_back({{"children", {i + 1}}});
    }
    draft.json["nodes"].push_back({{"mesh", 0}});
    draft.json["nodes"][1]["children"] = {2};
    scene = draft.read(folder);
    CHECK(scene.registry.size() == kCount / 4 + 1);
    CHECK(cornersOf(scene).size() == 12);
}

}  // namespace touchstone::gltf_foreign_tests
