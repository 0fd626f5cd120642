#pragma once
// Measures the quality of a sphere tree of any origin, by code that shares none with the builder's proofs.
#include <cstdint>
#include <string>

#include "haptics/builder/sphere_hierarchy.hpp"
#include "haptics/builder/tree_builder.hpp"

namespace touchstone {

/// Lengths in mm. The surface consists of every usable triangle of the mesh. The leaves' outside is the part of their
/// spheres that lies in no other leaf and is no wall of a hollow; where it lies inside the body, the surface next to it
/// is bare.
struct TreeMetrics {
    int leaves = 0, nodes = 0;
    double diagonal = 0;             ///< of the mesh's bounding box
    bool coverageProven = false;     ///< every triangle can be cut into pieces with all corners in one leaf
    double uncoveredShare = 0;       ///< share of the surface's area that no leaf covers
    double largestGap = 0;           ///< largest distance from a point of the surface to the leaves
    double protrusionMax = 0;        ///< largest distance from a sampled point of the leaves' outside to the body
    double protrusionRms = 0;        ///< over the leaves' outside, weighted by area
    double protrusionCertified = 0;  ///< upper bound: the largest radius - depth(center)
    double hollow = 0;               ///< largest ball inside the body clear of all leaves, within 0.5 % of the diagonal
    double volumeRatio = 0;          ///< volume of the leaves' union over the body's; NaN for a body without volume
    double hausdorffToTree = 0;      ///< largest distance from the surface to the leaves' outside, sampled, within 2 %
    double hausdorffToSurface = 0;   ///< largest distance from the leaves' outside to the surface
    double normalErrorMean = 0;      ///< rad, between the leaves' outside and the nearest surface, weighted by area
    int leavesOutside = 0;           ///< number of leaves that stick out of an ancestor
    double largestEscape = 0;        ///< largest distance by which a leaf sticks out of an ancestor
    int poses = 0;                   ///< number of fixed touching poses of the tree against itself
    double testsPerPose = 0;         ///< sphere-sphere tests when descending the hierarchy (an 8-wide step counts 8)
    double pairsPerPose = 0;         ///< touching leaf pairs, by brute force
    std::int64_t pairsMissed = 0;    ///< touching pairs of all poses that the walk does not find
    double pressedPairsPerPose = 0;  ///< overlapping leaf pairs after pressing deeper by 1 % of the diagonal
    std::int64_t pressedPairsMissed = 0;
    double walkUs = -1;  ///< CPU time of TreeWalk per touching pose, µs; negative if the tree is not a SphereTree
};

struct CheckOptions {
    int samples = 200000;    ///< number of samples of the surface, of the leaves' outside and of the volume
    int poses = 64;          ///< number of touching poses
    std::uint64_t seed = 1;  ///< random seed of the samples and poses
};

/// Measures a tree. `progress` as in buildSphereTree(). Throws std::invalid_argument as repairMesh() does, and if so
/// many leaves overlap or nearly coincide that the time would not be linear in their number.
TreeMetrics measureTree(const SphereHierarchy& hierarchy, const TriangleMesh& mesh, const CheckOptions& options = {},
                        const BuildProgress& progress = {});

/// The same for a SphereTree, including the time and the pairs of TreeWalk.
TreeMetrics measureTree(const SphereTree& tree, const TriangleMesh& mesh, const CheckOptions& options = {},
                        const BuildProgress& progress = {});

/// Checks the claims of the certificate independently of the builder: coverage, protrusion, leaves inside their
/// ancestors, and hollows (within 0.5 % of the diagonal). Returns one sentence about the first claim that does not
/// hold; empty if all hold. Much faster than measureTree().
std::string refuteCertificate(const SphereTree& tree, const TriangleMesh& mesh);

}  // namespace touchstone
