#pragma once
// Which leaves may meet for a while: one walk of two trees, kept as entries with their gaps.
#include <cstdint>
#include <vector>

#include "haptics/collision/tree_walk.hpp"
#include "haptics/math/simd.hpp"

namespace touchstone {

/// How far any leaf of a tool travels at most between two poses, mm: |δp| + ρ|δθ| about `center`, whose leaves reach
/// `reach`.
double travel(const Pose& from, const Pose& to, const Vec3& center, double reach);

/// Entries of a tool leaf and a bucket of obstacle leaves, ordered by tool leaf, then bucket. Those found at one pose
/// for margin M hold every pair with gap <= m at any pose within travel M - m of it, since a gap changes by no more
/// than the travel.
struct PairEntries {
    static constexpr int kCapacity = 1 << 18;

    PairEntries(const SphereTree& tool, const SphereTree& obstacle);

    std::vector<LeafBucket> at;
    AlignedVector<float> gap;  ///< least of the bucket at the pose, exact to floatGuard()
    int count = 0, capacity = 0;
    Pose X_OT;
    double margin = -1;  ///< mm; negative: complete for nothing
};

/// Finds entries. Poses X_OT: tool node in the obstacle's frame, mm. Real time: all memory is taken in the constructor;
/// no lock, no throw.
class PairFinder {
  public:
    PairFinder(const SphereTree& tool, const SphereTree& obstacle);

    /// All entries of a margin, from a walk of the trees. False if there are more than memory; `out` is then complete
    /// for nothing.
    bool find(const Pose& X_OT, double margin, PairEntries& out);
    /// Those of a narrower margin, from entries that are complete for it.
    void narrow(const PairEntries& from, const Pose& X_OT, double margin, PairEntries& out);
    /// How much margin entries are complete for at a pose, mm; negative: none.
    double reserve(const PairEntries& entries, const Pose& X_OT) const;

    /// visit(entry) for every entry that may hold a pair with gap <= margin at X_OT.
    template <class Visit>
    void forEachWithin(const PairEntries& entries, const Pose& X_OT, double margin, Visit&& visit) const;

  private:
    void place(const Pose& X_OT);
    void keep(LeafBucket entry, float limit, PairEntries& out) const;

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    Vec3 center_;
    double reach_;
    TreeWalk walk_;
    PairEntries found_;
    AlignedVector<float> placed_[4];  ///< x, y, z, r of each tool leaf, in the obstacle's frame
    std::vector<std::int32_t> offsets_;
};

template <class Visit>
void PairFinder::forEachWithin(const PairEntries& entries, const Pose& X_OT, double margin, Visit&& visit) const {
    using namespace simd;
    const double grown = margin + travel(entries.X_OT, X_OT, center_, reach_);
    const Float8 limit = splat(float(grown) + 2 * floatGuard(*tool_, *obstacle_, X_OT));
    for (int i = 0; i < entries.count; i += 8) {
        Mask mask = lessEqual(load(&entries.gap[i]), limit);
        if (i + 8 > entries.count) mask &= (1u << (entries.count - i)) - 1;
        for (; mask; mask &= mask - 1) visit(entries.at[i + std::countr_zero(mask)]);
    }
}

}  // namespace touchstone
