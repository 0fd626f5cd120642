#pragma once
// Leaves out the triangles of a file that enclose nothing.
#include <optional>

#include "haptics/builder/mesh_faces.hpp"
#include "haptics/builder/triangle_mesh.hpp"

namespace touchstone {

/// Largest area of loose sheets beside the closed shells, as a share of that of these.
constexpr double kLooseSheets = 0.05;

/// A mesh without some triangles, and what these are: connected, or together far away.
struct Tidied {
    TriangleMesh mesh;
    std::vector<MeshPatch> loose;
};

/// What is left without the triangles of loose sheets. `corners`: of the faces of each sheet, as welded vertices, of
/// which there are `vertices`; `kept`: all other faces. A triangle belongs to a sheet if it has a corner that only this
/// sheet has, or the corners of one of its faces.
Tidied withoutSheets(const TriangleMesh& mesh, const std::vector<int>& placeOf, std::size_t vertices,
                     const std::vector<std::vector<int>>& corners, const std::vector<Corners>& kept);

/// The mesh without the few triangles that lie many times the size of all others away; nothing if no triangle does.
/// Whether they enclose something must still be seen: `far` receives them.
std::optional<Tidied> withoutFar(const TriangleMesh& mesh, TriangleMesh& far);

}  // namespace touchstone
