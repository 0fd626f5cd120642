#pragma once
// Which faces others go through.
#include "haptics/builder/mesh_faces.hpp"

namespace touchstone {

constexpr double kTouching = 1e-9;  ///< of the diagonal: two faces so near may cross

/// By face: whether another may go through it or lie on it; faces that only share vertices do not. Doubts count as
/// yes, also where more than a hundred are about. Lengths in the frame of RepairedMesh.
std::vector<char> crossedFaces(const std::vector<Vec3>& vertices, const std::vector<Corners>& faces, Pulse& pulse);

}  // namespace touchstone
