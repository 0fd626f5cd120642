#include "haptics/collision/neighbour_list.hpp"

#include <algorithm>
#include <bit>

#include "haptics/collision/leaf_gaps.hpp"

namespace touchstone {

using namespace simd;

double travel(const Pose& from, const Pose& to, const Vec3& center, double reach) {
    return (to * center - from * center).norm() + reach * logRotation(to.q * from.q.conjugate()).norm();
}

NeighbourList::NeighbourList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex)
    : tool_(&tool),
      obstacle_(&obstacle),
      center_(tool.center()),
      reach_(tool.reach()),
      obstacleIndex_(obstacleIndex),
      walk_(tool, obstacle) {
    const std::int64_t possible = std::int64_t(tool.leafCount()) * obstacle.levels[1].count;
    const std::size_t capacity = std::size_t(std::min<std::int64_t>(possible, kCapacity));
    found_.resize(capacity);
    buckets_.resize(capacity);
    offsets_.resize(std::size_t(tool.leafCount()) + 1);
    groups_.resize(std::size_t(tool.leafCount()));
    for (auto& column : placed_) column.resize(std::size_t(paddedToEight(tool.leafCount())));
}

/// Centres of all tool leaves in the obstacle's frame, and their reach.
void NeighbourList::placeToolLeaves(const Pose& X_OT, float margin) {
    const Eigen::Matrix3f R = X_OT.R().cast<float>();
    const Eigen::Vector3f p = X_OT.p.cast<float>();
    const TreeLevel& leaves = tool_->levels[0];
    for (int i = 0; i < leaves.count; i += SphereTree::kBranching) {
        const Float8 x = load(&leaves.x[i]), y = load(&leaves.y[i]), z = load(&leaves.z[i]);
        for (int k = 0; k < 3; ++k) store(&placed_[k][i], R(k, 0) * x + R(k, 1) * y + R(k, 2) * z + p[k]);
        store(&placed_[3][i], load(&leaves.r[i]) + margin);
    }
}

bool NeighbourList::build(const Pose& X_OT, double margin) {
    builtMargin_ = -1;
    groupCount_ = 0;
    placeToolLeaves(X_OT, float(margin) + floatGuard(*tool_, *obstacle_, X_OT));
    const TreeLevel& leaves = obstacle_->levels[0];
    std::fill(offsets_.begin(), offsets_.end(), 0);

    int n = 0;
    bool full = false;
    walk_.run(X_OT, margin, [&](const LeafBucket* entries, int count) {
        for (int i = 0; i < count && !full; ++i) {
            // The walk tested the bucket's box; the leaves themselves drop most of what it found.
            const LeafBucket e = entries[i];
            const int first = e.bucket * SphereTree::kBranching;
            const Float8 dx = load(&leaves.x[first]) - splat(placed_[0][e.toolLeaf]);
            const Float8 dy = load(&leaves.y[first]) - splat(placed_[1][e.toolLeaf]);
            const Float8 dz = load(&leaves.z[first]) - splat(placed_[2][e.toolLeaf]);
            const Float8 sum = max(load(&leaves.r[first]) + splat(placed_[3][e.toolLeaf]), splat(0.0f));
            if (!lessEqual(dx * dx + dy * dy + dz * dz, sum * sum)) continue;
            full = n == int(found_.size());
            if (full) break;
            found_[n++] = e;
            ++offsets_[e.toolLeaf];
        }
    });
    if (full) return false;

    // Stable counting sort by tool leaf; its buckets are ascending already.
    int sum = 0;
    for (int leaf = 0; leaf < tool_->leafCount(); ++leaf) {
        const int count = offsets_[leaf];
        offsets_[leaf] = sum;
        if (count) groups_[groupCount_++] = {leaf, sum, sum + count};
        sum += count;
    }
    for (int i = 0; i < n; ++i) buckets_[offsets_[found_[i].toolLeaf]++] = found_[i].bucket;
    builtAt_ = X_OT;
    builtMargin_ = margin;
    return true;
}

bool NeighbourList::covers(const Pose& X_OT, double margin) const {
    return builtMargin_ >= 0 && margin + travel(builtAt_, X_OT, center_, reach_) <= builtMargin_;
}

/// visit(toolLeaf, c_O, bucket, mask) for every entry with a leaf within margin, by a float test that may hit a little
/// too much.
template <class Visit>
void NeighbourList::forEachHit(const Pose& X_OT, double margin, Visit&& visit) const {
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    const TreeLevel& leaves = obstacle_->levels[0];
    const Mat3 R = X_OT.R();
    for (int g = 0; g < groupCount_; ++g) {
        const Group& group = groups_[g];
        const Sphere s = tool_->leaf(group.toolLeaf);
        const Vec3 c = R * Vec3(s.x, s.y, s.z) + X_OT.p;
        const Float8 x = splat(float(c.x())), y = splat(float(c.y())), z = splat(float(c.z()));
        const Float8 reach = splat(s.r + limit);
        for (int i = group.begin; i < group.end; ++i) {
            const int first = buckets_[i] * SphereTree::kBranching;
            const Float8 dx = load(&leaves.x[first]) - x, dy = load(&leaves.y[first]) - y,
                         dz = load(&leaves.z[first]) - z;
            const Float8 sum = max(load(&leaves.r[first]) + reach, splat(0.0f));
            if (const Mask mask = lessEqual(dx * dx + dy * dy + dz * dz, sum * sum))
                visit(group.toolLeaf, c, buckets_[i], mask);
        }
    }
}

bool NeighbourList::appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const {
    int n = rows.size();
    bool fits = true;
    forEachHit(X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        if (!fits) return;
        const LeafGaps l = leafGaps(c_O, tool_->leaf(toolLeaf).r, *obstacle_, bucket);
        mask &= lessEqual(l.gap, splat(margin));
        fits = n + int(std::popcount(mask)) <= rows.capacity();
        if (!mask || !fits) return;

        const Vec3 r = R_WO * (c_O - X_OT * center_);
        const Double8 inverse = l.distance > 0.0 ? 1.0 / l.distance : splat(0.0);
        Double8 normal[3];
        for (int k = 0; k < 3; ++k) normal[k] = (R_WO(k, 0) * l.dx + R_WO(k, 1) * l.dy + R_WO(k, 2) * l.dz) * inverse;
        for (int k = 0; k < 3; ++k) compressStore(rows.column(k) + n, normal[k], mask);
        compressStore(rows.column(3) + n, r.y() * normal[2] - r.z() * normal[1], mask);
        compressStore(rows.column(4) + n, r.z() * normal[0] - r.x() * normal[2], mask);
        compressStore(rows.column(5) + n, r.x() * normal[1] - r.y() * normal[0], mask);
        compressStore(rows.gap() + n, l.gap, mask);
        const std::int64_t id = std::int64_t(contactId(obstacleIndex_, toolLeaf, bucket * SphereTree::kBranching));
        compressStore(rows.ids() + n, Long8{0, 1, 2, 3, 4, 5, 6, 7} + id, mask);
        n += std::popcount(mask);
    });
    if (fits) rows.setSize(n);
    return fits;
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
    forEachHit(after, 0, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        const Sphere s = tool_->leaf(toolLeaf);
        const LeafGaps now = leafGaps(c_O, s.r, *obstacle_, bucket);
        mask &= lessEqual(now.gap, splat(0.0));
        if (!mask) return;
        const LeafGaps then = leafGaps(before * Vec3(s.x, s.y, s.z), s.r, *obstacle_, bucket);
        for (; mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            overlap.depth = std::max(overlap.depth, -now.gap[i]);
            overlap.deeper |= now.gap[i] < std::min(then.gap[i], -tolerance);
        }
    });
    return overlap;
}

double NeighbourList::gap(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const {
    const Sphere t = tool_->leaf(toolLeaf), o = obstacle_->leaf(obstacleLeaf);
    return (X_OT * Vec3(t.x, t.y, t.z) - Vec3(o.x, o.y, o.z)).norm() - (double(t.r) + double(o.r));
}

}  // namespace touchstone
