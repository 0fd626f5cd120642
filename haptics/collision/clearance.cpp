#include "haptics/collision/clearance.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "haptics/collision/leaf_gaps.hpp"

namespace touchstone {
namespace {

using namespace simd;

constexpr double kRounding = 1e-9;    // mm: more than two ways to compute a gap can differ by
constexpr double kTouch = 1e-10;      // mm: leaves that slide along each other do not meet
constexpr float kFloatError = 1e-6f;  // of a way: what following it in float may be off by

/// Eight blocks of a level, or one of them eight times.
struct Blocks {
    Float8 at[3], r, lo[3], hi[3], round;

    static Blocks eight(const TreeLevel& level, int first) {
        return {level, [first](const AlignedVector<float>& v) { return load(&v[first]); }};
    }
    static Blocks one(const TreeLevel& level, int i) {
        return {level, [i](const AlignedVector<float>& v) { return splat(v[i]); }};
    }

  private:
    template <class Get>
    TOUCHSTONE_INLINE Blocks(const TreeLevel& l, Get get)
        : at{get(l.x), get(l.y), get(l.z)},
          r(get(l.r)),
          lo{get(l.lo[0]), get(l.lo[1]), get(l.lo[2])},
          hi{get(l.hi[0]), get(l.hi[1]), get(l.hi[2])},
          round(get(l.round)) {}
};

/// Depth first, the least bounds first; a pair of blocks is left out when its bound is no less than the best so far.
/// `Measure` gives what a leaf pair has, and of eight pairs of blocks what their leaves have at least.
template <class Measure>
class Search {
  public:
    Search(const SphereTree& tool, const SphereTree& obstacle, const Measure& measure, double atMost,
           LeafPair* nearest = nullptr)
        : tool_(tool), obstacle_(obstacle), measure_(measure), best_(atMost), nearest_(nearest) {}

    double run() {
        if (nearest_) test(nearest_->toolLeaf, nearest_->obstacleLeaf);
        descend(int(tool_.levels.size()) - 1, 0, int(obstacle_.levels.size()) - 1, 0);
        return best_;
    }

  private:
    void test(int i, int j) {
        const double value = measure_.exact(tool_.leaf(i), obstacle_.leaf(j));
        if (!(value < best_)) return;
        best_ = value;
        if (nearest_) *nearest_ = {i, j};
    }

    void descend(int a, int i, int b, int j) {
        if (a == 0 && b == 0) return test(i, j);
        const bool descendObstacle = a == 0 || (b > 0 && obstacle_.levels[b].r[j] >= tool_.levels[a].r[i]);
        const int children = (descendObstacle ? j : i) * SphereTree::kBranching;
        const Mask blocks = (descendObstacle ? obstacle_.levels[b - 1] : tool_.levels[a - 1]).blocksFrom(children);
        const float best = float(best_);
        const Float8 bound = descendObstacle ? measure_.bound(Blocks::one(tool_.levels[a], i),
                                                              Blocks::eight(obstacle_.levels[b - 1], children), best)
                                             : measure_.bound(Blocks::eight(tool_.levels[a - 1], children),
                                                              Blocks::one(obstacle_.levels[b], j), best);
        // The lanes that may hold less, the least first.
        std::array<int, 8> order;
        int count = 0;
        for (Mask open = lessEqual(bound, splat(best)) & blocks; open; open &= open - 1) {
            const int lane = std::countr_zero(open);
            int at = count++;
            for (; at > 0 && bound[order[at - 1]] > bound[lane]; --at) order[at] = order[at - 1];
            order[at] = lane;
        }
        for (int n = 0; n < count && double(bound[order[n]]) < best_; ++n)
            if (descendObstacle)
                descend(a, i, b - 1, children + order[n]);
            else
                descend(a - 1, children + order[n], b, j);
    }

    const SphereTree& tool_;
    const SphereTree& obstacle_;
    const Measure& measure_;
    double best_;
    LeafPair* nearest_;
};

/// The centres of tool blocks in the obstacle's frame.
class Placement {
  public:
    explicit Placement(const Pose& X_OT) : R_(X_OT.R().cast<float>()), p_(X_OT.p.cast<float>()) {}

    TOUCHSTONE_INLINE Float8 at(const Blocks& tool, int k) const {
        return R_(k, 0) * tool.at[0] + R_(k, 1) * tool.at[1] + R_(k, 2) * tool.at[2] + p_[k];
    }

  private:
    const Eigen::Matrix3f R_;
    const Eigen::Vector3f p_;
};

class Gap {
  public:
    Gap(const Pose& X_OT, float guard) : X_OT_(X_OT), place_(X_OT), guard_(guard) {}

    double exact(const Sphere& tool, const Sphere& obstacle) const { return leafGap(tool, obstacle, X_OT_); }

    Float8 bound(const Blocks& tool, const Blocks& obstacle, float) const {
        Float8 apart2 = splat(0.0f), outside2 = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const Float8 c = place_.at(tool, k), way = c - obstacle.at[k],
                         outside = apart(c, c, obstacle.lo[k], obstacle.hi[k]);
            apart2 += way * way;
            outside2 += outside * outside;
        }
        const Float8 reach = tool.r + guard_;
        const Float8 ball = simd::sqrt(apart2) - obstacle.r - reach,
                     box = simd::sqrt(outside2) - obstacle.round - reach;
        // A box bounds how far leaves are apart, not how deep they overlap.
        return outside2 > 0.0f ? max(ball, box) : ball;
    }

  private:
    const Pose& X_OT_;
    const Placement place_;
    const float guard_;
};

/// No gap is less than that of the first pair within a margin, which ends the search.
class FirstWithin : public Gap {
  public:
    FirstWithin(const Pose& X_OT, float guard, double margin) : Gap(X_OT, guard), margin_(margin) {}

    double exact(const Sphere& tool, const Sphere& obstacle) const {
        constexpr double kInfinity = std::numeric_limits<double>::infinity();
        return Gap::exact(tool, obstacle) < margin_ ? -kInfinity : kInfinity;
    }

  private:
    const double margin_;
};

/// The share of a way after which leaves meet; infinite if they do not.
class Meeting {
  public:
    /// An arc leaves the straight way by s² reach |turn|²/2; s up to atMost.
    Meeting(const Course& way, const Vec3& center, double reach, double atMost, float guard)
        : way_(way), place_(way.X_OT), center_(center), bend_(atMost * reach * way.turn.squaredNorm() / 2) {
        const Vec3 c = way.X_OT * center;
        for (int k = 0; k < 3; ++k) {
            c_[k] = float(c[k]);
            shift_[k] = float(way.shift[k]);
            turn_[k] = float(way.turn[k]);
        }
        angle_ = float(way.turn.norm());
        guard_ = guard + kFloatError * float(way.shift.norm() + reach * way.turn.norm());
    }

    /// Centres at d + s u meet where |d + s u| = R + s bend, or where it gets less than at the start.
    double exact(const Sphere& tool, const Sphere& obstacle) const {
        const Vec3 arm = way_.X_OT.q * (tool.center() - center_), d = way_.X_OT * tool.center() - obstacle.center(),
                   u = way_.shift + way_.turn.cross(arm);
        const double distance = d.norm(), touch = std::min(double(tool.r) + double(obstacle.r), distance) - kTouch;
        const double a = u.squaredNorm() - bend_ * bend_, b = d.dot(u) - bend_ * touch,
                     c = (distance - touch) * (distance + touch);
        const double root2 = b * b - a * c;
        if (root2 < 0 || (b >= 0 && a >= 0)) return std::numeric_limits<double>::infinity();
        return c / (std::sqrt(root2) - b);
    }

    /// By the spheres of the blocks, and the box of the tool's way against that of the obstacle.
    Float8 bound(const Blocks& tool, const Blocks& obstacle, float best) const {
        Float8 c[3], arm[3], u[3], d[3];
        for (int k = 0; k < 3; ++k) {
            c[k] = place_.at(tool, k);
            arm[k] = c[k] - c_[k];
            d[k] = c[k] - obstacle.at[k];
        }
        Float8 u2 = splat(1e-30f), du = splat(0.0f), d2 = splat(0.0f), outside2 = splat(0.0f), near2 = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            u[k] = shift_[k] + (turn_[i] * arm[j] - turn_[j] * arm[i]);
            u2 += u[k] * u[k];
            du += d[k] * u[k];
            d2 += d[k] * d[k];
        }
        const Float8 s = max(-du / u2, splat(0.0f)), nearest = s < best ? s : splat(best);
        for (int k = 0; k < 3; ++k) {
            const Float8 end = c[k] + best * u[k], at = d[k] + nearest * u[k];
            const Float8 outside =
                apart(c[k] < end ? c[k] : end, c[k] < end ? end : c[k], obstacle.lo[k], obstacle.hi[k]);
            outside2 += outside * outside;
            near2 += at * at;
        }
        // What the leaves of a block go beside its centre's way.
        const Float8 beside = float(bend_) + angle_ * tool.r, reach = tool.r + guard_ + best * beside;
        const Float8 ball = obstacle.r + reach, box = obstacle.round + reach;
        const Float8 soonest = (simd::sqrt(d2) - obstacle.r - tool.r - guard_) / (simd::sqrt(u2) + beside);
        const auto meet = (near2 <= ball * ball) & (outside2 <= box * box);
        return meet ? soonest : splat(std::numeric_limits<float>::infinity());
    }

  private:
    const Course& way_;
    const Placement place_;
    const Vec3& center_;
    const double bend_;
    float c_[3], shift_[3], turn_[3], angle_, guard_;
};

}  // namespace

double leastGap(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double atMost,
                LeafPair* nearest) {
    const Gap gap(X_OT, floatGuard(tool, obstacle, X_OT));
    return Search(tool, obstacle, gap, atMost, nearest).run();
}

bool anyWithin(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT, double margin) {
    const FirstWithin first(X_OT, floatGuard(tool, obstacle, X_OT), margin);
    return Search(tool, obstacle, first, margin).run() < margin;
}

double freeShare(const SphereTree& tool, const SphereTree& obstacle, const Course& way, double reach, double atMost) {
    const Vec3 center = tool.center();
    const Meeting meeting(way, center, reach, atMost, floatGuard(tool, obstacle, way.X_OT));
    return std::max(0.0, Search(tool, obstacle, meeting, atMost).run());
}

double deepestGap(const SphereTree& tool, const SphereTree& obstacle, TreeWalk& walk, const Pose& X_OT) {
    const Mat3 R = X_OT.R();
    double best = 0;
    int placed = -1;
    Vec3 c = Vec3::Zero();
    double radius = 0;
    walk.run({X_OT, 0}, [&](const LeafBucket* entries, int count) {
        for (const LeafBucket* entry = entries; entry != entries + count; ++entry) {
            if (entry->toolLeaf != placed) {
                placed = entry->toolLeaf;
                const Sphere s = tool.leaf(placed);
                c = R * Vec3(s.x, s.y, s.z) + X_OT.p;
                radius = s.r;
            }
            Mask deeper = lessEqual(leafGaps(c, radius, obstacle, entry->bucket).gap, splat(best + kRounding));
            for (; deeper; deeper &= deeper - 1)
                best = std::min(
                    best,
                    leafGap(tool.leaf(placed),
                            obstacle.leaf(entry->bucket * SphereTree::kBranching + std::countr_zero(deeper)), X_OT));
        }
    });
    return best;
}

}  // namespace touchstone
