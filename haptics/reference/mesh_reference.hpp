#pragma once
// What the tick would answer if it were exact: the same quasi-static problem on the triangle meshes themselves, solved
// to convergence, offline.
#include <memory>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone {

struct MeshObstacle {
    TriangleMesh mesh;
    Pose X_WO;  ///< its frame in the scene
};

struct MeshReferenceOptions {
    /// Surfaces are kept this far apart, mm: so that the line between nearest points keeps a direction.
    double shell = 1e-3;
    double margin = 0.3;      ///< mm: features this near become rows; no step is longer
    double tolerance = 1e-6;  ///< mm: a step this short is the last
    int iterations = 300;
};

struct MeshReferenceProblem {
    Pose X_WT_device;       ///< tool node where the device wants it
    Pose X_WT_start;        ///< tool node where it is, clear of the obstacles
    double stiffness = 1;   ///< N/mm
    double torsion = 1000;  ///< mN·m/rad
};

struct MeshReferenceAnswer {
    Pose X_WT;        ///< tool node
    Wrench wrench_C;  ///< on the hand, about C of the device pose
    bool converged = false;
    double residual = 0;   ///< length of the last step that the solver asked for, mm
    double clearance = 0;  ///< least distance of the meshes, mm; the margin when it is more
    double gap = 0;        ///< greatest distance of two features that carry load, mm
    int contacts = 0;      ///< that carry load
    int iterations = 0;
};

/// Finds min ½(x-h)'G(x-h) over poses that the tool can reach from the start, G of stiffness and torsion about C,
/// without the meshes meeting: where the tool comes to rest if the device stands still. Contacts are pairs of vertex
/// and face, edge and edge, and where they end; each iteration makes half-spaces of those within the margin that are
/// local minima of the distance (D. Johnson, P. Willemsen, Six degree-of-freedom haptic rendering of complex polygonal
/// models, 2003), solves exactly, moves no further than the margin, and halves the move until no triangle is met. The
/// energy falls with every move. Distances are exact up to rounding; there is no sampling. Immutable once made, and may
/// be shared; solve() allocates and takes milliseconds to seconds.
/// On about one pose in thirty of two bunnies the contacts alternate between neighboring features and it does not
/// converge: `residual` then says how far the tool still wanders, some hundredths of a mm.
class MeshReference {
  public:
    /// `p_TC`: the tool's reference point in its node's frame, as World::p_TC(). Throws std::invalid_argument with one
    /// sentence when a mesh has no triangle.
    MeshReference(const TriangleMesh& tool, const Vec3& p_TC, const std::vector<MeshObstacle>& obstacles,
                  const MeshReferenceOptions& options = {});
    ~MeshReference();

    /// Throws std::invalid_argument with one sentence when the meshes meet at the start.
    MeshReferenceAnswer solve(const MeshReferenceProblem& problem) const;

    /// Least distance of the meshes at a pose of the tool node, mm; 0 where triangles meet, `atMost` where it is more.
    double clearance(const Pose& X_WT, double atMost) const;

    struct Impl;

  private:
    std::unique_ptr<const Impl> impl_;
};

}  // namespace touchstone
