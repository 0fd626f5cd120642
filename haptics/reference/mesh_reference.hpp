#pragma once
// The exact answer of a tick: the same quasi-static problem on the triangle meshes themselves, solved to convergence,
// offline.
#include <memory>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone {

struct MeshObstacle {
    TriangleMesh mesh;
    Pose X_WO;  ///< its frame in the scene
};

struct MeshReferenceOptions {
    /// Distance that is kept between the surfaces, mm, so that the line between nearest points has a direction.
    double shell = 1e-3;
    double margin = 0.3;      ///< mm: features within it become rows, and no step is longer
    double tolerance = 1e-6;  ///< mm: a shorter step ends the iteration
    int iterations = 300;     ///< maximum number of iterations
};

struct MeshReferenceProblem {
    Pose X_WT_device;       ///< where the device wants the tool node
    Pose X_WT_start;        ///< where the tool node is, clear of the obstacles
    double stiffness = 1;   ///< N/mm
    double torsion = 1000;  ///< mN·m/rad
};

struct MeshReferenceAnswer {
    Pose X_WT;        ///< tool node
    Wrench wrench_C;  ///< on the hand, about C of the device pose
    bool converged = false;
    double residual = 0;   ///< length of the solver's last step, before any cap, mm
    double clearance = 0;  ///< smallest distance of the meshes, mm, at most the margin
    double gap = 0;        ///< largest distance of two features that carry load, mm
    int contacts = 0;      ///< number of contacts that carry load
    int iterations = 0;
};

/// Finds min ½(x-h)'G(x-h) over the poses that the tool can reach from the start without touching the obstacles, with G
/// of stiffness and torsion about C. This is the pose at which the tool comes to rest if the device does not move.
/// Contacts are pairs of a vertex and a face or of two edges, including their ends. Each iteration makes half-spaces of
/// the contacts within the margin that are local minima of the distance (D. Johnson, P. Willemsen, Six
/// degree-of-freedom haptic rendering of complex polygonal models, 2003), solves exactly, moves no further than the
/// margin, and halves the move until no triangles touch. The energy decreases with every move. Distances are exact up
/// to rounding, without sampling. The object is immutable and may be shared; solve() allocates and takes milliseconds
/// to seconds. For about one in thirty poses of two bunnies the contacts alternate between neighboring features, and
/// the iteration does not converge; `residual` then tells how far the tool still moves, some hundredths of a mm.
class MeshReference {
  public:
    /// `p_TC`: the tool's reference point in its node's frame, as World::p_TC(). Throws std::invalid_argument with one
    /// sentence if a mesh has no triangle.
    MeshReference(const TriangleMesh& tool, const Vec3& p_TC, const std::vector<MeshObstacle>& obstacles,
                  const MeshReferenceOptions& options = {});
    ~MeshReference();

    /// Throws std::invalid_argument with one sentence if the meshes touch at the start.
    MeshReferenceAnswer solve(const MeshReferenceProblem& problem) const;

    /// Smallest distance of the meshes at a pose of the tool node, mm; 0 if triangles touch, and at most `atMost`.
    double clearance(const Pose& X_WT, double atMost) const;

    struct Impl;

  private:
    std::unique_ptr<const Impl> impl_;
};

}  // namespace touchstone
