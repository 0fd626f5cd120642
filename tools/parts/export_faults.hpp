#pragma once
// Meshes as other programs export them: rounded, with seams that do not meet, and with triangles that bound nothing.
#include "engine/scene/scene.hpp"

namespace touchstone::app {

/// Shares are of the triangles of a mesh, 0 to 1.
struct ExportFaults {
    double grid = 1e-6;     ///< to which coordinates are rounded, m; 0: as they are
    double junctions = 0;   ///< beside which one neighbor has a vertex on the edge that the other has not
    double slivers = 0;     ///< beside which a triangle lies that is as thin as the grid
    double degenerate = 0;  ///< that come with a triangle between two points
    double flipped = 0;     ///< turned over
    double innerWalls = 0;  ///< below which a wall lies inside the part
    bool everythingTwice = false;
    unsigned seed = 1;
};

/// The mesh as separate triangles with these faults. It bounds the same volume, to its grid.
engine::MeshData withFaults(const engine::MeshData& mesh, const ExportFaults& faults);

/// What a careless export of a good part has: micrometers in meters, and some of every fault above.
inline constexpr ExportFaults kUsualFaults{.junctions = 0.1,
                                           .slivers = 0.01,
                                           .degenerate = 0.003,
                                           .flipped = 0.02,
                                           .innerWalls = 0.01,
                                           .everythingTwice = true};

/// Gives all meshes of a scene these faults.
void addFaults(engine::Scene& scene, const ExportFaults& faults);

}  // namespace touchstone::app
