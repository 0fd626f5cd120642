#include "tools/touchstone/tree_parts.hpp"

#include <spdlog/spdlog.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_read.hpp"
#include "engine/scene/mesh_file.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;

struct Unit {
    std::string_view name;
    double meters;
};
constexpr std::array kUnits{Unit{"mm", 1e-3}, Unit{"cm", 1e-2}, Unit{"m", 1.0}, Unit{"in", 0.0254}};

std::string extensionOf(const fs::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

TreePart readMeshPart(const PartChoice& choice) {
    if (!choice.part.empty())
        throw UsageError("--part chooses a node of a scene, but '" + choice.file + "' is one part");
    TreePart part;
    part.name = fs::path(choice.file).stem().string();
    part.mmPerUnit = sandbox::kMmPerMeter * metersPer(choice.unit.value_or("mm"));
    // The file is read in its own unit: single precision then keeps its digits, and the unit is applied in double.
    const engine::MeshFile read = engine::readMeshFile(choice.file, 1);
    for (const std::string& note : read.notes) spdlog::warn("{}", note);
    part.mesh = sandbox::toTriangles(read, part.mmPerUnit);
    return part;
}

TreePart nodePart(const engine::Scene& scene, engine::Entity node) {
    TreePart part;
    const std::string& given = scene.registry.get<engine::Name>(node).value;
    part.name = given.empty() ? nodeLabel(scene, node) : engine::printable(given);
    part.mesh = sandbox::bakedTriangles(scene, node);
    if (const auto* body = scene.registry.find<sandbox::BodyMarking>(node)) {
        part.role = sandbox::name(scene.registry.get<sandbox::Role>(node));
        part.options = body->tree;
    }
    if (part.mesh.triangles.empty())
        engine::failIn(scene.file, nodeLabel(scene, node), "it has no triangles: choose a node with a mesh");
    return part;
}

std::vector<TreePart> readSceneParts(const PartChoice& choice) {
    if (choice.unit)
        throw UsageError("--unit is for " + engine::meshExtensionWords("and") + " files: scenes are in meters");
    engine::Scene scene = engine::readGltf(findScene(choice.file));
    updateWorldTransforms(scene);
    const sandbox::SceneRoles roles = sandbox::assignRoles(scene);

    std::vector<TreePart> parts;
    if (!choice.part.empty()) {
        parts.push_back(nodePart(scene, nodeNamed(scene, choice.part)));
    } else {
        if (roles.tool) parts.push_back(nodePart(scene, roles.tool));
        for (const engine::Entity obstacle : roles.obstacles) parts.push_back(nodePart(scene, obstacle));
    }
    if (parts.empty()) {
        parts.emplace_back();
        parts.back().name = scene.file.stem().string();
        parts.back().mesh = sandbox::bakedTriangles(scene);
        if (parts.back().mesh.triangles.empty()) engine::failIn(scene.file, "", "holds no triangle: give it a mesh");
    }
    for (TreePart& part : parts) part.mmPerUnit = sandbox::kMmPerMeter;
    return parts;
}

}  // namespace

void addPartChoice(CLI::App& command, PartChoice& choice) {
    command.add_option("--unit", choice.unit,
                       "unit of " + engine::meshExtensionWords("and") + " coordinates: mm (default), cm, m or in");
    command.add_option("--part", choice.part, "name of a node of the scene");
}

engine::Entity nodeNamed(const engine::Scene& scene, const std::string& name) {
    std::vector<engine::Entity> found;
    std::string names;
    for (const engine::Entity node : scene.nodes) {
        if (!node) continue;
        const std::string& given = scene.registry.get<engine::Name>(node).value;
        if (given == name) found.push_back(node);
        if (!given.empty()) names += (names.empty() ? "" : ", ") + engine::printable(given);
    }
    const auto marked = std::stable_partition(found.begin(), found.end(), [&](engine::Entity node) {
        return scene.registry.has<sandbox::BodyMarking>(node);
    });
    if (found.empty())
        throw std::runtime_error(scene.file.string() + ": no node is called '" + engine::printable(name) + "'" +
                                 (names.empty() ? "" : "; there are " + names));
    const auto end = marked == found.begin() ? found.end() : marked;
    if (end - found.begin() > 1)
        throw std::runtime_error(scene.file.string() + ": several nodes are called '" + engine::printable(name) +
                                 "': give the node for the tree a unique name");
    return found.front();
}

double TreePart::diagonal() const {
    Eigen::AlignedBox3d box;
    for (const auto& triangle : mesh.triangles)
        for (const std::uint32_t v : triangle) box.extend(mesh.vertices[v]);
    return box.diagonal().norm();
}

double metersPer(const std::string& unit) {
    for (const Unit& known : kUnits)
        if (known.name == unit) return known.meters;
    throw UsageError("--unit is mm, cm, m or in, not '" + unit + "'");
}

std::vector<TreePart> readParts(const PartChoice& choice) {
    if (engine::isMeshFile(choice.file)) {
        std::vector<TreePart> parts;
        parts.push_back(readMeshPart(choice));
        return parts;
    }
    const std::string extension = extensionOf(choice.file);
    std::error_code error;
    if (extension != ".glb" && extension != ".gltf" && fs::is_regular_file(choice.file, error))
        throw std::runtime_error(choice.file + ": this is neither a mesh (" + engine::meshExtensionWords() +
                                 ") nor a scene (.glb or .gltf); export it as one of these");
    return readSceneParts(choice);
}

TreePart onlyPart(std::vector<TreePart> parts, const std::string& file, const std::string& why) {
    if (parts.size() == 1) return std::move(parts.front());
    std::string names;
    for (const TreePart& part : parts) names += (names.empty() ? "" : ", ") + part.name;
    throw UsageError(why + ", but '" + file + "' has " + std::to_string(parts.size()) +
                     " parts: choose one with --part (" + names + ")");
}

}  // namespace touchstone::app
