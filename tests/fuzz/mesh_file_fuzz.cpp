// Arbitrary bytes as a file of each format; the first byte selects it, by the first letter of its extension.
#include <cmath>
#include <deque>

#include "engine/scene/mesh_file.hpp"
#include "engine/scene/scene.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    static const std::deque<fuzz::ScratchFile> files = [] {
        std::deque<fuzz::ScratchFile> made;
        for (const std::string_view extension : engine::meshExtensions()) made.emplace_back(std::string(extension));
        return made;
    }();
    const auto extensions = engine::meshExtensions();
    std::size_t format = data[0] % extensions.size();
    for (std::size_t i = 0; i < extensions.size(); ++i)
        if (extensions[i][1] == char(data[0])) format = i;
    const std::filesystem::path& file = files[format].write(data + 1, size - 1);
    try {
        const auto [mesh, origin, notes] = engine::readMeshFile(file, 0.001);
        require(std::isfinite(origin.x + origin.y + origin.z), "the origin is finite");
        require(!mesh.indices.empty() && mesh.indices.size() % 3 == 0, "whole triangles");
        require(mesh.normals.size() == mesh.positions.size(), "a normal for each position");
        for (const std::uint32_t i : mesh.indices) require(i < mesh.positions.size(), "indices are valid");
        for (const glm::vec3& p : mesh.positions) require(std::isfinite(p.x + p.y + p.z), "positions are finite");
        for (const glm::vec3& n : mesh.normals)
            require(std::abs(glm::length(n) - 1) < 1e-4, "normals have unit length");
        require(notes.size() < 100, "notes of one kind are one");
        for (const std::string& note : notes) fuzz::requireSentence(note);
    } catch (const engine::SceneError& error) {
        fuzz::requireSentence(error.what());
        require(std::string(error.what()).find(file.filename().string()) != std::string::npos, "names the file");
    }
    return 0;
}
