#include "haptics/collision/pair_finder.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace touchstone {

using namespace simd;

double travel(const Pose& from, const Pose& to, const Vec3& center, double reach) {
    return (to * center - from * center).norm() + reach * logRotation(to.q * from.q.conjugate()).norm();
}

LeafExtent::LeafExtent(const SphereTree& tool) : center(tool.center()), reach(tool.reach()), about(Vec3::Zero()) {
    for (int i = 0; i < tool.leafCount(); ++i) {
        const Vec3 arm = tool.leaf(i).center() - center;
        for (int k = 0; k < 3; ++k) about[k] = std::max(about[k], std::hypot(arm[(k + 1) % 3], arm[(k + 2) % 3]));
    }
}

double deviation(const Course& from, const Course& other, const LeafExtent& extent) {
    // Leaves go straight on a course; turned ones get there by an arc that is off by up to half the angle squared.
    const auto bend = [&](const Vec3& turn) { return extent.reach * turn.squaredNorm() / 2; };
    const auto turned = [&](const Vec3& turn) { return extent.turned(from.X_OT.q, turn); };
    const double lever = from.turn.isZero(0) ? 0 : turned(from.turn) / from.turn.norm();
    const double way2 = from.shift.squaredNorm() + lever * lever * from.turn.squaredNorm();
    const auto at = [&](const Pose& X_OT) {
        const Vec3 p = X_OT * extent.center - from.X_OT * extent.center,
                   turn = logRotation(X_OT.q * from.X_OT.q.conjugate());
        const double start = p.norm() + turned(turn);
        if (way2 == 0) return start;
        const double s = std::clamp((p.dot(from.shift) + lever * lever * turn.dot(from.turn)) / way2, 0.0, 1.0);
        return std::min(start, (p - s * from.shift).norm() + turned(turn - s * from.turn) + bend(turn));
    };
    const double start = at(other.X_OT);
    if (other.stays()) return start;
    // Between its ends a straight way is no further from another than at one of them.
    return std::max(start, at(other.end(extent.center)) + bend(other.turn));
}

namespace {

double leastRadius(const SphereTree& tree) {
    const auto first = tree.levels.front().r.begin();
    return std::max(1e-9, double(*std::min_element(first, first + tree.leafCount())));  // points have none
}

}  // namespace

PairEntries::PairEntries(const SphereTree& tool, const SphereTree& obstacle) {
    const std::int64_t possible = std::int64_t(tool.leafCount()) * obstacle.levels[1].count;
    capacity = int(std::min<std::int64_t>(possible, kCapacity));
    at.resize(std::size_t(capacity) + 8);
    gap.resize(std::size_t(capacity) + 8);
    sum.resize(std::size_t(capacity) + 8);
}

PairFinder::PairFinder(const SphereTree& tool, const SphereTree& obstacle)
    : tool_(&tool),
      obstacle_(&obstacle),
      extent_(tool),
      leastSum_(leastRadius(tool) + leastRadius(obstacle)),
      walk_(tool, obstacle),
      found_(tool, obstacle),
      offsets_(std::size_t(tool.leafCount()) + 1) {
    for (auto& column : placed_) column.resize(std::size_t(paddedToEight(tool.leafCount())));
}

double PairFinder::reserve(const Coverage& have, const Coverage& asked) const {
    if (have.within.margin < 0) return -1;
    const double widest = asked.within.at(leastSum_);
    const double margin = asked.within.curve <= have.within.curve ? asked.within.margin : widest;
    return std::min(have.within.most - widest, have.within.margin - margin) - strayed(have, asked.course);
}

/// All tool leaves, or those of some entries, if these are few.
void PairFinder::place(const Course& course, const PairEntries* of) {
    const Pose& X_OT = course.X_OT;
    const Eigen::Matrix3f R = X_OT.R().cast<float>();
    const Eigen::Vector3f p = X_OT.p.cast<float>(), c = (X_OT * extent_.center).cast<float>();
    const Eigen::Vector3f shift = course.shift.cast<float>(), turn = course.turn.cast<float>();
    const bool stays = course.stays();
    const TreeLevel& leaves = tool_->levels[0];
    const auto placeEight = [&](int i) {
        const Float8 x = load(&leaves.x[i]), y = load(&leaves.y[i]), z = load(&leaves.z[i]);
        Float8 at[3];
        for (int k = 0; k < 3; ++k) {
            at[k] = R(k, 0) * x + R(k, 1) * y + R(k, 2) * z + p[k];
            store(&placed_[kX + k][i], at[k]);
        }
        store(&placed_[kR][i], load(&leaves.r[i]));
        if (stays) return;
        Float8 way2 = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            const Float8 way = shift[k] + (turn[a] * (at[b] - c[b]) - turn[b] * (at[a] - c[a]));
            store(&placed_[kWayX + k][i], way);
            way2 += way * way;
        }
        store(&placed_[kPerWay2][i], way2 > 1e-12f ? 1.0f / way2 : splat(0.0f));
    };
    if (of && of->count < leaves.count) {
        for (int i = 0, placed = -1; i < of->count; ++i)
            if (const int bucket = of->at[i].toolLeaf / SphereTree::kBranching; bucket != placed)
                placeEight((placed = bucket) * SphereTree::kBranching);
    } else {
        for (int i = 0; i < leaves.count; i += SphereTree::kBranching) placeEight(i);
    }
}

/// What is within, in float, with guard.
struct PairFinder::Limit {
    float margin, most, curve;

    Limit(const Within& within, float guard)
        : margin(float(within.margin) + guard), most(float(within.most) + guard), curve(curveInFloat(within)) {}
};

/// Takes the entry as number `count` if a leaf of its bucket is within the limit; without a branch, since half of them
/// are.
template <bool moves>
inline void PairFinder::keep(LeafBucket entry, const Limit& limit, PairEntries& out, int& count) const {
    const TreeLevel& leaves = obstacle_->levels[0];
    const int first = entry.bucket * SphereTree::kBranching;
    const auto placed = [&](int column) { return splat(placed_[column][entry.toolLeaf]); };
    Float8 dx = load(&leaves.x[first]) - placed(kX);
    Float8 dy = load(&leaves.y[first]) - placed(kY);
    Float8 dz = load(&leaves.z[first]) - placed(kZ);
    if constexpr (moves) {
        const Float8 wx = placed(kWayX), wy = placed(kWayY), wz = placed(kWayZ);
        Float8 s = (dx * wx + dy * wy + dz * wz) * placed(kPerWay2);
        s = max(s, splat(0.0f));
        s = s < 1.0f ? s : splat(1.0f);
        dx -= s * wx, dy -= s * wy, dz -= s * wz;
    }
    const Float8 sum = load(&leaves.r[first]) + placed(kR), gap = simd::sqrt(dx * dx + dy * dy + dz * dz) - sum;
    const Mask near = lessEqual((gap - limit.margin) * sum, splat(limit.curve)) & lessEqual(gap, splat(limit.most));
    out.at[count] = entry;
    out.gap[count] = least(gap);
    out.sum[count] = obstacle_->levels[1].round[entry.bucket] + placed_[kR][entry.toolLeaf];
    count += near != 0;
}

/// The walk tested the buckets' boxes; the leaves themselves drop most of what it found. False if too much is left.
template <bool moves>
bool PairFinder::walk(const Coverage& asked) {
    const Limit limit(asked.within, floatGuard(*tool_, *obstacle_, asked.course.X_OT));
    found_.count = 0;
    bool full = false;
    walk_.run(asked, [&](const LeafBucket* entries, int count) {
        for (int i = 0; i < count && !full; ++i) {
            keep<moves>(entries[i], limit, found_, found_.count);
            full = found_.count > found_.capacity;
        }
    });
    return !full;
}

bool PairFinder::find(const Coverage& asked, PairEntries& out) {
    out.within = {};
    place(asked.course);
    if (!(asked.course.stays() ? walk<false>(asked) : walk<true>(asked))) return false;

    // Stable counting sort by tool leaf; its buckets are ascending already.
    std::fill(offsets_.begin(), offsets_.end(), 0);
    for (int i = 0; i < found_.count; ++i) ++offsets_[found_.at[i].toolLeaf];
    std::exclusive_scan(offsets_.begin(), offsets_.end(), offsets_.begin(), 0);
    for (int i = 0; i < found_.count; ++i) {
        const int to = offsets_[found_.at[i].toolLeaf]++;
        out.at[to] = found_.at[i];
        out.gap[to] = found_.gap[i];
        out.sum[to] = found_.sum[i];
    }
    out.count = found_.count;
    static_cast<Coverage&>(out) = asked;
    return true;
}

void PairFinder::narrow(const PairEntries& from, const Coverage& asked, PairEntries& out) {
    place(asked.course, &from);
    const Limit limit(asked.within, floatGuard(*tool_, *obstacle_, asked.course.X_OT));
    int count = 0;
    const auto keepAll = [&]<bool moves>() {
        forEachWithin(from, asked, [&](const LeafBucket& entry) {
            keep<moves>(entry, limit, out, count);
            return true;
        });
    };
    if (asked.course.stays())
        keepAll.operator()<false>();
    else
        keepAll.operator()<true>();
    out.count = count;
    static_cast<Coverage&>(out) = asked;
}

}  // namespace touchstone
