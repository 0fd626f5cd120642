// Arbitrary bytes as a scene. If the first byte is even, the others are a .glb or .gltf file. If it is odd, two more
// bytes give the length of a JSON text and the rest is the binary chunk, so that a change of the text keeps the rest
// valid.
#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_read.hpp"
#include "engine/scene/gltf_write.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using fuzz::require;

namespace {

std::vector<std::uint8_t> fileOf(const std::uint8_t* data, std::size_t size) {
    const std::vector<std::uint8_t> bytes(data + 1, data + size);
    if (data[0] % 2 == 0 || bytes.size() < 2) return bytes;
    const auto text = bytes.begin() + 2;
    const auto end = text + std::min<std::ptrdiff_t>(bytes[0] | bytes[1] << 8, bytes.end() - text);
    return engine::glbBytes(std::string(text, end), engine::binChunk({end, bytes.end()}));
}

void checkMesh(const engine::MeshData& mesh) {
    require(!mesh.indices.empty() && mesh.indices.size() % 3 == 0, "whole triangles");
    require(mesh.normals.size() == mesh.positions.size(), "a normal for each position");
    require(mesh.texcoords.empty() || mesh.texcoords.size() == mesh.positions.size(), "as many texture coordinates");
    for (const std::uint32_t i : mesh.indices) require(i < mesh.positions.size(), "indices are valid");
    for (const glm::vec3& p : mesh.positions) require(std::isfinite(p.x + p.y + p.z), "positions are finite");
    for (const glm::vec3& n : mesh.normals) require(std::abs(glm::length(n) - 1) < 1e-4, "normals have unit length");
}

void checkScene(const engine::Scene& scene) {
    require(!scene.roots.empty(), "there is a root");
    for (const engine::MeshInstance& mesh : scene.meshes)
        for (const engine::Primitive& primitive : mesh.primitives) {
            checkMesh(*primitive.mesh);
            require(primitive.material < static_cast<int>(scene.materials.size()), "materials exist");
        }
    for (const engine::Material& material : scene.materials)
        for (const int image : material.textures())
            require(image < static_cast<int>(scene.images.size()), "images exist");
    for (const engine::Entity node : scene.nodes) {
        if (!node) continue;
        const glm::dmat4& world = scene.registry.get<engine::WorldTransform>(node).matrix;
        for (int k = 0; k < 16; ++k) require(std::abs(world[k / 4][k % 4]) <= 1e12, "nodes are in the world");
        if (const auto* mesh = scene.registry.find<engine::MeshInstance>(node))
            for (const engine::Primitive& primitive : mesh->primitives) checkMesh(*primitive.mesh);
    }
    for (const std::string& warning : scene.warnings) fuzz::requireSentence(warning);
}

/// Positions and triangles, mesh by mesh in the order of the nodes.
std::size_t differences(const engine::Scene& a, const engine::Scene& b) {
    std::size_t differing = a.nodes.size() == b.nodes.size() ? 0 : 1;
    for (std::size_t i = 0; i < a.nodes.size() && differing == 0; ++i) {
        if (!a.nodes[i]) continue;
        const auto *from = a.registry.find<engine::MeshInstance>(a.nodes[i]),
                   *to = b.registry.find<engine::MeshInstance>(b.nodes[i]);
        if (!from != !to || (from && from->primitives.size() != to->primitives.size())) return 1;
        for (std::size_t k = 0; from && k < from->primitives.size(); ++k)
            differing += from->primitives[k].mesh->positions != to->primitives[k].mesh->positions ||
                         from->primitives[k].mesh->indices != to->primitives[k].mesh->indices;
    }
    return differing;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    static const fuzz::ScratchFile file(".glb"), copy("-copy.glb");
    const std::vector<std::uint8_t> bytes = fileOf(data, size);
    engine::Scene scene;
    try {
        scene = engine::readGltf(file.write(bytes.data(), bytes.size()));
    } catch (const engine::SceneError& error) {
        fuzz::requireSentence(error.what());
        require(std::string(error.what()).find(file.path().filename().string()) != std::string::npos, "names the file");
        return 0;
    }
    checkScene(scene);
    try {
        writeGltf(scene, copy.path());
    } catch (
        const engine::SceneError& error) {  // content that glTF cannot store, such as an animation of a sheared node
        fuzz::requireSentence(error.what());
        return 0;
    }
    require(differences(scene, engine::readGltf(copy.path())) == 0, "what was written is read");
    return 0;
}
