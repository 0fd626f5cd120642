// Broken and hostile glTF files: each must give one sentence that names file, object and remedy; never a crash.
#include <catch2/catch.hpp>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/engine/scene/gltf_fixture.hpp"

namespace touchstone::gltf_broken_tests {

using namespace touchstone::engine;
using namespace touchstone::engine::test;
using nlohmann::json;

namespace {

template <class T>
void poke(Bytes& bytes, std::size_t offset, T value) {
    std::memcpy(bytes.data() + offset, &value, sizeof value);
}

/// Expects a SceneError of one line that names the file, holds the words, and ends with a remedy after ';' or ','.
void checkSentence(const std::filesystem::path& file, const std::string& words) {
    try {
        readGltf(file);
        FAIL_CHECK("was read, but should say: " << words);
    } catch (const SceneError& error) {
        const std::string sentence = error.what();
        CAPTURE(sentence);
        CHECK(sentence.starts_with(file.string() + ": "));
        CHECK(sentence.find(words) != std::string::npos);
        CHECK(sentence.find('\n') == std::string::npos);
        CHECK(sentence.find("; ", file.string().size()) != std::string::npos);
        CHECK(sentence.size() < file.string().size() + 260);
    }
}

struct BrokenCase {
    std::string name;
    std::function<void(json&, Bytes&)> damage;
    std::string words;
};

/// Offsets in the buffer of squareDraft(): positions 0, normals 48, coordinates 96, indices 128, times 140,
/// translations 148, rotations 172.
const std::vector<BrokenCase> kBrokenCases = {
    // Structure
    {"no asset", [](json& j, Bytes&) { j.erase("asset"); }, "\"asset\" is missing"},
    {"version 1", [](json& j, Bytes&) { j["asset"]["version"] = "1.0"; }, "asset: is glTF 1.0; convert it"},
    {"version as number", [](json& j, Bytes&) { j["asset"]["version"] = 2; }, "\"asset.version\" must be text"},
    {"too new", [](json& j, Bytes&) { j["asset"]["minVersion"] = "2.1"; }, "asset: requires glTF"},
    {"nodes as text", [](json& j, Bytes&) { j["nodes"] = "none"; }, "\"nodes\" must be a list"},
    {"node as number", [](json& j, Bytes&) { j["nodes"][1] = 5; }, "node 1: must be an object"},
    {"root as list", [](json& j, Bytes&) { j = json::array({1}); }, "must be an object"},
    {"name as number", [](json& j, Bytes&) { j["nodes"][0]["name"] = 5; }, "node 0: \"name\" must be text"},
    {"name with line breaks",
     [](json& j, Bytes&) {
         j["nodes"][0]["name"] = "a\nb";
         j["nodes"][0]["mesh"] = 9;
     },
     "node 0 \"a\\nb\""},
    {"required extension", [](json& j, Bytes&) { j["extensionsRequired"] = {"KHR_draco_mesh_compression"}; },
     "extensionsRequired: requires KHR_draco_mesh_compression"},
    {"extension name as number", [](json& j, Bytes&) { j["extensionsRequired"] = {1}; },
     "\"extensionsRequired\" must be a list of texts"},
    {"extensions as list", [](json& j, Bytes&) { j["nodes"][1]["extensions"] = {1}; },
     "node 1 \"tool\": \"extensions\" must be an object"},
    // Scenes
    {"no scenes",
     [](json& j, Bytes&) {
         j.erase("scenes");
         j.erase("scene");
     },
     "has no scene"},
    {"empty scene", [](json& j, Bytes&) { j["scenes"][0].erase("nodes"); }, "scene 0 \"main\": lists no nodes"},
    {"default scene", [](json& j, Bytes&) { j["scene"] = 1; }, "\"scene\" is 1 but the file has 1 scenes"},
    {"scene node", [](json& j, Bytes&) { j["scenes"][0]["nodes"] = {7}; },
     "scene 0 \"main\": \"nodes\" is 7 but the file has 2 nodes"},
    {"scene node twice",
     [](json& j, Bytes&) {
         j["scenes"][0]["nodes"] = {0, 0};
     },
     "lists node 0 \"base\" twice"},
    {"scene lists a child",
     [](json& j, Bytes&) {
         j["scenes"][0]["nodes"] = {0, 1};
     },
     "lists node 1 \"tool\", which is a child of node 0"},
    {"zero triangles", [](json& j, Bytes&) { j["nodes"][1].erase("mesh"); }, "scene 0 \"main\": has no triangles"},
    {"only points", [](json& j, Bytes&) { j["meshes"][0]["primitives"][0]["mode"] = 0; }, "has no triangles"},
    {"only degenerate triangles",
     [](json&, Bytes& b) {
         for (std::size_t i = 0; i < 6; ++i) poke<std::uint16_t>(b, 128 + 2 * i, 1);
     },
     "has no triangles"},
    // Hierarchy
    {"own child", [](json& j, Bytes&) { j["nodes"][1]["children"] = {1}; }, "node 1 \"tool\": has two parents"},
    {"cycle through the root", [](json& j, Bytes&) { j["nodes"][1]["children"] = {0}; }, "is its own ancestor"},
    {"same child twice",
     [](json& j, Bytes&) {
         j["nodes"][0]["children"] = {1, 1};
     },
     "has two parents"},
    {"child out of range", [](json& j, Bytes&) { j["nodes"][0]["children"] = {-1}; },
     "node 0 \"base\": \"children\" is -1"},
    {"mesh out of range", [](json& j, Bytes&) { j["nodes"][1]["mesh"] = 1; },
     "\"mesh\" is 1 but the file has 1 meshes"},
    // Transforms
    {"short translation",
     [](json& j, Bytes&) {
         j["nodes"][0]["translation"] = {1, 2};
     },
     "\"translation\" must be 3 numbers"},
    {"huge translation",
     [](json& j, Bytes&) {
         j["nodes"][0]["translation"] = {1e30, 0, 0};
     },
     "\"translation\" is 1e+30, not within"},
    {"null in scale",
     [](json& j, Bytes&) {
         j["nodes"][0]["scale"] = {1, nullptr, 1};
     },
     "\"scale\" must hold numbers only"},
    {"zero rotation",
     [](json& j, Bytes&) {
         j["nodes"][0]["rotation"] = {0, 0, 0, 0};
     },
     "node 0 \"base\": has a rotation of length zero"},
    {"short matrix",
     [](json& j, Bytes&) {
         j["nodes"][0]["matrix"] = {1, 0, 0};
     },
     "\"matrix\" must be 16 numbers"},
    {"projective matrix",
     [](json& j, Bytes&) {
         j["nodes"][0].erase("translation");
         j["nodes"][0]["matrix"] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
     },
     "last row is not 0 0 0 1"},
    {"matrix and translation",
     [](json& j, Bytes&) { j["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     "has a matrix as well as translation"},
    {"world overflow",
     [](json& j, Bytes&) {
         j["nodes"][0]["scale"] = j["nodes"][1]["scale"] = {1e9, 1, 1};
     },
     "node 1 \"tool\": its transform in the world"},
    // Buffers and views
    {"no buffer length", [](json& j, Bytes&) { j["buffers"][0].erase("byteLength"); },
     "buffer 0: \"byteLength\" is missing"},
    {"zero buffer", [](json& j, Bytes&) { j["buffers"][0]["byteLength"] = 0; },
     "buffer 0: \"byteLength\" is 0, not within"},
    {"long buffer", [](json& j, Bytes&) { j["buffers"][0]["byteLength"] = 1000000; }, "buffer 0: needs 1000000 bytes"},
    {"fractional buffer", [](json& j, Bytes&) { j["buffers"][0]["byteLength"] = 10.5; },
     "\"byteLength\" must be a whole number"},
    {"view of no buffer", [](json& j, Bytes&) { j["bufferViews"][0]["buffer"] = 3; }, "buffer view 0: \"buffer\" is 3"},
    {"view behind the buffer", [](json& j, Bytes&) { j["bufferViews"][1]["byteOffset"] = 200; },
     "buffer view 1: ends at byte 248 of a buffer of 204"},
    {"view offset overflow",
     [](json& j, Bytes&) { j["bufferViews"][1]["byteOffset"] = std::numeric_limits<std::uint64_t>::max() - 8; },
     "buffer view 1: \"byteOffset\" is 18446744073709551607"},
    {"negative view offset", [](json& j, Bytes&) { j["bufferViews"][1]["byteOffset"] = -48; },
     "buffer view 1: \"byteOffset\" is -48"},
    {"odd stride", [](json& j, Bytes&) { j["bufferViews"][0]["byteStride"] = 13; },
     "buffer view 0: has a byteStride that is not a multiple of 4"},
    {"small stride", [](json& j, Bytes&) { j["bufferViews"][0]["byteStride"] = 4; },
     "accessor 0: has elements of 12 bytes in a buffer view of stride 4"},
    {"large stride", [](json& j, Bytes&) { j["bufferViews"][0]["byteStride"] = 252; },
     "accessor 0: ends at byte 768 of buffer view 0, which has 48"},
    {"huge stride", [](json& j, Bytes&) { j["bufferViews"][0]["byteStride"] = 256; }, "\"byteStride\" is 256"},
    // Accessors
    {"no such view", [](json& j, Bytes&) { j["accessors"][0]["bufferView"] = 70; },
     "accessor 0: \"bufferView\" is 70 but the file has 7 bufferViews"},
    {"offset behind the view", [](json& j, Bytes&) { j["accessors"][0]["byteOffset"] = 4; },
     "accessor 0: ends at byte 52 of buffer view 0, which has 48"},
    {"huge count", [](json& j, Bytes&) { j["accessors"][0]["count"] = 2147483647; },
     "accessor 0: ends at byte 25769803764"},
    {"count overflow", [](json& j, Bytes&) { j["accessors"][0]["count"] = 1e19; },
     "accessor 0: \"count\" must be a whole number"},
    {"huge count of zeros",
     [](json& j, Bytes&) {
         j["accessors"][0]["count"] = 2147483647;
         j["accessors"][0].erase("bufferView");
     },
     "accessor 0: has 2147483647 elements but no data"},
    {"zero count", [](json& j, Bytes&) { j["accessors"][0]["count"] = 0; }, "accessor 0: \"count\" is 0"},
    {"component type", [](json& j, Bytes&) { j["accessors"][0]["componentType"] = 5124; },
     "accessor 0: \"componentType\" must be one of"},
    {"element type", [](json& j, Bytes&) { j["accessors"][0]["type"] = "VEC5"; },
     "accessor 0: \"type\" must be one of"},
    {"positions in two dimensions", [](json& j, Bytes&) { j["accessors"][0]["type"] = "VEC2"; },
     "accessor 0: has the wrong type for mesh 0 \"square\", primitive 0, POSITION; it must be VEC3 of floats"},
    {"positions of integers", [](json& j, Bytes&) { j["accessors"][0]["componentType"] = 5122; },
     "accessor 0: has the wrong type for mesh 0"},
    {"indices of floats", [](json& j, Bytes&) { j["meshes"][0]["primitives"][0]["indices"] = 4; },
     "accessor 4: has the wrong type for mesh 0 \"square\", primitive 0, indices"},
    {"signed indices", [](json& j, Bytes&) { j["accessors"][3]["componentType"] = 5122; },
     "accessor 3: has the wrong type"},
    {"sparse index out of range",
     [](json& j, Bytes& b) {
         poke<std::uint16_t>(b, 128, 60000);
         j["accessors"][0]["sparse"] = {
             {"count", 1}, {"indices", {{"bufferView", 3}, {"componentType", 5123}}}, {"values", {{"bufferView", 1}}}};
         j["meshes"][0]["primitives"][0].erase("indices");
     },
     "accessor 0: replaces element 60000 of 4"},
    {"sparse count",
     [](json& j, Bytes&) {
         j["accessors"][0]["sparse"] = {
             {"count", 5}, {"indices", {{"bufferView", 3}, {"componentType", 5121}}}, {"values", {{"bufferView", 1}}}};
     },
     "accessor 0: replaces more elements than it has"},
    {"sparse indices behind the view",
     [](json& j, Bytes&) {
         j["accessors"][0]["sparse"] = {
             {"count", 4}, {"indices", {{"bufferView", 3}, {"componentType", 5125}}}, {"values", {{"bufferView", 1}}}};
     },
     "accessor 0: ends at byte 16 of buffer view 3"},
    {"sparse values behind the view",
     [](json& j, Bytes&) {
         j["accessors"][0]["sparse"] = {{"count", 4},
                                        {"indices", {{"bufferView", 3}, {"componentType", 5121}}},
                                        {"values", {{"bufferView", 1}, {"byteOffset", 4}}}};
     },
     "accessor 0: ends at byte 52 of buffer view 1"},
    {"sparse without values",
     [](json& j, Bytes&) {
         j["accessors"][0]["sparse"] = {{"count", 1}, {"indices", {{"bufferView", 3}, {"componentType", 5121}}}};
     },
     "accessor 0: \"sparse.values\" is missing"},
    // Meshes
    {"mesh without primitives", [](json& j, Bytes&) { j["meshes"][0].erase("primitives"); },
     "mesh 0 \"square\": \"primitives\" is missing"},
    {"attribute out of range", [](json& j, Bytes&) { j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 99; },
     "mesh 0 \"square\", primitive 0: \"attributes.POSITION\" is 99 but the file has 7 accessors"},
    {"indices out of range", [](json& j, Bytes&) { j["meshes"][0]["primitives"][0]["indices"] = 99; },
     "\"indices\" is 99"},
    {"index beyond the vertices", [](json&, Bytes& b) { poke<std::uint16_t>(b, 132, 4); },
     "mesh 0 \"square\", primitive 0: index 2 is 4 but there are only 4 vertices"},
    {"restart index", [](json&, Bytes& b) { poke<std::uint16_t>(b, 132, 0xFFFF); }, "index 2 is 65535"},
    {"corners no multiple of 3", [](json& j, Bytes&) { j["accessors"][3]["count"] = 5; },
     "has 5 corners, which is not a multiple of 3"},
    {"indices without data", [](json& j, Bytes&) { j["accessors"][3].erase("bufferView"); },
     "mesh 0 \"square\": has indices without a buffer view"},
    {"fewer normals", [](json& j, Bytes&) { j["accessors"][1]["count"] = 3; },
     "mesh 0 \"square\", primitive 0: NORMAL has 3 elements but POSITION has 4"},
    {"fewer coordinates", [](json& j, Bytes&) { j["accessors"][2]["count"] = 3; }, "TEXCOORD_0 has 3 elements"},
    {"mode", [](json& j, Bytes&) { j["meshes"][0]["primitives"][0]["mode"] = 7; }, "\"mode\" is 7"},
    {"material out of range", [](json& j, Bytes&) { j["meshes"][0]["primitives"][0]["material"] = 1; },
     "\"material\" is 1"},
    {"NaN vertex", [](json&, Bytes& b) { poke(b, 16, std::numeric_limits<float>::quiet_NaN()); },
     "accessor 0: holds a non-finite number or one beyond 1e12 in element 1"},
    {"infinite vertex", [](json&, Bytes& b) { poke(b, 28, -std::numeric_limits<float>::infinity()); },
     "accessor 0: holds a non-finite number or one beyond 1e12 in element 2"},
    {"huge vertex", [](json&, Bytes& b) { poke(b, 0, 1e30f); }, "accessor 0: holds a non-finite number"},
    {"NaN normal", [](json&, Bytes& b) { poke(b, 48, std::numeric_limits<float>::quiet_NaN()); },
     "accessor 1: holds a non-finite number"},
    {"NaN coordinate", [](json&, Bytes& b) { poke(b, 96, std::numeric_limits<float>::quiet_NaN()); },
     "accessor 2: holds a non-finite number"},
    // Materials and images
    {"color of three",
     [](json& j, Bytes&) {
         j["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1};
     },
     "material 0 \"gold\": \"pbrMetallicRoughness.baseColorFactor\" must be 4 numbers"},
    {"texture out of range",
     [](json& j, Bytes&) {
         j["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
     },
     "\"pbrMetallicRoughness.baseColorTexture.index\" is 0 but the file has 0 textures"},
    {"invalid image",
     [](json& j, Bytes&) {
         j["images"] = {{{"name", "wood"}, {"bufferView", 0}}};
         j["textures"] = {{{"source", 0}}};
         j["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
     },
     "image 0 \"wood\": is neither PNG nor JPEG"},
    {"image in two places",
     [](json& j, Bytes&) {
         j["images"] = {{{"uri", "a.png"}, {"bufferView", 0}}};
         j["textures"] = {{{"source", 0}}};
         j["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
     },
     "image 0: must have either"},
    {"missing image",
     [](json& j, Bytes&) {
         j["images"] = {{{"uri", "wood.png"}}};
         j["textures"] = {{{"source", 0}}};
         j["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
     },
     "image 0: refers to the missing file \"wood.png\""},
    {"image outside",
     [](json& j, Bytes&) {
         j["images"] = {{{"uri", "../wood.png"}}};
         j["textures"] = {{{"source", 0}}};
         j["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
     },
     "image 0: refers to \"../wood.png\" outside the scene's folder"},
    // Animations
    {"sampler out of range", [](json& j, Bytes&) { j["animations"][0]["channels"][0]["sampler"] = 2; },
     "animation 0 \"demo\": refers to sampler 2 of 2"},
    {"channel node out of range", [](json& j, Bytes&) { j["animations"][0]["channels"][0]["target"]["node"] = 2; },
     "animation 0 \"demo\", channel 0: \"target.node\" is 2"},
    {"decreasing times", [](json&, Bytes& b) { poke(b, 144, 0.25f); },
     "animation 0 \"demo\", translation of node 1 \"tool\": key 1 is not later"},
    {"constant times", [](json&, Bytes& b) { poke(b, 144, 0.5f); }, "key 1 is not later"},
    {"negative time", [](json&, Bytes& b) { poke(b, 140, -1.0f); }, "starts before time 0"},
    {"NaN time", [](json&, Bytes& b) { poke(b, 140, std::numeric_limits<float>::quiet_NaN()); },
     "accessor 4: holds a non-finite number"},
    {"NaN value", [](json&, Bytes& b) { poke(b, 148, std::numeric_limits<float>::quiet_NaN()); },
     "accessor 5: holds a non-finite number"},
    {"zero key rotation", [](json&, Bytes& b) { poke(b, 184, 0.0f); },
     "rotation of node 1 \"tool\": key 0 is a rotation of length zero"},
    {"fewer values", [](json& j, Bytes&) { j["accessors"][5]["count"] = 1; }, "has 1 values but its 2 keys need 2"},
    {"no tangents", [](json& j, Bytes&) { j["animations"][0]["samplers"][0]["interpolation"] = "CUBICSPLINE"; },
     "has 2 values but its 2 keys need 6"},
    {"interpolation", [](json& j, Bytes&) { j["animations"][0]["samplers"][0]["interpolation"] = "SMOOTH"; },
     "\"interpolation\" must be one of"},
    {"times as vectors", [](json& j, Bytes&) { j["animations"][0]["samplers"][0]["input"] = 5; },
     "accessor 5: has the wrong type for animation 0"},
    {"two channels for one path",
     [](json& j, Bytes&) { j["animations"][0]["channels"].push_back(j["animations"][0]["channels"][0]); },
     "translation of node 1 \"tool\": is animated twice"},
    {"matrix node moves",
     [](json& j, Bytes&) { j["nodes"][1]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}; },
     "moves a node that has a matrix"},
};

}  // namespace

TEST_CASE("broken glTF: every kind of damage gives one sentence with file, object and remedy", "[gltf]") {
    const TemporaryFolder folder;
    for (const BrokenCase& broken : kBrokenCases) {
        DYNAMIC_SECTION(broken.name) {
            GltfDraft draft = squareDraft();
            broken.damage(draft.json, draft.bin);
            writeFile(folder / "broken.glb", draft.glb());
            checkSentence(folder / "broken.glb", broken.words);
        }
    }
}

TEST_CASE("broken glTF: containers", "[gltf]") {
    const TemporaryFolder folder;
    const auto file = folder / "broken.glb";
    const Bytes whole = squareDraft().glb();
    const auto damaged = [&](std::size_t offset, std::uint32_t word) {
        Bytes bytes = whole;
        poke(bytes, offset, word);
        writeFile(file, bytes);
        return file;
    };
    writeFile(file, Bytes());
    checkSentence(file, "is empty");
    checkSentence(folder / "absent.glb", "the file does not exist");
    checkSentence(folder.path(), "is a folder; name a file");
    checkSentence(damaged(4, 1), "header: has version 1, not 2");
    checkSentence(damaged(8, 8), "header: declares 8 bytes");
    checkSentence(damaged(8, 0xFFFFFFFF), "header: declares 4294967295 bytes");
    checkSentence(damaged(12, 0xFFFFFFF0), "JSON chunk: ends after the end of the file");
    checkSentence(damaged(16, 0x12345678), "does not start with exactly one JSON chunk");
    for (std::size_t size = 1; size < whole.size(); size += 7) {
        CAPTURE(size);
        writeFile(file, Bytes(whole.begin(), whole.begin() + std::ptrdiff_t(size)));
        CHECK_THROWS_AS(readGltf(file), SceneError);
    }
    writeFile(file, glbBytes(squareDraft().json.dump(), {}));
    checkSentence(file, "buffer 0: needs 204 bytes but only 0 are present");
}

TEST_CASE("broken glTF: JSON text", "[gltf]") {
    const TemporaryFolder folder;
    const auto file = folder / "broken.gltf";
    const auto text = [&](const std::string& contents) {
        writeFile(file, contents);
        return file;
    };
    checkSentence(text("{\"asset\":\n  {\"version\": }}"), "JSON: is broken at line 2, column 15");
    checkSentence(text("{"), "JSON: is broken at line 1");
    checkSentence(text("hello"), "is a text file of another kind, not glTF");
    checkSentence(text("[]"), "must be an object");
    checkSentence(text("{\"asset\":{\"version\":\"2.0\"},\"scene\":1e999}"), "JSON: holds a number");
    checkSentence(text("{\"asset\":{\"version\":\"\xff\xfe\"}}"), "JSON: is broken");
    checkSentence(text(std::string(1000000, '[')), "JSON: is nested deeper than 200 levels");
    std::string deep = "{\"asset\":{\"version\":\"2.0\"},\"extras\":";
    for (int i = 0; i < 100000; ++i) deep += "{\"a\":";
    checkSentence(text(deep), "JSON: is nested deeper");
}

TEST_CASE("broken glTF: external files stay inside the scene's folder", "[gltf]") {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder / "scene");
    GltfDraft draft = squareDraft();
    writeFile(folder / "secret.bin", draft.bin);
    writeFile(folder / "scene/short.bin", Bytes(10));
    writeFile(folder / "scene/inside.bin", draft.bin);
    std::filesystem::create_symlink(folder / "secret.bin", folder / "scene/link.bin");
    std::filesystem::create_directory_symlink(folder.path(), folder / "scene/up");
    std::filesystem::create_symlink("inside.bin", folder / "scene/good-link.bin");
    const auto file = folder / "scene/scene.gltf";
    const auto withUri = [&](const json& uri) {
        draft.json["buffers"][0]["uri"] = uri;
        writeFile(file, draft.json.dump());
        return file;
    };
    const std::string outside = "outside the scene's folder";
    checkSentence(withUri("../secret.bin"), outside);
    checkSentence(withUri("%2e%2e/secret.bin"), outside);
    checkSentence(withUri("a/../../secret.bin"), outside);
    checkSentence(withUri((folder / "secret.bin").string()), outside);
    checkSentence(withUri("file://" + (folder / "secret.bin").string()), outside);
    checkSentence(withUri("http://localhost/secret.bin"), outside);
    checkSentence(withUri("link.bin"), outside);
    checkSentence(withUri("up/secret.bin"), outside);
    checkSentence(withUri("inside.bin%00.png"), outside);
    checkSentence(withUri(""), outside);
    checkSentence(withUri("absent.bin"),
                  "buffer 0: refers to the missing file \"absent.bin\"; put it into the scene's folder");
    checkSentence(withUri(std::string(5000, 'a')), "refers to the missing file");
    checkSentence(withUri("short.bin"), "buffer 0: needs 204 bytes but only 10 are present");
    checkSentence(withUri("."), "buffer 0: refers to \".\", which is a folder");
    checkSentence(withUri("data:application/octet-stream;base64,AAAA"), "buffer 0: needs 204 bytes but only 3");
    checkSentence(withUri("data:application/octet-stream,hello"), "has a data URI without base64");
    checkSentence(withUri("data:;base64,@@@@"), "needs 204 bytes but only 0");
    checkSentence(withUri(5), "buffer 0: \"uri\" must be text");
    CHECK_NOTHROW(readGltf(withUri("good-link.bin")));
    CHECK_NOTHROW(readGltf(withUri("inside.bin")));
}

TEST_CASE("broken glTF: one accessor read a million times does not fill the memory", "[gltf]") {
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["accessors"].push_back({{"componentType", 5126}, {"count", 1 << 24}, {"type", "VEC3"}});
    json primitive = {{"attributes", {{"POSITION", 7}}}, {"indices", 3}};
    draft.json["meshes"][0]["primitives"] = json::array();
    for (int i = 0; i < 8; ++i) draft.json["meshes"][0]["primitives"].push_back(primitive);
    writeFile(folder / "broken.glb", draft.glb());
    checkSentence(folder / "broken.glb",
                  "mesh 0 \"square\": brings the scene above 67 million vertices, corners and keys");
}

TEST_CASE("broken glTF: mutated files give a scene or one sentence", "[gltf][fuzz]") {
    const unsigned seed = 20240612;
    CAPTURE(seed);
    std::mt19937 random(seed);
    const TemporaryFolder folder;
    GltfDraft draft = squareDraft();
    draft.json["accessors"][0]["sparse"] = {
        {"count", 2},
        {"indices", {{"bufferView", 3}, {"componentType", 5121}, {"byteOffset", 1}}},
        {"values", {{"bufferView", 1}}}};
    draft.add(smallPng(), 5121, "SCALAR", 1);
    draft.json["images"] = {{{"bufferView", 7}, {"mimeType", "image/png"}}};
    draft.json["textures"] = {{{"source", 0}}};
    draft.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
    const Bytes whole = draft.glb();
    const std::string text = draft.json.dump();
    // Numbers and words at the borders of some check.
    const std::vector<std::string> words = {"-1",         "0",
                                            "1",          "2",
                                            "3",          "6",
                                            "7",          "255",
                                            "65535",      "2147483647",
                                            "4294967295", "1e38",
                                            "-0.5",       "null",
                                            "true",       "\"x\"",
                                            "[]",         "{}",
                                            "[0]",        "5121",
                                            "5125",       "5126",
                                            "12",         "48",
                                            "204",        "9007199254740993"};
    int scenes = 0, sentences = 0;
    for (int i = 0; i < 4000; ++i) {
        CAPTURE(i);
        Bytes bytes = whole;
        if (i % 2 == 0) {  // replace random bytes
            for (unsigned k = 0; k <= random() % 4; ++k)
                bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
            if (random() % 8 == 0) bytes.resize(random() % bytes.size());
        } else {  // replace one JSON value by another
            std::string mutated = text;
            for (unsigned k = 0; k <= random() % 2; ++k) {
                std::size_t colon = mutated.find_first_of(":[,", random() % mutated.size());
                if (colon == std::string::npos) continue;
                const std::size_t end = mutated.find_first_of(",]}", colon + 1);
                if (end == std::string::npos) continue;
                mutated.replace(colon + 1, end - colon - 1, words[random() % words.size()]);
            }
            bytes = glbBytes(mutated, binChunk(draft.bin));
        }
        const auto file = folder / "mutated.glb";
        writeFile(file, bytes);
        try {
            const Scene scene = readGltf(file);
            ++scenes;
            for (const MeshInstance& mesh : scene.meshes)
                for (const Primitive& primitive : mesh.primitives) {
                    REQUIRE(primitive.mesh->normals.size() == primitive.mesh->positions.size());
                    for (const auto index : primitive.mesh->indices) REQUIRE(index < primitive.mesh->positions.size());
                }
        } catch (const SceneError& error) {
            ++sentences;
            REQUIRE(std::string(error.what()).find('\n') == std::string::npos);
        }
    }
    CHECK(scenes > 100);
    CHECK(sentences > 100);
}

TEST_CASE("glTF: the models of assimp load or give one sentence", "[gltf]") {
    const std::filesystem::path models = "/usr/share/assimp/models";
    if (!std::filesystem::exists(models)) return;  // an optional package
    int scenes = 0, sentences = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(models)) {
        const auto extension = entry.path().extension();
        if (extension != ".gltf" && extension != ".glb") continue;
        CAPTURE(entry.path().string());
        try {
            readGltf(entry.path());
            ++scenes;
        } catch (const SceneError& error) {
            ++sentences;
            INFO(error.what());
            CHECK(std::string(error.what()).find('\n') == std::string::npos);
        }
    }
    CHECK(scenes > 0);
    CHECK(sentences > 0);
}

}  // namespace touchstone::gltf_broken_tests
