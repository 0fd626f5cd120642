#include "haptics/collision/tree_walk.hpp"

#include <algorithm>

#include "haptics/math/simd.hpp"

namespace touchstone {
namespace {

using namespace simd;

constexpr int kFrontier = 4096;  // pairs a depth holds at once: three arrays of this size stay in the first cache

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
    // A coordinate passes through about eight roundings of 2^-24 of the largest intermediate.
    return float(8 * 0x1p-24 * (extent(tool) + extent(obstacle) + X_OT.p.norm()) + 1e-6);
}

/// The query in float: rotation and translation of the tool into the obstacle's frame, margin with guard.
struct TreeWalk::Query {
    float R[3][3], p[3], margin;
    ErasedSink sink;
    void* context;

    void place(float x, float y, float z, float out[3]) const {
        for (int k = 0; k < 3; ++k) out[k] = R[k][0] * x + R[k][1] * y + R[k][2] * z + p[k];
    }
};

TreeWalk::TreeWalk(const SphereTree& tool, const SphereTree& obstacle) : tool_(&tool), obstacle_(&obstacle) {
    // Down to single tool leaves against buckets, the larger blocks first.
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

void TreeWalk::runErased(const Pose& X_OT, double margin, ErasedSink sink, void* context) {
    Query query{};
    const Mat3 R = X_OT.R();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) query.R[i][j] = float(R(i, j));
        query.p[i] = float(X_OT.p[i]);
    }
    query.margin = float(margin) + floatGuard(*tool_, *obstacle_, X_OT);
    query.sink = sink;
    query.context = context;
    frontiers_[0].tool[0] = frontiers_[0].obstacle[0] = 0;
    descend(query, 0, 1);
}

/// Expands the pairs of one depth run by run: as many as the next depth holds, then that run to the end, then the next.
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
        const int found = descendObstacle ? expandObstacle(query, depth, first, count, used)
                                          : expandTool(query, depth, first, count, used);
        if (found) descend(query, depth + 1, found);
        first += used;
    }
}

int TreeWalk::expandObstacle(const Query& query, int depth, int first, int count, int& used) {
    const Frontier& here = frontiers_[depth];
    Frontier& next = frontiers_[depth + 1];
    const TreeLevel& tool = tool_->levels[levels_[depth][0]];
    const TreeLevel& obstacle = obstacle_->levels[levels_[depth + 1][1]];
    int found = 0, placed = -1;
    float c[3] = {}, reach = 0;
    for (int i = first; i < count && found <= kFrontier - SphereTree::kBranching; ++i, ++used) {
        const int block = here.tool[i];
        if (block != placed) {
            query.place(tool.x[block], tool.y[block], tool.z[block], c);
            reach = tool.r[block] + query.margin;
            placed = block;
        }
        const int children = here.obstacle[i] * SphereTree::kBranching;
        Float8 distance2 = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const Float8 x = splat(c[k]);
            const Float8 outside =
                max(max(load(&obstacle.lo[k][children]) - x, x - load(&obstacle.hi[k][children])), splat(0.0f));
            distance2 += outside * outside;
        }
        const Float8 limit = max(load(&obstacle.round[children]) + splat(reach), splat(0.0f));
        const Float8 dx = load(&obstacle.x[children]) - splat(c[0]), dy = load(&obstacle.y[children]) - splat(c[1]),
                     dz = load(&obstacle.z[children]) - splat(c[2]);
        const Float8 apart = max(load(&obstacle.r[children]) + splat(reach), splat(0.0f));
        const Mask hits = lessEqual(distance2, limit * limit) & lessEqual(dx * dx + dy * dy + dz * dz, apart * apart);
        compressStore(&next.obstacle[found], splat(children) + lanes(), hits);
        compressStore(&next.tool[found], splat(block), hits);
        found += std::popcount(hits);
    }
    return found;
}

int TreeWalk::expandTool(const Query& query, int depth, int first, int count, int& used) {
    const Frontier& here = frontiers_[depth];
    Frontier& next = frontiers_[depth + 1];
    const TreeLevel& tool = tool_->levels[levels_[depth + 1][0]];
    const TreeLevel& obstacle = obstacle_->levels[levels_[depth][1]];
    int found = 0, placed = -1;
    Float8 c[3] = {}, reach = {};
    for (int i = first; i < count && found <= kFrontier - SphereTree::kBranching; ++i, ++used) {
        const int children = here.tool[i] * SphereTree::kBranching;
        if (children != placed) {
            const Float8 x = load(&tool.x[children]), y = load(&tool.y[children]), z = load(&tool.z[children]);
            for (int k = 0; k < 3; ++k) c[k] = query.R[k][0] * x + query.R[k][1] * y + query.R[k][2] * z + query.p[k];
            reach = load(&tool.r[children]) + splat(query.margin);
            placed = children;
        }
        const int block = here.obstacle[i];
        Float8 distance2 = splat(0.0f);
        for (int k = 0; k < 3; ++k) {
            const Float8 outside =
                max(max(splat(obstacle.lo[k][block]) - c[k], c[k] - splat(obstacle.hi[k][block])), splat(0.0f));
            distance2 += outside * outside;
        }
        const Float8 limit = max(reach + splat(obstacle.round[block]), splat(0.0f));
        const Float8 dx = c[0] - splat(obstacle.x[block]), dy = c[1] - splat(obstacle.y[block]),
                     dz = c[2] - splat(obstacle.z[block]);
        const Float8 apart = max(reach + splat(obstacle.r[block]), splat(0.0f));
        const Mask hits = lessEqual(distance2, limit * limit) & lessEqual(dx * dx + dy * dy + dz * dz, apart * apart);
        compressStore(&next.tool[found], splat(children) + lanes(), hits);
        compressStore(&next.obstacle[found], splat(block), hits);
        found += std::popcount(hits);
    }
    return found;
}

}  // namespace touchstone
