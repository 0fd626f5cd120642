#include "haptics/builder/touching_poses.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <span>

#include "haptics/builder/leaf_union.hpp"
#include "haptics/collision/tree_walk.hpp"
#include "haptics/math/statistics.hpp"

namespace touchstone {
namespace {

/// Leaves in a frame whose z axis is the direction of travel, with a box tree.
struct LeafSet {
    std::vector<Leaf> balls;
    BoxTree tree;

    explicit LeafSet(std::vector<Leaf> all) : balls(std::move(all)), tree(boxesOf(balls)) {}

    static std::vector<Box> boxesOf(const std::vector<Leaf>& balls) {
        std::vector<Box> boxes;
        for (const Leaf& b : balls)
            boxes.push_back({b.center - Vec3::Constant(b.radius), b.center + Vec3::Constant(b.radius)});
        return boxes;
    }
};

/// Finds the largest travel at which two sets of leaves touch, by branch and bound over pairs of boxes.
class ContactSearch {
  public:
    ContactSearch(const LeafSet& tool, const LeafSet& obstacle) : tool_(tool), obstacle_(obstacle) {
        descendNodes(0, 0);
    }
    double travel = -HUGE_VAL;

  private:
    struct Slot {
        int node, k;
    };
    struct Pair {
        double bound;
        int i, j;
    };

    static const BoxTree::Node& at(const LeafSet& set, int n) { return set.tree.nodes()[n]; }

    // Boxes that are disjoint in x or y never touch. Others touch at most until they separate in z.
    double bound(const Slot& a, const Slot& b) const {
        const BoxTree::Node &s = at(tool_, a.node), &t = at(obstacle_, b.node);
        for (int x = 0; x < 2; ++x)
            if (s.lo[x][a.k] > t.hi[x][b.k] || t.lo[x][b.k] > s.hi[x][a.k]) return -HUGE_VAL;
        return t.hi[2][b.k] - s.lo[2][a.k];
    }

    void descendNodes(int n, int m) {
        std::array<Pair, 16> pairs;
        int count = 0;
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) {
                if (at(tool_, n).count[i] < 0 || at(obstacle_, m).count[j] < 0) continue;
                const double b = bound({n, i}, {m, j});
                if (b > travel) pairs[count++] = {b, i, j};
            }
        std::sort(pairs.begin(), pairs.begin() + count, [](const Pair& a, const Pair& b) { return a.bound > b.bound; });
        for (int p = 0; p < count && pairs[p].bound > travel; ++p) descend({n, pairs[p].i}, {m, pairs[p].j});
    }

    void descend(const Slot& a, const Slot& b) {
        const BoxTree::Node &s = at(tool_, a.node), &t = at(obstacle_, b.node);
        if (s.count[a.k] == 0 && t.count[b.k] == 0) return descendNodes(s.first[a.k], t.first[b.k]);
        if (s.count[a.k] == 0 || t.count[b.k] == 0) {
            const bool tool = s.count[a.k] == 0;
            for (int k = 0; k < 4; ++k) {
                const Slot i = tool ? Slot{s.first[a.k], k} : a, j = tool ? b : Slot{t.first[b.k], k};
                if (at(tool ? tool_ : obstacle_, tool ? i.node : j.node).count[k] >= 0 && bound(i, j) > travel)
                    descend(i, j);
            }
            return;
        }
        for (int i = 0; i < s.count[a.k]; ++i)
            for (int j = 0; j < t.count[b.k]; ++j) {
                const Leaf& p = tool_.balls[tool_.tree.order()[s.first[a.k] + i]];
                const Leaf& q = obstacle_.balls[obstacle_.tree.order()[t.first[b.k] + j]];
                const Vec3 off = q.center - p.center;
                const double reach = p.radius + q.radius;
                const double left = reach * reach - off.head<2>().squaredNorm();
                if (left >= 0) travel = std::max(travel, off.z() + std::sqrt(left));
            }
    }

    const LeafSet &tool_, &obstacle_;
};

struct LeafPair {
    int tool, obstacle;
    auto operator<=>(const LeafPair&) const = default;
};

double gapOf(const Leaf& a, const Leaf& b) { return (a.center - b.center).norm() - (a.radius + b.radius); }

/// A hierarchy as the obstacle, and a copy of it in another pose as the tool.
class PosedTree {
  public:
    explicit PosedTree(const SphereHierarchy& hierarchy) : nodes_(hierarchy.nodes) {
        for (const SphereNode& node : nodes_) {
            if (node.children == 0) leafNode_.push_back(static_cast<int>(obstacle_.size()));
            obstacle_.push_back({node.center, node.radius});
        }
    }

    void place(const Pose& X_OT) {
        placed_ = obstacle_;
        for (Leaf& b : placed_) b.center = X_OT * b.center;
    }

    /// All leaf pairs with a gap of at most the margin, by brute force over the leaves that reach into the other's box.
    std::vector<LeafPair> allPairs(double margin) const {
        const auto boxOf = [&](const std::vector<Leaf>& balls) {
            Box box;
            for (const int n : leafNode_) {
                const Vec3 r = Vec3::Constant(balls[n].radius + margin);
                box.add(balls[n].center - r);
                box.add(balls[n].center + r);
            }
            return box;
        };
        // Only leaves that reach into the box of the other tree can touch; side by side for the inner loop.
        const Box toolBox = boxOf(placed_), obstacleBox = boxOf(obstacle_);
        const auto reaches = [&](const Leaf& b, const Box& box) {
            const Vec3 off = (box.lo - b.center).cwiseMax(b.center - box.hi).cwiseMax(0.0);
            return off.norm() <= b.radius + margin;
        };
        std::vector<int> obstacles;
        std::array<std::vector<double>, 4> at;
        for (int j = 0; j < leafCount(); ++j) {
            const Leaf& b = obstacle_[leafNode_[j]];
            if (!reaches(b, toolBox)) continue;
            obstacles.push_back(j);
            for (int a = 0; a < 3; ++a) at[a].push_back(b.center[a]);
            at[3].push_back(b.radius + margin);
        }
        std::vector<LeafPair> out;
        const auto count = static_cast<int>(obstacles.size());
        for (int i = 0; i < leafCount(); ++i) {
            const Leaf& a = placed_[leafNode_[i]];
            if (!reaches(a, obstacleBox)) continue;
            for (int from = 0; from < count; from += kBlock) {
                // Count the candidates without branches, for vectorization. The few blocks with a hit are tested one by
                // one.
                const int to = std::min(count, from + kBlock);
                int hits = 0;
                for (int j = from; j < to; ++j) {
                    const double dx = a.center.x() - at[0][j], dy = a.center.y() - at[1][j],
                                 dz = a.center.z() - at[2][j];
                    const double reach = (a.radius + at[3][j]) * (1 + 1e-9);
                    hits += dx * dx + dy * dy + dz * dz <= reach * reach;
                }
                for (int j = from; j < to && hits > 0; ++j)
                    if (touches(i, obstacles[j], margin)) out.push_back({i, obstacles[j]});
            }
        }
        return out;
    }

    /// The pairs that a walk from the roots finds. Adds the number of its sphere tests to `tests`.
    std::vector<LeafPair> walkedPairs(double margin, std::int64_t& tests) const {
        std::vector<int> leafOf(nodes_.size(), -1);
        for (int i = 0; i < leafCount(); ++i) leafOf[leafNode_[i]] = i;
        std::vector<LeafPair> out, waiting;
        const auto test = [&](int a, int b) {
            ++tests;
            if (gapOf(placed_[a], obstacle_[b]) <= margin) waiting.push_back({a, b});
        };
        test(0, 0);
        while (!waiting.empty()) {
            const auto [a, b] = waiting.back();
            waiting.pop_back();
            const SphereNode &tool = nodes_[a], &obstacle = nodes_[b];
            if (tool.children == 0 && obstacle.children == 0) {
                out.push_back({leafOf[a], leafOf[b]});
            } else if (tool.children == 0 || (obstacle.children > 0 && obstacle.radius >= tool.radius)) {
                for (int k = 0; k < obstacle.children; ++k) test(a, obstacle.firstChild + k);
            } else {
                for (int k = 0; k < tool.children; ++k) test(tool.firstChild + k, b);
            }
        }
        return out;
    }

    bool touches(int i, int j, double margin) const {
        return gapOf(placed_[leafNode_[i]], obstacle_[leafNode_[j]]) <= margin;
    }
    int leafCount() const { return static_cast<int>(leafNode_.size()); }
    std::vector<SphereNode> leaves() const {
        std::vector<SphereNode> out;
        for (const int n : leafNode_) out.push_back(nodes_[n]);
        return out;
    }

  private:
    static constexpr int kBlock = 64;  // number of obstacle leaves that are counted at a time

    const std::vector<SphereNode>& nodes_;
    std::vector<int> leafNode_;
    std::vector<Leaf> obstacle_, placed_;
};

/// The pairs within the margin among the buckets that TreeWalk reports.
std::vector<LeafPair> pairsOf(TreeWalk& walk, const PosedTree& posed, const Pose& X_OT, double margin) {
    std::vector<LeafPair> out;
    walk.run({X_OT, margin}, [&](const PairEntry* found, int count) {
        for (const PairEntry& b : std::span(found, static_cast<std::size_t>(count)))
            for (int j = b.obstacle * SphereTree::kBranching;
                 j < std::min((b.obstacle + 1) * SphereTree::kBranching, posed.leafCount()); ++j)
                if (posed.touches(b.tool, j, margin)) out.push_back({b.tool, j});
    });
    return out;
}

/// The number of the sorted pairs `all` that are not in `found`.
std::int64_t missing(const std::vector<LeafPair>& all, std::vector<LeafPair> found) {
    std::sort(found.begin(), found.end());
    std::vector<LeafPair> left;
    std::set_difference(all.begin(), all.end(), found.begin(), found.end(), std::back_inserter(left));
    return static_cast<std::int64_t>(left.size());
}

double threadSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// CPU time of a walk in µs: the mean over the poses of the median over batches of repeated walks.
double walkMicroseconds(TreeWalk& walk, const std::vector<Pose>& poses, double margin) {
    constexpr int kBatches = 9;             // odd, for the median
    constexpr double kBatchSeconds = 2e-4;  // least duration of a batch
    std::int64_t entries = 0;
    double sum = 0;
    for (const Pose& X : poses) {
        const auto spent = [&](int repeats) {
            const double start = threadSeconds();
            for (int i = 0; i < repeats; ++i)
                walk.run({X, margin}, [&](const PairEntry*, int count) { entries += count; });
            return threadSeconds() - start;
        };
        int repeats = 16;
        while (spent(repeats) < kBatchSeconds) repeats *= 2;
        std::array<double, kBatches> batches{};
        for (double& batch : batches) batch = spent(repeats) / repeats;
        sum += upperMedian(batches);
    }
    return 1e6 * sum / static_cast<double>(poses.size());
}

}  // namespace

double lastContact(const std::vector<SphereNode>& tool, const std::vector<SphereNode>& obstacle, const Pose& X_OT,
                   const Vec3& direction) {
    Mat3 toZ;
    toZ.row(0) = direction.unitOrthogonal();
    toZ.row(1) = direction.cross(toZ.row(0));
    toZ.row(2) = direction;
    std::vector<Leaf> a, b;
    for (const SphereNode& s : tool) a.push_back({toZ * (X_OT * s.center), s.radius});
    for (const SphereNode& s : obstacle) b.push_back({toZ * s.center, s.radius});
    return ContactSearch(LeafSet(std::move(a)), LeafSet(std::move(b))).travel;
}

PoseFigures measurePoses(const SphereHierarchy& hierarchy, const SphereTree* tree, double diagonal, int poses,
                         std::uint64_t seed, const std::function<void(double)>& beat) {
    constexpr int kDraws = 4;  // maximum number of draws for each requested pose
    const double margin = kTouchShare * diagonal;
    PosedTree posed(hierarchy);
    const std::vector<SphereNode> leaves = posed.leaves();
    Box box;
    for (const SphereNode& s : leaves) box.add(s.center);
    std::optional<TreeWalk> walk;
    if (tree) walk.emplace(*tree, *tree);

    PoseFigures out;
    std::vector<Pose> touching;
    std::int64_t tests = 0, pairs = 0, pressedPairs = 0, ignored = 0;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (int draw = 0; draw < kDraws * poses && out.poses < poses; ++draw) {
        beat(static_cast<double>(out.poses) / poses);
        const Eigen::Vector4d turn{normal(random), normal(random), normal(random), normal(random)};
        const Vec3 direction = Vec3{normal(random), normal(random), normal(random)}.normalized();
        Pose X{Vec3::Zero(), Quat(turn.normalized())};
        X.p = box.center() - X.q * box.center();
        const double travel = lastContact(leaves, leaves, X, direction);
        if (travel == -HUGE_VAL) continue;
        ++out.poses;
        const Vec3 start = X.p;
        const auto check = [&](double back, double within, std::int64_t& count, std::int64_t& spent,
                               std::int64_t& missed) {
            X.p = start + (travel - back) * direction;
            posed.place(X);
            const std::vector<LeafPair> all = posed.allPairs(within);
            count += static_cast<std::int64_t>(all.size());
            missed += missing(all, posed.walkedPairs(within, spent));
            if (walk) missed += missing(all, pairsOf(*walk, posed, X, within));
        };
        check(0, margin, pairs, tests, out.pairsMissed);
        touching.push_back(X);
        check(kPressShare * diagonal, 0, pressedPairs, ignored, out.pressedPairsMissed);
    }
    if (out.poses == 0) return out;
    out.testsPerPose = static_cast<double>(tests) / out.poses;
    out.pairsPerPose = static_cast<double>(pairs) / out.poses;
    out.pressedPairsPerPose = static_cast<double>(pressedPairs) / out.poses;
    if (walk) out.walkUs = walkMicroseconds(*walk, touching, margin);
    return out;
}

}  // namespace touchstone
