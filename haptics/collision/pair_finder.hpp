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
/// How far a tool's leaves are from its centre. A long shaft turns about its axis with little way for any leaf.
struct LeafExtent {
    Vec3 center;
    double reach;  ///< greatest distance of a leaf's centre, mm
    Vec3 about;    ///< likewise from each axis of the tool's frame, mm

    explicit LeafExtent(const SphereTree& tool);
    /// How far a turn about the centre, on the obstacle's axes, takes any leaf of a tool that lies so at most, mm.
    double turned(const Quat& q_OT, const Vec3& turn) const {
        return std::min(reach * turn.norm(), (q_OT.conjugate() * turn).cwiseAbs().dot(about));
    }
    /// How far any leaf goes on a course at most, mm.
    double length(const Course& course) const { return course.shift.norm() + turned(course.X_OT.q, course.turn); }
};
/// How far any leaf of a tool goes from one course at most while it follows another, mm.
double deviation(const Course& from, const Course& other, const LeafExtent& extent);

/// Entries of a tool leaf and a bucket of obstacle leaves, ordered by tool leaf, then bucket: every pair of the
/// coverage. Found along a course for margin M they hold every pair with gap <= m wherever the tool deviates from it by
/// at most M - m, since a gap changes by no more than a centre moves.
struct PairEntries : Coverage {
    static constexpr int kCapacity = 1 << 18;

    PairEntries(const SphereTree& tool, const SphereTree& obstacle);

    std::vector<LeafBucket> at;
    AlignedVector<float> gap;  ///< least of the bucket along the course, exact to floatGuard()
    AlignedVector<float> sum;  ///< of the radii, least of the bucket
    int count = 0, capacity = 0;
};

/// Finds entries. Poses X_OT: tool node in the obstacle's frame, mm. Real time: all memory is taken in the constructor;
/// no lock, no throw.
class PairFinder {
  public:
    PairFinder(const SphereTree& tool, const SphereTree& obstacle);

    /// All entries, from a walk of the trees. False if there are more than memory; `out` is then complete for nothing.
    bool find(const Coverage& asked, PairEntries& out);
    /// From entries that are complete for what is asked, or from `out` itself if it is.
    void narrow(const PairEntries& from, const Coverage& asked, PairEntries& out);
    /// How much wider than asked entries of a coverage are complete, mm; negative: they are not complete.
    double reserve(const Coverage& have, const Coverage& asked) const;
    /// How far any leaf of the tool is off the entries' course at most somewhere on another, mm.
    double strayed(const Coverage& have, const Course& course) const { return deviation(have.course, course, extent_); }

    /// visit(entry) for every entry that may hold a pair that is asked for, until it returns false.
    template <class Visit>
    void forEachWithin(const PairEntries& entries, const Coverage& asked, Visit&& visit) const;

  private:
    /// Eight tool leaves in the obstacle's frame, and their ways.
    struct Placed {
        simd::Float8 at[3], r, way[3], perWay2;  ///< perWay2: 1 / |way|^2
    };
    template <bool moves>
    struct Meeting;
    struct Limit;

    void place(const Course& course, const PairEntries* of = nullptr);
    template <bool moves>
    int walk(const Coverage& asked);
    template <bool moves>
    bool find(const Coverage& asked, PairEntries& out);
    template <bool moves>
    void narrow(const PairEntries& from, const Coverage& asked, PairEntries& out);
    template <bool moves>
    void measure(PairEntries& entries) const;

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    LeafExtent extent_;
    double leastSum_;  ///< of the radii of a pair
    TreeWalk walk_;
    std::vector<LeafBucket> found_;
    AlignedVector<Placed> placed_;
    std::vector<std::int32_t> offsets_;
};

template <class Visit>
void PairFinder::forEachWithin(const PairEntries& entries, const Coverage& asked, Visit&& visit) const {
    using namespace simd;
    const Within grown = asked.within.wider(strayed(entries, asked.course) +
                                            2 * double(floatGuard(*tool_, *obstacle_, asked.course.X_OT)));
    const Float8 margin = splat(float(grown.margin)), most = splat(float(grown.most)),
                 curve = splat(curveInFloat(grown));
    // First which, then what: a branch on each would be guessed wrong too often.
    constexpr int kRun = 512;
    std::int32_t run[kRun + 8];
    for (int first = 0; first < entries.count; first += kRun) {
        const int end = std::min(first + kRun, entries.count);
        int found = 0;
        for (int i = end; i < std::min(end + kRun, entries.count); i += 16) {
            __builtin_prefetch(&entries.gap[i]);
            __builtin_prefetch(&entries.sum[i]);
            __builtin_prefetch(&entries.at[i]);
            __builtin_prefetch(&entries.at[i + 8]);
        }
        for (int i = first; i < end; i += 8) {
            const Float8 gap = load(&entries.gap[i]);
            Mask mask = lessEqual((gap - margin) * load(&entries.sum[i]), curve) & lessEqual(gap, most);
            if (i + 8 > end) mask &= (1u << (end - i)) - 1;
            compressStore(run + found, splat(i) + lanes(), mask);
            found += std::popcount(mask);
        }
        for (int i = 0; i < found; ++i)
            if (!visit(entries.at[run[i]])) return;
    }
}

}  // namespace touchstone
