#include "haptics/builder/mesh_repair.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "haptics/builder/solid_depth.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::mesh_repair_tests {
namespace {

int count(const RepairedMesh& m, FaceRole role) {
    return static_cast<int>(
        std::count_if(m.faces.begin(), m.faces.end(), [&](const Face& f) { return f.role == role; }));
}

/// Depth in mm at a point in mm.
double depthAt(const TriangleMesh& mesh, const Vec3& p) {
    const RepairedMesh body = repairMesh(mesh);
    return SolidDepth(body).depth(p * body.scale) / body.scale;
}

const TriangleMesh kBox = test::boxMesh(Vec3(10, 10, 10));
const Vec3 kCenter(5, 5, 5);

TEST_CASE("mesh repair: a box is closed for any orientation or split of its faces", "[tree]") {
    TriangleMesh mixed = kBox;
    for (std::size_t i = 0; i < mixed.triangles.size(); i += 3) std::swap(mixed.triangles[i][0], mixed.triangles[i][1]);
    TriangleMesh jittered = test::unwelded(kBox);
    for (std::size_t i = 0; i < jittered.vertices.size(); ++i)
        jittered.vertices[i].x() += 1e-7 * static_cast<double>(i % 5);
    for (const TriangleMesh& mesh :
         {kBox, test::flipped(kBox), mixed, test::unwelded(kBox), jittered, test::joined(kBox, kBox)}) {
        const RepairedMesh body = repairMesh(mesh);
        CHECK(body.closed());
        CHECK(count(body, FaceRole::Wall) == 12);
        CHECK(count(body, FaceRole::Sheet) == 0);
        CHECK(depthAt(mesh, kCenter) == Approx(5).epsilon(1e-6));
        CHECK(depthAt(mesh, Vec3(5, 5, 12)) == Approx(-2).epsilon(1e-6));
        CHECK(depthAt(mesh, Vec3(13, 14, 5)) == Approx(-5).epsilon(1e-6));
    }
}

TEST_CASE("mesh repair: an open box is a sheet, and its note says so", "[tree]") {
    TriangleMesh open = kBox;
    open.triangles.resize(10);
    const RepairedMesh body = repairMesh(open);
    CHECK_FALSE(body.closed());
    CHECK(count(body, FaceRole::Sheet) == 10);
    CHECK(body.holes == 0);
    CHECK(depthAt(open, kCenter) == Approx(-5));
}

TEST_CASE("mesh repair: a small hole that no sure cap closes is closed by guess and counted", "[tree]") {
    TriangleMesh holed = test::blobMesh(10);
    const std::size_t all = holed.triangles.size();
    const auto& missing = holed.triangles[300];
    const Vec3 middle = (holed.vertices[missing[0]] + holed.vertices[missing[1]] + holed.vertices[missing[2]]) / 3;
    holed.triangles.erase(holed.triangles.begin() + 300);
    // A thin stick through the hole crosses every cap.
    const TriangleMesh stick = test::moved(test::boxMesh(Vec3(0.1, 0.1, 4)), 1, middle - Vec3(0.05, 0.05, 2));
    const RepairedMesh body = repairMesh(test::joined(holed, stick));
    CHECK_FALSE(body.closed());
    CHECK(body.holes == 1);
    CHECK(body.closedHoles.empty());
    CHECK(count(body, FaceRole::Cap) == 3);
    CHECK(body.cover.size() == all - 1 + 12);
    CHECK(depthAt(holed, Vec3::Zero()) > 5);
}

TEST_CASE("mesh repair: the defects of a body that is not closed are counted", "[tree]") {
    const auto check = [](const TriangleMesh& mesh, int holes, int openEdges, int crowdedEdges) {
        const RepairedMesh body = repairMesh(mesh);
        CHECK(body.closed() == (openEdges + crowdedEdges == 0));
        const MeshDefects defects = defectsOf(body);
        CHECK(defects.holes == holes);
        CHECK(defects.openEdges == openEdges);
        CHECK(defects.crowdedEdges == crowdedEdges);
    };
    check(kBox, 0, 0, 0);
    TriangleMesh open = kBox;
    open.triangles.resize(10);
    check(open, 1, 4, 0);
    TriangleMesh holed = test::blobMesh(10);  // two small holes, which are closed for sure
    holed.triangles.erase(holed.triangles.begin() + 300);
    holed.triangles.erase(holed.triangles.begin() + 100);
    check(holed, 0, 0, 0);
    // A fin on an edge of the box, in the plane that halves the angle outside.
    check(test::joined(kBox, {{Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(5, -5, -5)}, {{0, 1, 2}}}), 1, 2, 1);
}

TEST_CASE("mesh repair: a shell inside another is buried, or a cavity if it is inverted", "[tree]") {
    const TriangleMesh inner = test::boxMesh(Vec3(6, 6, 6), Vec3(2, 2, 2));
    const TriangleMesh solid = test::joined(kBox, inner), hollow = test::joined(kBox, test::flipped(inner));
    CHECK(count(repairMesh(solid), FaceRole::Buried) == 12);
    CHECK(depthAt(solid, kCenter) == Approx(5));
    for (const TriangleMesh& mesh : {hollow, test::flipped(hollow)}) {
        CHECK(repairMesh(mesh).closed());
        CHECK(count(repairMesh(mesh), FaceRole::Buried) == 0);
        CHECK(depthAt(mesh, kCenter) == Approx(-3));
        CHECK(depthAt(mesh, Vec3(5, 5, 1)) == Approx(1));
    }
}

TEST_CASE("mesh repair: overlapping boxes make one body, and no face that protrudes from the other is dropped",
          "[tree]") {
    const TriangleMesh mesh = test::joined(kBox, test::boxMesh(Vec3(10, 10, 10), Vec3(5, 5, 5)));
    const RepairedMesh body = repairMesh(mesh);
    CHECK(body.closed());
    CHECK(depthAt(mesh, Vec3(7, 7, 7)) > 0);
    CHECK(depthAt(mesh, Vec3(12, 12, 12)) > 0);
    CHECK(depthAt(mesh, Vec3(12, 2, 2)) < 0);
    // Faces that are cut stay walls, so the depth is never overestimated.
    CHECK(count(body, FaceRole::Wall) == 24);
}

TEST_CASE("mesh repair: boxes that share a face have a membrane between them, which bounds no volume", "[tree]") {
    const TriangleMesh mesh = test::joined(kBox, test::boxMesh(Vec3(10, 10, 10), Vec3(10, 0, 0)));
    const RepairedMesh body = repairMesh(mesh);
    CHECK(body.closed());
    CHECK(count(body, FaceRole::Wall) == 20);
    CHECK(count(body, FaceRole::Sheet) == 2);
    CHECK(depthAt(mesh, Vec3(10, 5, 5)) == Approx(5));
}

TEST_CASE("mesh repair: boxes that share an edge stay two closed shells", "[tree]") {
    const TriangleMesh mesh = test::joined(kBox, test::boxMesh(Vec3(10, 10, 10), Vec3(10, 10, 0)));
    CHECK(repairMesh(mesh).closed());
    CHECK(depthAt(mesh, kCenter) == Approx(5));
    CHECK(depthAt(mesh, Vec3(15, 15, 5)) == Approx(5));
}

TEST_CASE("mesh repair: a body drawn from both sides, or whose copy has faces turned over, is closed", "[tree]") {
    const TriangleMesh blob = test::blobMesh(10);
    TriangleMesh turned = test::joined(blob, blob);
    for (std::size_t i = 0; i < turned.triangles.size(); i += 7)
        std::swap(turned.triangles[i][0], turned.triangles[i][1]);
    for (const TriangleMesh& mesh : {test::joined(blob, test::flipped(blob)), turned}) {
        const RepairedMesh body = repairMesh(mesh);
        CHECK(body.closed());
        CHECK(count(body, FaceRole::Wall) == int(blob.triangles.size()));
        CHECK(body.repairs.duplicates == int(blob.triangles.size()));
        CHECK(depthAt(mesh, Vec3::Zero()) > 5);
    }
}

TEST_CASE("mesh repair: a face drawn from both sides is one sheet", "[tree]") {
    TriangleMesh mesh;
    mesh.vertices = {Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(0, 10, 0)};
    mesh.triangles = {{0, 1, 2}, {0, 2, 1}};
    const RepairedMesh body = repairMesh(mesh);
    CHECK(body.faces.size() == 1);
    CHECK(count(body, FaceRole::Sheet) == 1);
    CHECK_FALSE(body.closed());
}

TEST_CASE("mesh repair: a seam of zero-area triangles closes its mesh", "[tree]") {
    // The diagonal 0-3 of the bottom gets a vertex in its middle on one side only; a zero-area triangle fills the seam.
    TriangleMesh mesh = kBox;
    mesh.vertices.push_back(Vec3(5, 5, 0));
    mesh.triangles[0] = {0, 2, 8};
    mesh.triangles.push_back({2, 3, 8});
    mesh.triangles.push_back({0, 8, 3});
    CHECK(repairMesh(mesh).closed());
    CHECK(depthAt(mesh, kCenter) == Approx(5));
}

TEST_CASE("mesh repair: T-junctions are closed, and no face moves further than reported", "[tree]") {
    TriangleMesh cube = test::patchedCube(10, {1, 2, 3, 4, 5, 7});
    const RepairedMesh body = repairMesh(cube);
    CHECK(body.closed());
    CHECK(body.holes == 0);
    CHECK(count(body, FaceRole::Sheet) == 0);
    CHECK(depthAt(cube, kCenter) == Approx(5));
    // The bottom is one square. The lower edges of the walls have vertices on its edges; one of them is now off by less
    // than the tolerance, 1e-5 * 17 mm.
    for (Vec3& v : cube.vertices)
        if (v.z() == 0 && v.x() == 5 && v.y() == 10) v.y() = 10 - 1e-4;
    const RepairedMesh near = repairMesh(cube);
    CHECK(near.closed());
    CHECK(near.weld / near.scale == Approx(1e-4).epsilon(1e-3));
    // If it is off by more, it is a crack, which a sliver closes and which is counted.
    for (Vec3& v : cube.vertices)
        if (v.y() == 10 - 1e-4) v.y() = 10 - 1e-3;
    CHECK(repairMesh(cube).closed());
    CHECK(repairMesh(cube).closedHoles.size() == 1);
}

TEST_CASE("mesh repair: a wall between two chambers is an inner sheet, and a protruding wall opens the body",
          "[tree]") {
    TriangleMesh right = test::boxMesh(Vec3(10, 10, 10), Vec3(10, 0, 0));
    right.triangles.erase(right.triangles.begin() + 8, right.triangles.begin() + 10);  // the side x = 10
    TriangleMesh chambers = test::joined(kBox, right);
    const RepairedMesh body = repairMesh(chambers);
    CHECK(body.closed());
    CHECK(count(body, FaceRole::Wall) == 20);
    CHECK(count(body, FaceRole::Sheet) == 2);
    CHECK(depthAt(chambers, Vec3(10, 5, 5)) == Approx(5));

    TriangleMesh finned = kBox;  // its center is inside, one corner is outside
    finned.vertices.insert(finned.vertices.end(), {Vec3(1, 1, 5), Vec3(9, 1, 5), Vec3(1, 12, 5)});
    finned.triangles.push_back({8, 9, 10});
    CHECK_FALSE(repairMesh(finned).closed());
    finned.vertices.back().y() = 9;
    CHECK(repairMesh(finned).closed());
}

TEST_CASE("mesh repair: a finely meshed shell inside another is buried, including its flat faces", "[tree]") {
    const TriangleMesh inner = test::moved(test::patchedCube(6, {4, 4, 4, 4, 4, 4}), 1, Vec3(2, 2, 2));
    CHECK(count(repairMesh(test::joined(kBox, inner)), FaceRole::Buried) == 6 * 32);
    CHECK(depthAt(test::joined(kBox, inner), kCenter) == Approx(5));
}

TEST_CASE("mesh repair: where a shell intersects itself, points with winding number two are inside", "[tree]") {
    // Two arms of radius 2 cross at a right angle at the origin. The wall of one arm alone, 2 - 1.5 sqrt(1/2) = 0.94
    // away from this point, lies inside the other arm there; the nearest wall of both together is 1.33 away.
    const TriangleMesh eight = test::eightMesh(10, 2, 240, 48);
    const RepairedMesh body = repairMesh(eight);
    CHECK(body.closed());
    CHECK(count(body, FaceRole::Buried) > 200);
    CHECK(depthAt(eight, Vec3(1.5, 0, 0)) > 1.1);  // crossing faces stay walls, and they are 0.3 long
    CHECK(depthAt(eight, Vec3(1.5, 0, 0)) < 1.34);
}

TEST_CASE("mesh repair: a shell that is inside out behind a crossing is a sheet, and others are not", "[tree]") {
    // The outline of a plate runs to and fro along a fin: what is right of its way there is the fin.
    const auto plate = [](double width) {
        const std::vector<Vec3> outline{{0, 0, 0},  {10, 0, 0},         {10, 10, 0},       {4, 10, 0},
                                        {4, 15, 0}, {4 + width, 15, 0}, {4 + width, 5, 0}, {0, 5, 0}};
        const auto corners = std::uint32_t(outline.size());
        return test::lathe(corners, 2, 0, 3, [=](double angle, double t) {
            return Vec3(outline[std::size_t(std::lround(angle * corners / (2 * std::numbers::pi)))] +
                        t * Vec3(0, 0, 3));
        });
    };
    for (const TriangleMesh& mesh : {plate(2), test::flipped(plate(2)), test::unwelded(plate(0.1))}) {
        const RepairedMesh body = repairMesh(mesh);
        CHECK(body.insideOut == 1);
        CHECK(defectsOf(body).insideOut == 1);
        CHECK_FALSE(body.closed());
        CHECK(count(body, FaceRole::Sheet) == int(body.faces.size()));
        CHECK(body.walls.empty());
    }
    // A fold of a micrometer is not felt, and the fin on the other side of its way is one.
    CHECK(repairMesh(plate(0.001)).closed());
    CHECK(repairMesh(plate(-2)).closed());
    const RepairedMesh both = repairMesh(test::joined(plate(2), test::moved(kBox, 1, Vec3(30, 0, 0))));
    CHECK(both.insideOut == 1);
    CHECK_FALSE(both.closed());
    CHECK(count(both, FaceRole::Wall) == 12);
    // Where two cavities overlap, there is no less of the body than in each of them.
    const TriangleMesh hole = test::flipped(test::moved(test::sphereMesh(2), 1, Vec3(4, 5, 5)));
    const RepairedMesh hollow = repairMesh(test::joined(kBox, test::joined(hole, test::moved(hole, 1, Vec3(2, 0, 0)))));
    CHECK(hollow.insideOut == 0);
    CHECK(hollow.closed());
}

TEST_CASE("mesh repair: vertices without a triangle are ignored", "[tree]") {
    TriangleMesh mesh = kBox;
    mesh.vertices.insert(mesh.vertices.end(), 100000, Vec3::Constant(1e200));
    mesh.vertices.push_back(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
    CHECK(repairMesh(mesh).closed());
    CHECK(repairMesh(mesh).diagonal == repairMesh(kBox).diagonal);
}

TEST_CASE("mesh repair: a sliver too thin to weld is open on its own, and does no harm beside a body", "[tree]") {
    TriangleMesh sliver;
    sliver.vertices = {Vec3(0, 0, 5), Vec3(10, 0, 5), Vec3(5, 1e-8, 5)};
    sliver.triangles = {{0, 1, 2}};
    CHECK_FALSE(repairMesh(sliver).closed());
    CHECK(repairMesh(test::joined(kBox, sliver)).closed());
}

TEST_CASE("mesh repair: a strip thinner than the tolerance along seams stays as it came", "[tree]") {
    TriangleMesh strip;
    strip.vertices = {Vec3(0, 0, 5), Vec3(10, 0, 5), Vec3(10, 5e-5, 5), Vec3(0, 5e-5, 5)};
    strip.triangles = {{0, 1, 2}, {0, 2, 3}};
    const RepairedMesh body = repairMesh(strip);
    CHECK(body.faces.size() == 2);
    CHECK_FALSE(body.closed());
}

TEST_CASE("mesh repair: the progress callback can cancel at any call", "[tree]") {
    const TriangleMesh mesh = test::joined(test::blobMesh(10, 100, 50), test::soupMesh(3000, 2, 4));
    int beats = 0;
    repairMesh(mesh, [&] { ++beats; });
    CHECK(beats > 20);
    struct Stop {};
    for (int allowed = 0; allowed < beats; allowed += 1 + beats / 20) {
        int left = allowed;
        const Heartbeat stop = [&] {
            if (left-- == 0) throw Stop{};
        };
        CHECK_THROWS_AS(repairMesh(mesh, stop), Stop);
    }
}

TEST_CASE("mesh repair: meshes without area or beyond the range of float are refused in one sentence", "[tree]") {
    TriangleMesh line;
    line.vertices = {Vec3(0, 0, 0), Vec3(1, 1, 1), Vec3(2, 2, 2)};
    line.triangles = {{0, 1, 2}, {1, 1, 2}};
    CHECK_THROWS_AS(repairMesh(line), std::invalid_argument);
    CHECK_THROWS_AS(repairMesh(TriangleMesh{}), std::invalid_argument);
    CHECK_THROWS_AS(repairMesh(test::moved(kBox, 1e36, Vec3::Zero())), std::invalid_argument);
    CHECK_THROWS_AS(repairMesh(test::moved(kBox, 1e-40, Vec3::Zero())), std::invalid_argument);
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        TriangleMesh broken = kBox;
        broken.vertices[3].y() = bad;
        CHECK_THROWS_AS(repairMesh(broken), std::invalid_argument);
    }
    CHECK(repairMesh(test::moved(kBox, 1e30, Vec3::Zero())).closed());
    CHECK(repairMesh(test::moved(kBox, 1e-25, Vec3::Zero())).closed());
}

}  // namespace
}  // namespace touchstone::mesh_repair_tests
