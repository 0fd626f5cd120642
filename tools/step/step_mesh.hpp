#pragma once
// Triangles of exact solids.
#include <TopoDS_Shape.hxx>
#include <optional>

#include "engine/scene/cad_parts.hpp"

namespace touchstone::step {

struct MeshChoice {
    std::optional<double> deviation;  ///< m; by default from the clearance of the shape
    bool inStep = false;         ///< counts of facets divide each other; else those of holes and shafts are coprime
    bool keepClearance = false;  ///< holes are circumscribed, shafts inscribed
};

/// Gives the shape triangles that deviate from its solids by as much as is asked for, and measures by how much they do.
/// They are closed wherever the faces of the solids are. Sets a problem if a face has no triangles at all. Shafts and
/// holes have vertices on lines along their axis, in equal distances, spheres and tori also on rows about it; other
/// surfaces are left to Open Cascade.
void makeMesh(const TopoDS_Shape& solids, const MeshChoice& choice, engine::CadShape& shape);

}  // namespace touchstone::step
