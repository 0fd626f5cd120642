#include "haptics/collision/neighbour_list.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

#include "haptics/collision/leaf_gaps.hpp"

namespace touchstone {

using namespace simd;

double travel(const Pose& from, const Pose& to, const Vec3& center, double reach) {
    return (to * center - from * center).norm() + reach * logRotation(to.q * from.q.conjugate()).norm();
}

namespace {

constexpr double kNarrow = 0.25;     // of the slack: how much further the narrow set reaches
constexpr double kCrossed = 1e-10;   // mm
constexpr double kRounding = 1e-12;  // mm: a gap that falls by less has not fallen

std::size_t capacityFor(const SphereTree& tool, const SphereTree& obstacle) {
    const std::int64_t possible = std::int64_t(tool.leafCount()) * obstacle.levels[1].count;
    return std::size_t(std::min<std::int64_t>(possible, NeighbourList::kCapacity));
}

}  // namespace

NeighbourList::NeighbourList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex)
    : tool_(&tool),
      obstacle_(&obstacle),
      center_(tool.center()),
      reach_(tool.reach()),
      obstacleIndex_(obstacleIndex),
      walk_(tool, obstacle),
      all_(capacityFor(tool, obstacle)),
      near_(capacityFor(tool, obstacle)),
      offsets_(std::size_t(tool.leafCount()) + 1) {
    for (auto& column : placed_) column.resize(std::size_t(paddedToEight(tool.leafCount())));
}

/// How much margin entries are complete for at this pose.
double NeighbourList::reserve(const Entries& entries, const Pose& X_OT) const {
    return entries.margin < 0 ? -1 : entries.margin - travel(entries.pose, X_OT, center_, reach_);
}

bool NeighbourList::complete(const Pose& X_OT, double margin, double slack) {
    // Entries that are near no longer are looked at in vain: the narrow set is renewed before its reserve is spent.
    const double left = reserve(near_, X_OT);
    if (left >= margin && near_.margin - left <= kNarrow * slack) return true;
    // Deep overlaps can fill the memory: then without slack, for this pose alone.
    if (reserve(all_, X_OT) < margin && !walk(X_OT, margin + slack) && !walk(X_OT, margin)) return false;
    narrow(X_OT, std::min(margin + kNarrow * slack, reserve(all_, X_OT)));
    return true;
}

void NeighbourList::placeToolLeaves(const Pose& X_OT) {
    const Eigen::Matrix3f R = X_OT.R().cast<float>();
    const Eigen::Vector3f p = X_OT.p.cast<float>();
    const TreeLevel& leaves = tool_->levels[0];
    for (int i = 0; i < leaves.count; i += SphereTree::kBranching) {
        const Float8 x = load(&leaves.x[i]), y = load(&leaves.y[i]), z = load(&leaves.z[i]);
        for (int k = 0; k < 3; ++k) store(&placed_[k][i], R(k, 0) * x + R(k, 1) * y + R(k, 2) * z + p[k]);
        store(&placed_[3][i], load(&leaves.r[i]));
    }
}

/// Appends the entry if a leaf of its bucket is within the limit; without a branch, since half of them are.
inline void NeighbourList::keep(LeafBucket entry, float limit, Entries& out) const {
    const TreeLevel& leaves = obstacle_->levels[0];
    const int first = entry.bucket * SphereTree::kBranching;
    const Float8 dx = load(&leaves.x[first]) - splat(placed_[0][entry.toolLeaf]);
    const Float8 dy = load(&leaves.y[first]) - splat(placed_[1][entry.toolLeaf]);
    const Float8 dz = load(&leaves.z[first]) - splat(placed_[2][entry.toolLeaf]);
    const float gap =
        least(simd::sqrt(dx * dx + dy * dy + dz * dz) - (load(&leaves.r[first]) + splat(placed_[3][entry.toolLeaf])));
    out.at[out.count] = entry;
    out.gap[out.count] = gap;
    out.count += gap <= limit;
}

bool NeighbourList::walk(const Pose& X_OT, double margin) {
    all_.margin = near_.margin = -1;
    placeToolLeaves(X_OT);
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    // The walk tested the buckets' boxes; the leaves themselves drop most of what it found.
    Entries& found = near_;
    found.count = 0;
    const int capacity = int(found.at.size()) - 8;
    bool full = false;
    walk_.run(X_OT, margin, [&](const LeafBucket* entries, int count) {
        for (int i = 0; i < count && !full; ++i) {
            keep(entries[i], limit, found);
            full = found.count > capacity;
        }
    });
    if (full) return false;

    // Stable counting sort by tool leaf; its buckets are ascending already.
    std::fill(offsets_.begin(), offsets_.end(), 0);
    for (int i = 0; i < found.count; ++i) ++offsets_[found.at[i].toolLeaf];
    std::exclusive_scan(offsets_.begin(), offsets_.end(), offsets_.begin(), 0);
    for (int i = 0; i < found.count; ++i) {
        const int to = offsets_[found.at[i].toolLeaf]++;
        all_.at[to] = found.at[i];
        all_.gap[to] = found.gap[i];
    }
    all_.count = found.count;
    all_.pose = X_OT;
    all_.margin = margin;
    return true;
}

/// visit(entry) for every entry that may hold a pair with gap <= margin.
template <class Visit>
void NeighbourList::forEachWithin(const Entries& entries, const Pose& X_OT, double margin, Visit&& visit) const {
    const double grown = margin + travel(entries.pose, X_OT, center_, reach_);
    const Float8 limit = splat(float(grown) + 2 * floatGuard(*tool_, *obstacle_, X_OT));
    for (int i = 0; i < entries.count; i += 8) {
        Mask mask = lessEqual(load(&entries.gap[i]), limit);
        if (i + 8 > entries.count) mask &= (1u << (entries.count - i)) - 1;
        for (; mask; mask &= mask - 1) visit(entries.at[i + std::countr_zero(mask)]);
    }
}

void NeighbourList::narrow(const Pose& X_OT, double margin) {
    placeToolLeaves(X_OT);
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    near_.count = 0;
    forEachWithin(all_, X_OT, margin, [&](const LeafBucket& entry) { keep(entry, limit, near_); });
    near_.pose = X_OT;
    near_.margin = margin;
}

/// visit(toolLeaf, c_O, bucket, mask) for every entry with a leaf within margin, by a float test that may hit a little
/// too much.
template <class Visit>
void NeighbourList::forEachHit(const Pose& X_OT, double margin, Visit&& visit) const {
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    const TreeLevel& leaves = obstacle_->levels[0];
    const Mat3 R = X_OT.R();
    int placed = -1;
    Vec3 c = Vec3::Zero();
    Float8 x{}, y{}, z{}, reach{};
    forEachWithin(near_, X_OT, margin, [&](const LeafBucket& entry) {
        if (entry.toolLeaf != placed) {
            placed = entry.toolLeaf;
            const Sphere s = tool_->leaf(placed);
            c = R * Vec3(s.x, s.y, s.z) + X_OT.p;
            x = splat(float(c.x())), y = splat(float(c.y())), z = splat(float(c.z()));
            reach = splat(s.r + limit);
        }
        const int first = entry.bucket * SphereTree::kBranching;
        const Float8 dx = load(&leaves.x[first]) - x, dy = load(&leaves.y[first]) - y, dz = load(&leaves.z[first]) - z;
        const Float8 sum = max(load(&leaves.r[first]) + reach, splat(0.0f));
        if (const Mask mask = lessEqual(dx * dx + dy * dy + dz * dz, sum * sum)) visit(placed, c, entry.bucket, mask);
    });
}

namespace {

/// Rows of one tool leaf against a bucket, a lane a row: (n, r x n) on world axes.
struct RowLanes {
    Double8 j[6];

    RowLanes(const LeafGaps& l, const Mat3& R_WO, const Vec3& r) {
        const Double8 inverse = l.distance > 0.0 ? 1.0 / l.distance : splat(0.0);
        for (int k = 0; k < 3; ++k) j[k] = (R_WO(k, 0) * l.dx + R_WO(k, 1) * l.dy + R_WO(k, 2) * l.dz) * inverse;
        j[3] = r.y() * j[2] - r.z() * j[1];
        j[4] = r.z() * j[0] - r.x() * j[2];
        j[5] = r.x() * j[1] - r.y() * j[0];
    }
    void store(RowSet& rows, int n, const Double8& gap, std::uint64_t firstId, Mask mask) const {
        for (int k = 0; k < 6; ++k) compressStore(rows.column(k) + n, j[k], mask);
        compressStore(rows.gap() + n, gap, mask);
        compressStore(rows.ids() + n, Long8{0, 1, 2, 3, 4, 5, 6, 7} + std::int64_t(firstId), mask);
    }
};

}  // namespace

bool NeighbourList::appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows, int most) const {
    const Vec3 C = X_OT * center_;
    most = std::min(most, rows.capacity());
    int n = rows.size();
    bool fits = true;
    forEachHit(X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        if (!fits) return;
        const LeafGaps l = leafGaps(c_O, tool_->leaf(toolLeaf).r, *obstacle_, bucket);
        mask &= lessEqual(l.gap, splat(margin));
        fits = n + int(std::popcount(mask)) <= most;
        if (!mask || !fits) return;
        RowLanes(l, R_WO, R_WO * (c_O - C))
            .store(rows, n, l.gap, contactId(obstacleIndex_, toolLeaf, bucket * SphereTree::kBranching), mask);
        n += std::popcount(mask);
    });
    if (fits) rows.setSize(n);
    return fits;
}

int NeighbourList::appendCrossed(const Pose& X_OT, const Mat3& R_WO, double beyond, double margin, const Crossing& by,
                                 const RowSet& rows, RowSet& crossed) const {
    const Vec3 C = X_OT * center_;
    const Vec6 compliance = by.stiffness.cwiseInverse();
    int n = crossed.size(), pairs = 0;
    bool fits = true;
    forEachHit(X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        if (!fits) return;
        const LeafGaps l = leafGaps(c_O, tool_->leaf(toolLeaf).r, *obstacle_, bucket);
        mask &= lessEqual(l.gap, splat(margin)) & ~lessEqual(l.gap, splat(beyond));
        if (!mask) return;
        pairs += std::popcount(mask);
        const RowLanes lanes(l, R_WO, R_WO * (c_O - C));
        Double8 s = by.notDeeper ? max(l.gap, splat(0.0)) : l.gap;
        for (int k = 0; k < 6; ++k) s += lanes.j[k] * by.x[k];
        if (by.slack > 0) {
            Double8 length2{};
            for (int k = 0; k < 6; ++k) length2 += compliance[k] * (lanes.j[k] * lanes.j[k]);
            s += by.slack * simd::sqrt(length2);
        }
        mask &= lessEqual(s, splat(-kCrossed));
        const std::uint64_t firstId = contactId(obstacleIndex_, toolLeaf, bucket * SphereTree::kBranching);
        for (Mask known = mask; known; known &= known - 1)  // a solver may leave a row it has crossed
            if (rows.find(firstId + std::uint64_t(std::countr_zero(known))) >= 0) mask &= ~(known & -known);
        fits = rows.size() + n + int(std::popcount(mask)) <= rows.capacity();
        if (!mask || !fits) return;
        lanes.store(crossed, n, l.gap, firstId, mask);
        n += std::popcount(mask);
    });
    if (!fits) return -1;
    crossed.setSize(n);
    return pairs;
}

int NeighbourList::appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const {
    struct {
        int toolLeaf = -1, obstacleLeaf = 0;
        Vec3 c_O, offset;
        double gap = 0, distance = 0;
    } best;
    int pairs = 0;
    const auto flush = [&] {
        if (best.toolLeaf < 0 || rows.size() == rows.capacity()) return;
        const Vec3 n = best.distance > 0 ? Vec3(R_WO * best.offset / best.distance) : Vec3(Vec3::Zero());
        const Vec3 r = R_WO * (best.c_O - X_OT * center_);
        Vec6 j;
        j << n, r.cross(n);
        rows.push(j, best.gap, contactId(obstacleIndex_, best.toolLeaf, best.obstacleLeaf));
    };
    forEachHit(X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        const LeafGaps l = leafGaps(c_O, tool_->leaf(toolLeaf).r, *obstacle_, bucket);
        mask &= lessEqual(l.gap, splat(margin));
        pairs += std::popcount(mask);
        for (; mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            if (toolLeaf == best.toolLeaf && l.gap[i] >= best.gap) continue;
            if (toolLeaf != best.toolLeaf) flush();
            best = {toolLeaf,     bucket * SphereTree::kBranching + i, c_O, Vec3(l.dx[i], l.dy[i], l.dz[i]), l.gap[i],
                    l.distance[i]};
        }
    });
    flush();
    return pairs;
}

NeighbourList::Overlap NeighbourList::remeasure(const Pose& before, const Pose& after, double tolerance) const {
    Overlap overlap;
    const Mat3 R = before.R();
    forEachHit(after, 0, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        if (overlap.deeper()) return;
        const Sphere s = tool_->leaf(toolLeaf);
        const LeafGaps now = leafGaps(c_O, s.r, *obstacle_, bucket);
        mask &= lessEqual(now.gap, splat(0.0));
        if (!mask) return;
        const LeafGaps then = leafGaps(R * Vec3(s.x, s.y, s.z) + before.p, s.r, *obstacle_, bucket);
        for (; mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            overlap.depth = std::max(overlap.depth, -now.gap[i]);
            if (now.gap[i] < std::min(then.gap[i] - kRounding, -tolerance) && !overlap.deeper()) {
                overlap.toolLeaf = toolLeaf;
                overlap.obstacleLeaf = bucket * SphereTree::kBranching + i;
            }
        }
    });
    return overlap;
}

bool NeighbourList::isDeeper(const Pose& before, const Pose& after, const Overlap& pair, double tolerance) const {
    return gap(after, pair.toolLeaf, pair.obstacleLeaf) <
           std::min(gap(before, pair.toolLeaf, pair.obstacleLeaf) - kRounding, -tolerance);
}

double NeighbourList::gap(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const {
    const Sphere t = tool_->leaf(toolLeaf), o = obstacle_->leaf(obstacleLeaf);
    return (X_OT * Vec3(t.x, t.y, t.z) - Vec3(o.x, o.y, o.z)).norm() - (double(t.r) + double(o.r));
}

}  // namespace touchstone
