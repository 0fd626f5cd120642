#include "haptics/collision/neighbor_list.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

#include "haptics/collision/leaf_gaps.hpp"

namespace touchstone {

using namespace simd;

namespace {

constexpr double kNarrow = 0.12;                    // of the slack: how much further the narrow set reaches
constexpr int kHandful = 64;                        // entries: not worth to be narrowed
constexpr double kFew = 0.7;                        // of the pairs' margin: what pays to ask for along a course
constexpr double kWide = 3;                         // times the narrow reserve: too much to look at every tick
constexpr double kLongWay = 2;                      // times the margin: and more is
constexpr double kLonger = 2;                       // curve that is found beyond what is asked for
constexpr double kWalkTicks = 8, kNarrowTicks = 2;  // that a walk and the narrow set look ahead,
constexpr double kShortest = 0.01, kLongest = 2;    // if that is longer than the one, mm, and up to the other
constexpr float kMost = 0.5f;                       // of the deepest crossing: rows crossed that far are taken at once
constexpr double kFloatError = 2e-6;  // of a step's length: what is left of a gap may be off by that in float
constexpr int kFarRows = 1 << 18;
constexpr double kCrossed = 1e-10;   // mm
constexpr double kRounding = 1e-12;  // mm: a gap that falls by less has not fallen, poses that near are one

/// For a step that is.
Within longer(Within within) {
    within.curve *= kLonger;
    return within;
}

double meanRadius(const SphereTree& tree) {
    const auto& r = tree.levels.front().r;
    return std::max(1e-9, std::accumulate(r.begin(), r.end(), 0.0) / tree.leafCount());
}

}  // namespace

NeighborList::NeighborList(const SphereTree& tool, const SphereTree& obstacle, int obstacleIndex)
    : tool_(&tool),
      obstacle_(&obstacle),
      extent_(tool),
      meanSum_(meanRadius(tool) + meanRadius(obstacle)),
      obstacleIndex_(obstacleIndex),
      finder_(tool, obstacle),
      all_(tool, obstacle),
      near_(tool, obstacle),
      far_(int(std::min<std::int64_t>(std::int64_t(tool.leafCount()) * obstacle.leafCount(), kFarRows)) + 8) {}

bool NeighborList::complete(const Coverage& asked, double slack) {
    const Course& course = asked.course;
    // Entries that are near no longer are looked at in vain: the narrow set is renewed before its reserve is spent.
    const double narrow = kNarrow * slack;
    const double left = finder_.reserve(near_, asked);
    const bool serves = near_.count <= kHandful || (left <= kWide * narrow && finder_.strayed(near_, course) <= narrow);
    if (left >= 0 && serves) return true;

    const double own = finder_.reserve(all_, asked), offered = offered_ ? finder_.reserve(*offered_, asked) : -1;
    const PairEntries* from = left >= narrow ? &near_ : offered > own ? offered_ : &all_;
    if (!(left - narrow >= 0 || own >= 0 || offered >= 0)) {
        from = &all_;
        near_.within = {};
        // Where others find entries, too, theirs will soon serve: little is enough till then.
        const double spare = offered_ ? 2 * narrow : slack, ticks = offered_ ? kNarrowTicks : kWalkTicks;
        // Where the tool goes slowly, also for steps as long as a tick.
        Within within = longer(asked.within);
        if (const double tick = extent_.length({course.X_OT, shift_, turn_}); tick <= slack)
            within = {within.margin, std::max(within.curve, tick * tick), std::max(within.most, tick)};
        // Deep overlaps can fill the memory: then without slack, for this course alone.
        if (!finder_.find({ahead(course, ticks, spare), within.wider(spare)}, all_) && !finder_.find(asked, all_))
            return false;
    }
    // Looking ahead pays while the tool keeps to its course, and where the next tick need not find anew in any case.
    Coverage next{ahead(course, kNarrowTicks, narrow), longer(asked.within)};
    if (finder_.strayed(*from, next.course) > narrow || extent_.length(next.course) > kNarrowTicks * slack)
        next.course = course;
    if (finder_.reserve(*from, next) < 0) next = asked;
    next.within = next.within.wider(std::min(narrow, finder_.reserve(*from, next)));
    if (from->count <= kHandful) next = *from;
    finder_.narrow(*from, next, near_);
    return true;
}

/// What is expected of some ticks, as far as it is worth while to look ahead, if the course lies within half the slack
/// of that; else the course itself.
Course NeighborList::ahead(const Course& course, double ticks, double slack) const {
    const Course tick{course.X_OT, shift_, turn_};
    const double length = extent_.length(tick);
    if (length * ticks < kShortest) return course;
    const Course way = tick.times(std::min(ticks, kLongest / length));
    return deviation(way, course, extent_) <= slack / 2 ? way : course;
}

/// A distance of centres curves upwards by less than the square of their way over itself, and is no less than the sum
/// of radii before they touch: a gap that stays above half of that has a plane that lies behind the end of the way.
/// What turns ends beside its way by the bend of an arc.
Coverage NeighborList::crossing(const Course& step, double margin) const {
    const double length = extent_.length(step), bend = extent_.reach * step.turn.squaredNorm() / 2;
    const Within onWay{bend + 2 * kCrossed, length * length / 2, std::max(margin, 2 * kCrossed)};
    // Long ways differ too much from each other to look along each.
    if (length <= kLongWay * margin && onWay.at(meanSum_) < kFew * margin) return {step, onWay};
    return {step.X_OT, margin};
}

/// visit(toolLeaf, c_O, bucket, mask) for every entry with a leaf within margin, by a float test that may hit a little
/// too much, until it returns false.
template <class Visit>
void NeighborList::forEachHit(const PairEntries& entries, const Pose& X_OT, double margin, Visit&& visit) const {
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    const TreeLevel& leaves = obstacle_->levels[0];
    const Mat3 R = X_OT.R();
    int placed = -1;
    Vec3 c = Vec3::Zero();
    Float8 x{}, y{}, z{}, reach{};
    finder_.forEachWithin(entries, {X_OT, margin}, [&](const LeafBucket& entry) {
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
        const Mask mask = lessEqual(dx * dx + dy * dy + dz * dz, sum * sum);
        return !mask || visit(placed, c, entry.bucket, mask);
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

bool NeighborList::appendRows(const Pose& X_OT, const Mat3& R_WO, double margin, RowSet& rows, int most) const {
    const Vec3 C = X_OT * extent_.center;
    most = std::min(most, rows.capacity());
    int n = rows.size();
    bool fits = true;
    forEachHit(near_, X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        const LeafGaps l = leafGaps(c_O, tool_->leaf(toolLeaf).r, *obstacle_, bucket);
        mask &= lessEqual(l.gap, splat(margin));
        fits = n + int(std::popcount(mask)) <= most;
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
    const Vec3 c_O = X_OT.R() * s.center() + X_OT.p;  // to the last bit as the others have it
    const LeafGaps l = leafGaps(c_O, s.r, *obstacle_, bucket);
    if (!(l.gap[obstacleLeaf - first] <= margin) || rows.size() == rows.capacity()) return;
    RowLanes(l, R_WO, R_WO * (c_O - X_OT * extent_.center))
        .store(rows, rows.size(), l.gap, contactId(obstacleIndex_, toolLeaf, first), 1u << (obstacleLeaf - first));
    rows.setSize(rows.size() + 1);
}

bool NeighborList::farHas(const Coverage& asked) const {
    return farHas_.course.X_OT == asked.course.X_OT && finder_.reserve(farHas_, asked) >= -kRounding;
}

/// The rows that a step may cross, in far_. False if they do not fit.
bool NeighborList::findFar(const Course& step, double margin) {
    const Pose& X_OT = step.X_OT;
    Coverage asked = crossing(step, margin);
    if (asked.within.margin >= margin || !isComplete(asked)) asked = {X_OT, margin};
    // Rows of pairs further than the margin were not crossed: the margin is the step's length, or the greatest there
    // is.
    if (farHas(asked)) return true;
    farHas_ = asked;
    far_.clear();
    const float limit = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    const TreeLevel& leaves = obstacle_->levels[0];
    const Mat3 R = X_OT.R();
    int placed = -1;
    float c[3] = {}, r[3] = {}, radius = 0;
    bool fits = true;
    finder_.forEachWithin(near_, asked, [&](const LeafBucket& entry) {
        if (entry.toolLeaf != placed) {
            placed = entry.toolLeaf;
            const Sphere s = tool_->leaf(placed);
            const Vec3 arm = R * (s.center() - extent_.center), at = R * s.center() + X_OT.p;
            for (int k = 0; k < 3; ++k) c[k] = float(at[k]), r[k] = float(arm[k]);
            radius = s.r;
        }
        fits = !far_.isFull();
        if (fits) far_.append(placed, c, radius, r, leaves, entry.bucket * SphereTree::kBranching, limit);
        return fits;
    });
    if (!fits) farHas_.within = {};
    return fits;
}

/// Bound on the error of what far_ says is left of a gap.
float NeighborList::farError(const Course& step) const {
    return 4 * floatGuard(*tool_, *obstacle_, step.X_OT) + float(kFloatError * extent_.length(step));
}

bool NeighborList::appendCrossed(const Pose& X_OT, const Mat3& R_WO, double margin, const Crossing& by,
                                 const RowSet& rows, RowSet& crossed) {
    const Course step{X_OT, R_WO.transpose() * by.x.head<3>(), R_WO.transpose() * by.x.tail<3>()};
    if (!findFar(step, margin)) return false;
    const Vec6 compliance = by.stiffness.cwiseInverse();
    const float worst = far_.measure(step.shift, step.turn, by.slack, compliance.head<3>().minCoeff(),
                                     compliance.tail<3>().minCoeff(), by.share);
    const float error = farError(step);

    const int before = crossed.size();
    bool fits = true;
    const auto check = [&](int i) {
        const int t = far_.toolLeaf(i), o = far_.obstacleLeaf(i), n = crossed.size();
        if (rows.find(contactId(obstacleIndex_, t, o)) >= 0) return true;  // a solver may leave a row it has crossed
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
    // The most crossed ones first: what they leave of the step crosses few of the others. A crossing that no float
    // holds counts as the largest, so that halving it ends.
    const float deepest = std::max(worst, std::numeric_limits<float>::lowest());
    for (float limit = kMost * deepest; fits && worst <= error; limit *= kMost) {
        const bool last = limit > -error;
        far_.forEachBelow(last ? error : limit, check);
        if (last || crossed.size() > before) break;
    }
    if (!fits) crossed.setSize(before);
    return fits;
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
        const Vec3 r = R_WO * (best.c_O - X_OT * extent_.center);
        Vec6 j;
        j << n, r.cross(n);
        rows.push(j, best.gap, contactId(obstacleIndex_, best.toolLeaf, best.obstacleLeaf));
    };
    forEachHit(near_, X_OT, margin, [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
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

std::optional<bool> NeighborList::anyWithin(const Pose& X_OT, double margin) const {
    for (const PairEntries* entries : {&near_, &all_, offered_}) {
        if (!entries || finder_.reserve(*entries, {X_OT, margin}) < 0) continue;
        bool any = false;
        forEachHit(*entries, X_OT, margin, [&](int toolLeaf, const Vec3&, int bucket, Mask mask) {
            for (; mask && !any; mask &= mask - 1)
                any = gap(X_OT, toolLeaf, bucket * SphereTree::kBranching + std::countr_zero(mask)) < margin;
            return !any;
        });
        return any;
    }
    return {};
}

NeighborList::Overlap NeighborList::remeasure(const Pose& before, const Pose& after, double tolerance) {
    Overlap overlap;
    const Mat3 R = before.R(), R_after = after.R();
    const auto look = [&](int toolLeaf, const Vec3& c_O, int bucket, Mask mask) {
        const Sphere s = tool_->leaf(toolLeaf);
        const LeafGaps now = leafGaps(c_O, s.r, *obstacle_, bucket);
        mask &= lessEqual(now.gap, splat(0.0));
        if (!mask) return true;
        const LeafGaps then = leafGaps(R * Vec3(s.x, s.y, s.z) + before.p, s.r, *obstacle_, bucket);
        for (; mask; mask &= mask - 1) {
            const int i = std::countr_zero(mask);
            overlap.depth = std::max(overlap.depth, -now.gap[i]);
            if (now.gap[i] < std::min(then.gap[i] - kRounding, -tolerance) && !overlap.deeper()) {
                overlap.toolLeaf = toolLeaf;
                overlap.obstacleLeaf = bucket * SphereTree::kBranching + i;
            }
        }
        return !overlap.deeper();
    };
    const Course step = Course::between(before, after, extent_.center);
    const double length = extent_.length(step);
    const bool known = farHas({before, length}) || farHas(crossing(step, length));
    if (!known || far_.leastDistance() < length) {
        forEachHit(near_, after, 0, look);
        return overlap;
    }
    // A distance is convex along a straight way: no gap falls below what its row leaves but for the bend of an arc.
    far_.measure(step.shift, step.turn, 0, 0, 0, 1);
    const double bend = extent_.reach * step.turn.squaredNorm() / 2;
    far_.forEachBelow(float(bend) + farError(step), [&](int i) {
        const Sphere s = tool_->leaf(far_.toolLeaf(i));
        const int bucket = far_.obstacleLeaf(i) / SphereTree::kBranching;
        return look(far_.toolLeaf(i), R_after * Vec3(s.x, s.y, s.z) + after.p, bucket,
                    1u << far_.obstacleLeaf(i) % SphereTree::kBranching);
    });
    return overlap;
}

bool NeighborList::isDeeper(const Pose& before, const Pose& after, const Overlap& pair, double tolerance) const {
    return gap(after, pair.toolLeaf, pair.obstacleLeaf) <
           std::min(gap(before, pair.toolLeaf, pair.obstacleLeaf) - kRounding, -tolerance);
}

double NeighborList::gap(const Pose& X_OT, int toolLeaf, int obstacleLeaf) const {
    return leafGap(tool_->leaf(toolLeaf), obstacle_->leaf(obstacleLeaf), X_OT);
}

}  // namespace touchstone
