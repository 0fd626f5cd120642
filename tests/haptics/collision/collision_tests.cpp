// Compares walk, neighbor list and clearance with brute force over all leaf pairs.
#include <catch2/catch.hpp>
#include <map>
#include <random>
#include <set>

#include "haptics/collision/clearance.hpp"
#include "haptics/collision/neighbor_list.hpp"

namespace touchstone::collision_tests {

namespace {

/// Leaves scattered on a bumpy ball of about 40 mm radius.
SphereTree bumpyBall(int leaves, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<float> radius(1, 6);
    std::vector<Sphere> spheres(static_cast<std::size_t>(leaves));
    for (Sphere& s : spheres) {
        const Vec3 d = Vec3(normal(random), normal(random), normal(random)).normalized();
        const Vec3 p = d * (40 + 6 * std::sin(5 * d.x()) * std::cos(4 * d.y()));
        s = {float(p.x()) + 10, float(p.y()), float(p.z()), radius(random)};
    }
    return makeSphereTree(spheres);
}

Pose randomPose(std::mt19937& random, double spread) {
    std::normal_distribution<double> normal;
    const Quat q = Quat(normal(random), normal(random), normal(random), normal(random)).normalized();
    return {spread * Vec3(normal(random), normal(random), normal(random)), q};
}

double pairGap(const SphereTree& tool, const SphereTree& obstacle, const Pose& X, int i, int j) {
    const Sphere t = tool.leaf(i), o = obstacle.leaf(j);
    return (X * Vec3(t.x, t.y, t.z) - Vec3(o.x, o.y, o.z)).norm() - double(t.r) - double(o.r);
}

std::map<std::uint64_t, double> brutePairs(const SphereTree& tool, const SphereTree& obstacle, const Pose& X,
                                           double margin) {
    std::map<std::uint64_t, double> pairs;
    for (int i = 0; i < tool.leafCount(); ++i)
        for (int j = 0; j < obstacle.leafCount(); ++j)
            if (const double g = pairGap(tool, obstacle, X, i, j); g <= margin) pairs[contactId(0, i, j)] = g;
    return pairs;
}

}  // namespace

TEST_CASE("sphere tree: every block contains its leaves and no leaf is lost", "[tree]") {
    for (const int leaves : {1, 2, 7, 8, 9, 63, 64, 65, 500, 512, 513, 4000}) {
        CAPTURE(leaves);
        const SphereTree tree = bumpyBall(leaves, 7);
        REQUIRE(tree.leafCount() == leaves);
        REQUIRE(tree.levels.size() >= 2);
        REQUIRE(tree.levels.back().count == 1);
        int blockSize = 1;
        for (std::size_t k = 0; k < tree.levels.size(); ++k, blockSize *= 8) {
            REQUIRE(tree.levels[k].count == (leaves + blockSize - 1) / blockSize);
            for (int i = 0; i < leaves; ++i) {
                const Sphere leaf = tree.leaf(i), block = tree.block(int(k), i / blockSize);
                REQUIRE((leaf.center() - block.center()).norm() + leaf.r <= block.r);
                // A ball is a smaller ball grown by the rounding radius of the box.
                const double round = tree.levels[k].round[i / blockSize], rest = leaf.r - round;
                REQUIRE(rest >= 0);
                for (int d = 0; d < 3; ++d) {
                    REQUIRE(tree.levels[k].lo[d][i / blockSize] <= leaf.center()[d] - rest);
                    REQUIRE(tree.levels[k].hi[d][i / blockSize] >= leaf.center()[d] + rest);
                }
            }
        }
    }
}

TEST_CASE("sphere tree: leaves on a grid, where all coordinates tie, are ordered and none is lost", "[tree]") {
    std::vector<Sphere> grid;
    for (int i = 0; i < 30000; ++i) grid.push_back({float(i % 31), float(i / 31 % 31), float(i / 961), 0.7f});
    const SphereTree tree = makeSphereTree(grid);
    std::set<std::array<float, 3>> places;
    for (int i = 0; i < tree.leafCount(); ++i) places.insert({tree.leaf(i).x, tree.leaf(i).y, tree.leaf(i).z});
    CHECK(places.size() == grid.size());
}

TEST_CASE("sphere tree: 4,096 leaves make 4,681 nodes", "[tree]") { REQUIRE(bumpyBall(4096, 1).nodeCount() == 4681); }

TEST_CASE("neighbor list: rows are the pairs of brute force, in order of identity, at any age of the list",
          "[collision]") {
    const unsigned seed = GENERATE(1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u);
    CAPTURE(seed);
    std::mt19937 random(seed);
    const int sizes[] = {1, 5, 9, 70, 300, 600};
    const SphereTree tool = bumpyBall(sizes[random() % 6], seed), obstacle = bumpyBall(sizes[random() % 6], seed + 100);
    NeighborList list(tool, obstacle, 0);
    RowSet rows(1 << 15);
    const double reach = tool.reach();
    for (int pose = 0; pose < 12; ++pose) {
        const Pose built = randomPose(random, 35);
        REQUIRE(list.complete({built, 0.5}, 1.5));
        // Query at the pose of the walk and after up to 1.5 mm of travel.
        for (const double aged : {0.0, 0.7, 1.5}) {
            const Pose nudge{0.5 * aged * Vec3(0.6, 0, -0.8),
                             expRotation(0.49 * aged / std::max(reach, 1e-3) * Vec3(0, 1, 0))};
            Pose now{built.p + nudge.p, nudge.q * built.q};
            now.p += built * tool.center() - Pose{built.p, nudge.q * built.q} * tool.center();
            REQUIRE(list.complete({now, 0.5}, 1.5));
            rows.clear();
            REQUIRE(list.appendRows(now, Mat3::Identity(), 0.5, rows));
            const auto expected = brutePairs(tool, obstacle, now, 0.5);
            REQUIRE(rows.size() == int(expected.size()));
            int i = 0;
            for (const auto& [id, gap] : expected) {
                REQUIRE(rows.id(i) == id);
                REQUIRE(rows.gap()[i] == Approx(gap).margin(1e-12));
                ++i;
            }
        }
    }
}

TEST_CASE("neighbor list: a row predicts how its gap changes under a small increment", "[collision]") {
    std::mt19937 random(11);
    const SphereTree tool = bumpyBall(80, 3), obstacle = bumpyBall(120, 4);
    NeighborList list(tool, obstacle, 0);
    RowSet rows(1 << 15);
    const Pose X_WO = randomPose(random, 20);
    const Pose X_OT{Vec3(60, 10, -5), expRotation(Vec3(0.2, -0.4, 1.0))};
    REQUIRE(list.complete({X_OT, 5}, 0));
    REQUIRE(list.appendRows(X_OT, X_WO.R(), 5, rows));
    REQUIRE(rows.size() > 10);

    // δp of C and δθ about C, on world axes. The second-order term is |δ|²/2D for centers D >= 2 mm apart: 1e-10 for
    // |δ| ~ 2e-5.
    Vec6 x;
    x << 1e-5, -2e-5, 1.5e-5, 3e-7, -2e-7, 4e-7;
    const Pose X_WT = X_WO * X_OT;
    const Vec3 C = X_WT * tool.center();
    Pose moved;
    moved.q = expRotation(x.tail<3>()) * X_WT.q;
    moved.p = C + x.head<3>() - moved.q * tool.center();
    const Pose X_OT_moved = X_WO.inverse() * moved;
    for (int i = 0; i < rows.size(); ++i) {
        const int t = toolLeafOf(rows.id(i)), o = obstacleLeafOf(rows.id(i));
        const double change = list.gap(X_OT_moved, t, o) - list.gap(X_OT, t, o);
        REQUIRE(rows.row(i).dot(x) == Approx(change).margin(2e-9));
        REQUIRE(rows.row(i).head<3>().norm() == Approx(1).margin(1e-12));
    }
}

TEST_CASE("neighbor list: with too many rows, each tool leaf keeps its smallest gap and all pairs are counted",
          "[collision]") {
    const SphereTree tool = bumpyBall(200, 5), obstacle = bumpyBall(200, 6);
    NeighborList list(tool, obstacle, 0);
    const Pose X{Vec3(20, 0, 0), Quat::Identity()};
    REQUIRE(list.complete({X, 6}, 0));
    const auto expected = brutePairs(tool, obstacle, X, 6);
    RowSet few(40);
    REQUIRE(int(expected.size()) > few.capacity());
    REQUIRE_FALSE(list.appendRows(X, Mat3::Identity(), 6, few));
    REQUIRE(few.size() == 0);

    RowSet rows(200);
    REQUIRE(list.appendNearestRows(X, Mat3::Identity(), 6, rows) == int(expected.size()));
    std::map<std::uint64_t, std::pair<double, std::uint64_t>> least;
    for (const auto& [id, gap] : expected) {
        const auto [at, added] = least.try_emplace(id >> 28, gap, id);
        if (!added && gap < at->second.first) at->second = {gap, id};
    }
    REQUIRE(rows.size() == int(least.size()));
    int i = 0;
    for (const auto& [leaf, gapAndId] : least) REQUIRE(rows.id(i++) == gapAndId.second);
}

TEST_CASE("pair finder: entries of a motion hold every pair near it, and the distance of the tool from it is bounded",
          "[collision]") {
    std::mt19937 random(22);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const SphereTree tool = bumpyBall(150, 7), obstacle = bumpyBall(200, 8);
    const Vec3 C = tool.center();
    LeafPairFinder finder(tool, obstacle);
    PairEntries all(tool, obstacle), narrow(tool, obstacle);
    const auto holds = [](const PairEntries& entries, int t, int o) {
        for (int i = 0; i < entries.count; ++i)
            if (entries.at[i].tool == t && entries.at[i].obstacle == o / SphereTree::kBranching) return true;
        return false;
    };
    const auto vector = [&](double length) {
        return Vec3(length * uniform(random), length * uniform(random), length * uniform(random));
    };
    int pairs = 0;
    for (int k = 0; k < 30; ++k) {
        const StraightMotion motion{randomPose(random, 25), vector(4), vector(0.15)}, first = motion.times(0.4);
        const double margin = 1.5, slack = 0.5;
        REQUIRE(finder.find({motion, margin + slack}, all));
        REQUIRE(finder.reserve(all, {first, margin}) >= 0);
        finder.narrow(all, {first, margin}, narrow);
        for (const double s : {0.0, 0.2, 0.4, 0.7, 1.0}) {
            const Pose off{vector(0.1), expRotation(vector(1e-3))}, X = off * motion.times(s).end(C);
            // The bound holds for each leaf, because each leaf moves in a straight line.
            const double bound = deviation(motion, X, Extent(tool));
            const Mat3 R = motion.X_OT.R();
            for (int t = 0; t < tool.leafCount(); ++t) {
                const Vec3 from = R * tool.leaf(t).center() + motion.X_OT.p;
                const Vec3 way = motion.shift + motion.turn.cross(from - motion.X_OT * C);
                const Vec3 now = X * tool.leaf(t).center() - from;
                const double along = std::clamp(now.dot(way) / way.squaredNorm(), 0.0, 1.0);
                REQUIRE((now - along * way).norm() <= bound + 1e-12);
            }
            const double near = finder.reserve(all, {X, 0});
            for (const auto& [id, gap] : brutePairs(tool, obstacle, X, std::max(near, 0.0))) {
                REQUIRE(holds(all, toolLeafOf(id), obstacleLeafOf(id)));
                ++pairs;
            }
            if (s <= 0.4)
                for (const auto& [id, gap] :
                     brutePairs(tool, obstacle, X, std::max(finder.reserve(narrow, {X, 0}), 0.0)))
                    REQUIRE(holds(narrow, toolLeafOf(id), obstacleLeafOf(id)));
        }
    }
    REQUIRE(pairs > 1000);
}

TEST_CASE("pair finder: entries hold every pair of any coverage inside their own, also along curves", "[collision]") {
    std::mt19937 random(23);
    std::uniform_real_distribution<double> uniform(0, 1);
    const SphereTree tool = bumpyBall(150, 7), obstacle = bumpyBall(200, 8);
    LeafPairFinder finder(tool, obstacle);
    PairEntries all(tool, obstacle), narrow(tool, obstacle);
    const auto within = [&](double margin) {
        const double curve = uniform(random) < 0.3 ? 0 : 4 * uniform(random);
        return Within{margin, curve, margin + 3 * uniform(random)};
    };
    int held = 0, asked = 0, curved = 0;
    const auto requireHeld = [&](const PairEntries& entries, const Coverage& coverage) {
        std::set<std::pair<int, int>> buckets;
        finder.forEachWithin(entries, coverage, [&](const PairEntry& entry) {
            buckets.insert({entry.tool, entry.obstacle});
            return true;
        });
        for (const auto& [id, gap] : brutePairs(tool, obstacle, coverage.motion.X_OT, coverage.within.most)) {
            const int t = toolLeafOf(id), o = obstacleLeafOf(id);
            if (gap > coverage.within.at(double(tool.leaf(t).r) + double(obstacle.leaf(o).r))) continue;
            REQUIRE(buckets.count({t, o / SphereTree::kBranching}));
            ++held;
            curved += gap > coverage.within.margin;
        }
    };
    for (int k = 0; k < 200; ++k) {
        const Pose X = randomPose(random, 25);
        REQUIRE(finder.find({X, within(1.5)}, all));
        requireHeld(all, all);
        const Coverage near{Pose{X.p + 0.3 * uniform(random) * Vec3::UnitX(), X.q}, within(uniform(random))};
        if (finder.reserve(all, near) < 0) continue;
        ++asked;
        requireHeld(all, near);
        finder.narrow(all, near, narrow);
        requireHeld(narrow, near);
        finder.narrow(all, near, all);  // in its place
        REQUIRE(all.count == narrow.count);
        requireHeld(all, near);
    }
    REQUIRE(asked > 50);
    REQUIRE(held > 1000);
    REQUIRE(curved > 100);
}

TEST_CASE("neighbor list: the rows that an increment violates are those of brute force without the known ones",
          "[collision]") {
    std::mt19937 random(21);
    const SphereTree tool = bumpyBall(150, 7), obstacle = bumpyBall(200, 8);
    NeighborList list(tool, obstacle, 0);
    RowSet all(1 << 15), near(1 << 15), crossed(1 << 15);
    // Also for the answer of an elastic solve, whose rows are softened by the slack, and for one that deepens nothing.
    Crossing by;
    by.stiffness << 1, 1, 1, 1000, 1000, 1000;
    by.slack = GENERATE(0.0, 0.7);
    by.share = GENERATE(0.0, 0.3, 1.0);
    // With a list of all pairs, or of those that the path may violate.
    const bool onWay = GENERATE(false, true);
    const double nearest_mm = onWay ? 0 : 1;
    // With all pairs up to that margin as known rows, or only the nearest pair of each tool leaf.
    const bool nearest = GENERATE(false, true);
    int found = 0;
    for (int pose = 0; pose < (onWay ? 160 : 16); ++pose) {
        const Pose X = randomPose(random, 25);
        list.forget();
        REQUIRE(list.complete({X, 4}, 0.5));
        for (RowSet* rows : {&all, &near, &crossed}) rows->clear();
        REQUIRE(list.appendRows(X, Mat3::Identity(), 4, all));
        if (nearest)
            list.appendNearestRows(X, Mat3::Identity(), nearest_mm, near);
        else
            REQUIRE(list.appendRows(X, Mat3::Identity(), nearest_mm, near));
        for (int k = 0; k < 6; ++k) by.x[k] = std::uniform_real_distribution<double>(-1, 1)(random);
        by.x.head<3>() *= onWay ? 1.5 : 3;
        by.x.tail<3>() *= onWay ? 0.04 : 0.1;
        const int nearOnes = near.size();
        RowSet given(1 << 15);
        for (int i = 0; i < near.size(); ++i) given.push(near.row(i), near.gap()[i], near.id(i));
        if (onWay) {
            const Coverage asked = list.coverageOf({X, by.x.head<3>(), by.x.tail<3>()}, 4);
            REQUIRE(asked.within.margin < 0.1);
            list.forget();
            REQUIRE(list.complete(asked, 0.1));
        }
        // Each call adds the most violated ones of the remaining rows.
        const auto left = [&](const RowSet& rows, int i) {
            const double g = std::max(rows.gap()[i], by.share * rows.gap()[i]);
            const double length = rows.row(i).cwiseQuotient(by.stiffness.cwiseSqrt()).norm();
            return rows.row(i).dot(by.x) + g + by.slack * length;
        };
        for (int round = 0;; ++round) {
            REQUIRE(round < 30);
            crossed.clear();
            REQUIRE(list.appendCrossed(X, X, Mat3::Identity(), 4, by, near, crossed) != Crossed::Overflow);
            if (crossed.size() == 0) break;
            double worst = 0;
            for (int i = 0; i < all.size(); ++i)
                if (near.find(all.id(i)) < 0) worst = std::min(worst, left(all, i));
            const auto deepest = [&] {
                double least = 0;
                for (int i = 0; i < crossed.size(); ++i) least = std::min(least, left(crossed, i));
                return least;
            };
            REQUIRE(deepest() == Approx(worst).epsilon(1e-12));
            near.merge(crossed);
        }
        found += near.size() - nearOnes;
        int at = 0;
        for (int i = 0; i < all.size(); ++i) {
            const double s = left(all, i);
            if (std::abs(s) < 1e-9) continue;  // on the plane: either answer is right
            const bool expected = given.find(all.id(i)) >= 0 || s < 0;
            REQUIRE((near.find(all.id(i)) >= 0) == expected);
            if (!expected) continue;
            REQUIRE(near.id(at) == all.id(i));
            REQUIRE(near.row(at).isApprox(all.row(i), 1e-13));
            REQUIRE(near.gap()[at++] == all.gap()[i]);
        }
    }
    REQUIRE(found > 50);  // otherwise the test checks nothing
}

TEST_CASE("neighbor list: points have rows like spheres, also for a step of zero length", "[collision]") {
    const SphereTree point = makeSphereTree({{0, 0, 0, 0}});
    NeighborList list(point, point, 0);
    const Pose X{Vec3(1, 0, 0), Quat::Identity()};
    REQUIRE(list.coverageOf(X, 2).within.margin < 1e-9);
    REQUIRE(list.complete({X, 2}, 0.5));
    for (const double way : {0.0, -0.5, -1.5}) {
        RowSet none(8), crossed(8);
        Crossing by;
        by.x[0] = way;
        REQUIRE(list.appendCrossed(X, X, Mat3::Identity(), 2, by, none, crossed) != Crossed::Overflow);
        REQUIRE(crossed.size() == (way < -1 ? 1 : 0));
    }
}

TEST_CASE("neighbor list: re-measuring detects a pair that got deeper and accepts one that did not", "[collision]") {
    // Two unit spheres; they touch when the tool's center is at x = 2.
    const SphereTree one = makeSphereTree({{0, 0, 0, 1}});
    NeighborList list(one, one, 0);
    const auto at = [](double x) { return Pose{Vec3(x, 0, 0), Quat::Identity()}; };
    REQUIRE(list.complete({at(2), 1}, 0));
    REQUIRE_FALSE(list.remeasure(at(2), at(1.9996), 0.5e-3).deeper);  // 0.4 µm overlap: tolerated
    REQUIRE(list.remeasure(at(2), at(1.9), 0.5e-3).deeper);
    REQUIRE(list.remeasure(at(2), at(1.9), 0.5e-3).depth == Approx(0.1));
    REQUIRE_FALSE(list.remeasure(at(1.8), at(1.9), 0.5e-3).deeper);  // coming out
    REQUIRE_FALSE(list.remeasure(at(1.9), at(1.9), 0.5e-3).deeper);
    REQUIRE(list.remeasure(at(1.9), at(1.8), 0.5e-3).deeper);
}

TEST_CASE("neighbor list: re-measuring the rows of a step gives the result of re-measuring all pairs", "[collision]") {
    const unsigned seed = GENERATE(31u, 32u, 33u);
    CAPTURE(seed);
    std::mt19937 random(seed);
    const SphereTree tool = bumpyBall(150, seed), obstacle = bumpyBall(300, seed + 1);
    NeighborList all(tool, obstacle, 0), list(tool, obstacle, 0);
    const Pose away{Vec3(1000, 0, 0), Quat::Identity()};
    int deeper = 0, overlaps = 0, byRows = 0;
    for (int pose = 0; pose < 200; ++pose) {
        const Pose X = randomPose(random, 25);
        Crossing by;
        for (int k = 0; k < 6; ++k) by.x[k] = std::uniform_real_distribution<double>(-1, 1)(random);
        by.x.tail<3>() *= pose % 2 ? 0.15 : 0;
        const double tolerance = pose % 3 ? 0.5e-3 : 5;
        const StraightMotion step{X, by.x.head<3>(), by.x.tail<3>()};
        const double length = Extent(tool).length(step);
        double nearest = 1e30;
        for (int i = 0; i < tool.leafCount(); ++i)
            for (int j = 0; j < obstacle.leafCount(); ++j)
                nearest = std::min(nearest, (X * tool.leaf(i).center() - obstacle.leaf(j).center()).norm());
        RowSet none(1 << 15), crossed(1 << 15);
        REQUIRE(list.complete({X, 4}, 0.5));
        // On a long path all pairs within the margin are rows, and the tool moves no further than the margin.
        constexpr double kShare = 0.4;
        REQUIRE(list.appendCrossed(X, X, Mat3::Identity(), kShare * length, by, none, crossed) != Crossed::Overflow);
        REQUIRE(all.complete({X, 4}, 0.5));
        // Nothing is near there, so only the rows can detect the overlap.
        if (nearest > length) REQUIRE(list.complete({away, 4}, 0.5));
        byRows += nearest > length;
        for (const double share : {kShare, 0.1, 0.01}) {
            const Pose after = step.times(share).end(tool.center());
            const auto expected = all.remeasure(X, after, tolerance), got = list.remeasure(X, after, tolerance);
            REQUIRE(got.deeper == expected.deeper);
            if (!expected.deeper) REQUIRE(got.depth == expected.depth);
            deeper += expected.deeper;
            overlaps += !expected.deeper && expected.depth > 0;
        }
    }
    REQUIRE(deeper > 50);
    REQUIRE(overlaps > 20);
    REQUIRE(byRows > 50);

    // A leaf near a large sphere penetrates it by the curvature of its arc, which its row does not contain.
    const SphereTree pair = makeSphereTree({{5, 0, 0, 0.1f}, {-5, 0, 0, 0.1f}}),
                     large = makeSphereTree({{-15.101f, 0, 0, 20}});
    NeighborList bent(pair, large, 0);
    const StraightMotion turn{Pose{}, Vec3::Zero(), Vec3(0, 0, 0.1)};
    Crossing by;
    by.x.tail<3>() = turn.turn;
    RowSet none(8), crossed(8);
    REQUIRE(bent.complete({turn.X_OT, 0.2}, 0.1));
    REQUIRE(bent.appendCrossed(turn.X_OT, turn.X_OT, Mat3::Identity(), 0.2, by, none, crossed) != Crossed::Overflow);
    REQUIRE(bent.complete({away, 0.2}, 0.1));
    const Pose after = turn.times(0.4).end(pair.center());
    REQUIRE(bent.remeasure(turn.X_OT, after, 0.5e-3).deeper);
}

TEST_CASE("clearance: equals the smallest gap of brute force", "[collision]") {
    const unsigned seed = GENERATE(21u, 22u, 23u, 24u);
    CAPTURE(seed);
    std::mt19937 random(seed);
    const SphereTree tool = bumpyBall(1 + int(random() % 200), seed),
                     obstacle = bumpyBall(1 + int(random() % 400), seed + 1);
    TreeWalk walk(tool, obstacle);
    NeighborList list(tool, obstacle, 0);
    int overlaps = 0;
    for (int pose = 0; pose < 20; ++pose) {
        const Pose X = randomPose(random, 60);
        double least = 1e30;
        for (int i = 0; i < tool.leafCount(); ++i)
            for (int j = 0; j < obstacle.leafCount(); ++j) least = std::min(least, pairGap(tool, obstacle, X, i, j));
        REQUIRE(leastGap(tool, obstacle, X) == Approx(least).margin(1e-11));
        REQUIRE(leastGap(tool, obstacle, X, least - 1) == least - 1);
        // An initial pair changes nothing, and the nearest pair replaces it.
        LeafPair nearest{int(random() % unsigned(tool.leafCount())), int(random() % unsigned(obstacle.leafCount()))};
        REQUIRE(leastGap(tool, obstacle, X, 1e30, &nearest) == leastGap(tool, obstacle, X));
        REQUIRE(pairGap(tool, obstacle, X, nearest.toolLeaf, nearest.obstacleLeaf) == Approx(least).margin(1e-11));
        REQUIRE(deepestGap(tool, obstacle, walk, X) == leastGap(tool, obstacle, X, 0));
        overlaps += least < 0;
    }
    CAPTURE(overlaps);
    REQUIRE((overlaps > 0 && overlaps < 20));
}

TEST_CASE("free share: ends at the first contact of brute force", "[collision]") {
    const unsigned seed = GENERATE(31u, 32u, 33u, 34u);
    CAPTURE(seed);
    std::mt19937 random(seed);
    const SphereTree tool = bumpyBall(1 + int(random() % 200), seed),
                     obstacle = bumpyBall(1 + int(random() % 400), seed + 1);
    const double reach = tool.reach();
    std::uniform_real_distribution<double> coordinate(-1, 1);
    const auto vector = [&](double size) {
        return Vec3(size * Vec3(coordinate(random), coordinate(random), coordinate(random)));
    };
    int met = 0, inside = 0, missed = 0;
    for (int pose = 0; pose < 60; ++pose) {
        const StraightMotion way{randomPose(random, 60), vector(80), pose % 2 ? vector(0.2) : Vec3(Vec3::Zero())};
        // Test every pair in small steps: contact is a gap below both zero and its value at the start.
        const auto deepest = [&](double share) {
            const Pose X = way.times(share).end(tool.center());
            double least = 1e30;
            for (int i = 0; i < tool.leafCount(); ++i)
                for (int j = 0; j < obstacle.leafCount(); ++j)
                    least = std::min(least, pairGap(tool, obstacle, X, i, j) -
                                                std::min(0.0, pairGap(tool, obstacle, way.X_OT, i, j)));
            return least;
        };
        const double share = freeShare(tool, obstacle, way, tool.center(), reach);
        CAPTURE(pose, share);
        for (int k = 1; k <= 8; ++k) REQUIRE(deepest(share * k / 8) > -1e-8);
        met += share > 1e-6 && share < 1;
        inside += leastGap(tool, obstacle, way.X_OT) < 0;
        missed += share == 1;
        // It ends no earlier: the pair that stops it is no further away than the curvature of an arc to either side.
        const double bend = share * reach * way.turn.squaredNorm() / 2;
        if (share < 1) REQUIRE(deepest(share) < 2 * bend + 1e-8);
        REQUIRE(freeShare(tool, obstacle, way, tool.center(), reach, share / 2) == share / 2);
    }
    CAPTURE(met, inside, missed);
    REQUIRE((met >= 5 && inside >= 5 && missed >= 5));
}

TEST_CASE("free share: touching bodies may slide and separate, but not penetrate", "[collision]") {
    const SphereTree ball = makeSphereTree({{0, 0, 0, 1}});
    const Pose touching{Vec3(2, 0, 0), Quat::Identity()}, inside{Vec3(1.5, 0, 0), Quat::Identity()};
    for (const Pose& X : {touching, inside}) {
        REQUIRE(freeShare(ball, ball, {X, Vec3(0, 3, 0), Vec3::Zero()}, ball.center(), 0) == 1);
        REQUIRE(freeShare(ball, ball, {X, Vec3(3, 0, 0), Vec3::Zero()}, ball.center(), 0) == 1);
        REQUIRE(freeShare(ball, ball, {X, Vec3(-3, 0, 0), Vec3::Zero()}, ball.center(), 0) < 1e-8);
        REQUIRE(freeShare(ball, ball, {X, Vec3::Zero(), Vec3::Zero()}, ball.center(), 0) == 1);
    }
    // Straight ahead, 10 mm of 40 are free; a fast body does not jump over the obstacle.
    REQUIRE(freeShare(ball, ball, {Pose{Vec3(12, 0, 0), Quat::Identity()}, Vec3(-40, 0, 0), Vec3::Zero()},
                      ball.center(), 0) == Approx(0.25));
}

}  // namespace touchstone::collision_tests
