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

/// A pose on the y axis or `x` beside it, turned about it; mm and rad.
ToolPose upright(double y, double angle, double x = 0);

/// Adds the goal pose, with its tolerances in mm and rad, and what else is known of it.
void addGoal(engine::Scene& scene, const ToolPose& pose, double room, double angle,
             const nlohmann::json& more = nlohmann::json::object());

/// A way to a goal: these poses in its frame.
nlohmann::json wayTo(const ToolPose& goal, const std::vector<ToolPose>& way);

/// Markings as docs/scenes.md describes them. Every tool has the stiffness of the reference device, 1 N/mm and
/// 1 N·m/rad, and every outcome a penetration of at most 1 µm. `leaves`: 0 leaves their number to the scene.
nlohmann::json toolMarking(int leaves, nlohmann::json outcome);
nlohmann::json obstacleMarking(int leaves);

/// Extras of a scene whose parts fit with this clearance on each side, mm.
nlohmann::json fitExtras(double clearance);

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
