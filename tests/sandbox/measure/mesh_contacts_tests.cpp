// What the picture shows of contact between meshes: contacts with their forces, gaps and the nearest points.
#include <catch2/catch.hpp>
#include <random>

#include "haptics/reference/mesh_reference.hpp"
#include "haptics/sandbox/picture/scene_overlays.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::mesh_contacts_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

Settings meshes() {
    Settings settings;
    settings.geometry = Geometry::Mesh;
    settings.linearizations = 4;
    settings.shadow = kNoSolver;
    return settings;
}

TriangleMesh centeredBox(double x, double y, double z) { return boxMesh({x, y, z}, {-x / 2, -y / 2, -z / 2}); }

/// The tick at which a tool that the device holds here has come to rest.
TickRecord restAt(const World& world, const Settings& settings, const Pose& device) {
    TickState state(world);
    TickRecord record;
    for (int tick = 0; tick < 2000; ++tick) {
        const TickRecord next = step(world, settings, {.X_WT_device = device}, state);
        const bool rests = travel(record.X_WT, next.X_WT, world.p_TC(), world.tool.surface->extent.reach) < 1e-9;
        record = next;
        if (rests) break;
    }
    return record;
}

/// Sum of the contacts' forces, and their moment about C.
Wrench sumOf(std::span<const ContactPoint> contacts, const Vec3& C) {
    Wrench sum;
    for (const ContactPoint& contact : contacts) {
        sum.force += contact.load * contact.n_W;
        sum.torque += (contact.p_W - C).cross(contact.load * contact.n_W);
    }
    return sum;
}

}  // namespace

TEST_CASE("contacts of meshes: forces act at points of both surfaces and balance the wrench of a tool at rest",
          "[contacts]") {
    struct Case {
        TriangleMesh tool, obstacle;
        Pose start, device;
    };
    const auto c = GENERATE(values<Case>({
        {centeredBox(4, 4, 4), centeredBox(10, 10, 6), at(0.3, -0.2, 9), at(0.4, -0.3, 3.5, {0.02, -0.01, 0})},
        {blobMesh(4, 24, 13), torusMesh(6, 2, 28, 14), at(0, 0, 12), at(0.2, 0.3, 1.5, {0.1, 0, 0.2})},
        {blobMesh(3), blobMesh(5, 30, 15), at(0, 0, 12), at(0, 0.3, 6)},
    }));
    auto world = std::make_shared<World>(meshWorld(c.tool, c.obstacle, c.start));
    world->obstacles[0].X_WO = at(0.1, 0, 0, {0, 0, 0.3});
    const Settings settings = meshes();
    const TickRecord record = restAt(*world, settings, c.device);
    REQUIRE(record.wrench_C.force.norm() > 0.3);
    REQUIRE_FALSE(record.flags & kUnfinished);
    ContactFinder finder(world);
    const auto contacts = finder.find(record, settings, 0.2);
    const Pose X_TW = record.X_WT.inverse(), X_OW = world->obstacles[0].X_WO.inverse();
    const auto tool = trianglesOf(c.tool), obstacle = trianglesOf(c.obstacle);
    int loaded = 0;
    for (const ContactPoint& contact : contacts) {
        CAPTURE(contact.p_W.transpose(), contact.n_W.transpose(), contact.gap, contact.load);
        loaded += contact.load > 0;
        CHECK(contact.n_W.norm() == Approx(1));
        CHECK(bruteDistance(X_TW * contact.p_W, tool) < 1e-9);
        // Along the normal the obstacle is as far away as the gap says; under load that is the distance kept.
        CHECK(bruteDistance(X_OW * (contact.p_W - contact.gap * contact.n_W), obstacle) < 1e-5);
        if (contact.load > 1e-3) CHECK(contact.gap == Approx(settings.contactDistance).margin(1e-5));
    }
    REQUIRE(loaded > 0);
    const Wrench sum = sumOf(contacts, record.X_WT * world->p_TC());
    CHECK((sum.force - record.wrench_C.force).norm() < 1e-3);
    CHECK((sum.torque - record.wrench_C.torque).norm() < 5e-3);
}

TEST_CASE("contacts of meshes: a part that is not closed is shown by its spheres beside one that is", "[contacts]") {
    // The tool of one leaf of radius 1 stands in a box of 2 mm: to its right a closed cube, below it an open obstacle
    // whose tree is a ball of radius 5.
    auto world = std::make_shared<World>(meshWorld(centeredBox(2, 2, 2), centeredBox(4, 4, 4), at(0, 0, 0)));
    world->obstacles[0].X_WO = at(3.01, 0, 0);
    world->obstacles[0].part.spheres = ball(1);
    world->obstacles.push_back({.name = "open", .part = bySpheres(ball(5)), .X_WO = at(0, -6.01, 0)});
    const Settings settings = meshes();
    const TickRecord record = restAt(*world, settings, at(0.5, -0.7, 0));
    ContactFinder finder(world);
    const auto contacts = finder.find(record, settings, 0.1);
    const Wrench sum = sumOf(contacts, record.X_WT * world->p_TC());
    CHECK((sum.force - record.wrench_C.force).norm() < 1e-3);
    const auto below = std::find_if(contacts.begin(), contacts.end(), [](auto& c) { return c.n_W.y() > 0.9; });
    REQUIRE(below != contacts.end());
    CHECK(below->load == Approx(0.69).margin(5e-3));
    CHECK((below->p_W - (record.X_WT * Vec3(0, -1, 0))).norm() < 2e-2);
}

TEST_CASE("contacts of meshes: without contact there are none, and a tool above a face shows its corners",
          "[contacts]") {
    const auto world =
        std::make_shared<const World>(meshWorld(centeredBox(4, 4, 4), centeredBox(10, 10, 6), at(0, 0, 9)));
    ContactFinder finder(world);
    TickRecord record;
    record.X_WT = record.X_WT_device = at(0, 0, 5.3);
    CHECK(finder.find(record, meshes(), 0.2).empty());
    record.X_WT = record.X_WT_device = at(0, 0, 5.1);
    const auto contacts = finder.find(record, meshes(), 0.2);
    CHECK(contacts.size() == 4);
    for (const ContactPoint& contact : contacts) {
        CHECK(contact.load == 0);
        CHECK(contact.gap == Approx(0.1));
        CHECK((contact.n_W - Vec3::UnitZ()).norm() < 1e-9);
    }
}

TEST_CASE("gap map: the gap at every corner of a patch is the distance by brute force", "[overlays]") {
    const TriangleMesh mesh = blobMesh(4, 24, 13), other = torusMesh(6, 2, 28, 14);
    const Surface part = surfaceOf(mesh), obstacle = surfaceOf(other);
    const Pose X_PO = at(0, 0.3, 3.2, {0.2, 0.1, 0});
    const PlacedSurface placed{&obstacle, X_PO};
    constexpr double kLimit = 1;
    const GapMap map = gapMap(part, {&placed, 1}, kLimit);
    const auto triangles = trianglesOf(other);
    REQUIRE(map.points.size() == map.gaps.size());
    int near = 0;
    for (std::size_t i = 0; i < map.points.size(); ++i) {
        const double expected = std::min(kLimit, bruteDistance(X_PO.inverse() * map.points[i], triangles));
        CHECK(double(map.gaps[i]) == Approx(expected).margin(1e-6));
        near += expected < kLimit;
    }
    CHECK(near > 50);
    // The patches are the surface, cut where it is near.
    double area = 0, whole = 0;
    for (const auto& c : map.patches) {
        const auto at = [&](int k) { return map.points[std::size_t(c[std::size_t(k)])]; };
        const Triangle patch{at(0), at(1), at(2)};
        area += areaOf(patch);
        const double least =
            std::min({map.gaps[std::size_t(c[0])], map.gaps[std::size_t(c[1])], map.gaps[std::size_t(c[2])]});
        if (least < kLimit) CHECK(std::sqrt(longestEdge(patch).length2) <= kLimit / 2);
    }
    for (const Triangle& t : trianglesOf(mesh)) whole += areaOf(t);
    CHECK(area == Approx(whole));
    CHECK(map.patches.size() > part.features.faces.size());
}

TEST_CASE("gap map: a tip above the middle of a large face is found there", "[overlays]") {
    const Surface plate = surfaceOf(centeredBox(40, 40, 2)), tip = surfaceOf(centeredBox(0.4, 0.4, 4));
    const PlacedSurface placed{&tip, at(7.3, 2.1, 3.25)};  // its end is 0.25 mm above the plate
    const GapMap map = gapMap(plate, {&placed, 1}, 1);
    float least = 1;
    for (const float gap : map.gaps) least = std::min(least, gap);
    CHECK(least >= 0.25f - 1e-6f);
    CHECK(least < 0.4f);
    CHECK(map.patches.size() < 2000);
}

TEST_CASE("overlays: between meshes the nearest pair is that of the surfaces", "[overlays]") {
    const TriangleMesh mesh = blobMesh(3), other = torusMesh(6, 2, 28, 14);
    const auto world = std::make_shared<const World>(meshWorld(mesh, other, at(0, 0, 9)));
    const MeshReference reference(mesh, Vec3::Zero(), {{other, Pose{}}});
    SceneOverlays overlays(world);
    DisplayOptions options;
    options.clearance = true;
    for (const Pose& X : {at(0, 0, 7), at(1, 3, 6.1), at(9, 6, 0.3), at(20, 0, 0)}) {
        TickRecord record;
        record.X_WT = record.X_WT_device = X;
        overlays.find(record, meshes(), options);
        REQUIRE(overlays.nearestPlace());
        engine::Frame frame;
        overlays.add(frame, record, options);
        REQUIRE(frame.labels.size() == 1);
        CHECK(std::stod(frame.labels[0].text) == Approx(reference.clearance(X, 30)).margin(6e-4));
    }
}

TEST_CASE("contacts: with friction they carry their share of it, and tell whether they slide", "[contacts]") {
    const auto geometry = GENERATE(Geometry::Mesh, Geometry::Spheres);
    CAPTURE(int(geometry));
    World made = geometry == Geometry::Mesh
                     ? meshWorld(centeredBox(10, 10, 4), centeredBox(100, 100, 6), at(0, 0, 5.1))
                     : worldOf(treeOf({{-4, -4, 0, 2}, {4, -4, 0, 2}, {-4, 4, 0, 2}, {4, 4, 0, 2}}),
                               treeOf({{0, 0, -1e6f, 1e6f}}), at(0, 0, 2.1));
    rub(made, {0.5, 0.3});
    const auto world = std::make_shared<const World>(made);
    const Settings settings = settingsFor(geometry);
    TickState state(*world);
    ContactFinder finder(world);
    Pose device = world->X_WT_start;
    TickRecord record;
    const auto lead = [&](const Vec3& by) {
        for (int i = 0; i < 100; ++i) {
            device.p += by / 100;
            record = step(*world, settings, {device}, state);
        }
    };
    const auto expect = [&](bool slides, double coefficient) {
        Vec3 sum = Vec3::Zero();
        int loaded = 0;
        for (const ContactPoint& contact : finder.find(record, settings, 0.1)) {
            sum += contact.load * contact.n_W + contact.friction_W;
            if (contact.load < 1e-3) continue;
            ++loaded;
            CHECK(contact.slides == slides);
            CHECK(contact.coefficient == coefficient);
            CHECK(contact.friction_W.norm() <= coefficient * contact.load * (1 + 1e-6));
        }
        CHECK(loaded >= 3);
        CHECK((sum - record.wrench_C.force).norm() < 1e-3);
    };
    lead({0, 0, -2});
    lead({0.5, 0, 0});
    expect(false, 0.5);
    lead({3, 0, 0});
    expect(true, 0.3);
    CHECK(record.wrench_C.force.x() == Approx(0.3 * record.wrench_C.force.z() * -1).epsilon(1e-3));
}

}  // namespace touchstone::mesh_contacts_tests
