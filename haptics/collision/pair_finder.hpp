#pragma once
// The pairs of leaves or features that may touch in the next ticks: the result of one search, kept as entries with
// their gaps.
#include <cstdint>
#include <vector>

#include "haptics/collision/search_budget.hpp"
#include "haptics/collision/tree_walk.hpp"
#include "haptics/math/simd.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {

/// Upper bound on the travel of any leaf between two poses, mm: |δp| + ρ|δθ| about `center`, with ρ = `reach` the
/// greatest distance of a leaf's center from it.
double travel(const Pose& from, const Pose& to, const Vec3& center, double reach);
/// Distances of a tool's points (the centers of its leaves, or the vertices of its mesh) from its center and axes. They
/// bound the travel of a rotation: when a long shaft turns about its axis, no point travels far.
struct Extent {
    Vec3 center = Vec3::Zero();
    double reach = 0;           ///< greatest distance of a point from `center`, mm
    Vec3 about = Vec3::Zero();  ///< greatest distance from each axis of the tool's frame through `center`, mm

    explicit Extent(const Vec3& center_) : center(center_) {}
    Extent(const SphereTree& tool, const Vec3& center);
    explicit Extent(const SphereTree& tool) : Extent(tool, tool.center()) {}
    void add(const Vec3& point);
    /// Upper bound on the travel of any point for a rotation about the center, mm. `turn` is on the obstacle's axes;
    /// q_OT is the tool's orientation in its frame.
    double turned(const Quat& q_OT, const Vec3& turn) const {
        return std::min(reach * turn.norm(), (q_OT.conjugate() * turn).cwiseAbs().dot(about));
    }
    /// Upper bound on the travel of any point along a motion, mm.
    double length(const StraightMotion& motion) const {
        return motion.shift.norm() + turned(motion.X_OT.q, motion.turn);
    }
};
/// Upper bound on the distance of any point from motion `from` while the tool follows motion `other`, mm.
double deviation(const StraightMotion& from, const StraightMotion& other, const Extent& extent);

/// Directions along which eight pairs of features are apart. One feature of a pair is not beyond `offset` along n, and
/// a and b are points of the other between which all of it lies, each in the frame of its own part, from its center. So
/// their distance is at least min(n·Xa, n·Xb) - offset at any pose X of the second part in the frame of the first.
struct Separation8 {
    simd::Float8 n[3], offset, a[3], b[3];
};

/// Separations of pairs that follow each other, number by number.
class Separations {
  public:
    /// Room for those of n pairs; n is a multiple of 8.
    void resize(int n);
    int capacity() const { return capacity_; }
    /// Those of eight pairs from the one at `first` on.
    TOUCHSTONE_INLINE Separation8 eight(int first) const {
        Separation8 s;
        forEach(s, [&](int k, simd::Float8& number) { number = simd::load(&numbers_[at(k, first)]); });
        return s;
    }
    /// Writes the lanes of the mask to consecutive places from `first` on, as far as there is room. What is behind them
    /// is overwritten.
    TOUCHSTONE_INLINE void write(int first, const Separation8& s, simd::Mask lanes) {
        if (first >= capacity_) return;
        forEach(
            s, [&](int k, const simd::Float8& number) { simd::compressStore(&numbers_[at(k, first)], number, lanes); });
    }

  private:
    static constexpr int kNumbers = 10;

    template <class S, class Visit>
    TOUCHSTONE_INLINE static void forEach(S& s, Visit&& visit) {
        for (int k = 0; k < 3; ++k) visit(k, s.n[k]), visit(3 + k, s.a[k]), visit(6 + k, s.b[k]);
        visit(9, s.offset);
    }
    std::size_t at(int k, int i) const { return std::size_t(k) * stride_ + std::size_t(i); }

    AlignedVector<float> numbers_;
    std::size_t stride_ = 0;
    int capacity_ = 0;
};

/// Entries of a tool leaf and a bucket of obstacle leaves, ordered by tool leaf, then bucket; or of two features. They
/// hold every pair of the coverage. Entries found along a motion for margin M hold every pair with gap <= m wherever
/// the tool deviates from the motion by at most M - m, since no gap changes by more than a point moves.
struct PairEntries : Coverage {
    explicit PairEntries(std::int64_t possible);  ///< possible: number of all entries of the two parts
    PairEntries(const SphereTree& tool, const SphereTree& obstacle);

    AlignedVector<PairEntry> at;
    AlignedVector<float> gap;  ///< smallest gap of the entry along the motion, mm, to the finder's guard(); of features
                               ///< a lower bound
    AlignedVector<float> sum;  ///< smallest sum of the radii in the entry, mm; 1 for features
    Separations apart;         ///< of the first entries; none for leaves
    int count = 0, capacity = 0;
    bool ofFeatures = false;
};

/// Finds the entries of two parts, by the geometry in which they touch. Poses X_OT: tool node in the obstacle's frame,
/// mm. Real time: the constructors take all memory; no lock, no throw.
class PairFinder {
  public:
    virtual ~PairFinder() = default;

    /// Searches count their work there and end with its part; null: no bound. The caller keeps ownership.
    void use(SearchBudget* budget) { budget_ = budget; }
    /// Finds all entries of a coverage. Returns false if they exceed the capacity, or the search its budget; `out` is
    /// then complete for no coverage.
    bool find(const Coverage& asked, PairEntries& out);
    /// Selects the entries of a coverage from entries that are complete for it; `from` may be `out` itself. With
    /// `renew`, pairs of features whose separation no longer keeps them apart are measured again, which pays for
    /// entries that were found along a long motion.
    void narrow(const PairEntries& from, const Coverage& asked, PairEntries& out, bool renew = false);
    /// Memory for the entries of these parts.
    virtual PairEntries entries() const = 0;
    virtual bool ofFeatures() const { return false; }

    /// Reserve of a search, mm: how much further than asked it reaches, where the settings ask for `setting`.
    virtual double slack(double setting) const { return setting; }

    const Extent& extent() const { return extent_; }
    /// The margin by which entries that cover `have` exceed what is asked, mm; negative if they are not complete for
    /// it.
    double reserve(const Coverage& have, const Coverage& asked) const {
        return have.within.margin < 0 ? -1 : reserve(have, asked, deviationFrom(have, asked.motion));
    }
    /// The same if the deviation of the two motions is known.
    double reserve(const Coverage& have, const Coverage& asked, double deviation) const;
    /// Upper bound on the distance of any point from the motion of `have` while the tool follows `motion`, mm.
    double deviationFrom(const Coverage& have, const StraightMotion& motion) const {
        return have.motion == motion ? 0 : deviation(have.motion, motion, extent_);
    }
    /// Bound on the error of a gap in float at this pose, mm.
    virtual float guard(const Pose& X_OT) const = 0;

    /// Calls visit(entry) for every entry that may hold a pair of the coverage `asked`, until it returns false.
    template <class Visit>
    void forEachWithin(const PairEntries& entries, const Coverage& asked, Visit&& visit) const;

  protected:
    PairFinder(const Extent& extent, double leastSum) : extent_(extent), leastSum_(leastSum) {}
    virtual bool search(const Coverage& asked, PairEntries& out) = 0;
    virtual void select(const PairEntries& from, const Coverage& asked, PairEntries& out, bool renew) = 0;

    /// Counts tests; whether the search may go on.
    bool spend(std::int64_t tests) const { return !budget_ || budget_->spend(tests); }
    /// Whether the search in progress is within its budget.
    bool fits() const { return !budget_ || budget_->fits(); }

    Extent extent_;
    SearchBudget* budget_ = nullptr;

  private:
    double leastSum_;  ///< smallest sum of the radii of a pair, mm
};

/// Finds the entries of two sphere trees.
class LeafPairFinder final : public PairFinder {
  public:
    /// `center`: the point about which the tool turns, in its own frame, mm.
    LeafPairFinder(const SphereTree& tool, const SphereTree& obstacle, const Vec3& center);
    LeafPairFinder(const SphereTree& tool, const SphereTree& obstacle)
        : LeafPairFinder(tool, obstacle, tool.center()) {}

    PairEntries entries() const override { return {*tool_, *obstacle_}; }
    float guard(const Pose& X_OT) const override { return floatGuard(*tool_, *obstacle_, X_OT); }

  private:
    /// Eight tool leaves in the obstacle's frame, with their paths along the motion.
    struct Placed {
        simd::Float8 at[3], r, path[3], perPath2;  ///< perPath2: 1 / |path|²
    };
    template <bool moves>
    struct Meeting;
    struct Limit;

    bool search(const Coverage& asked, PairEntries& out) override;
    void select(const PairEntries& from, const Coverage& asked, PairEntries& out, bool renew) override;
    void place(const StraightMotion& motion, const PairEntries* of = nullptr);
    template <bool moves>
    int walk(const Coverage& asked);
    template <bool moves>
    bool searchAlong(const Coverage& asked, PairEntries& out);
    template <bool moves>
    void selectAlong(const PairEntries& from, const Coverage& asked, PairEntries& out);
    template <bool moves>
    void measure(PairEntries& entries) const;

    const SphereTree* tool_;
    const SphereTree* obstacle_;
    TreeWalk walk_;
    AlignedVector<PairEntry> found_;       ///< what a walk found, before it is sorted
    AlignedVector<Placed> placed_;         ///< the tool leaves on the motion in use
    AlignedVector<std::int32_t> offsets_;  ///< of the counting sort, by tool leaf
};

template <class Visit>
void PairFinder::forEachWithin(const PairEntries& entries, const Coverage& asked, Visit&& visit) const {
    using namespace simd;
    const Within grown =
        asked.within.wider(deviationFrom(entries, asked.motion) + 2 * double(guard(asked.motion.X_OT)));
    const Float8 margin = splat(float(grown.margin)), most = splat(float(grown.most)),
                 curve = splat(curveInFloat(grown));
    // The indices of the hits of a run are collected before they are visited, since a branch on each entry would be
    // mispredicted too often. A run of 512 indices takes 2 KiB; the entries of the next run are prefetched meanwhile.
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
