#include "haptics/collision/neighbour_list.hpp"

#include <algorithm>
#include <bit>

#include "haptics/collision/leaf_gaps.hpp"

namespace touchstone {

using namespace simd;

namespace {

constexpr double kNarrow = 0.25;     // of the slack: how much further the narrow set reaches
constexpr double kCrossed = 1e-10;   // mm
constexpr double kRounding = 1e-12;  // mm: a gap that falls by less has not fallen

}  // namespace

NeighbourList::NeighbourList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex)
    : tool_(&tool),
      obstacle_(&obstacle),
      center_(tool.center()),
      obstacleIndex_(obstacleIndex),
      finder_(tool, obstacle),
      all_(tool, obstacle),
      near_(tool, obstacle) {}

bool NeighbourList::complete(const Pose& X_OT, double margin, double slack) {
    // Entries that are near no longer are looked at in vain: the narrow set is renewed before its reserve is spent.
    const double left = finder_.reserve(near_, X_OT);
    if (left >= margin && near_.margin - left <= kNarrow * slack) return true;

    const double own = finder_.reserve(all_, X_OT), offered = offered_ ? finder_.reserve(*offered_, X_OT) : -1;
    const PairEntries* from = offered > own ? offered_ : &all_;
    if (std::max(own, offered) < margin) {
        from = &all_;
        near_.margin = -1;
        // Deep overlaps can fill the memory: then without slack, for this pose alone.
        if (!finder_.find(X_OT, margin + slack, all_) && !finder_.find(X_OT, margin, all_)) return false;
    }
    finder_.narrow(*from, X_OT, std::min(margin + kNarrow * slack, finder_.reserve(*from, X_OT)), near_);
    return true;
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
    finder_.forEachWithin(near_, X_OT, margin, [&](const LeafBucket& entry) {
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

NeighbourList::Found NeighbourList::appendCrossed(const Pose& X_OT, const Mat3& R_WO, double beyond, double margin,
                                                  const Crossing& by, const RowSet& rows, RowSet& crossed) const {
    const Vec3 C = X_OT * center_;
    const Vec3 shift = R_WO.transpose() * by.x.head<3>(), turn = R_WO.transpose() * by.x.tail<3>();
    const Vec6 compliance = by.stiffness.cwiseInverse();
    const float guard = 2 * floatGuard(*tool_, *obstacle_, X_OT);
    const TreeLevel& leaves = obstacle_->levels[0];
    Found out;
    int n = crossed.size(), moved = -1;
    Float8 way[3] = {};  // of the tool leaf's centre
    forEachHit(X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        if (!out.fits) return;
        if (toolLeaf != moved) {
            moved = toolLeaf;
            const Vec3 v = shift + turn.cross(c_O - C);
            for (int k = 0; k < 3; ++k) way[k] = splat(float(v[k]));
        }
        // In float first, since almost none is crossed: distance * (gap + n·way) with what rounding may take.
        const double radius = tool_->leaf(toolLeaf).r;
        const int first = bucket * SphereTree::kBranching;
        const Float8 dx = splat(float(c_O.x())) - load(&leaves.x[first]),
                     dy = splat(float(c_O.y())) - load(&leaves.y[first]),
                     dz = splat(float(c_O.z())) - load(&leaves.z[first]);
        const Float8 distance = simd::sqrt(dx * dx + dy * dy + dz * dz);
        const Float8 rough = distance * (distance - load(&leaves.r[first]) - splat(float(radius) + guard)) +
                             dx * way[0] + dy * way[1] + dz * way[2];
        const Mask maybe = mask & lessEqual(rough, splat(0.0f));
        if (!maybe && out.near) return;

        const LeafGaps l = leafGaps(c_O, radius, *obstacle_, bucket);
        mask &= lessEqual(l.gap, splat(margin)) & ~lessEqual(l.gap, splat(beyond));
        out.near = out.near || mask;
        mask &= maybe;
        if (!mask) return;
        const RowLanes lanes(l, R_WO, R_WO * (c_O - C));
        Double8 s = by.notDeeper ? max(l.gap, splat(0.0)) : l.gap;
        for (int k = 0; k < 6; ++k) s += lanes.j[k] * by.x[k];
        if (by.slack > 0) {
            Double8 length2{};
            for (int k = 0; k < 6; ++k) length2 += compliance[k] * (lanes.j[k] * lanes.j[k]);
            s += by.slack * simd::sqrt(length2);
        }
        mask &= lessEqual(s, splat(-kCrossed));
        const std::uint64_t firstId = contactId(obstacleIndex_, toolLeaf, first);
        for (Mask known = mask; known; known &= known - 1)  // a solver may leave a row it has crossed
            if (rows.find(firstId + std::uint64_t(std::countr_zero(known))) >= 0) mask &= ~(known & -known);
        out.fits = rows.size() + n + int(std::popcount(mask)) <= rows.capacity();
        if (!mask || !out.fits) return;
        lanes.store(crossed, n, l.gap, firstId, mask);
        n += std::popcount(mask);
    });
    if (out.fits) crossed.setSize(n);
    return out;
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
    return leafGap(*tool_, toolLeaf, *obstacle_, obstacleLeaf, X_OT);
}

}  // namespace touchstone
