#include "haptics/collision/pair_finder.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace touchstone {

using namespace simd;

double travel(const Pose& from, const Pose& to, const Vec3& center, double reach) {
    return (to * center - from * center).norm() + reach * logRotation(to.q * from.q.conjugate()).norm();
}

Extent::Extent(const SphereTree& tool, const Vec3& center_) : center(center_) {
    for (int i = 0; i < tool.leafCount(); ++i) add(tool.leaf(i).center());
}

void Extent::add(const Vec3& point) {
    const Vec3 arm = point - center;
    reach = std::max(reach, arm.norm());
    for (int k = 0; k < 3; ++k) about[k] = std::max(about[k], std::hypot(arm[(k + 1) % 3], arm[(k + 2) % 3]));
}

namespace {

/// logRotation() of a turn that is mostly small, to 1e-12 of its length.
Vec3 turnOf(const Quat& q) {
    const double s2 = q.vec().squaredNorm();
    if (s2 > 1e-4 || q.w() < 0) return logRotation(q);
    return (2 + s2 * (1.0 / 3 + s2 * (3.0 / 20))) * q.vec();  // of 2 asin(s) / s
}

}  // namespace

double deviation(const StraightMotion& from, const StraightMotion& other, const Extent& extent) {
    // During a motion leaves move along straight paths. A rotating leaf follows an arc, which deviates from the
    // straight path by up to reach |turn|²/2.
    const auto bend = [&](const Vec3& turn) { return extent.reach * turn.squaredNorm() / 2; };
    const auto turned = [&](const Vec3& turn) { return extent.turned(from.X_OT.q, turn); };
    const double lever = from.turn.isZero(0) ? 0 : turned(from.turn) / from.turn.norm();
    const double way2 = from.shift.squaredNorm() + lever * lever * from.turn.squaredNorm();
    const auto at = [&](const Pose& X_OT) {
        const Vec3 p = X_OT * extent.center - from.X_OT * extent.center,
                   turn = turnOf(X_OT.q * from.X_OT.q.conjugate());
        const double start = p.norm() + turned(turn);
        if (way2 == 0) return start;
        const double s = std::clamp((p.dot(from.shift) + lever * lever * turn.dot(from.turn)) / way2, 0.0, 1.0);
        return std::min(start, (p - s * from.shift).norm() + turned(turn - s * from.turn) + bend(turn));
    };
    const double start = at(other.X_OT);
    if (other.stays()) return start;
    // The distance between two straight paths is largest at an end.
    return std::max(start, at(other.end(extent.center)) + bend(other.turn));
}

namespace {

double leastRadius(const SphereTree& tree) {
    const auto first = tree.levels.front().r.begin();
    return std::max(1e-9, double(*std::min_element(first, first + tree.leafCount())));  // the radius of a point is 0
}

}  // namespace

void Separations::resize(int n) {
    // Eight lanes may be written behind the last pair; with more, equal numbers of a pair do not share sets of the
    // cache.
    stride_ = std::size_t(n) + 24;
    numbers_.resize(kNumbers * stride_);
    capacity_ = n;
}

PairEntries::PairEntries(const SphereTree& tool, const SphereTree& obstacle)
    : PairEntries(std::int64_t(tool.leafCount()) * obstacle.levels[1].count) {}

PairEntries::PairEntries(std::int64_t possible) {
    capacity = int(std::min<std::int64_t>(possible, kEntryCapacity));
    at.resize(std::size_t(capacity) + 8);
    gap.resize(std::size_t(capacity) + 8);
    sum.resize(std::size_t(capacity) + 8);
}

bool PairFinder::find(const Coverage& asked, PairEntries& out) {
    out.within = {};
    out.ofFeatures = ofFeatures();
    if (!search(asked, out)) return false;
    static_cast<Coverage&>(out) = asked;
    return true;
}

void PairFinder::narrow(const PairEntries& from, const Coverage& asked, PairEntries& out, bool renew) {
    select(from, asked, out, renew);
    static_cast<Coverage&>(out) = asked;
}

double PairFinder::reserve(const Coverage& have, const Coverage& asked, double deviation) const {
    if (have.within.margin < 0 || have.within.turn < asked.within.turn) return -1;
    const double widest = asked.within.at(leastSum_);
    const double margin = asked.within.curve <= have.within.curve ? asked.within.margin : widest;
    return std::min(have.within.most - widest, have.within.margin - margin) - deviation;
}

LeafPairFinder::LeafPairFinder(const SphereTree& tool, const SphereTree& obstacle, const Vec3& center)
    : PairFinder(Extent(tool, center), leastRadius(tool) + leastRadius(obstacle)),
      tool_(&tool),
      obstacle_(&obstacle),
      walk_(tool, obstacle),
      found_(std::size_t(PairEntries(tool, obstacle).capacity) + 1),
      placed_(std::size_t(paddedToEight(tool.leafCount())) / SphereTree::kBranching),
      offsets_(std::size_t(tool.leafCount()) + 1) {}

/// Places all tool leaves, or only those of the given entries if these are fewer.
void LeafPairFinder::place(const StraightMotion& motion, const PairEntries* of) {
    const Pose& X_OT = motion.X_OT;
    const Eigen::Matrix3f R = X_OT.R().cast<float>();
    const Eigen::Vector3f p = X_OT.p.cast<float>(), c = (X_OT * extent_.center).cast<float>();
    const Eigen::Vector3f shift = motion.shift.cast<float>(), turn = motion.turn.cast<float>();
    const bool stays = motion.stays();
    const TreeLevel& leaves = tool_->levels[0];
    const auto placeEight = [&](int bucket) {
        const int i = bucket * SphereTree::kBranching;
        const Float8 x = load(&leaves.x[i]), y = load(&leaves.y[i]), z = load(&leaves.z[i]);
        Placed& placed = placed_[bucket];
        placed.r = load(&leaves.r[i]);
        for (int k = 0; k < 3; ++k) placed.at[k] = sumOfProducts(R(k, 0), x, R(k, 1), y, R(k, 2), z) + p[k];
        if (stays) return;
        Float8 path2 = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            placed.path[k] = shift[k] + sumOfProducts(turn[a], placed.at[b] - c[b], -turn[b], placed.at[a] - c[a]);
            path2 = fma(placed.path[k], placed.path[k], path2);
        }
        placed.perPath2 = path2 > 1e-12f ? 1.0f / path2 : splat(0.0f);  // a shorter path counts as a point
    };
    if (of && of->count < leaves.count) {
        for (int i = 0, placed = -1; i < of->count; ++i)
            if (const int bucket = of->at[i].tool / SphereTree::kBranching; bucket != placed)
                placeEight(placed = bucket);
    } else {
        for (int i = 0; i < int(placed_.size()); ++i) placeEight(i);
    }
}

/// Where the tool leaf of an entry is nearest to each obstacle leaf of the bucket on its motion.
template <bool moves>
struct LeafPairFinder::Meeting {
    Float8 distance2;  ///< squared distance of the centers there
    Float8 sum;        ///< sum of the radii

    TOUCHSTONE_INLINE Meeting(PairEntry entry, const AlignedVector<Placed>& placed, const TreeLevel& leaves) {
        const Placed& tool = placed[entry.tool / SphereTree::kBranching];
        const auto of = [lane = entry.tool % SphereTree::kBranching](const Float8& column) {
            return splat(column[lane]);
        };
        const int first = entry.obstacle * SphereTree::kBranching;
        Float8 dx = load(&leaves.x[first]) - of(tool.at[0]);
        Float8 dy = load(&leaves.y[first]) - of(tool.at[1]);
        Float8 dz = load(&leaves.z[first]) - of(tool.at[2]);
        if constexpr (moves) {
            const Float8 wx = of(tool.path[0]), wy = of(tool.path[1]), wz = of(tool.path[2]);
            Float8 s = sumOfProducts(dx, wx, dy, wy, dz, wz) * of(tool.perPath2);
            s = max(s, splat(0.0f));
            s = s < 1.0f ? s : splat(1.0f);
            dx = fnma(s, wx, dx), dy = fnma(s, wy, dy), dz = fnma(s, wz, dz);
        }
        distance2 = sumOfProducts(dx, dx, dy, dy, dz, dz);
        sum = load(&leaves.r[first]) + of(tool.r);
    }
};

/// A Within in float, with the float guard added.
struct LeafPairFinder::Limit {
    Float8 margin, most, curve;

    Limit(const Within& within, float guard)
        : margin(splat(float(within.margin) + guard)),
          most(splat(float(within.most) + guard)),
          curve(splat(curveInFloat(within))) {}

    /// Whether any leaf of the bucket is within: distance <= sum + min(margin + curve / sum, most), without a square
    /// root.
    template <bool moves>
    TOUCHSTONE_INLINE bool holds(const Meeting<moves>& m) const {
        const Float8 bent = fma(m.sum, m.sum + margin, curve), straight = m.sum + most;
        return lessEqual(m.distance2 * (m.sum * m.sum), bent * bent) & lessEqual(m.distance2, straight * straight);
    }
};

/// Computes the gaps of the entries. This is a separate pass, since a walk tests many more entries than it keeps.
template <bool moves>
void LeafPairFinder::measure(PairEntries& entries) const {
    const TreeLevel& leaves = obstacle_->levels[0];
    for (int i = 0; i < entries.count; ++i) {
        const PairEntry entry = entries.at[i];
        const Meeting<moves> m(entry, placed_, leaves);
        entries.gap[i] = least(simd::sqrt(m.distance2) - m.sum);
        entries.sum[i] = least(m.sum);
    }
}

/// The walk itself tests the boxes of the buckets; a test of the leaves removes most of the entries that it finds.
/// Returns the number of entries kept in found_, or a number above the capacity if there are more.
template <bool moves>
int LeafPairFinder::walk(const Coverage& asked) {
    const Limit limit(asked.within, floatGuard(*tool_, *obstacle_, asked.motion.X_OT));
    const TreeLevel& leaves = obstacle_->levels[0];
    const int capacity = int(found_.size()) - 1;
    int kept = 0;
    walk_.run(asked, [&](const PairEntry* entries, int count) {
        for (int i = 0; i < count && kept <= capacity; ++i) {
            found_[kept] = entries[i];
            kept += limit.holds(Meeting<moves>(entries[i], placed_, leaves));
        }
    });
    return kept;
}

template <bool moves>
bool LeafPairFinder::searchAlong(const Coverage& asked, PairEntries& out) {
    place(asked.motion);
    const int count = walk<moves>(asked);
    if (count > out.capacity) return false;

    // A stable counting sort by tool leaf; the buckets of a tool leaf are in ascending order already.
    std::fill(offsets_.begin(), offsets_.end(), 0);
    for (int i = 0; i < count; ++i) ++offsets_[found_[i].tool];
    std::exclusive_scan(offsets_.begin(), offsets_.end(), offsets_.begin(), 0);
    for (int i = 0; i < count; ++i) out.at[offsets_[found_[i].tool]++] = found_[i];
    out.count = count;
    measure<moves>(out);
    return true;
}

bool LeafPairFinder::search(const Coverage& asked, PairEntries& out) {
    return asked.motion.stays() ? searchAlong<false>(asked, out) : searchAlong<true>(asked, out);
}

template <bool moves>
void LeafPairFinder::selectAlong(const PairEntries& from, const Coverage& asked, PairEntries& out) {
    place(asked.motion, &from);
    const Limit limit(asked.within, floatGuard(*tool_, *obstacle_, asked.motion.X_OT));
    const TreeLevel& leaves = obstacle_->levels[0];
    int count = 0;
    forEachWithin(from, asked, [&](const PairEntry& entry) {
        out.at[count] = entry;
        count += limit.holds(Meeting<moves>(entry, placed_, leaves));
        return true;
    });
    out.count = count;
    measure<moves>(out);
}

void LeafPairFinder::select(const PairEntries& from, const Coverage& asked, PairEntries& out, bool) {
    asked.motion.stays() ? selectAlong<false>(from, asked, out) : selectAlong<true>(from, asked, out);
}

}  // namespace touchstone
