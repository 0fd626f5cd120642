#include "haptics/collision/tree_walk.hpp"

#include <algorithm>

#include "haptics/math/simd.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {
namespace {

using namespace simd;

double meanRadius(const TreeLevel& level) {
    double sum = 0;
    for (int i = 0; i < level.count; ++i) sum += level.r[i];
    return sum / level.count;
}

}  // namespace

float floatGuard(const SphereTree& tool, const SphereTree& obstacle, const Pose& X_OT) {
    const auto extent = [](const SphereTree& tree) {
        const Sphere root = tree.block(int(tree.levels.size()) - 1, 0);
        return tree.center().norm() + root.r;
    };
    // A coordinate is rounded about eight times, each time by up to 2^-24 of the largest intermediate value. The 1e-6
    // mm covers trees so small that this bound itself would be lost in rounding.
    return float(8 * 0x1p-24 * (extent(tool) + extent(obstacle) + X_OT.p.norm()) + 1e-6);
}

/// The query in float: the tool's rotation and translation into the obstacle's frame, its motion there, and the Within
/// with the float guard added.
struct TreeWalk::Query {
    float R[3][3], p[3], margin, most, curve;
    float shift[3], turn[3], c[3];  ///< c: the tool's center
    float radiusFactor;  ///< a rotation moves a block's leaves further than its center: a factor on its radius
    ErasedSink sink;
    void* context;

    /// The largest gap of leaf pairs whose radii are at least these.
    TOUCHSTONE_INLINE Float8 near(const Float8& toolLeast, const Float8& obstacleLeast) const {
        const Float8 bent = margin + curve / max(toolLeast + obstacleLeast, splat(1e-30f));
        return bent < most ? bent : splat(most);
    }

    /// The centers of tool blocks, or the boxes around their paths if the tool moves. T: float or Float8.
    template <bool moves, class T>
    TOUCHSTONE_INLINE void place(const T& x, const T& y, const T& z, T lo[3], T hi[3]) const {
        T at[3];
        for (int k = 0; k < 3; ++k) lo[k] = hi[k] = at[k] = sumOfProducts(R[k][0], x, R[k][1], y, R[k][2], z) + p[k];
        if constexpr (moves)
            for (int k = 0; k < 3; ++k) {
                const int i = (k + 1) % 3, j = (k + 2) % 3;
                const T path = shift[k] + sumOfProducts(turn[i], at[j] - c[j], -turn[j], at[i] - c[i]);
                const T end = at[k] + path;
                lo[k] = at[k] < end ? at[k] : end;
                hi[k] = at[k] < end ? end : at[k];
            }
    }
};

TreeWalk::TreeWalk(const SphereTree& tool, const SphereTree& obstacle) : tool_(&tool), obstacle_(&obstacle) {
    // The levels go down to single tool leaves and obstacle buckets; the side with the larger blocks is split first.
    int a = int(tool.levels.size()) - 1, b = int(obstacle.levels.size()) - 1;
    levels_.push_back({a, b});
    while (a > 0 || b > 1) {
        const bool descendObstacle = a == 0 || (b > 1 && meanRadius(obstacle.levels[b]) >= meanRadius(tool.levels[a]));
        (descendObstacle ? b : a) -= 1;
        levels_.push_back({a, b});
    }
    frontiers_.resize(levels_.size());
    for (Frontier& f : frontiers_) {
        f.tool.resize(kFrontier + SphereTree::kBranching);
        f.obstacle.resize(kFrontier + SphereTree::kBranching);
    }
    out_.resize(kFrontier + SphereTree::kBranching);
}

void TreeWalk::runErased(const Coverage& asked, ErasedSink sink, void* context) {
    const StraightMotion& motion = asked.motion;
    Query query{};
    const Pose& X_OT = motion.X_OT;
    const Mat3 R = X_OT.R();
    const Vec3 center = X_OT * tool_->center();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) query.R[i][j] = float(R(i, j));
        query.p[i] = float(X_OT.p[i]);
        query.shift[i] = float(motion.shift[i]);
        query.turn[i] = float(motion.turn[i]);
        query.c[i] = float(center[i]);
    }
    query.radiusFactor = float(1 + motion.turn.norm());
    const float guard = floatGuard(*tool_, *obstacle_, X_OT);
    query.margin = float(asked.within.margin) + guard;
    query.most = float(asked.within.most) + guard;
    query.curve = curveInFloat(asked.within);
    query.sink = sink;
    query.context = context;
    // Trees that are far apart are rejected in double: in float the squares could overflow, and every pair would pass.
    const float toolRadius = tool_->levels.back().r[0], obstacleRadius = obstacle_->levels.back().r[0];
    const double near = double(toolRadius) * (1 + motion.turn.stableNorm()) + double(obstacleRadius) +
                        motion.shift.stableNorm() + asked.within.most;
    if (!((center - obstacle_->center()).stableNorm() <= near + 1e-6)) return;
    frontiers_[0].tool[0] = frontiers_[0].obstacle[0] = 0;
    if (motion.stays())
        descend<false>(query, 0, 1);
    else
        descend<true>(query, 0, 1);
}

/// Expands the pairs of one depth run by run. A run is as long as the next depth can hold, and it is expanded down to
/// the leaves before the next run begins.
template <bool moves>
void TreeWalk::descend(const Query& query, int depth, int count) {
    const Frontier& here = frontiers_[depth];
    if (depth + 1 == int(levels_.size())) {
        for (int i = 0; i < count; ++i) out_[i] = {here.tool[i], here.obstacle[i]};
        query.sink(query.context, out_.data(), count);
        return;
    }
    const bool descendObstacle = levels_[depth + 1][1] != levels_[depth][1];
    for (int first = 0; first < count;) {
        int used = 0;
        const int found = descendObstacle ? expandObstacle<moves>(query, depth, first, count, used)
                                          : expandTool<moves>(query, depth, first, count, used);
        if (found) descend<moves>(query, depth + 1, found);
        first += used;
    }
}

template <bool moves>
int TreeWalk::expandObstacle(const Query& query, int depth, int first, int count, int& used) {
    const Frontier& here = frontiers_[depth];
    Frontier& next = frontiers_[depth + 1];
    const TreeLevel& tool = tool_->levels[levels_[depth][0]];
    const TreeLevel& obstacle = obstacle_->levels[levels_[depth + 1][1]];
    int found = 0, placed = -1;
    float lo[3] = {}, hi[3] = {}, reach = 0, least = 0;
    for (int i = first; i < count && found <= kFrontier - SphereTree::kBranching; ++i, ++used) {
        const int block = here.tool[i];
        if (block != placed) {
            query.place<moves>(tool.x[block], tool.y[block], tool.z[block], lo, hi);
            reach = tool.r[block] * query.radiusFactor;
            least = tool.round[block];
            placed = block;
        }
        const int children = here.obstacle[i] * SphereTree::kBranching;
        const float* centers[3] = {&obstacle.x[children], &obstacle.y[children], &obstacle.z[children]};
        Float8 box2 = splat(0.0f), ball2 = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const Float8 outside =
                apart(load(&obstacle.lo[k][children]), load(&obstacle.hi[k][children]), splat(lo[k]), splat(hi[k]));
            box2 = fma(outside, outside, box2);
            const Float8 x = load(centers[k]), d = moves ? apart(x, x, splat(lo[k]), splat(hi[k])) : x - splat(lo[k]);
            ball2 = fma(d, d, ball2);
        }
        const Float8 round = load(&obstacle.round[children]), near = query.near(splat(least), round) + reach;
        const Float8 box = max(round + near, splat(0.0f));
        const Float8 ball = max(load(&obstacle.r[children]) + near, splat(0.0f));
        const Mask hits = lessEqual(box2, box * box) & lessEqual(ball2, ball * ball) & obstacle.blocksFrom(children);
        compressStore(&next.obstacle[found], splat(children) + lanes(), hits);
        compressStore(&next.tool[found], splat(block), hits);
        found += std::popcount(hits);
    }
    return found;
}

template <bool moves>
int TreeWalk::expandTool(const Query& query, int depth, int first, int count, int& used) {
    const Frontier& here = frontiers_[depth];
    Frontier& next = frontiers_[depth + 1];
    const TreeLevel& tool = tool_->levels[levels_[depth + 1][0]];
    const TreeLevel& obstacle = obstacle_->levels[levels_[depth][1]];
    int found = 0, placed = -1;
    Float8 lo[3] = {}, hi[3] = {}, reach = {}, least = {};
    Mask blocks = 0;
    for (int i = first; i < count && found <= kFrontier - SphereTree::kBranching; ++i, ++used) {
        const int children = here.tool[i] * SphereTree::kBranching;
        if (children != placed) {
            query.place<moves>(load(&tool.x[children]), load(&tool.y[children]), load(&tool.z[children]), lo, hi);
            reach = load(&tool.r[children]) * query.radiusFactor;
            least = load(&tool.round[children]);
            blocks = tool.blocksFrom(children);
            placed = children;
        }
        const int block = here.obstacle[i];
        const float center[3] = {obstacle.x[block], obstacle.y[block], obstacle.z[block]};
        Float8 box2 = splat(0.0f), ball2 = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const Float8 outside = apart(lo[k], hi[k], splat(obstacle.lo[k][block]), splat(obstacle.hi[k][block]));
            box2 = fma(outside, outside, box2);
            const Float8 x = splat(center[k]), d = moves ? apart(lo[k], hi[k], x, x) : lo[k] - x;
            ball2 = fma(d, d, ball2);
        }
        const Float8 near = query.near(least, splat(obstacle.round[block])) + reach;
        const Float8 box = max(near + obstacle.round[block], splat(0.0f));
        const Float8 ball = max(near + obstacle.r[block], splat(0.0f));
        const Mask hits = lessEqual(box2, box * box) & lessEqual(ball2, ball * ball) & blocks;
        compressStore(&next.tool[found], splat(children) + lanes(), hits);
        compressStore(&next.obstacle[found], splat(block), hits);
        found += std::popcount(hits);
    }
    return found;
}

}  // namespace touchstone
