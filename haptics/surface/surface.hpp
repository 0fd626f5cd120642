#pragma once
// A closed part as the tick touches it: the features of its mesh, and the tree that finds them.
#include "haptics/collision/pair_finder.hpp"
#include "haptics/surface/feature_tree.hpp"
#include "haptics/surface/surface_features.hpp"

namespace touchstone {

/// Immutable once made, and shared by threads. Features have the order of the tree's patches. What is in float, from
/// the center, is for searches; a crossing is computed from the points in double.
struct Surface {
    /// A feature for searches: of a face the corners and the normal, of an edge the ends and the wings (EdgePlace).
    /// They are side by side, since eight features of a search lie anywhere.
    using Record = std::array<float, 12>;

    SurfaceFeatures features;
    Extent extent;
    FeatureTree tree;
    std::vector<int> firstVertex, firstEdge;  ///< by patch, and the end of the last one: its own features
    std::vector<Eigen::Vector3f> points;      ///< from the center, mm
    AlignedVector<Record> faces, edges;       ///< the last is repeated, so that eight neighbors can be read
    std::vector<Eigen::Vector3f> spokes;      ///< directions of features.spokes, of unit length
    std::vector<NormalCone> tips;             ///< of outward normals, by vertex
    std::vector<int> shells;                  ///< a face of each connected group of faces

    /// Features of one part: what a contact's identity can number.
    static constexpr int kMaxFeatures = 1 << 26;

    /// Sorts the features into a tree. The part turns about the center of its bounding box. Throws
    /// std::invalid_argument with one sentence if there are more features of a kind than kMaxFeatures.
    explicit Surface(SurfaceFeatures from);

    std::size_t bytes() const;  ///< of memory

    /// The boxes of the faces of a patch.
    void faceBoxes(int patch, simd::Float8 lo[3], simd::Float8 hi[3]) const;
    /// The boxes of the faces below the children of a node or, at height 0, of the faces of a patch. Returns their
    /// number.
    int boxesBelow(int height, int node, simd::Float8 lo[3], simd::Float8 hi[3]) const;
    int facesOf(int patch) const {
        return std::min(FeatureTree::kChildren, int(features.faces.size()) - FeatureTree::kChildren * patch);
    }

  private:
    std::vector<int> faceOrder() const;
};

/// Where the boxes of the tool's tree lie with its node at X_OT in the obstacle's frame.
BoxPlacement placementOf(const Surface& tool, const Surface& obstacle, const Pose& X_OT);

}  // namespace touchstone
