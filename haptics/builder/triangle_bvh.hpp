#pragma once
// Exact distance to triangles and the generalized winding number, from one tree.
#include <array>
#include <cmath>
#include <vector>

#include "haptics/builder/box_tree.hpp"

namespace touchstone {

using Triangle = std::array<Vec3, 3>;

inline double areaOf(const Triangle& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm(); }

/// The bounding boxes of triangles.
std::vector<Box> boxesOf(const std::vector<Triangle>& triangles);

struct Edge {
    int first = 0;  ///< the edge joins the corners first and first + 1, mod 3
    double length2 = 0;
};
inline Edge longestEdge(const Triangle& t) {
    Edge longest;
    for (int k = 0; k < 3; ++k)
        if (const double l2 = (t[(k + 1) % 3] - t[k]).squaredNorm(); l2 > longest.length2) longest = {k, l2};
    return longest;
}

/// The point of a triangle nearest to p. A needle triangle is treated as its three sides.
/// Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.5 (the Voronoi regions).
Vec3 closestPoint(const Vec3& p, const Triangle& triangle, bool needle);

/// Signed solid angle of the triangle seen from p, divided by 4π: positive if its front faces away from p.
/// Source: van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983).
double solidAngleShare(const Vec3& p, const Triangle& triangle);

class TriangleBvh {
  public:
    struct Hit {
        double distance = HUGE_VAL;
        Vec3 point = Vec3::Zero();
        bool front = false;  ///< p lies on the front side of the nearest triangle
        int triangle = -1;   ///< index in the constructor's list; -1 if no triangle is nearer than the bound
    };

    explicit TriangleBvh(std::vector<Triangle> triangles);

    bool empty() const { return triangles_.empty(); }

    /// The nearest point among those nearer than `bound`. Exact up to rounding; ties are resolved deterministically.
    /// Where many points are about equally near, two options shorten the search: it ends at the first point nearer than
    /// `enough`, and the result may be farther than the nearest point by up to `tolerance`.
    Hit closest(const Vec3& p, double bound = HUGE_VAL, double enough = 0, double tolerance = 0) const;

    /// The largest radius, up to the given one, with which a ball through p with center p + radius·direction contains
    /// no point of the triangles deeper than `slack`. Smaller balls through p lie in larger ones, so one descent with a
    /// shrinking ball finds it. Pre: |direction| = 1.
    double tangentRadius(const Vec3& p, const Vec3& direction, double radius, double slack) const;

    /// The winding number of the surface about p; for a closed surface it is an integer at points off the surface. Far
    /// groups are approximated by dipoles, with an error well below the 1/2 that separates inside from outside. Source:
    /// Barill, Dickson, Schmidt, Levin, Jacobson, Fast Winding Numbers, ACM TOG 37 (2018).
    double windingNumber(const Vec3& p) const;

    /// Calls visit(triangle index) for the triangles whose bounding boxes intersect the box.
    template <class Visit>
    void overlapping(const Box& box, Visit&& visit) const;

  private:
    struct Dipoles {
        std::array<Eigen::Array4d, 3> area, center;  ///< vector area and its centroid
        Eigen::Array4d farSquared;                   ///< squared distance beyond which the dipole is accurate
    };

    /// The triangles of a bucket in SIMD lanes: four distances cost little more than one.
    struct Pack {
        std::array<Eigen::Array4d, 3> a, ab, ac;
        Eigen::Array4d perAb2, perAc2, perBc2;  ///< inverse squared side lengths; 0 for a side of zero length
        Eigen::Array4d perNormal2;              ///< 1 / |ab x ac|^2; 0 for needles

        Eigen::Array4d squaredDistance(const Vec3& p) const;
    };

    std::vector<Triangle> triangles_;  ///< in the tree's order
    std::vector<char> needle_;
    BoxTree tree_;
    std::vector<Pack> packs_;
    std::vector<std::array<int, 4>> packOf_;  ///< index of the pack of each bucket of a node
    std::vector<Dipoles> dipoles_;
};

template <class Visit>
void TriangleBvh::overlapping(const Box& box, Visit&& visit) const {
    std::array<int, BoxTree::kStack> stack;
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree_.nodes()[stack[--top]];
        for (int k = 0; k < 4; ++k) {
            bool meets = node.count[k] >= 0;
            for (int a = 0; a < 3; ++a) meets = meets && node.lo[a][k] <= box.hi[a] && node.hi[a][k] >= box.lo[a];
            if (!meets) continue;
            if (node.count[k] == 0) stack[top++] = node.first[k];
            for (int i = 0; i < node.count[k]; ++i) visit(tree_.order()[node.first[k] + i]);
        }
    }
}

}  // namespace touchstone
