// Walks and searches at every finite pose: they read only inside the arrays, find only leaves that exist, and end. The
// address sanitizer detects reads past the end; every build checks the results.
#include <catch2/catch.hpp>

#include "haptics/collision/clearance.hpp"
#include "haptics/collision/leaf_gaps.hpp"
#include "haptics/collision/neighbor_list.hpp"
#include "tests/support/any_number.hpp"
#include "tests/support/sphere_models.hpp"

namespace touchstone::far_pose_tests {

using test::AnyNumber;
using test::blob;

namespace {

/// Leaf counts that leave lanes of every level empty, and one that fills all of them.
constexpr int kLeaves[] = {1, 3, 9, 65, 130, 512, 600};

struct Bodies {
    SphereTree tool, obstacle;

    explicit Bodies(AnyNumber& any)
        : tool(*blob(kLeaves[any.next() % std::size(kLeaves)], 40, any.next())),
          obstacle(*blob(kLeaves[any.next() % std::size(kLeaves)], 40, any.next())) {}

    void require(const PairEntry& entry) const {
        REQUIRE(entry.tool >= 0);
        REQUIRE(entry.tool < tool.leafCount());
        REQUIRE(entry.obstacle >= 0);
        REQUIRE(entry.obstacle < obstacle.levels[1].count);
    }
    void require(const RowSet& rows) const {
        for (int i = 0; i < rows.size(); ++i) {
            REQUIRE(toolLeafOf(rows.id(i)) < tool.leafCount());
            REQUIRE(obstacleLeafOf(rows.id(i)) < obstacle.leafCount());
            REQUIRE(rows.row(i).allFinite());
            REQUIRE(std::isfinite(rows.gap()[i]));
        }
    }
};

}  // namespace

TEST_CASE("far poses: a walk visits only leaves that exist, for any finite numbers", "[collision][far]") {
    const unsigned seed = GENERATE(range(1u, 25u));
    CAPTURE(seed);
    AnyNumber any(seed);
    const Bodies bodies(any);
    TreeWalk walk(bodies.tool, bodies.obstacle);
    for (int i = 0; i < 60; ++i) {
        StraightMotion motion({any.vector(), any.quaternion()});
        if (any.next() % 2) motion.shift = any.vector();
        if (any.next() % 2) motion.turn = any.vector();
        Within within(std::abs(any.next() % 2 ? any.number() : any.small()));
        if (any.next() % 4 == 0) within = {within.margin, std::abs(any.number()), std::abs(any.number())};
        std::int64_t entries = 0;
        walk.run({motion, within}, [&](const PairEntry* found, int count) {
            for (int n = 0; n < count; ++n) bodies.require(found[n]);
            entries += count;
        });
        // No entry occurs twice.
        REQUIRE(entries <= std::int64_t(bodies.tool.leafCount()) * bodies.obstacle.levels[1].count);
    }
}

TEST_CASE("far poses: nothing is near a tool that is far away", "[collision][far]") {
    const unsigned seed = GENERATE(range(1u, 13u));
    CAPTURE(seed);
    AnyNumber any(seed);
    const Bodies bodies(any);
    TreeWalk walk(bodies.tool, bodies.obstacle);
    LeafPairFinder finder(bodies.tool, bodies.obstacle);
    PairEntries entries(bodies.tool, bodies.obstacle);
    for (const double far : {1e3, 1e6, 1e12, 1e15, 1e18, 1e20, 1e25, 1e30, 1e38, 1e60, 1e150, 1e200, 1e308})
        for (int axes = 1; axes < 8; ++axes) {
            Pose X{Vec3::Zero(), any.rotation()};
            for (int k = 0; k < 3; ++k) X.p[k] = axes >> k & 1 ? (any.next() % 2 ? far : -far) : any.small();
            CAPTURE(X.p.transpose());
            int visited = 0;
            walk.run({X, 0.5}, [&](const PairEntry*, int count) { visited += count; });
            CHECK(visited == 0);
            CHECK(deepestGap(bodies.tool, bodies.obstacle, walk, X) == 0);
            CHECK(leastGap(bodies.tool, bodies.obstacle, X, 0) == 0);
            CHECK(freeShare(bodies.tool, bodies.obstacle, {X, Vec3(1, 2, 3), Vec3(0.1, 0, 0)}, bodies.tool.center(),
                            bodies.tool.reach()) == 1);
            REQUIRE(finder.find({X, 0.5}, entries));
            CHECK(entries.count == 0);
        }
}

TEST_CASE("far poses: the least gap is right as far as floats hold its square", "[collision][far]") {
    const unsigned seed = GENERATE(range(1u, 13u));
    CAPTURE(seed);
    AnyNumber any(seed);
    const Bodies bodies(any);
    for (const double far : {1e4, 1e6, 1e9, 1e12, 1e14, 1e15, 1.001e15, 1e16, 1e18}) {
        Pose X{Vec3(any.small(), any.small(), any.small()).normalized() * far, any.rotation()};
        if (any.next() % 2) X.p = Vec3::Constant(far);  // where padding used to be
        CAPTURE(X.p.transpose());
        LeafPair pair;
        const double least = leastGap(bodies.tool, bodies.obstacle, X, 1e30, &pair);
        CHECK(least == Approx(X.p.norm()).epsilon(1e-6).margin(200));  // no body is larger
        REQUIRE(pair.toolLeaf < bodies.tool.leafCount());
        REQUIRE(pair.obstacleLeaf < bodies.obstacle.leafCount());
        CHECK(leafGap(bodies.tool.leaf(pair.toolLeaf), bodies.obstacle.leaf(pair.obstacleLeaf), X) == least);
        // A path that ends before the other body meets nothing.
        const double reach = bodies.tool.reach();
        CHECK(freeShare(bodies.tool, bodies.obstacle, {X, -0.5 * X.p, Vec3::Zero()}, bodies.tool.center(), reach) == 1);
    }
}

TEST_CASE("far poses: clearance and free share end with a number up to their limit", "[collision][far]") {
    const unsigned seed = GENERATE(range(1u, 25u));
    CAPTURE(seed);
    AnyNumber any(seed);
    const Bodies bodies(any);
    TreeWalk walk(bodies.tool, bodies.obstacle);
    const double reach = bodies.tool.reach();
    for (int i = 0; i < 60; ++i) {
        const Pose X{any.vector(), any.quaternion()};
        CAPTURE(X.p.transpose(), X.q.coeffs().transpose());
        const double most = any.next() % 2 ? any.number() : 1e30;
        LeafPair pair{int(any.next()) % bodies.tool.leafCount(), int(any.next()) % bodies.obstacle.leafCount()};
        if (pair.toolLeaf < 0 || pair.obstacleLeaf < 0) pair = {};
        const double least = leastGap(bodies.tool, bodies.obstacle, X, most, &pair);
        REQUIRE(least <= most);
        REQUIRE(std::isfinite(least));
        REQUIRE(pair.toolLeaf < bodies.tool.leafCount());
        REQUIRE(pair.obstacleLeaf < bodies.obstacle.leafCount());
        const double deepest = deepestGap(bodies.tool, bodies.obstacle, walk, X);
        REQUIRE(deepest <= 0);
        REQUIRE(std::isfinite(deepest));
        const StraightMotion way{X, any.vector(), any.vector()};
        const double share = freeShare(bodies.tool, bodies.obstacle, way, bodies.tool.center(), reach, 1);
        REQUIRE(share >= 0);
        REQUIRE(share <= 1);
    }
}

TEST_CASE("far poses: entries and rows refer only to leaves that exist", "[collision][far]") {
    const unsigned seed = GENERATE(range(1u, 25u));
    CAPTURE(seed);
    AnyNumber any(seed);
    const Bodies bodies(any);
    NeighborList list(bodies.tool, bodies.obstacle, 0);
    LeafPairFinder finder(bodies.tool, bodies.obstacle);
    PairEntries entries(bodies.tool, bodies.obstacle), narrowed(bodies.tool, bodies.obstacle);
    RowSet rows(1 << 12), crossed(1 << 12);
    const Mat3 R = Mat3::Identity();
    for (int i = 0; i < 25; ++i) {
        StraightMotion motion({any.vector(), any.quaternion()});
        if (any.next() % 3 == 0) motion.X_OT = {Vec3(any.small(), any.small(), any.small()), any.rotation()};
        if (any.next() % 2) motion.shift = any.vector();
        if (any.next() % 2) motion.turn = any.vector();
        const double margin = std::abs(any.next() % 3 ? any.small() / 20 : any.number());
        const Coverage asked{motion, margin};
        const Pose X = motion.X_OT, other{any.vector(), any.quaternion()};
        const Vec3 shift = any.vector(), turn = any.vector();
        if (finder.find(asked, entries)) {
            for (int n = 0; n < entries.count; ++n) bodies.require(entries.at[n]);
            finder.narrow(entries, {X, margin / 2}, narrowed);
            for (int n = 0; n < narrowed.count; ++n) bodies.require(narrowed.at[n]);
        }
        list.expect({X, shift, turn});
        if (any.next() % 2) list.offer(&entries);
        list.complete(asked, std::abs(any.small()));
        rows.clear();
        if (list.appendRows(X, R, margin, rows)) bodies.require(rows);
        rows.clear();
        list.appendNearestRows(X, R, margin, rows);
        bodies.require(rows);
        rows.clear();
        crossed.clear();
        Crossing by;
        by.x << any.vector(), any.vector();
        if (list.appendCrossed(X, X, R, margin, by, rows, crossed) != Crossed::Overflow) bodies.require(crossed);
        REQUIRE(list.remeasure(X, other, 1e-3).depth >= 0);
        list.offer(nullptr);
    }
}

}  // namespace touchstone::far_pose_tests
