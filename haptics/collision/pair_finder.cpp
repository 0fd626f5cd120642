#include "haptics/collision/pair_finder.hpp"

#include <algorithm>
#include <numeric>

namespace touchstone {

using namespace simd;

double travel(const Pose& from, const Pose& to, const Vec3& center, double reach) {
    return (to * center - from * center).norm() + reach * logRotation(to.q * from.q.conjugate()).norm();
}

PairEntries::PairEntries(const SphereTree& tool, const SphereTree& obstacle) {
    const std::int64_t possible = std::int64_t(tool.leafCount()) * obstacle.levels[1].count;
    capacity = int(std::min<std::int64_t>(possible, kCapacity));
    at.resize(std::size_t(capacity) + 8);
    gap.resize(std::size_t(capacity) + 8);
}

PairFinder::PairFinder(const SphereTree& tool, const SphereTree& obstacle)
    : tool_(&tool),
      obstacle_(&obstacle),
      center_(tool.center()),
      reach_(tool.reach()),
      walk_(tool, obstacle),
      found_(tool, obstacle),
      offsets_(std::size_t(tool.leafCount()) + 1) {
    for (auto& column : placed_) column.resize(std::size_t(paddedToEight(tool.leafCount())));
}

double PairFinder::reserve(const PairEntries& entries, const Pose& X_OT) const {
    return entries.margin < 0 ? -1 : entries.margin - travel(entries.X_OT, X_OT, center_, reach_);
}

void PairFinder::place(const Pose& X_OT) {
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
inline void PairFinder::keep(LeafBucket entry, float limit, PairEntries& out) const {
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

bool PairFinder::find(const Pose& X_OT, double margin, PairEntries& out) {
    out.margin = -1;
    place(X_OT);
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    // The walk tested the buckets' boxes; the leaves themselves drop most of what it found.
    found_.count = 0;
    bool full = false;
    walk_.run(X_OT, margin, [&](const LeafBucket* entries, int count) {
        for (int i = 0; i < count && !full; ++i) {
            keep(entries[i], limit, found_);
            full = found_.count > found_.capacity;
        }
    });
    if (full) return false;

    // Stable counting sort by tool leaf; its buckets are ascending already.
    std::fill(offsets_.begin(), offsets_.end(), 0);
    for (int i = 0; i < found_.count; ++i) ++offsets_[found_.at[i].toolLeaf];
    std::exclusive_scan(offsets_.begin(), offsets_.end(), offsets_.begin(), 0);
    for (int i = 0; i < found_.count; ++i) {
        const int to = offsets_[found_.at[i].toolLeaf]++;
        out.at[to] = found_.at[i];
        out.gap[to] = found_.gap[i];
    }
    out.count = found_.count;
    out.X_OT = X_OT;
    out.margin = margin;
    return true;
}

void PairFinder::narrow(const PairEntries& from, const Pose& X_OT, double margin, PairEntries& out) {
    place(X_OT);
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    out.count = 0;
    forEachWithin(from, X_OT, margin, [&](const LeafBucket& entry) { keep(entry, limit, out); });
    out.X_OT = X_OT;
    out.margin = margin;
}

}  // namespace touchstone
