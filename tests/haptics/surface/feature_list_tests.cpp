#include "haptics/surface/feature_list.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <numbers>
#include <set>

#include "haptics/reference/mesh_reference.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/random.hpp"

namespace touchstone::feature_list_tests {

using namespace touchstone::test;

namespace {

constexpr double kDistance = 2e-3;

Surface boxPart() { return surfaceOf(test::boxMesh({8, 6, 7}, {-4, -3, -3})); }
/// With the box its tree differs in height.
Surface densePart() { return surfaceOf(test::blobMesh(4, 40, 16)); }
Surface toolOf(unsigned seed) {
    if (seed >= 7) return seed == 7 ? boxPart() : densePart();
    return surfaceOf(seed % 2 ? test::torusMesh(4, 1.5, 14, 9) : test::blobMesh(4, 12, 7));
}
Surface obstacleOf(unsigned seed) {
    if (seed >= 7) return seed == 7 ? densePart() : boxPart();
    return seed % 3 ? surfaceOf(test::blobMesh(5, 12, 7)) : boxPart();
}

/// Whether two features can touch as they are turned.
bool canTouch(const Surface& tool, const Surface& obstacle, const Pose& X_OT, const PairEntry& pair) {
    const auto stands = [](const Surface& s, const SurfaceFeatures::Vertex& v, const Vec3& normal) {
        for (int k = 0; k < v.spokes; ++k)
            if ((s.features.points[s.features.spokes[v.firstSpoke + k]] - s.features.points[v.point]).dot(normal) < 0)
                return false;
        return true;
    };
    const int feature = featureOf(pair.tool);
    if (kindOf(pair.tool) == PairKind::VertexFace)
        return stands(tool, tool.features.vertices[feature],
                      X_OT.q.conjugate() * obstacle.features.faces[pair.obstacle].normal);
    if (kindOf(pair.tool) == PairKind::FaceVertex)
        return stands(obstacle, obstacle.features.vertices[pair.obstacle],
                      X_OT.q * tool.features.faces[feature].normal);
    const EdgePlace a = edgePlaceOf(tool.features, tool.features.edges[feature]),
                    b = edgePlaceOf(obstacle.features, obstacle.features.edges[pair.obstacle]);
    const Vec3 m = (X_OT.q * (a.ends[1] - a.ends[0])).cross(b.ends[1] - b.ends[0]);
    const auto rises = [&](const Vec3& up) {
        return (X_OT.q * a.wings[0]).dot(up) >= 0 && (X_OT.q * a.wings[1]).dot(up) >= 0 && b.wings[0].dot(up) <= 0 &&
               b.wings[1].dot(up) <= 0;
    };
    return rises(m) || rises(-m);
}

}  // namespace

TEST_CASE("feature pairs: a search finds all pairs that come within the margin and can touch, and no distant ones") {
    const auto seed = unsigned(GENERATE(range(1, 5)));
    CAPTURE(seed);
    Random random(seed);
    const Surface tool = toolOf(seed), obstacle = obstacleOf(seed);
    FeaturePairFinder finder(tool, obstacle);
    PairEntries entries = finder.entries(), narrowed = finder.entries();
    std::size_t expected = 0;
    for (int n = 0; n < 40; ++n) {
        StraightMotion motion = random.pose(4, 1);
        if (n % 2) motion.shift = 0.3 * random.vector(), motion.turn = 0.05 * random.vector();
        const double margin = n == 0 ? 50 : n % 4 < 2 ? 0.4 : 1.5;  // at the first all nodes meet
        // A turning point ends beside its straight way.
        const double bend = tool.extent.reach * motion.turn.squaredNorm() / 2;
        REQUIRE(finder.find({motion, margin}, entries));
        std::map<std::pair<int, int>, float> found;
        for (int i = 0; i < entries.count; ++i) found[{entries.at[i].tool, entries.at[i].obstacle}] = entries.gap[i];
        CHECK(int(found.size()) == entries.count);
        const auto at = [&](double s) { return motion.times(s).end(tool.extent.center); };
        const auto check = [&](PairKind kind, int t, int o) {
            const PairEntry pair{toolFeature(kind, t), o};
            double least = 1e9;
            bool touches = false;
            for (const double s : {0.0, 0.5, 1.0}) {
                const double gap = finder.nearest(at(s), pair).distance();
                least = std::min(least, gap);
                touches = touches || (gap < margin - bend - 0.01 && canTouch(tool, obstacle, at(s), pair));
            }
            const auto entry = found.find({pair.tool, pair.obstacle});
            expected += touches;
            if (touches) {
                REQUIRE(entry != found.end());
                REQUIRE(entry->second <= least + bend + 1e-4);
            }
        };
        for (int t = 0; t < int(tool.features.vertices.size()); ++t)
            for (int o = 0; o < int(obstacle.features.faces.size()); ++o) check(PairKind::VertexFace, t, o);
        for (int t = 0; t < int(tool.features.faces.size()); ++t)
            for (int o = 0; o < int(obstacle.features.vertices.size()); ++o) check(PairKind::FaceVertex, t, o);
        for (int t = 0; t < int(tool.features.edges.size()); ++t)
            for (int o = 0; o < int(obstacle.features.edges.size()); ++o) check(PairKind::EdgeEdge, t, o);
        if (!motion.stays()) continue;
        for (int i = 0; i < entries.count; ++i)
            REQUIRE(finder.nearest(motion.X_OT, entries.at[i]).distance() <= margin + 2 * finder.guard(motion.X_OT));
        // Selecting from more pairs gives all that a search gives, which also leaves out by the cones of groups.
        finder.narrow(entries, {motion, margin / 3}, narrowed);
        std::set<std::pair<int, int>> selected, searched;
        for (int i = 0; i < narrowed.count; ++i) selected.insert({narrowed.at[i].tool, narrowed.at[i].obstacle});
        REQUIRE(finder.find({motion, margin / 3}, narrowed));
        for (int i = 0; i < narrowed.count; ++i) searched.insert({narrowed.at[i].tool, narrowed.at[i].obstacle});
        CHECK(std::includes(selected.begin(), selected.end(), searched.begin(), searched.end()));
    }
    CHECK(expected > 8);
}

TEST_CASE("feature pairs: the gap of a large part that turns is at most its distance on the way") {
    Random random(5);
    const Surface tool = surfaceOf(test::boxMesh({20, 20, 4}, {-10, -10, -2})),
                  obstacle = surfaceOf(test::blobMesh(1.5, 12, 7));
    FeaturePairFinder finder(tool, obstacle);
    PairEntries entries = finder.entries();
    const double margin = 0.8;
    int checked[3] = {};
    for (int n = 0; n < 200; ++n) {
        const Vec3 aside = 7 * random.vector();
        const StraightMotion motion{Pose{{aside.x(), aside.y(), 3.7}, Quat::Identity()}, 0.2 * random.vector(),
                                    0.05 * random.vector()};
        const double bend = tool.extent.reach * motion.turn.squaredNorm() / 2;
        REQUIRE(finder.find({motion, margin}, entries));
        for (int i = 0; i < entries.count; ++i) {
            const PairEntry& pair = entries.at[std::size_t(i)];
            double least = 1e9;
            for (int k = 0; k <= 10; ++k)
                least = std::min(least, finder.nearest(motion.times(0.1 * k).end(tool.extent.center), pair).distance());
            CHECK(entries.gap[std::size_t(i)] <= least + bend + 1e-4);
            ++checked[int(kindOf(pair.tool))];
        }
    }
    CHECK(checked[int(PairKind::FaceVertex)] > 200);
    CHECK(checked[int(PairKind::EdgeEdge)] > 200);
}

TEST_CASE("feature pairs: the gap of surfaces that slide is the distance at which they slide") {
    const Surface tool = surfaceOf(test::boxMesh({8, 8, 2}, {-4, -4, -1})),
                  obstacle = surfaceOf(test::boxMesh({20, 20, 2}, {-10, -10, -1}));
    FeaturePairFinder finder(tool, obstacle);
    PairEntries entries = finder.entries();
    const double way = GENERATE(0.02, 0.1, 0.4, 1.2), turn = GENERATE(0.0, 0.002);
    const StraightMotion motion{
        Pose{{0.3, 0.2, 2.1}, expRotation({0, 0, 0.3})}, {0.8 * way, 0.6 * way, 0}, {0, 0, turn}};
    REQUIRE(finder.find({motion, 0.5}, entries));
    int over = 0;
    for (int i = 0; i < entries.count; ++i) {
        const double gap = entries.gap[std::size_t(i)];
        CHECK(gap <= finder.nearest(motion.X_OT, entries.at[std::size_t(i)]).distance() + 1e-4);
        over += gap < 0.101;
        // Shorter ways are measured once, and a turn takes what it moves the vertices of a face against each other.
        if (way > 0.03) CHECK(gap >= 0.1 - turn * 8 * 3 - 1e-4);
    }
    CHECK(over >= 4);  // its corners are over faces
}

TEST_CASE("feature pairs: a selection for another motion holds every pair that comes near on it") {
    const auto seed = unsigned(GENERATE(range(1, 7)));
    CAPTURE(seed);
    Random random(seed);
    const Surface tool = toolOf(seed), obstacle = obstacleOf(seed);
    FeaturePairFinder finder(tool, obstacle);
    PairEntries wide = finder.entries(), selected = finder.entries();
    const int separated = wide.apart.capacity();
    int near[3] = {};
    for (int n = 0; n < 60; ++n) {
        const StraightMotion motion{random.pose(4, 1), 0.3 * random.vector(), (n % 3 ? 0.05 : 0.0) * random.vector()};
        wide.apart.resize(n % 2 ? 8 : separated);  // not all entries of a large set have separations
        REQUIRE(finder.find({motion, 2.0}, wide));
        const Pose start = motion.times(0.5).end(tool.extent.center);
        const StraightMotion other{
            {start.p + 0.05 * random.vector(), start.q}, 0.2 * random.vector(), 0.04 * random.vector()};
        const double bend = tool.extent.reach * other.turn.squaredNorm() / 2;
        for (const double margin : {0.6, 0.2}) {
            REQUIRE(finder.reserve(wide, {other, margin}) >= 0);
            // The second one is selected from the first.
            finder.narrow(margin == 0.6 ? wide : selected, {other, margin}, selected, n % 4 > 1);
            std::map<std::pair<int, int>, float> found;
            for (int i = 0; i < selected.count; ++i)
                found[{selected.at[i].tool, selected.at[i].obstacle}] = selected.gap[i];
            CHECK(int(found.size()) == selected.count);
            for (int i = 0; i < wide.count; ++i) {
                double least = 1e9;
                for (int k = 0; k <= 10; ++k)
                    least = std::min(
                        least, finder.nearest(other.times(0.1 * k).end(tool.extent.center), wide.at[i]).distance());
                const auto entry = found.find({wide.at[i].tool, wide.at[i].obstacle});
                if (least > margin - bend - 1e-4) continue;
                REQUIRE(entry != found.end());
                REQUIRE(entry->second <= least + bend + 1e-4);
                ++near[int(kindOf(wide.at[i].tool))];
            }
        }
    }
    for (const int pairs : near) CHECK(pairs > 10);
}

TEST_CASE("feature pairs: surfaces that slide stay as far apart in a selection as they are") {
    const Surface tool = surfaceOf(test::boxMesh({8, 8, 2}, {-4, -4, -1})),
                  obstacle = surfaceOf(test::boxMesh({20, 20, 2}, {-10, -10, -1}));
    // Either part may be the one that moves, and either has the vertices that are near.
    const bool swapped = GENERATE(false, true);
    FeaturePairFinder finder(swapped ? obstacle : tool, swapped ? tool : obstacle);
    PairEntries wide = finder.entries(), selected = finder.entries();
    const Pose start{{0.2, 0.1, 2.05}, Quat::Identity()};
    REQUIRE(finder.find({start, 1.0}, wide));
    REQUIRE(wide.count > 0);
    const StraightMotion slide{start, {0.3, -0.2, 0}, {0, 0, 0.01}};
    finder.narrow(wide, {slide, 0.04}, selected);
    CHECK(selected.count == 0);
    finder.narrow(wide, {slide, 0.06}, selected);
    CHECK(selected.count > 0);
    for (int i = 0; i < selected.count; ++i) CHECK(selected.gap[i] == Approx(0.05).margin(4e-3));
}

TEST_CASE("feature list: it holds what was asked for, whatever was expected and searched before") {
    const auto seed = unsigned(GENERATE(range(1, 5)));
    CAPTURE(seed);
    Random random(seed);
    const Surface tool = surfaceOf(test::blobMesh(4, 24, 13)), obstacle = surfaceOf(test::torusMesh(6, 2, 28, 14));
    FeatureList list(tool, obstacle, 0);
    Pose X = random.pose(3, 1);
    Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();
    int fast = 0;
    for (int n = 0; n < 4000; ++n) {
        if (n % 50 == 0) {
            shift = (n % 100 ? 0.3 : 0.05) * random.vector();
            turn = (n % 3 ? 0.0 : 0.03) * random.vector();
        }
        list.expect({X, shift, turn});
        // The steps of a tick leave the expected motion by more and more.
        for (const double share : {0.1, 0.4, 1.0}) {
            const StraightMotion step{X, share * shift + 0.04 * share * random.vector(), share * turn};
            const double margin = 0.001 + 0.02 * std::abs(random.normal(random.engine));
            // A motion that turns lies beside itself by the bends of its arcs, as far as the list can tell.
            const double bends = 3 * tool.extent.reach * step.turn.squaredNorm() / 2;
            REQUIRE(list.complete({step, margin + bends}, 0.5));
            REQUIRE(list.isComplete({step, margin}));
            fast += tool.extent.length(step) > 0.3;
        }
        X = StraightMotion{X, shift, turn}.end(tool.extent.center);
        if (X.p.norm() > 8) X = random.pose(3, 1);
    }
    CHECK(fast > 100);
}

TEST_CASE("feature list: the rows of a step do not depend on where and how widely the pairs were found") {
    const auto seed = unsigned(GENERATE(range(1, 5)));
    CAPTURE(seed);
    Random random(seed);
    const Surface tool = surfaceOf(test::blobMesh(4, 16, 9)), obstacle = surfaceOf(test::torusMesh(5, 2, 16, 10));
    FeatureList fresh(tool, obstacle, 3), aged(tool, obstacle, 3);
    for (FeatureList* list : {&fresh, &aged}) list->keepApart(kDistance);
    int crossedSteps = 0, pairsAround = 0, pairsTested = 0, pairsCrossing = 0;
    for (int n = 0; n < 300; ++n) {
        // Near poses at which the parts just do not overlap.
        Pose X = random.pose(3, 1);
        while (overlap(tool, obstacle, X)) X.p *= 1.05;
        Crossing by;
        by.x << 0.1 * random.vector(), 0.01 * random.vector();
        const Mat3 R = expRotation(random.vector()).toRotationMatrix();
        const StraightMotion step{X, R.transpose() * by.x.head<3>(), R.transpose() * by.x.tail<3>()};
        using Rows = std::map<std::uint64_t, std::array<double, 7>>;
        const auto rowsIn = [](const RowSet& crossed) {
            Rows all;
            for (int i = 0; i < crossed.size(); ++i) {
                const Vec6 row = crossed.row(i);
                all[crossed.id(i)] = {row[0], row[1], row[2], row[3], row[4], row[5], crossed.gap()[i]};
                CHECK(crossed.id(i) >> 56 == 3);
                if (i > 0) CHECK(crossed.id(i) > crossed.id(i - 1));
            }
            return all;
        };
        const auto rowsOf = [&](FeatureList& list) {
            RowSet rows(1 << 10), crossed(1 << 10);
            REQUIRE(list.appendCrossed(X, X, R, 1, by, rows, crossed) != Crossed::Overflow);
            return rowsIn(crossed);
        };
        fresh.forget();
        REQUIRE(fresh.complete(fresh.coverageOf(step, 1), 0.1));
        const double away = n % 3 ? 0.03 : 0.3;
        Pose other{X.p + 0.2 * random.vector(), (expRotation(away * random.vector()) * X.q).normalized()};
        aged.forget();
        REQUIRE(aged.complete({other, deviation(other, step, tool.extent) + 0.5}, 0.3));
        REQUIRE(aged.complete(aged.coverageOf(step, 1), 0.3));
        const Rows expected = rowsOf(fresh);
        CHECK(rowsOf(aged) == expected);
        for (const auto& [id, row] : expected) CHECK(fresh.hasFeatures(id));
        crossedSteps += !expected.empty();
        // No pair that crosses is left out before its test.
        FeaturePairFinder finder(tool, obstacle);
        PairEntries around = finder.entries();
        const Pose from = n % 2 ? X : other;
        REQUIRE(finder.find({from, deviation(from, step, tool.extent) + 0.5}, around));
        const Pose after = step.end(tool.extent.center);
        std::set<std::pair<int, int>> tested;
        finder.forEachCrossing(around, {step, 0.5}, X, after, kDistance / 2, [&](const PairEntry& pair) {
            return tested.insert({pair.tool, pair.obstacle}).second;
        });
        pairsAround += around.count;
        pairsTested += int(tested.size());
        for (int i = 0; i < around.count; ++i) {
            const PairEntry& pair = around.at[std::size_t(i)];
            if (!fresh.deepens(pair, X, after)) continue;
            ++pairsCrossing;
            REQUIRE(tested.count({pair.tool, pair.obstacle}) == 1);
        }
        // What crosses nothing leaves the parts apart.
        if (expected.empty() && step.turn.norm() < 0.01) CHECK(!overlap(tool, obstacle, step.end(tool.extent.center)));
        if (expected.empty()) CHECK(!fresh.remeasure(X, step.end(tool.extent.center), 0).deeper);
    }
    CHECK(crossedSteps > 20);
    CHECK(pairsCrossing > 20);
    CHECK(pairsTested < pairsAround / 3);
}

TEST_CASE("feature list: where large parts all but touch, rounding leaves out no pair that a small step crosses") {
    const auto seed = unsigned(GENERATE(range(1, 5)));
    CAPTURE(seed);
    Random random(seed);
    const Surface tool = surfaceOf(test::boxMesh({60, 70, 80}, {-30, -35, -40})),
                  obstacle = surfaceOf(test::boxMesh({90, 100, 80}, {-45, -50, -40}));
    FeatureList list(tool, obstacle, 0);
    list.keepApart(kDistance);
    FeaturePairFinder finder(tool, obstacle);
    PairEntries around = finder.entries();
    int crossing = 0, ofEdges = 0;
    for (int n = 0; n < 60; ++n) {
        Pose X = random.pose(60, 1);
        while (overlap(tool, obstacle, X)) X.p *= 1.05;
        // Toward the middle until they touch, and back by less than the distance that is kept.
        double near = 0, apart = 1;
        const Vec3 p = X.p;
        while ((apart - near) * p.norm() > 1e-3 * kDistance) {
            const double middle = (near + apart) / 2;
            X.p = middle * p;
            (overlap(tool, obstacle, X) ? near : apart) = middle;
        }
        X.p = apart * p + 0.7 * kDistance * p.normalized();
        for (int k = 0; k < 5; ++k) {
            const double length = kDistance * std::pow(10, -k / 2.0 + 1);
            const StraightMotion step{X, length * random.vector(), length / 100 * random.vector()};
            const Pose after = step.end(tool.extent.center);
            REQUIRE(finder.find({step, 0.5}, around));
            std::set<std::pair<int, int>> tested;
            finder.forEachCrossing(around, {step, 0.5}, X, after, kDistance / 2, [&](const PairEntry& pair) {
                return tested.insert({pair.tool, pair.obstacle}).second;
            });
            for (int i = 0; i < around.count; ++i) {
                const PairEntry& pair = around.at[std::size_t(i)];
                if (!list.deepens(pair, X, after)) continue;
                ++crossing;
                ofEdges += kindOf(pair.tool) == PairKind::EdgeEdge;
                CHECK(tested.count({pair.tool, pair.obstacle}) == 1);
            }
        }
    }
    CHECK(crossing > 50);
    CHECK(ofEdges > 20);
}

TEST_CASE("feature pairs: edges that slide across each other at the distance kept are not tested") {
    // Two boxes, ridge on ridge.
    TriangleMesh roof = centeredBox(10, 10, 10);
    const Quat turned = expRotation(std::numbers::pi / 4 * Vec3::UnitX());
    for (Vec3& vertex : roof.vertices) vertex = turned * vertex;
    const Surface tool = surfaceOf(centeredBox(10, 10, 10)), obstacle = surfaceOf(roof);
    FeaturePairFinder finder(tool, obstacle);
    FeatureList list(tool, obstacle, 0);
    list.keepApart(kDistance);
    PairEntries near = finder.entries();
    const auto tested = [&](const Vec3& shift, const Vec3& turn) {
        const Pose X{{0, 0, 10 * std::numbers::sqrt2 + kDistance}, expRotation(std::numbers::pi / 4 * Vec3::UnitY())};
        const StraightMotion step{X, shift, turn};
        REQUIRE(finder.find({step, 0.1}, near));
        REQUIRE(near.count > 0);
        int count = 0, crossed = 0;
        const Pose after = step.end(tool.extent.center);
        finder.forEachCrossing(near, {step, 0.1}, X, after, kDistance / 2, [&](const PairEntry& pair) {
            CHECK(kindOf(pair.tool) == PairKind::EdgeEdge);
            crossed += list.deepens(pair, X, after);
            return ++count > 0;
        });
        return std::pair(count, crossed);
    };
    using Counts = std::pair<int, int>;
    CHECK(tested({0.1, -0.2, 0}, Vec3::Zero()) == Counts(0, 0));
    CHECK(tested({0.01, -0.02, 0}, {0, 0, 0.001}) == Counts(0, 0));
    CHECK(tested({0, 0, -0.4 * kDistance}, Vec3::Zero()) == Counts(0, 0));
    CHECK(tested({0.1, -0.2, -0.6 * kDistance}, Vec3::Zero()) == Counts(1, 1));
    CHECK(tested({0.1, -0.2, -0.6 * kDistance}, {0, 0, 0.01}) == Counts(1, 1));
    CHECK(tested({0, 0, -2 * kDistance}, Vec3::Zero()) == Counts(1, 1));
}

}  // namespace touchstone::feature_list_tests
