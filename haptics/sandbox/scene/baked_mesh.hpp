#pragma once
// The triangles of a body of the scene: in its rigid frame, in mm, scale and mirroring baked into the vertices.
#include "engine/scene/mesh_file.hpp"
#include "engine/scene/scene.hpp"
#include "haptics/builder/triangle_mesh.hpp"

namespace touchstone::sandbox {

/// All meshes that belong to a node with a role, as one mesh in the node's rigid frame, mm. If there are colliders
/// below the node, their geometry replaces what is drawn.
TriangleMesh bakedTriangles(const engine::Scene& scene, engine::Entity roleNode);

/// The whole scene as one mesh in the scene frame, mm.
TriangleMesh bakedTriangles(const engine::Scene& scene);

/// By how much single precision may have moved the vertices of bakedTriangles() from their places, mm: it grows with
/// their distance from the origin of their mesh.
double singleRounding(const engine::Scene& scene, engine::Entity roleNode);

/// A mesh in mm, in the coordinates of its file, whose unit is `mmPerUnit`.
TriangleMesh toTriangles(const engine::MeshFile& file, double mmPerUnit);

}  // namespace touchstone::sandbox
