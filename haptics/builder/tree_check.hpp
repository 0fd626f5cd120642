#pragma once
// How good a sphere tree is, whoever built it, measured by code that shares none with the builder's proofs.
#include <cstdint>
#include <string>

#include "haptics/builder/sphere_hierarchy.hpp"
#include "haptics/builder/tree_builder.hpp"

namespace touchstone {

/// Lengths in mm. The surface is every usable triangle of the mesh. The leaves' outside is what of their spheres lies
/// in no other leaf and is no wall of a hollow: a point of it inside the body has the surface bare beside it.
struct TreeMetrics {
    int leaves = 0, nodes = 0;
    double diagonal = 0;             ///< of the mesh's bounding box
    bool coverageProven = false;     ///< every triangle is cut into pieces with all corners in one leaf
    double uncoveredShare = 0;       ///< of the surface's area
    double largestGap = 0;           ///< farthest that a point of the surface is from the leaves
    double protrusionMax = 0;        ///< farthest that a sampled point of the leaves' outside is from the body
    double protrusionRms = 0;        ///< over the leaves' outside, by area
    double protrusionCertified = 0;  ///< bound: the largest radius - depth(centre)
    double hollow = 0;               ///< largest ball inside the body clear of all leaves, to 0.5 % of the diagonal
    double volumeRatio = 0;          ///< of the leaves' union to the body; NaN for a body without volume
    double hausdorffToTree = 0;      ///< largest distance from the surface to the leaves' outside, sampled, to 2 %
    double hausdorffToSurface = 0;   ///< and from the leaves' outside to the surface
    double normalErrorMean = 0;      ///< rad, between the leaves' outside and the nearest surface, by area
    int leavesOutside = 0;           ///< leaves that stick out of an ancestor
    double largestEscape = 0;        ///< by at most so much
    int poses = 0;                   ///< fixed touching poses of the tree against itself
    double testsPerPose = 0;         ///< sphere against sphere (an 8-wide step counts 8), descending the hierarchy
    double pairsPerPose = 0;         ///< touching leaf pairs, by brute force
    std::int64_t pairsMissed = 0;    ///< of them all, those that the walk does not find
    double pressedPairsPerPose = 0;  ///< overlapping leaf pairs once pressed 1 % of the diagonal deeper
    std::int64_t pressedPairsMissed = 0;
    double walkUs = -1;  ///< CPU time of TreeWalk per touching pose; negative: not a tree of ours
};

struct CheckOptions {
    int samples = 200000;  ///< of the surface, of the leaves' outside, and of the volume
    int poses = 64;
    std::uint64_t seed = 1;
};

/// Measures. `progress` as in buildSphereTree(). Throws std::invalid_argument as repairMesh() does, and
/// where so many leaves overlap or nearly coincide that measuring would not end in time linear in their number.
TreeMetrics measureTree(const SphereHierarchy& hierarchy, const TriangleMesh& mesh, const CheckOptions& options = {},
                        const BuildProgress& progress = {});

/// The same for a tree of ours, with the time and the pairs of TreeWalk.
TreeMetrics measureTree(const SphereTree& tree, const TriangleMesh& mesh, const CheckOptions& options = {},
                        const BuildProgress& progress = {});

/// Proves what the certificate claims once more, by other means: coverage, protrusion, leaves inside their ancestors,
/// and hollows, these to 0.5 % of the diagonal. Returns the first claim that does not hold, in one sentence; empty if
/// all do. Much faster than measuring.
std::string refuteCertificate(const SphereTree& tree, const TriangleMesh& mesh);

}  // namespace touchstone
