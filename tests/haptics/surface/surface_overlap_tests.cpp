// Overlap of closed parts, by exact predicates and by the library.
#include "haptics/surface/surface_overlap.hpp"

#include <catch2/catch.hpp>
#include <climits>
#include <numbers>
#include <random>

#include "haptics/surface/surface_distance.hpp"
#include "tests/support/exact_judge.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::surface_overlap_tests {

using namespace touchstone::test;

namespace {

constexpr double kNanometer = 1e-6, kMicrometer = 1e-3;  // mm

/// How far the mesh reaches along z when it is turned.
double reach(const TriangleMesh& mesh, const Vec3& turn) {
    double most = 0;
    for (const Vec3& p : mesh.vertices) most = std::max(most, (expRotation(turn) * p).z());
    return most;
}

}  // namespace

TEST_CASE("exact judge: sees an intersection of a micrometer, and none across a gap of a nanometer", "[surface]") {
    const double right = std::numbers::pi / 2;
    const Vec3 flat = Vec3::Zero(), aboutX(right / 2, 0, 0), aboutY(0, right / 2, 0),
               upright = std::acos(1 / std::sqrt(3.0)) * Vec3(-1, 1, 0).normalized();
    struct Case {
        const char* name;
        Vec3 tool, obstacle;
    };
    for (const Case& c :
         {Case{"face on face", flat, flat}, Case{"edge on face", aboutX, flat}, Case{"corner on face", upright, flat},
          Case{"face on corner", flat, upright}, Case{"edge across edge", aboutX, aboutY}}) {
        CAPTURE(c.name);
        const TriangleMesh tool = centeredBox(4, 4, 4), obstacle = centeredBox(6, 6, 6);
        const ExactJudge judge(tool, obstacle);
        const auto X_OT = [&](double gap) {
            const double height = reach(tool, c.tool) + reach(obstacle, c.obstacle) + gap;
            return at(0, 0, 0, c.obstacle).inverse() * at(0.1, 0.2, height, c.tool);
        };
        CHECK(judge.intersections(X_OT(-kMicrometer)) == 1);
        CHECK(judge.intersections(X_OT(-kNanometer)) == 1);
        CHECK(judge.intersections(X_OT(kNanometer)) == 0);
        CHECK_FALSE(judge.contained(X_OT(kNanometer)));
        CHECK(overlap(surfaceOf(tool), surfaceOf(obstacle), X_OT(-kMicrometer)));
        CHECK_FALSE(overlap(surfaceOf(tool), surfaceOf(obstacle), X_OT(kNanometer)));
    }
}

TEST_CASE("exact judge: counts each pair of triangles that intersect", "[surface]") {
    const TriangleMesh tool = blobMesh(3, 9, 5), obstacle = torusMesh(3, 1.5, 9, 7);
    const ExactJudge judge(tool, obstacle);
    std::vector<std::vector<ExactJudge>> pairs(tool.triangles.size());
    for (std::size_t i = 0; i < tool.triangles.size(); ++i)
        for (const auto& other : obstacle.triangles)
            pairs[i].push_back({{tool.vertices, {tool.triangles[i]}}, {obstacle.vertices, {other}}});
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    int most = 0;
    for (int pose = 0; pose < 20; ++pose) {
        const Pose X = at(2 * normal(random), 2 * normal(random), 2 * normal(random),
                          {normal(random), normal(random), normal(random)});
        int expected = 0;
        for (const auto& row : pairs)
            for (const ExactJudge& pair : row) expected += pair.intersections(X);
        CHECK(judge.intersections(X, INT_MAX) == expected);
        CHECK(judge.intersections(X, 3) == std::min(expected, 3));
        most = std::max(most, expected);
    }
    CHECK(most > 50);
}

TEST_CASE("overlap: a part inside the material of another overlaps, one in its cavity does not", "[surface]") {
    // Walls of 2 mm around a cavity of 4 mm.
    const TriangleMesh hollow = joined(centeredBox(8, 8, 8), flipped(centeredBox(4, 4, 4)));
    const auto check = [&](const TriangleMesh& tool, const Pose& X, bool expected) {
        CAPTURE(X.p.transpose());
        const ExactJudge judge(tool, hollow), swapped(hollow, tool);
        const Surface ours = surfaceOf(tool), others = surfaceOf(hollow);
        CHECK(judge.intersections(X) == 0);
        CHECK(judge.contained(X) == expected);
        CHECK(swapped.contained(X.inverse()) == expected);
        CHECK(overlap(ours, others, X) == expected);
        CHECK(overlap(others, ours, X.inverse()) == expected);
        CHECK((overlapDepth(ours, others, X) > 0) == expected);
    };
    const Vec3 turn(0.1, 0.2, 0.3);
    const TriangleMesh small = centeredBox(1, 1, 1);
    check(small, at(0, 0, 0, turn), false);
    check(small, at(3, 0, 0, turn), true);
    check(small, at(-3, 1, 2, turn), true);
    check(small, at(6, 0, 0, turn), false);
    check(centeredBox(20, 20, 20), at(0, 0, 0, turn), true);
    // Two bodies, one of which is in the cavity and one in the wall.
    check(joined(small, moved(small, 1, {3, 0, 0})), at(0, 0, 0), true);
    check(joined(small, moved(small, 1, {6, 0, 0})), at(0, 0, 0), false);

    CHECK(isInside(surfaceOf(hollow), {3, 1, 1}));
    CHECK_FALSE(isInside(surfaceOf(hollow), {1, 1, 1}));
    // The corners of the small box are 0.5 mm from its center, and the walls of the large one 5 mm.
    CHECK(overlapDepth(surfaceOf(small), surfaceOf(centeredBox(10, 10, 10)), Pose{}) == Approx(4.5).margin(1e-9));
}

TEST_CASE("overlap: parts whose faces are flush where they overlap", "[surface]") {
    const Surface cube = surfaceOf(centeredBox(10, 10, 10)), plate = surfaceOf(centeredBox(40, 1, 40)),
                  peg = surfaceOf(centeredBox(2, 10, 4));
    CHECK(overlap(cube, cube, Pose{}));
    CHECK(overlapDepth(cube, cube, at(9, 0, 0)) == Approx(1).margin(1e-9));
    CHECK(overlapDepth(cube, cube, at(9, 4, 0)) == Approx(1).margin(1e-9));
    CHECK(overlapDepth(cube, cube, at(9, 0, -7)) == Approx(1).margin(1e-9));
    CHECK(overlapDepth(cube, cube, at(10, 0, 0)) == Approx(0).margin(1e-9));
    // Flush with two sides of the plate and 0.25 mm deep, far from the middle of its faces.
    const Pose corner = at(19, 5.25, 18);
    CHECK(overlapDepth(peg, plate, corner) == Approx(0.25).margin(1e-9));
    CHECK(overlapDepth(plate, peg, corner.inverse()) == Approx(0.25).margin(1e-9));
}

TEST_CASE("overlap: its depth is that of the deepest vertex, or of the middle of an edge that passes through",
          "[surface]") {
    // Bars that cross, 0.5 mm deep: no vertex of either is in the other.
    const Surface along = surfaceOf(centeredBox(20, 2, 2)), across = surfaceOf(centeredBox(2, 20, 2));
    CHECK(overlapDepth(along, across, at(0, 0, 1.5)) == Approx(0.5).margin(1e-9));
    CHECK(overlapDepth(across, along, at(0.3, 0.2, -1.5)) == Approx(0.5).margin(1e-9));
    CHECK(overlapDepth(along, across, at(0, 0, 2.1)) == 0);

    const Surface tool = surfaceOf(blobMesh(4, 40, 21)), obstacle = surfaceOf(blobMesh(5, 44, 25));
    for (const double shift : {0.0, 3.0, 7.0, 8.5}) {
        const Pose X = at(shift, 0.2, 0.1, Vec3(0.3, 0.2, 0.1));
        double deepest = 0;
        for (const auto& [inner, outer, way] :
             {std::tuple(&tool, &obstacle, X), std::tuple(&obstacle, &tool, X.inverse())})
            for (const Vec3& p : inner->features.points)
                if (isInside(*outer, way * p)) deepest = std::max(deepest, distanceTo(*outer, way * p));
        CAPTURE(shift);
        REQUIRE(deepest > 0.05);
        CHECK(overlapDepth(tool, obstacle, X) >= deepest);
        CHECK(overlapDepth(tool, obstacle, X) <= 1.2 * deepest);  // where an edge is deeper than its ends
    }
}

TEST_CASE("overlap: agrees with exact predicates on random poses close to contact", "[surface]") {
    struct Pair {
        const char* name;
        TriangleMesh tool, obstacle;
    };
    const Pair pairs[] = {
        {"boxes", centeredBox(4, 3, 2), centeredBox(5, 6, 7)},
        {"box and thin plate", centeredBox(4, 3, 2), centeredBox(20, 20, 0.01)},
        {"blobs", blobMesh(4, 24, 13), blobMesh(5, 22, 11)},
        {"bar and ring", centeredBox(3, 3, 16), torusMesh(5, 2, 30, 14)},
        {"needle and ball", centeredBox(0.02, 0.03, 12), sphereMesh(4, 30, 15)},
        {"speck and large ring", centeredBox(0.05, 0.04, 0.03), torusMesh(60, 30, 40, 20)},
        {"two shells", joined(sphereMesh(2), moved(sphereMesh(2), 1, {5, 0, 0})), torusMesh(5, 2, 30, 14)},
    };
    std::mt19937 random(11);
    std::normal_distribution<double> normal;
    const auto vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
    for (const Pair& pair : pairs) {
        CAPTURE(pair.name);
        const ExactJudge judge(pair.tool, pair.obstacle);
        const Surface tool = surfaceOf(pair.tool), obstacle = surfaceOf(pair.obstacle);
        int overlaps = 0, poses = 0;
        for (int approach = 0; approach < 30; ++approach) {
            // At distance zero a point within the tool is at a vertex of the obstacle.
            const Vec3 direction = vector().normalized(), turn = 2 * vector();
            const auto vertex = [&](const TriangleMesh& mesh) {
                return mesh.vertices[random() % mesh.vertices.size()];
            };
            const Vec3 meeting = vertex(pair.obstacle) - expRotation(turn) * (0.9 * vertex(pair.tool));
            const auto X = [&](double distance) { return Pose{meeting + distance * direction, expRotation(turn)}; };
            double far = 3 * (tool.extent.reach + obstacle.extent.reach), near = 0;
            REQUIRE_FALSE(judge.overlap(X(far)));
            // Where the parts begin to overlap, or at least one such place.
            if (!judge.overlap(X(near))) continue;
            while (far - near > 0.1 * kNanometer) {
                const double middle = (far + near) / 2;
                (judge.overlap(X(middle)) ? near : far) = middle;
            }
            for (const double gap : {kNanometer, 100 * kNanometer, kMicrometer, 20 * kMicrometer})
                for (const double distance : {near - gap, far + gap}) {
                    const Pose exact = X(distance), turned = Pose{exact.p, expRotation(gap * vector()) * exact.q};
                    for (const Pose& pose : {exact, turned}) {
                        CAPTURE(approach, gap, distance > far);
                        const bool expected = judge.overlap(pose);
                        REQUIRE(overlap(tool, obstacle, pose) == expected);
                        if (!expected && gap == kMicrometer) REQUIRE(overlapDepth(tool, obstacle, pose) == 0);
                        overlaps += expected;
                        ++poses;
                    }
                }
        }
        CHECK(overlaps > poses / 4);
        CHECK(overlaps < 3 * poses / 4);
        CHECK(poses > 100);
    }
}

}  // namespace touchstone::surface_overlap_tests
