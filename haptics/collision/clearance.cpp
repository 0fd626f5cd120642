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

/// Upper bound on the difference of a gap computed by two different expressions in double, mm. With a smaller value
/// deepestGap() could miss the deepest pair; a larger one recomputes more pairs.
constexpr double kGapRounding = 1e-9;
/// Leaves count as meeting only if they approach by more than this, mm, so that leaves that slide along each other do
/// not stop a flight. A larger value lets a flight enter by as much.
constexpr double kTouch = 1e-10;
/// Bound on the rounding error of a path in float, as a fraction of its length. A smaller value could miss a pair.
constexpr float kPathError = 1e-6f;

/// Eight blocks of a level, or one block in all eight lanes.
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

/// Branch and bound, depth first with the smallest bound first. A pair of blocks is skipped if its bound is not below
/// the best value so far. `Measure` returns the value of a leaf pair, and for eight pairs of blocks lower bounds on the
/// values of their leaf pairs.
template <class Measure>
class Search {
  public:
    Search(const SphereTree& tool, const SphereTree& obstacle, const Measure& measure, double atMost,
           LeafPair* nearest = nullptr, SearchBudget* budget = nullptr)
        : tool_(tool), obstacle_(obstacle), measure_(measure), best_(atMost), nearest_(nearest), budget_(budget) {}

    double run() {
        if (nearest_) test(nearest_->toolLeaf, nearest_->obstacleLeaf);
        descend(int(tool_.levels.size()) - 1, 0, int(obstacle_.levels.size()) - 1, 0);
        return best_;
    }
    /// Whether run() ended before it had an answer.
    bool ended() const { return ended_; }

  private:
    void test(int i, int j) {
        const double value = measure_.exact(tool_.leaf(i), obstacle_.leaf(j));
        if (!(value < best_)) return;
        best_ = value;
        if (nearest_) *nearest_ = {i, j};
    }

    void descend(int a, int i, int b, int j) {
        ended_ = ended_ || (budget_ && !budget_->spend(1));
        if (ended_) return;
        if (a == 0 && b == 0) return test(i, j);
        const bool descendObstacle = a == 0 || (b > 0 && obstacle_.levels[b].r[j] >= tool_.levels[a].r[i]);
        const int children = (descendObstacle ? j : i) * SphereTree::kBranching;
        const Mask blocks = (descendObstacle ? obstacle_.levels[b - 1] : tool_.levels[a - 1]).blocksFrom(children);
        const float best = float(best_);
        const Float8 bound = descendObstacle ? measure_.bound(Blocks::one(tool_.levels[a], i),
                                                              Blocks::eight(obstacle_.levels[b - 1], children), best)
                                             : measure_.bound(Blocks::eight(tool_.levels[a - 1], children),
                                                              Blocks::one(obstacle_.levels[b], j), best);
        // The lanes that may hold a smaller value, in ascending order of their bounds.
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
    SearchBudget* budget_;
    bool ended_ = false;
};

/// The centers of tool blocks in the obstacle's frame.
class Placement {
  public:
    explicit Placement(const Pose& X_OT) : R_(X_OT.R().cast<float>()), p_(X_OT.p.cast<float>()) {}

    TOUCHSTONE_INLINE Float8 at(const Blocks& tool, int k) const {
        return sumOfProducts(R_(k, 0), tool.at[0], R_(k, 1), tool.at[1], R_(k, 2), tool.at[2]) + p_[k];
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
            const Float8 c = place_.at(tool, k), offset = c - obstacle.at[k],
                         outside = apart(c, c, obstacle.lo[k], obstacle.hi[k]);
            apart2 = fma(offset, offset, apart2);
            outside2 = fma(outside, outside, outside2);
        }
        const Float8 reach = tool.r + guard_;
        const Float8 ball = simd::sqrt(apart2) - obstacle.r - reach,
                     box = simd::sqrt(outside2) - obstacle.round - reach;
        // A box bounds the distance of separate leaves, but not the depth of an overlap.
        return outside2 > 0.0f ? max(ball, box) : ball;
    }

  private:
    const Pose& X_OT_;
    const Placement place_;
    const float guard_;
};

/// The fraction of a motion at which leaves meet; infinite if they do not.
class Meeting {
  public:
    /// After the fraction s <= atMost an arc deviates from the straight path by s² reach |turn|²/2.
    Meeting(const StraightMotion& motion, const Vec3& center, double reach, double atMost, float guard)
        : motion_(motion), place_(motion.X_OT), center_(center), bend_(atMost * reach * motion.turn.squaredNorm() / 2) {
        const Vec3 c = motion.X_OT * center;
        for (int k = 0; k < 3; ++k) {
            c_[k] = float(c[k]);
            shift_[k] = float(motion.shift[k]);
            turn_[k] = float(motion.turn[k]);
        }
        angle_ = float(motion.turn.norm());
        guard_ = guard + kPathError * float(motion.shift.norm() + reach * motion.turn.norm());
    }

    /// With d the offset of the centers and u the path, leaves meet where |d + s u| = R + s bend. R is the sum of the
    /// radii, or the distance at the start if that is smaller.
    double exact(const Sphere& tool, const Sphere& obstacle) const {
        const Vec3 arm = motion_.X_OT.q * (tool.center() - center_),
                   d = motion_.X_OT * tool.center() - obstacle.center(), u = motion_.shift + motion_.turn.cross(arm);
        const double distance = d.norm(), touch = std::min(double(tool.r) + double(obstacle.r), distance) - kTouch;
        const double a = u.squaredNorm() - bend_ * bend_, b = d.dot(u) - bend_ * touch,
                     c = (distance - touch) * (distance + touch);
        const double root2 = b * b - a * c;
        if (root2 < 0 || (b >= 0 && a >= 0)) return std::numeric_limits<double>::infinity();
        return c / (std::sqrt(root2) - b);
    }

    /// Bounds by the spheres of the blocks, and by the box around the tool's path and the obstacle's box.
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
            u[k] = shift_[k] + sumOfProducts(turn_[i], arm[j], -turn_[j], arm[i]);
            u2 = fma(u[k], u[k], u2);
            du = fma(d[k], u[k], du);
            d2 = fma(d[k], d[k], d2);
        }
        const Float8 s = max(-du / u2, splat(0.0f)), nearest = s < best ? s : splat(best);
        for (int k = 0; k < 3; ++k) {
            const Float8 end = fma(best, u[k], c[k]), at = fma(nearest, u[k], d[k]);
            const Float8 outside =
                apart(c[k] < end ? c[k] : end, c[k] < end ? end : c[k], obstacle.lo[k], obstacle.hi[k]);
            outside2 = fma(outside, outside, outside2);
            near2 = fma(at, at, near2);
        }
        // The deviation of a block's leaves from the path of its center.
        const Float8 beside = float(bend_) + angle_ * tool.r, reach = tool.r + guard_ + best * beside;
        const Float8 ball = obstacle.r + reach, box = obstacle.round + reach;
        const Float8 soonest = (simd::sqrt(d2) - obstacle.r - tool.r - guard_) / (simd::sqrt(u2) + beside);
        const auto meet = (near2 <= ball * ball) & (outside2 <= box * box);
        return meet ? soonest : splat(std::numeric_limits<float>::infinity());
    }

  private:
    const StraightMotion& motion_;
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

double freeShare(const SphereTree& tool, const SphereTree& obstacle, const StraightMotion& motion, const Vec3& center,
                 double reach, double atMost, SearchBudget* budget) {
    const Meeting meeting(motion, center, reach, atMost, floatGuard(tool, obstacle, motion.X_OT));
    Search search(tool, obstacle, meeting, atMost, nullptr, budget);
    const double share = std::max(0.0, search.run());
    return search.ended() ? -1 : share;
}

double deepestGap(const SphereTree& tool, const SphereTree& obstacle, TreeWalk& walk, const Pose& X_OT) {
    const Mat3 R = X_OT.R();
    double best = 0;
    int placed = -1;
    Vec3 c = Vec3::Zero();
    double radius = 0;
    walk.run({X_OT, 0}, [&](const PairEntry* entries, int count) {
        for (const PairEntry* entry = entries; entry != entries + count; ++entry) {
            if (entry->tool != placed) {
                placed = entry->tool;
                const Sphere s = tool.leaf(placed);
                c = R * Vec3(s.x, s.y, s.z) + X_OT.p;
                radius = s.r;
            }
            Mask deeper = lessEqual(leafGaps(c, radius, obstacle, entry->obstacle).gap, splat(best + kGapRounding));
            for (; deeper; deeper &= deeper - 1)
                best = std::min(
                    best,
                    leafGap(tool.leaf(placed),
                            obstacle.leaf(entry->obstacle * SphereTree::kBranching + std::countr_zero(deeper)), X_OT));
        }
    });
    return best;
}

}  // namespace touchstone
