#include "haptics/builder/triangle_bvh.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

namespace touchstone {
namespace {

// Ratio of height to longest side below which rounding makes the plane of a face meaningless.
constexpr double kNeedle = 1e-7;
// Distance from which a group counts as a dipole, in radii of the group. The first-order error is then about 1e-2 of
// the group's contribution.
constexpr double kDipoleReach = 2.5;

Vec3 closestOnSegment(const Vec3& p, const Vec3& a, const Vec3& b) {
    const Vec3 ab = b - a;
    const double length2 = ab.squaredNorm();
    if (!(length2 > 0)) return a;
    return a + std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) * ab;
}

bool isNeedle(const Triangle& t) {
    const double longest2 =
        std::max({(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm()});
    return !((t[1] - t[0]).cross(t[2] - t[0]).norm() > kNeedle * longest2);
}

}  // namespace

Vec3 closestPoint(const Vec3& p, const Triangle& triangle, bool needle) {
    const auto& [a, b, c] = triangle;
    if (needle) {
        Vec3 best = closestOnSegment(p, a, b);
        for (const Vec3& q : {closestOnSegment(p, b, c), closestOnSegment(p, c, a)})
            if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
        return best;
    }
    const Vec3 ab = b - a, ac = c - a;
    const Vec3 ap = p - a, bp = p - b, cp = p - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
    const double scale = 1 / (va + vb + vc);
    return a + vb * scale * ab + vc * scale * ac;
}

double solidAngleShare(const Vec3& p, const Triangle& triangle) {
    const Vec3 a = triangle[0] - p, b = triangle[1] - p, c = triangle[2] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    const double det = a.dot(b.cross(c));
    const double den = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    return det == 0 ? 0 : std::atan2(det, den) / (2 * std::numbers::pi);
}

std::vector<Box> boxesOf(const std::vector<Triangle>& triangles) {
    std::vector<Box> boxes(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i)
        for (const Vec3& v : triangles[i]) boxes[i].add(v);
    return boxes;
}

TriangleBvh::TriangleBvh(std::vector<Triangle> triangles) : tree_(boxesOf(triangles)) {
    for (int i : tree_.order()) triangles_.push_back(triangles[i]);
    for (const Triangle& t : triangles_) needle_.push_back(isNeedle(t));
    // Packs four triangles of a leaf side by side, with the reciprocals that a distance needs.
    const auto inverse = [](double x) { return x > 0 ? 1 / x : 0; };
    for (const BoxTree::Node& node : tree_.nodes()) {
        packOf_.emplace_back();
        for (int k = 0; k < 4; ++k) {
            packOf_.back()[k] = static_cast<int>(packs_.size());
            if (node.count[k] <= 0) continue;
            Pack pack;
            for (int lane = 0; lane < 4; ++lane) {
                // The last triangle fills the unused lanes.
                const int i = node.first[k] + std::min(lane, node.count[k] - 1);
                const auto& [a, b, c] = triangles_[i];
                for (int x = 0; x < 3; ++x) {
                    pack.a[x][lane] = a[x];
                    pack.ab[x][lane] = b[x] - a[x];
                    pack.ac[x][lane] = c[x] - a[x];
                }
                pack.perAb2[lane] = inverse((b - a).squaredNorm());
                pack.perAc2[lane] = inverse((c - a).squaredNorm());
                pack.perBc2[lane] = inverse((c - b).squaredNorm());
                pack.perNormal2[lane] = needle_[i] ? 0 : inverse((b - a).cross(c - a).squaredNorm());
            }
            packs_.push_back(pack);
        }
    }

    // A node's dipole is the sum of its children's. Children come after their parent, so one backward pass computes
    // all.
    struct Group {
        Vec3 area = Vec3::Zero(), moment = Vec3::Zero();
        double weight = 0;
    };
    const auto& nodes = tree_.nodes();
    std::vector<Group> groups(nodes.size());
    dipoles_.resize(nodes.size());
    for (std::size_t n = nodes.size(); n-- > 0;) {
        for (int k = 0; k < 4; ++k) {
            Group g;
            if (nodes[n].count[k] == 0) g = groups[nodes[n].first[k]];
            for (int i = 0; i < nodes[n].count[k]; ++i) {
                const auto& [a, b, c] = triangles_[nodes[n].first[k] + i];
                const Vec3 area = 0.5 * (b - a).cross(c - a);
                g.area += area;
                g.moment += area.norm() * (a + b + c) / 3;
                g.weight += area.norm();
            }
            groups[n].area += g.area;
            groups[n].moment += g.moment;
            groups[n].weight += g.weight;
            Vec3 lo, hi;
            for (int a = 0; a < 3; ++a) {
                lo[a] = nodes[n].lo[a][k];
                hi[a] = nodes[n].hi[a][k];
            }
            const bool some = nodes[n].count[k] >= 0;
            const Vec3 center = g.weight > 0 ? Vec3(g.moment / g.weight) : some ? Vec3(0.5 * (lo + hi)) : Vec3::Zero();
            const double radius = some ? (hi - center).cwiseAbs().cwiseMax((center - lo).cwiseAbs()).norm() : 0;
            for (int a = 0; a < 3; ++a) {
                dipoles_[n].area[a][k] = g.area[a];
                dipoles_[n].center[a][k] = center[a];
            }
            dipoles_[n].farSquared[k] = kDipoleReach * kDipoleReach * radius * radius;
        }
    }
}

// The distance to the nearest of the three sides, or to the face if the projection of p lies inside it.
Eigen::Array4d TriangleBvh::Pack::squaredDistance(const Vec3& p) const {
    using Lane = Eigen::Array4d;
    const Lane apx = p[0] - a[0], apy = p[1] - a[1], apz = p[2] - a[2];
    const Lane bcx = ac[0] - ab[0], bcy = ac[1] - ab[1], bcz = ac[2] - ab[2];
    const Lane bpx = apx - ab[0], bpy = apy - ab[1], bpz = apz - ab[2];
    const auto side = [](const Lane& x, const Lane& y, const Lane& z, const Lane& ex, const Lane& ey, const Lane& ez,
                         const Lane& perLength2) -> Lane {
        const Lane t = ((x * ex + y * ey + z * ez) * perLength2).max(0.0).min(1.0);
        return (x - t * ex).square() + (y - t * ey).square() + (z - t * ez).square();
    };
    const Lane sides = side(apx, apy, apz, ab[0], ab[1], ab[2], perAb2)
                           .min(side(apx, apy, apz, ac[0], ac[1], ac[2], perAc2))
                           .min(side(bpx, bpy, bpz, bcx, bcy, bcz, perBc2));
    const Lane nx = ab[1] * ac[2] - ab[2] * ac[1], ny = ab[2] * ac[0] - ab[0] * ac[2],
               nz = ab[0] * ac[1] - ab[1] * ac[0];
    // n . (e x d) for a side e and the vector d from its start to p: positive on the inner side.
    const auto within = [&](const Lane& ex, const Lane& ey, const Lane& ez, const Lane& x, const Lane& y,
                            const Lane& z) -> Lane {
        return nx * (ey * z - ez * y) + ny * (ez * x - ex * z) + nz * (ex * y - ey * x);
    };
    const Lane least = within(ab[0], ab[1], ab[2], apx, apy, apz)
                           .min(-within(ac[0], ac[1], ac[2], apx, apy, apz))
                           .min(within(bcx, bcy, bcz, bpx, bpy, bpz));
    const Lane plane = (nx * apx + ny * apy + nz * apz).square() * perNormal2;
    return (least > 0 && perNormal2 > 0).select(plane, sides);
}

TriangleBvh::Hit TriangleBvh::closest(const Vec3& p, double bound, double enough, double tolerance) const {
    struct Waiting {
        double squaredDistance;
        int node;
    };
    std::array<Waiting, BoxTree::kStack> stack;
    Hit hit;
    double best = bound * bound;
    const double stop = enough > 0 ? enough * enough : 0;
    const auto lessTolerance = [&](double square) {
        const double distance = std::max(0.0, std::sqrt(square) - tolerance);
        return tolerance > 0 ? distance * distance : square;
    };
    double worthwhile = lessTolerance(best);  // squared distance beyond which a box cannot improve the result
    int top = 0;
    stack[top++] = {0, 0};
    while (top > 0 && best >= stop) {
        const Waiting w = stack[--top];
        if (w.squaredDistance >= worthwhile) continue;
        const BoxTree::Node& node = tree_.nodes()[w.node];
        const Eigen::Array4d d = node.squaredDistance(p);
        // Nearest first: buckets are tested immediately, and nodes wait on the stack with the nearest on top.
        std::array<int, 4> rank{0, 1, 2, 3};
        const auto order = [&](int i, int j) {
            if (d[rank[j]] < d[rank[i]]) std::swap(rank[i], rank[j]);
        };
        order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
        for (int k : rank) {
            if (!(d[k] < worthwhile)) break;
            if (node.count[k] == 0) continue;
            const Eigen::Array4d near = packs_[packOf_[w.node][k]].squaredDistance(p);
            for (int lane = 0; lane < node.count[k]; ++lane) {
                // The lanes round differently in the last digits, so the exact closest point decides.
                if (!(near[lane] < best * (1 + 1e-12))) continue;
                const int i = node.first[k] + lane;
                const Vec3 q = closestPoint(p, triangles_[i], needle_[i]);
                const double q2 = (q - p).squaredNorm();
                if (q2 < best) {
                    best = q2;
                    worthwhile = lessTolerance(best);
                    hit.point = q;
                    hit.triangle = i;
                }
            }
        }
        for (int r = 3; r >= 0; --r) {
            const int k = rank[r];
            if (node.count[k] == 0 && d[k] < worthwhile) stack[top++] = {d[k], node.first[k]};
        }
    }
    if (hit.triangle >= 0) {
        const auto& [a, b, c] = triangles_[hit.triangle];
        hit.distance = std::sqrt(best);
        hit.front = (b - a).cross(c - a).dot(p - hit.point) > 0;
        hit.triangle = tree_.order()[hit.triangle];
    }
    return hit;
}

double TriangleBvh::tangentRadius(const Vec3& p, const Vec3& direction, double radius, double slack) const {
    // Maximum number of shrinking steps for one triangle. Each gives the ball limited by the point that was too deep.
    constexpr int kSteps = 12;
    Vec3 center = p + radius * direction;
    double reach2 = 0;
    const auto shrinkTo = [&](double r) {
        radius = r;
        center = p + r * direction;
        reach2 = std::max(0.0, r - slack) * std::max(0.0, r - slack);
    };
    shrinkTo(radius);
    // Visits the boxes near the ball, nearest first, and shrinks the ball to each triangle that reaches into it.
    std::array<int, BoxTree::kStack> stack;
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const int n = stack[--top];
        const BoxTree::Node& node = tree_.nodes()[n];
        const Eigen::Array4d d = node.squaredDistance(center);
        std::array<int, 4> rank{0, 1, 2, 3};
        const auto order = [&](int i, int j) {
            if (d[rank[j]] < d[rank[i]]) std::swap(rank[i], rank[j]);
        };
        order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
        for (int k : rank) {
            if (!(d[k] < reach2)) break;
            if (node.count[k] == 0) continue;
            const Eigen::Array4d near = packs_[packOf_[n][k]].squaredDistance(center);
            for (int lane = 0; lane < node.count[k]; ++lane) {
                if (!(near[lane] < reach2)) continue;
                const int i = node.first[k] + lane;
                for (int step = 0; step < kSteps; ++step) {
                    const Vec3 to = closestPoint(center, triangles_[i], needle_[i]) - p;
                    const double along = to.dot(direction);
                    if (!((to + p - center).squaredNorm() < reach2)) break;
                    // Solves |center - q| = r - slack for r.
                    const double next = along > slack ? (to.squaredNorm() - slack * slack) / (2 * (along - slack)) : 0;
                    shrinkTo(std::clamp(next, 0.0, (1 - 1e-6) * radius));
                }
            }
        }
        for (int r = 3; r >= 0; --r)
            if (const int k = rank[r]; node.count[k] == 0 && d[k] < reach2) stack[top++] = node.first[k];
    }
    return radius;
}

double TriangleBvh::windingNumber(const Vec3& p) const {
    std::array<int, BoxTree::kStack> stack;
    double sum = 0;
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const int n = stack[--top];
        const BoxTree::Node& node = tree_.nodes()[n];
        const Dipoles& group = dipoles_[n];
        const Eigen::Array4d x = group.center[0] - p[0], y = group.center[1] - p[1], z = group.center[2] - p[2];
        const Eigen::Array4d d2 = x * x + y * y + z * z;
        const Eigen::Array4d flux = (group.area[0] * x + group.area[1] * y + group.area[2] * z) / (d2 * d2.sqrt());
        for (int k = 0; k < 4; ++k) {
            if (node.count[k] < 0) continue;
            if (d2[k] > group.farSquared[k]) {
                sum += flux[k] / (4 * std::numbers::pi);
            } else if (node.count[k] == 0) {
                stack[top++] = node.first[k];
            } else {
                for (int i = 0; i < node.count[k]; ++i) sum += solidAngleShare(p, triangles_[node.first[k] + i]);
            }
        }
    }
    return sum;
}

}  // namespace touchstone
