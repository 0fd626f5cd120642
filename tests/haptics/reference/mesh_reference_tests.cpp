// Compares the offline reference with answers that follow from the geometry.
#include "haptics/reference/mesh_reference.hpp"

#include <catch2/catch.hpp>
#include <random>

#include "haptics/reference/contact_surface.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::mesh_reference_tests {

namespace {

Pose at(double x, double y, double z, const Vec3& rotation = Vec3::Zero()) {
    return {Vec3(x, y, z), expRotation(rotation)};
}

/// A box about the origin.
TriangleMesh boxAbout(const Vec3& size) { return test::boxMesh(size, -0.5 * size); }

constexpr double kShell = 1e-3;  // mm: distance that the reference keeps between surfaces

}  // namespace

TEST_CASE("mesh reference: a ball on a plane rests at the surface and pushes back with k times the depth",
          "[reference]") {
    // The lowest vertex is the pole at z = -10; the faces around it form a cone that falls away by 0.02 mm.
    const TriangleMesh ball = test::sphereMesh(10, 96, 47);
    const MeshReference reference(ball, Vec3::Zero(), {{test::boxMesh({60, 60, 10}, {-30, -30, -10}), {}}});
    const MeshReferenceAnswer answer = reference.solve({at(1, 2, 7), at(0, 0, 12), 1, 1000});
    CHECK(answer.converged);
    CHECK(answer.X_WT.p.z() == Approx(10).margin(0.03));
    CHECK((answer.wrench_C.force - Vec3(0, 0, answer.X_WT.p.z() - 7)).norm() < 1e-6);
    CHECK(answer.clearance == Approx(kShell).margin(1e-6));
    CHECK(reference.clearance(answer.X_WT, 1) == Approx(kShell).margin(1e-6));
}

TEST_CASE("mesh reference: without contact the answer is the device pose, without force", "[reference]") {
    const MeshReference reference(boxAbout({10, 10, 10}), Vec3::Zero(), {{boxAbout({10, 10, 10}), {}}});
    const MeshReferenceAnswer answer = reference.solve({at(20, 1, 0, {0.3, 0, 0}), at(15, 0, 0)});
    CHECK(answer.converged);
    CHECK((answer.X_WT.p - Vec3(20, 1, 0)).norm() < 1e-9);
    CHECK(answer.wrench_C.force.norm() < 1e-9);
    CHECK(answer.contacts == 0);
}

TEST_CASE("mesh reference: a box pushed into a corner fits it, and each wall carries its own force", "[reference]") {
    // Floor and two walls, scene axes; the box of 10 comes from above.
    const TriangleMesh slab = boxAbout({60, 60, 60});
    const std::vector<MeshObstacle> corner{{slab, at(0, 0, -30)}, {slab, at(-30, 0, 0)}, {slab, at(0, -30, 0)}};
    const MeshReference reference(boxAbout({10, 10, 10}), Vec3::Zero(), corner);
    const MeshReferenceAnswer answer = reference.solve({at(2, 3, 4), at(7, 8, 9)});
    CHECK(answer.converged);
    // 1 N/mm: 3, 2 and 1 mm of overlap.
    CHECK((answer.X_WT.p - Vec3::Constant(5 + kShell)).norm() < 1e-5);
    CHECK((answer.wrench_C.force - Vec3(3 + kShell, 2 + kShell, 1 + kShell)).norm() < 1e-5);
    CHECK(answer.wrench_C.torque.norm() < 1e-3);
}

TEST_CASE("mesh reference: a tilted box on a floor leans as springs and lever determine", "[reference]") {
    const double half = 5, tilt = GENERATE(0.05, 0.3);
    const TriangleMesh floor = boxAbout({60, 60, 60});
    const MeshReference reference(boxAbout({10, 10, 10}), Vec3::Zero(), {{floor, at(0, 0, -30)}});
    const double depth = 2;
    const MeshReferenceAnswer answer =
        reference.solve({at(0, 0, half - depth, {0, tilt, 0}), at(0, 0, 9, {0, tilt, 0})});
    CHECK(answer.converged);
    // The lowest edge touches: the center is 5 (cos a + sin a) above the floor. Golden section finds the minimum.
    const auto energy = [&](double a) {
        const double z = half * (std::cos(a) + std::sin(a)) + kShell - (half - depth);
        return 0.5 * z * z + 0.5 * 1000 * (a - tilt) * (a - tilt);
    };
    double low = 0, high = tilt;
    for (int i = 0; i < 100; ++i) {
        const double a = low + 0.382 * (high - low), b = low + 0.618 * (high - low);
        (energy(a) < energy(b) ? high : low) = energy(a) < energy(b) ? b : a;
    }
    const double expected = 0.5 * (low + high);
    CHECK(logRotation(answer.X_WT.q).y() == Approx(expected).margin(1e-6));
    CHECK(answer.wrench_C.torque.y() == Approx(1000 * (expected - tilt)).margin(1e-3));
    CHECK(answer.X_WT.p.z() == Approx(half * (std::cos(expected) + std::sin(expected)) + kShell).margin(1e-5));
}

TEST_CASE("mesh reference: two crossing edges keep each other apart", "[reference]") {
    // Two roof ridges, one along x below, one along y above: only their edges can touch.
    TriangleMesh roof;
    roof.vertices = {{-20, -10, -10}, {20, -10, -10}, {20, 10, -10}, {-20, 10, -10}, {-20, 0, 0}, {20, 0, 0}};
    roof.triangles = {{0, 1, 5}, {0, 5, 4}, {2, 3, 4}, {2, 4, 5}, {1, 2, 5}, {3, 0, 4}, {0, 3, 2}, {0, 2, 1}};
    TriangleMesh above;
    for (const Vec3& v : roof.vertices) above.vertices.push_back(Vec3(v.y(), v.x(), -v.z()));
    above.triangles = roof.triangles;  // mirrored twice, so the front stays outside
    const MeshReference reference(above, Vec3(0, 0, 5), {{roof, {}}});
    // With C straight above the crossing of the ridges the tool balances; only a push would make it roll off.
    const MeshReferenceAnswer answer = reference.solve({at(0, 0, -1.5), at(0, 0, 0.4)});
    CHECK(answer.X_WT.p.z() == Approx(kShell).margin(1e-6));
    CHECK(answer.wrench_C.force.z() == Approx(1.5 + kShell).margin(1e-6));
    CHECK(answer.contacts == 1);
}

TEST_CASE("mesh reference: distances agree with dense sampling, and overlap is detected", "[reference]") {
    const TriangleMesh blob = test::blobMesh(10), torus = test::torusMesh(12, 3);
    const MeshReference reference(blob, Vec3::Zero(), {{torus, {}}});
    const TriangleBvh bvh(test::trianglesOf(torus));
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    int apart = 0, entered = 0;
    for (int i = 0; i < 40; ++i) {
        const Pose pose = at(8 * uniform(random), 8 * uniform(random), 13 + 3 * uniform(random),
                             3 * Vec3(uniform(random), uniform(random), uniform(random)));
        const double clearance = reference.clearance(pose, 1.5);
        // Sampled points of the blob can only overestimate its distance to the torus.
        double sampled = 1.5;
        bool inside = false;
        for (const Triangle& t : test::trianglesOf(blob))
            for (int k = 0; k < 9; ++k) {
                const Vec3 p = pose * test::pointOn(t, (k % 3 + 0.5) / 3, (k / 3 + 0.5) / 3);
                sampled = std::min(sampled, bvh.closest(p, sampled).distance);
                inside = inside || (k == 4 && bvh.windingNumber(p) > 0.5);
            }
        if (inside) {
            CHECK(clearance == 0);
            ++entered;
        } else {
            CHECK(clearance <= sampled + 1e-12);
            // Nine samples on each triangle of 2.5 mm: no point of it is further than this from a sample.
            if (clearance > 0) CHECK(clearance >= sampled - 1.2);
            apart += clearance > 0 && clearance < 1.5;
        }
    }
    CHECK(apart > 5);
    CHECK(entered > 5);
}

TEST_CASE("mesh reference: bodies that overlap at the start and meshes without triangles are refused", "[reference]") {
    const MeshReference reference(boxAbout({10, 10, 10}), Vec3::Zero(), {{boxAbout({10, 10, 10}), {}}});
    CHECK_THROWS_WITH(reference.solve({at(9, 1, 1), at(9, 1, 1, {0.1, 0.2, 0})}),
                      Catch::Contains("touch at the start"));
    const MeshReference small(boxAbout({1, 1, 1}), Vec3::Zero(), {{boxAbout({10, 10, 10}), {}}});
    const MeshReference large(boxAbout({10, 10, 10}), Vec3::Zero(), {{boxAbout({1, 1, 1}), {}}});
    for (const MeshReference* inside : {&small, &large})
        CHECK_THROWS_WITH(inside->solve({at(9, 1, 1), at(1, 1, 1)}), Catch::Contains("touch at the start"));
    CHECK_THROWS_WITH(MeshReference({}, Vec3::Zero(), {}), Catch::Contains("no triangle"));
}

}  // namespace touchstone::mesh_reference_tests
