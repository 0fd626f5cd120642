#include "haptics/collision/neighbor_list.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

#include "haptics/collision/clearance.hpp"
#include "haptics/collision/leaf_gaps.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {

using namespace simd;

namespace {

/// Bound on the rounding error of a predicted gap in float, as a fraction of the step's length. It must not be smaller
/// than the true error, or a crossed row is missed.
constexpr double kFloatError = 2e-6;
/// A row counts as crossed only beyond this gap, mm. The exact solver satisfies rows to about 1e-14, so that a smaller
/// value would add rows that its answer touches; a larger one lets a step enter by as much.
constexpr double kCrossed = 1e-10;
/// Rounding error of a gap in double, mm: a gap that decreases by less has not changed, and poses that differ by less
/// are the same.
constexpr double kSameGap = 1e-12;

double meanRadius(const SphereTree& tree) {
    const auto& r = tree.levels.front().r;
    return std::max(1e-9, std::accumulate(r.begin(), r.end(), 0.0) / tree.leafCount());
}

}  // namespace

NeighborList::NeighborList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex, const Vec3& center)
    : ContactList(std::make_unique<LeafPairFinder>(tool, obstacle, center)),
      tool_(&tool),
      obstacle_(&obstacle),
      meanRadii_(meanRadius(tool) + meanRadius(obstacle)),
      obstacleIndex_(obstacleIndex),
      candidates_(int(std::min<std::int64_t>(std::int64_t(tool.leafCount()) * obstacle.leafCount(), kEntryCapacity)) +
                  8) {}

/// Along a straight path of length l the distance d of two centers lies above its linearization by less than l²/2d, and
/// d is at least the sum of the radii until the leaves touch. A gap that stays above l²/(2 sum of radii) therefore has
/// a plane beyond the end of the path. A rotating leaf ends beside its straight path by the bend of its arc.
Coverage NeighborList::coverageOf(const StraightMotion& step, double margin) const {
    const double length = extent().length(step), bend = extent().reach * step.turn.squaredNorm() / 2;
    const Within onPath{bend + 2 * kCrossed, length * length / 2, std::max(margin, 2 * kCrossed)};
    if (length <= kLongStep * margin && onPath.at(meanRadii_) < kUsefulFraction * margin) return {step, onPath};
    return {step.X_OT, margin};
}

/// Calls visit(toolLeaf, c_O, bucket, mask) for every entry with a leaf within the margin, until it returns false. The
/// test is in float and may include leaves a little farther away.
template <class Visit>
void NeighborList::forEachHit(const PairEntries& entries, const Pose& X_OT, double margin, Visit&& visit) const {
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    const TreeLevel& leaves = obstacle_->levels[0];
    const Mat3 R = X_OT.R();
    int placed = -1;
    Vec3 c = Vec3::Zero();
    Float8 x{}, y{}, z{}, reach{};
    finder_->forEachWithin(entries, {X_OT, margin}, [&](const PairEntry& entry) {
        if (entry.tool != placed) {
            placed = entry.tool;
            const Sphere s = tool_->leaf(placed);
            c = R * Vec3(s.x, s.y, s.z) + X_OT.p;
            x = splat(float(c.x())), y = splat(float(c.y())), z = splat(float(c.z()));
            reach = splat(s.r + limit);
        }
        const int first = entry.obstacle * SphereTree::kBranching;
        const Float8 dx = load(&leaves.x[first]) - x, dy = load(&leaves.y[first]) - y, dz = load(&leaves.z[first]) - z;
        const Float8 sum = max(load(&leaves.r[first]) + reach, splat(0.0f));
        const Mask mask = lessEqual(sumOfProducts(dx, dx, dy, dy, dz, dz), sum * sum);
        return !mask || visit(placed, c, entry.obstacle, mask);
    });
}

namespace {

/// Rows (n, r x n) of one tool leaf and a bucket, on world axes, one lane for each row.
struct RowLanes {
    Double8 j[6];

    RowLanes(const LeafGaps& l, const Mat3& R_WO, const Vec3& r) {
        const Double8 inverse = choose(less(kZeros, l.distance), 1.0 / l.distance, kZeros);
        for (int k = 0; k < 3; ++k)
            j[k] = sumOfProducts(R_WO(k, 0), l.dx, R_WO(k, 1), l.dy, R_WO(k, 2), l.dz) * inverse;
        j[3] = sumOfProducts(r.y(), j[2], -r.z(), j[1]);
        j[4] = sumOfProducts(r.z(), j[0], -r.x(), j[2]);
        j[5] = sumOfProducts(r.x(), j[1], -r.y(), j[0]);
    }
    void store(RowSet& rows, int n, const Double8& gap, std::uint64_t firstId, Mask mask) const {
        for (int k = 0; k < 6; ++k) compressStore(rows.column(k) + n, j[k], mask);
        compressStore(rows.gap() + n, gap, mask);
        compressStore(rows.ids() + n, Long8{0, 1, 2, 3, 4, 5, 6, 7} + std::int64_t(firstId), mask);
    }
};

}  // namespace

bool NeighborList::appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows, int maxRows) const {
    const Vec3 C = X_OT * extent().center;
    maxRows = std::min(maxRows, rows.capacity());
    int n = rows.size();
    bool fits = true;
    forEachHit(narrow_, X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        const LeafGaps l = leafGaps(c_O, tool_->leaf(toolLeaf).r, *obstacle_, bucket);
        mask &= lessEqual(l.gap, splat(margin));
        fits = n + int(std::popcount(mask)) <= maxRows;
        if (!mask || !fits) return fits;
        RowLanes(l, R_WO, R_WO * (c_O - C))
            .store(rows, n, l.gap, contactId(obstacleIndex_, toolLeaf, bucket * SphereTree::kBranching), mask);
        n += std::popcount(mask);
        return true;
    });
    if (fits) rows.setSize(n);
    return fits;
}

void NeighborList::appendRow(const Pose& X_OT, const Mat3& R_WO, double margin, int toolLeaf, int obstacleLeaf,
                             RowSet& rows) const {
    const Sphere s = tool_->leaf(toolLeaf);
    const int bucket = obstacleLeaf / SphereTree::kBranching, first = bucket * SphereTree::kBranching;
    const Vec3 c_O = X_OT.R() * s.center() + X_OT.p;  // the same expression as in forEachHit(), for equal bits
    const LeafGaps l = leafGaps(c_O, s.r, *obstacle_, bucket);
    if (!(l.gap[obstacleLeaf - first] <= margin) || rows.size() == rows.capacity()) return;
    RowLanes(l, R_WO, R_WO * (c_O - X_OT * extent().center))
        .store(rows, rows.size(), l.gap, contactId(obstacleIndex_, toolLeaf, first), 1u << (obstacleLeaf - first));
    rows.setSize(rows.size() + 1);
}

bool NeighborList::hasCandidatesFor(const Coverage& asked) const {
    return candidateCoverage_.motion.X_OT == asked.motion.X_OT &&
           finder_->reserve(candidateCoverage_, asked) >= -kSameGap;
}

/// Collects the rows that a step may cross in candidates_. Returns false if they do not fit.
bool NeighborList::collectCandidates(const StraightMotion& step, double margin) {
    const Pose& X_OT = step.X_OT;
    Coverage asked = coverageOf(step, margin);
    if (asked.within.margin >= margin || !isComplete(asked)) asked = {X_OT, margin};
    // Pairs beyond the margin need no candidates: the margin is the step's length, beyond which it crosses nothing, or
    // the settings' margin.
    if (hasCandidatesFor(asked)) return true;
    candidateCoverage_ = asked;
    candidates_.clear();
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    const TreeLevel& leaves = obstacle_->levels[0];
    const Mat3 R = X_OT.R();
    int placed = -1;
    float c[3] = {}, r[3] = {}, radius = 0;
    bool fits = true;
    finder_->forEachWithin(narrow_, asked, [&](const PairEntry& entry) {
        if (entry.tool != placed) {
            placed = entry.tool;
            const Sphere s = tool_->leaf(placed);
            const Vec3 arm = R * (s.center() - extent().center), at = R * s.center() + X_OT.p;
            for (int k = 0; k < 3; ++k) c[k] = float(at[k]), r[k] = float(arm[k]);
            radius = s.r;
        }
        fits = !candidates_.isFull();
        if (fits) candidates_.append(placed, c, radius, r, leaves, entry.obstacle * SphereTree::kBranching, limit);
        return fits;
    });
    if (!fits) candidateCoverage_.within = {};
    return fits;
}

/// Bound on the error of a predicted gap of candidates_, mm.
float NeighborList::candidateError(const StraightMotion& step) const {
    return 4 * floatGuard(*tool_, *obstacle_, step.X_OT) + float(kFloatError * extent().length(step));
}

Crossed NeighborList::appendCrossed(const Pose& X_OT, const Pose&, const Mat3& R_WO, double margin, const Crossing& by,
                                    RowSet& rows, RowSet& crossed) {
    const StraightMotion step{X_OT, R_WO.transpose() * by.x.head<3>(), R_WO.transpose() * by.x.tail<3>()};
    if (!collectCandidates(step, margin)) return Crossed::Overflow;
    const Vec6 compliance = by.stiffness.cwiseInverse();
    const float worst = candidates_.measure(step.shift, step.turn, by.slack, compliance.head<3>().minCoeff(),
                                            compliance.tail<3>().minCoeff(), by.share);
    const float error = candidateError(step);

    const int before = crossed.size();
    bool fits = true;
    const auto check = [&](int i) {
        const int t = candidates_.toolLeaf(i), o = candidates_.obstacleLeaf(i), n = crossed.size();
        if (rows.find(contactId(obstacleIndex_, t, o)) >= 0) return true;  // the solver has this row and may violate it
        fits = rows.size() + n < rows.capacity();
        if (!fits) return false;
        appendRow(X_OT, R_WO, margin, t, o, crossed);
        if (crossed.size() == n) return true;
        const Vec6 j = crossed.row(n);
        const double g = std::max(crossed.gap()[n], by.share * crossed.gap()[n]);
        const double length = std::sqrt(j.cwiseAbs2().dot(compliance));
        if (g + j.dot(by.x) + by.slack * length > -kCrossed) crossed.setSize(n);
        return true;
    };
    // The rows that are crossed furthest come first, see kDeepestFraction. An infinite crossing is replaced by the
    // largest float, so that multiplying it by the fraction comes to an end.
    const float deepest = std::max(worst, std::numeric_limits<float>::lowest());
    for (float limit = kDeepestFraction * deepest; fits && worst <= error; limit *= kDeepestFraction) {
        const bool last = limit > -error;
        candidates_.forEachBelow(last ? error : limit, check);
        if (last || crossed.size() > before) break;
    }
    if (!fits) crossed.setSize(before);
    return !fits ? Crossed::Overflow : crossed.size() > before ? Crossed::Rows : Crossed::Nothing;
}

int NeighborList::appendNearestRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows) const {
    struct {
        int toolLeaf = -1, obstacleLeaf = 0;
        Vec3 c_O, offset;
        double gap = 0, distance = 0;
    } best;
    int pairs = 0;
    const auto flush = [&] {
        if (best.toolLeaf < 0 || rows.size() == rows.capacity()) return;
        const Vec3 n = best.distance > 0 ? Vec3(R_WO * best.offset / best.distance) : Vec3(Vec3::Zero());
        const Vec3 r = R_WO * (best.c_O - X_OT * extent().center);
        Vec6 j;
        j << n, r.cross(n);
        rows.push(j, best.gap, contactId(obstacleIndex_, best.toolLeaf, best.obstacleLeaf));
    };
    forEachHit(narrow_, X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
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
        return true;
    });
    flush();
    return pairs;
}

NeighborList::Overlap NeighborList::remeasure(const Pose& before, const Pose& after, double tolerance) {
    Overlap overlap;
    const Mat3 R = before.R(), R_after = after.R();
    const auto measure = [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        const Sphere s = tool_->leaf(toolLeaf);
        const LeafGaps now = leafGaps(c_O, s.r, *obstacle_, bucket);
        mask &= lessEqual(now.gap, splat(0.0));
        if (!mask) return true;
        const LeafGaps then = leafGaps(R * Vec3(s.x, s.y, s.z) + before.p, s.r, *obstacle_, bucket);
        for (; mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            overlap.depth = std::max(overlap.depth, -now.gap[i]);
            overlap.deeper = overlap.deeper || now.gap[i] < std::min(then.gap[i] - kSameGap, -tolerance);
        }
        return !overlap.deeper;
    };
    const StraightMotion step = StraightMotion::between(before, after, extent().center);
    const double length = extent().length(step);
    const bool known = hasCandidatesFor({before, length}) || hasCandidatesFor(coverageOf(step, length));
    if (!known || candidates_.leastDistance() < length) {
        forEachHit(narrow_, after, 0, measure);
        return overlap;
    }
    // A distance is convex along a straight path, so no gap falls below the one that its row predicts, except by the
    // bend of an arc. Only candidates with a small predicted gap need to be measured.
    candidates_.measure(step.shift, step.turn, 0, 0, 0, 1);
    const double bend = extent().reach * step.turn.squaredNorm() / 2;
    candidates_.forEachBelow(float(bend) + candidateError(step), [&](int i) {
        const Sphere s = tool_->leaf(candidates_.toolLeaf(i));
        const int bucket = candidates_.obstacleLeaf(i) / SphereTree::kBranching;
        return measure(candidates_.toolLeaf(i), R_after * Vec3(s.x, s.y, s.z) + after.p, bucket,
                       1u << candidates_.obstacleLeaf(i) % SphereTree::kBranching);
    });
    return overlap;
}

ContactList::Nearest NeighborList::nearest(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const {
    const Sphere tool = tool_->leaf(toolLeaf), obstacle = obstacle_->leaf(obstacleLeaf);
    const Vec3 center = X_OT * tool.center(), normal = (center - obstacle.center()).normalized();
    return {center - double(tool.r) * normal, normal, leafGap(tool, obstacle, X_OT)};
}

double NeighborList::freeShare(const StraightMotion& motion, double atMost) {
    for (double share = atMost; share > kLeastShare * atMost; share /= 2) {
        beginFlight();
        const double free =
            touchstone::freeShare(*tool_, *obstacle_, motion, extent().center, extent().reach, share, budget_);
        if (free >= 0) return free;
    }
    return 0;
}

}  // namespace touchstone
