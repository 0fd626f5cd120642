#pragma once
// A closed part as the tick touches it: the features of its mesh, and the trees that find them.
#include "haptics/collision/pair_finder.hpp"
#include "haptics/surface/feature_tree.hpp"
#include "haptics/surface/surface_features.hpp"

namespace touchstone {

/// Immutable once made, and shared by threads. Features have the order of the trees. The vectors in float are for
/// searches; a crossing is computed from the points in double.
struct Surface {
    SurfaceFeatures features;
    Extent extent;
    FeatureTree vertices, edges, faces;
    std::vector<Eigen::Vector3f> points;                ///< from the center, mm
    std::vector<Eigen::Vector3f> normals;               ///< by face
    std::vector<Eigen::Vector3f> spokes;                ///< directions of features.spokes, of unit length
    std::vector<std::array<Eigen::Vector3f, 2>> wings;  ///< by edge, as EdgePlace::wings
    std::vector<FeatureShape> tips;                     ///< by vertex, with its cone of outward normals
    std::vector<int> shells;                            ///< a point of each connected group of faces

    /// Features of one part: what a contact's identity can number.
    static constexpr int kMaxFeatures = 1 << 26;

    /// Sorts the features into trees. The part turns about the center of its bounding box. Throws std::invalid_argument
    /// with one sentence if there are more features of a kind than kMaxFeatures.
    explicit Surface(SurfaceFeatures from);
};

/// Where the boxes of the tool's trees lie with its node at X_OT in the obstacle's frame.
BoxPlacement placementOf(const Surface& tool, const Surface& obstacle, const Pose& X_OT);

}  // namespace touchstone
