#pragma once
// Finds the faces that other faces may cross.
#include "haptics/builder/mesh_faces.hpp"

namespace touchstone {

constexpr double kTouching = 1e-9;  ///< distance at which two faces count as crossing, in the frame of RepairedMesh

/// Tells for each face whether another face may cross it or lie on it. Faces that only share vertices do not cross. A
/// case in doubt counts as a crossing, and so does a face with more than a hundred neighbors. Lengths in the frame of
/// RepairedMesh.
std::vector<char> crossedFaces(const std::vector<Vec3>& vertices, const std::vector<Corners>& faces, Pulse& pulse);

}  // namespace touchstone
