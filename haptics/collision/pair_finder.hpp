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
/// How far any of its leaves goes from one course at most while it follows another, mm.
double deviation(const Course& from, const Course& other, const Vec3& center, double reach);

/// Entries of a tool leaf and a bucket of obstacle leaves, ordered by tool leaf, then bucket. Those found along a
/// course for margin M hold every pair with gap <= m wherever the tool deviates from it by at most M - m, since a gap
/// changes by no more than a centre moves.
struct PairEntries {
    static constexpr int kCapacity = 1 << 18;

    PairEntries(const SphereTree& tool, const SphereTree& obstacle);

    std::vector<LeafBucket> at;
    AlignedVector<float> gap;  ///< least of the bucket along the course, exact to floatGuard()
    int count = 0, capacity = 0;
    Course course;
    double margin = -1;  ///< mm; negative: complete for nothing
};

/// Finds entries. Poses X_OT: tool node in the obstacle's frame, mm. Real time: all memory is taken in the constructor;
/// no lock, no throw.
class PairFinder {
  public:
    PairFinder(const SphereTree& tool, const SphereTree& obstacle);

    /// All entries of a margin, from a walk of the trees. False if there are more than memory; `out` is then complete
    /// for nothing.
    bool find(const Course& course, double margin, PairEntries& out);
    /// Those of a narrower margin or a shorter course, from entries that are complete for it.
    void narrow(const PairEntries& from, const Course& course, double margin, PairEntries& out);
    /// How much margin entries are complete for on all of a course, mm; negative: none.
    double reserve(const PairEntries& entries, const Course& course) const;

    /// visit(entry) for every entry that may hold a pair with gap <= margin on the course, until it returns false.
    template <class Visit>
    void forEachWithin(const PairEntries& entries, const Course& course, double margin, Visit&& visit) const;

  private:
    void place(const Course& course);
    template <bool moves>
    void keep(LeafBucket entry, float limit, PairEntries& out) const;
    template <bool moves>
    bool walk(const Course& course, double margin);

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    Vec3 center_;
    double reach_;
    TreeWalk walk_;
    PairEntries found_;
    enum { kX, kY, kZ, kR, kWayX, kWayY, kWayZ, kPerWay2, kColumns };
    AlignedVector<float> placed_[kColumns];  ///< of each tool leaf, in the obstacle's frame; kPerWay2: 1 / |way|^2
    std::vector<std::int32_t> offsets_;
};

template <class Visit>
void PairFinder::forEachWithin(const PairEntries& entries, const Course& course, double margin, Visit&& visit) const {
    using namespace simd;
    const double grown = margin + deviation(entries.course, course, center_, reach_);
    const Float8 limit = splat(float(grown) + 2 * floatGuard(*tool_, *obstacle_, course.X_OT));
    for (int i = 0; i < entries.count; i += 8) {
        Mask mask = lessEqual(load(&entries.gap[i]), limit);
        if (i + 8 > entries.count) mask &= (1u << (entries.count - i)) - 1;
        for (; mask; mask &= mask - 1)
            if (!visit(entries.at[i + std::countr_zero(mask)])) return;
    }
}

}  // namespace touchstone
