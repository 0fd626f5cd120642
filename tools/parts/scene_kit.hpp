#pragma once
// Building blocks of the scenes: marked bodies, materials, the bunny, the position of first contact.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/scene/scene.hpp"
#include "haptics/collision/sphere_tree.hpp"
#include "tools/parts/demonstration.hpp"

namespace touchstone::app {

engine::Material gold();
engine::Material silver();

std::shared_ptr<const engine::MeshData> shared(engine::MeshData mesh);

/// Adds a root node at a pose, with a mesh (may be null) and `extras.touchstone = marking`.
engine::Entity addBody(engine::Scene& scene, const char* name, const ToolPose& pose,
                       std::shared_ptr<const engine::MeshData> mesh, const engine::Material& material,
                       nlohmann::json marking);

/// Markings as docs/scenes.md describes them. Every tool has the stiffness of the reference device, 1 N/mm and
/// 1 N·m/rad, and every outcome a penetration of at most 1 µm.
nlohmann::json toolMarking(int leaves, nlohmann::json outcome);
nlohmann::json obstacleMarking(int leaves);

/// The settings of a fit with this clearance, mm: leaves whose protrusions on both bodies together are at most 0.9 of
/// it (or `leaves`, if not 0), and a margin and trust of 0.4 of it.
nlohmann::json closeFit(nlohmann::json marking, int leaves, double clearance);
nlohmann::json closeFitExtras(double clearance);

/// The bunny about the center of its bounding box, scaled so that its largest side is 100 mm; up is +y, the face at -x.
/// Throws engine::SceneError that names the package to install when the file is missing.
std::shared_ptr<const engine::MeshData> stanfordBunny(const std::filesystem::path& file);

/// The sphere tree of a mesh, mm, read from the cache folder or built; an empty folder disables the cache.
SphereTree treeOf(const engine::MeshData& mesh, int leaves, const std::filesystem::path& cache);

/// The distance from `start` along the unit direction at which the tool touches an obstacle at the origin, mm. Throws
/// engine::SceneError when it misses the obstacle.
double travelToContact(const SphereTree& tool, const SphereTree& obstacle, const ToolPose& start,
                       const glm::dvec3& direction);

}  // namespace touchstone::app
