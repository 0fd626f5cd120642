#pragma once
// What the scenes are put together from: marked bodies, looks, the bunny, the height of first contact.
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

/// What a fit of this clearance, mm, needs: of its bodies, leaves that stand out of both by nine tenths of it together
/// (or `leaves`, if not 0), and of the scene, a margin and trust of 0.4 of it.
nlohmann::json closeFit(nlohmann::json marking, int leaves, double clearance);
nlohmann::json closeFitExtras(double clearance);

/// The bunny about the centre of its bounding box, whose largest side is made 100 mm; up is +y, the face at -x.
/// Throws engine::SceneError, with what to install when the file is missing.
std::shared_ptr<const engine::MeshData> stanfordBunny(const std::filesystem::path& file);

/// The sphere tree of a mesh, mm, from the cache folder or built; an empty folder means no cache.
SphereTree treeOf(const engine::MeshData& mesh, int leaves, const std::filesystem::path& cache);

/// How far the tool can go from `start` along the unit direction before it touches an obstacle at the origin, mm.
/// Throws engine::SceneError when it passes by.
double travelToContact(const SphereTree& tool, const SphereTree& obstacle, const ToolPose& start,
                       const glm::dvec3& direction);

}  // namespace touchstone::app
