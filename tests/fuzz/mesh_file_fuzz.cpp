// Any bytes as an STL file (first byte even) or an OBJ file (odd).
#include <cmath>

#include "engine/scene/mesh_file.hpp"
#include "engine/scene/scene.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using fuzz::require;

// The importer library leaks its own meshes when it throws over a broken file; the leak checker shall see ours only.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp"; }
extern "C" const char* __lsan_default_options();
extern "C" const char* __lsan_default_options() { return "print_suppressions=0"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    static const fuzz::ScratchFile stl(".stl"), obj(".obj");
    const std::filesystem::path& file = (data[0] % 2 == 0 ? stl : obj).write(data + 1, size - 1);
    try {
        const engine::MeshData mesh = engine::readMeshFile(file, 0.001);
        require(!mesh.indices.empty() && mesh.indices.size() % 3 == 0, "whole triangles");
        require(mesh.normals.size() == mesh.positions.size(), "a normal for each position");
        for (const std::uint32_t i : mesh.indices) require(i < mesh.positions.size(), "indices are valid");
        for (const glm::vec3& p : mesh.positions) require(std::isfinite(p.x + p.y + p.z), "positions are finite");
        for (const glm::vec3& n : mesh.normals)
            require(std::abs(glm::length(n) - 1) < 1e-4, "normals have unit length");
    } catch (const engine::SceneError& error) {
        fuzz::requireSentence(error.what());
        require(std::string(error.what()).find(file.filename().string()) != std::string::npos, "names the file");
    }
    return 0;
}
