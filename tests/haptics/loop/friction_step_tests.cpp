// The tick with friction, judged by Coulomb's law.
#include <array>
#include <catch2/catch.hpp>
#include <numbers>

#include "haptics/loop/step.hpp"
#include "haptics/qp/contact_forces.hpp"
#include "haptics/qp/friction_table.hpp"
#include "tests/support/alloc_count.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/random.hpp"
#include "tests/support/wandering_hand.hpp"

namespace touchstone::friction_step_tests {

using namespace touchstone::test;

namespace {

constexpr double kDistance = 0.002;

World with(World world, const Friction& friction) {
    rub(world, friction);
    return world;
}

/// A block of 10 x 10 x 4 mm that rests on a plane at z = 0, as meshes or as leaves.
World blockOnPlane(Geometry geometry, const Friction& friction) {
    if (geometry == Geometry::Mesh)
        return with(meshWorld(centeredBox(10, 10, 4), centeredBox(100, 100, 6), at(0, 0, 5 + kDistance)), friction);
    const auto feet = treeOf({{-4, -4, 0, 2}, {4, -4, 0, 2}, {-4, 4, 0, 2}, {4, 4, 0, 2}});
    return with(worldOf(feet, treeOf({{0, 0, -1e6f, 1e6f}}), at(0, 0, 2)), friction);
}

/// Leads the device along a line in steps of at most `by` mm; returns the last tick.
TickRecord lead(const World& world, TickState& state, const Settings& settings, Pose& device, const Vec3& to,
                double by = 0.01) {
    TickRecord record;
    const Vec3 from = device.p;
    const int steps = std::max(1, int(std::ceil((to - from).norm() / by)));
    for (int i = 1; i <= steps; ++i) {
        device.p = from + (to - from) * (double(i) / steps);
        record = step(world, settings, {device}, state);
    }
    return record;
}

/// A bar along y from z = bottom to top whose sides lean outward by the half angle and are 6 mm apart at z = 0.
TriangleMesh vee(double bottom, double top, double half) {
    TriangleMesh m = centeredBox(1, 10, 1);
    for (Vec3& p : m.vertices) {
        const double z = p.z() < 0 ? bottom : top;
        p = Vec3((p.x() < 0 ? -1 : 1) * (3 + std::tan(half) * z), p.y(), z);
    }
    return m;
}

/// A star about the z axis whose spikes reach from one radius to the other.
TriangleMesh starMesh(std::uint32_t spikes, double radius, double inner, double height) {
    const std::uint32_t n = 2 * spikes;
    TriangleMesh m;
    for (const double z : {-height / 2, height / 2})
        for (std::uint32_t i = 0; i < n; ++i) {
            const double angle = std::numbers::pi * i / spikes, r = i % 2 ? inner : radius;
            m.vertices.push_back({r * std::cos(angle), r * std::sin(angle), z});
        }
    for (const double z : {-height / 2, height / 2}) m.vertices.push_back({0, 0, z});
    for (std::uint32_t i = 0, j = 1; i < n; ++i, j = (i + 1) % n) {
        for (const auto& side : {std::array{i, j, n + j}, std::array{i, n + j, n + i}}) m.triangles.push_back(side);
        for (const auto& cap : {std::array{2 * n, j, i}, std::array{2 * n + 1, n + i, n + j}})
            m.triangles.push_back(cap);
    }
    return m;
}

/// Two walls along y that lean outward by the half angle, 6 mm apart at z = 0.
TriangleMesh groove(double half) {
    TriangleMesh walls;
    for (const double side : {-1.0, 1.0}) {
        TriangleMesh wall = centeredBox(1, 60, 1);
        for (Vec3& p : wall.vertices) {
            const double z = p.z() < 0 ? -1.1 : 10;
            const bool inner = p.x() * side < 0;
            p = Vec3(side * (inner ? 3 + std::tan(half) * z : 40), p.y(), z);
        }
        walls = walls.vertices.empty() ? wall : joined(walls, wall);
    }
    return walls;
}

double friction(const TickRecord& record) { return record.wrench_C.force.head<2>().norm(); }

}  // namespace

TEST_CASE("friction: a block holds up to the coefficient at rest, slides against the other, and the force opposes it",
          "[step][friction]") {
    const World world = blockOnPlane(Geometry::Mesh, {0.5, 0.3});
    const Settings settings = settingsFor(Geometry::Mesh);
    for (int k = 0; k < 64; ++k) {
        const double angle = 2 * std::numbers::pi * k / 64;
        const Vec3 along(std::cos(angle), std::sin(angle), 0);
        CAPTURE(k);
        TickState state(world);
        Pose device = world.X_WT_start;
        const Pose start = lead(world, state, settings, device, device.p - Vec3(0, 0, 2)).X_WT;
        double held = 0, slid = 0;
        TickRecord record, before;
        for (int i = 0; i < 1000; ++i) {
            device.p += 0.0023 * along;
            before = record;
            record = step(world, settings, {device}, state);
            const double ratio = friction(record) / record.wrench_C.force.z();
            if (record.sliding == 0)
                held = std::max(held, ratio);
            else
                slid = ratio;
            // What sticks does not creep.
            if (record.sliding == 0) REQUIRE((record.X_WT.p - start.p).norm() < 1e-8);
        }
        CHECK(held <= 0.5 * (1 + 1e-6));
        CHECK(held > 0.5 - 0.0023 / 2);  // one more step of the device exceeds it
        CHECK(slid == Approx(0.3).epsilon(1e-6));
        CHECK(record.wrench_C.force.z() == Approx(2).epsilon(1e-6));
        CHECK(record.sliding >= 3);
        const Vec3 slip = (record.X_WT.p - before.X_WT.p).normalized();
        CHECK((record.wrench_C.force.head<2>().normalized() + slip.head<2>()).norm() < 1e-6);
    }
}

TEST_CASE("friction: on an incline a block holds below the angle of friction and slides above it", "[step][friction]") {
    const auto geometry = GENERATE(Geometry::Mesh, Geometry::Spheres);
    const double mu = GENERATE(0.1, 0.4, 1.0);
    CAPTURE(int(geometry), mu);
    const World world = blockOnPlane(geometry, {mu, mu});
    // The plane of leaves is a ball, whose normals under the feet differ by 1e-5 rad.
    const double margin = geometry == Geometry::Mesh ? 1e-6 : 1e-4;
    for (const double off : {-margin, margin}) {
        TickState state(world);
        Pose device = world.X_WT_start;
        const Settings settings = settingsFor(geometry);
        const Pose start = lead(world, state, settings, device, device.p + Vec3(0, 0, -1)).X_WT;
        TickRecord record = lead(world, state, settings, device, device.p + Vec3(mu * (1 + off), 0, 0));
        bool soft = record.flags & kFrictionSoft;
        for (int i = 0; i < 20; ++i) {
            record = step(world, settings, {device}, state);
            soft = soft || record.flags & kFrictionSoft;
        }
        const double moved = record.X_WT.p.x() - start.p.x();
        if (off < 0)
            CHECK(std::abs(moved) < 1e-9);
        else if (soft)  // a tick that is flagged so may give way
            CHECK(moved < 5e-4);
        else
            CHECK(moved == Approx(mu * off).epsilon(0.5));  // until the spring pulls no more than friction holds
        if (!soft) CHECK(friction(record) == Approx(mu * (1 + std::min(off, 0.0))).epsilon(margin / 2));
    }
}

TEST_CASE("friction: a block that sticks does not creep however the hand trembles", "[step][friction]") {
    const World world = blockOnPlane(Geometry::Mesh, {0.5, 0.5});
    const Settings settings = settingsFor(Geometry::Mesh);
    TickState state(world);
    Pose device = world.X_WT_start;
    const double normal = 3;
    Pose start = lead(world, state, settings, device, device.p + Vec3(0, 0, -normal)).X_WT;
    const TickRecord pressed = lead(world, state, settings, device, device.p + Vec3(0.9 * 0.5 * normal, 0, 0));
    start = pressed.X_WT;
    Random random(7);
    double creep = 0;
    for (int tick = 0; tick < 60'000; ++tick) {
        const Pose noisy{device.p + 0.005 * random.vector(), expRotation(1e-4 * random.vector()) * device.q};
        const TickRecord record = step(world, settings, {noisy}, state);
        REQUIRE((record.flags & (kFrictionHeld | kFrictionSoft)) == 0);
        creep = std::max(creep, (record.X_WT.p - start.p).norm());
    }
    CHECK(creep <= 1e-6);
    CHECK(pressed.wrench_C.force.x() == Approx(-0.9 * 0.5 * normal).epsilon(1e-6));
}

TEST_CASE("friction: a wedge that was pressed in stays if its half angle is below that of friction",
          "[step][friction]") {
    // Two walls that lean outward by 0.1 rad; the wedge fits between them.
    const double half = 0.1;
    const auto wedge = [&](double bottom, double top, double z0, double z1) {
        TriangleMesh m = centeredBox(1, 10, 1);
        for (Vec3& p : m.vertices) {
            const double width = p.z() < 0 ? bottom : top;
            p = Vec3(p.x() < 0 ? -width : width, p.y(), p.z() < 0 ? z0 : z1);
        }
        return m;
    };
    const double slope = std::tan(half);
    TriangleMesh walls = moved(centeredBox(20, 30, 20), 1, Vec3(0, 0, -10));
    // Each wall is a box of which the inner side leans.
    for (const double side : {-1.0, 1.0}) {
        TriangleMesh wall = centeredBox(1, 30, 1);
        for (Vec3& p : wall.vertices) {
            const double z = p.z() < 0 ? 0 : 20;
            const bool inner = p.x() * side < 0;
            p = Vec3(side * (inner ? 3 + slope * z : 9), p.y(), z);
        }
        walls = joined(walls, wall);
    }
    for (const double mu : {0.8 * slope, 1.25 * slope}) {
        CAPTURE(mu);
        const World world = with(meshWorld(wedge(4, 4 + 10 * slope, 0, 10), walls, at(0, 0, 11)), {mu, mu});
        const Settings settings = settingsFor(Geometry::Mesh);
        TickState state(world);
        Pose device = world.X_WT_start;
        const TickRecord pressed = lead(world, state, settings, device, Vec3(0, 0, 5));
        CHECK(pressed.wrench_C.force.z() > 3);
        const double rest = pressed.X_WT.p.z();
        // The hand lets go, then pulls with 0.05 N.
        TickRecord record = lead(world, state, settings, device, Vec3(0, 0, rest));
        record = lead(world, state, settings, device, Vec3(0, 0, rest + 0.05));
        for (int i = 0; i < 50; ++i) record = step(world, settings, {device}, state);
        if (mu > slope)
            CHECK(record.X_WT.p.z() == Approx(rest).margin(1e-6));
        else
            CHECK(record.X_WT.p.z() > rest + 0.04);
    }
}

TEST_CASE("friction: along a groove it is that of the flat divided by the sine of the half angle", "[step][friction]") {
    const double half = GENERATE(0.4, 0.8, 1.2), mu = 0.2, normal = 2;
    CAPTURE(half);
    const World world = with(meshWorld(vee(-1, 3, half), groove(half), at(0, 0, 0.1)), {mu, mu});
    const Settings settings = settingsFor(Geometry::Mesh);
    TickState state(world);
    Pose device = world.X_WT_start;
    const double rest = lead(world, state, settings, device, Vec3(0, 0, -0.5)).X_WT.p.z();
    lead(world, state, settings, device, Vec3(0, 0, rest - normal));
    const TickRecord record = lead(world, state, settings, device, device.p + Vec3(0, 4, 0));
    CHECK(record.sliding >= 2);
    CHECK(record.wrench_C.force.z() == Approx(normal).epsilon(1e-6));
    CHECK(-record.wrench_C.force.y() == Approx(mu * normal / std::sin(half)).epsilon(1e-6));
}

TEST_CASE("friction: an obstacle that moves drags the tool along", "[step][friction]") {
    for (const double mu : {0.0, 0.5}) {
        const World world = blockOnPlane(Geometry::Mesh, {mu, mu});
        const Settings settings = settingsFor(Geometry::Mesh);
        TickState state(world);
        Pose device = world.X_WT_start;
        lead(world, state, settings, device, device.p + Vec3(0, 0, -2));
        const std::vector<Pose> target{at(0.4, 0, 0)};
        TickRecord record;
        for (int i = 0; i < 50; ++i) record = step(world, settings, {device, state.nextMove(target)}, state);
        CHECK(state.obstacles()[0].p.x() == Approx(0.4));
        CHECK(record.X_WT.p.x() == Approx(mu > 0 ? 0.4 : 0).margin(1e-6));
    }
}

TEST_CASE("friction: no tick drives the hand, nothing overlaps, and the answer obeys the law", "[step][friction]") {
    struct Case {
        const char* name;
        TriangleMesh tool, obstacle;
        double size;
        /// Shares of the ticks that may be flagged so. Contact is chaotic: another rounding may make one of 3,000 so.
        double soft, held;
    };
    const std::vector<Case> cases{
        {"blob and blob", blobMesh(4, 24, 13), blobMesh(5, 22, 11), 6, 0.0005, 0},
        {"bar in a ring", centeredBox(3, 3, 16), torusMesh(5, 2, 30, 14), 4, 0.001, 0},
        {"cylinder and box", cylinderMesh(3, 6), centeredBox(7, 6, 5), 5, 0.0005, 0},
    };
    const auto which = GENERATE(range(0, 3));
    const double mu = GENERATE(0.2, 0.5, 0.9);
    const Case& c = cases[which];
    CAPTURE(c.name, mu);
    const World world = with(meshWorld(c.tool, c.obstacle, at(0, 0, 30)), {mu, mu});
    const Settings settings = settingsFor(Geometry::Mesh);
    TickState state(world);
    WanderingHand hand(unsigned(41 + which), c.size);
    int loaded = 0, sticking = 0, soft = 0, held = 0, inexact = 0, driven = 0, jams = 0;
    bool wasSoft = false;
    for (int tick = 0; tick < 3000; ++tick) {
        const TickRecord record = step(world, settings, {hand.next()}, state);
        REQUIRE(!meshesOverlap(world, record.X_WT, state.obstacles()));
        inexact += record.coulomb.worst_N() > 1e-6;
        REQUIRE(record.coulomb.worst_N() < 1e-4);  // of forces up to 1,000 N where the bar is wedged
        loaded += !record.wrench_C.isZero();
        sticking += record.sticking > 0;
        const bool isSoft = (record.flags & kFrictionSoft) != 0;
        soft += isSoft;
        jams += isSoft && !wasSoft;
        wasSoft = isSoft;
        held += (record.flags & kFrictionHeld) != 0;
        if (record.flags & (kFrictionSoft | kFrictionHeld)) continue;
        // Forces reach 1,000 N where the bar is wedged.
        REQUIRE(record.coulomb.complementarity_mJ < 1e-6);
        REQUIRE(record.coulomb.direction_mJ < 1e-5);
        // The motion of the tick is that of its solves but for rounding, the bend of its turns, and a last step of up
        // to 0.1 µm that is not made.
        if (record.flags & (kUnfinished | kCapped | kHalved)) continue;
        REQUIRE(record.coulomb.dissipation_mJ > -3e-5 - 1e-4 * record.frictionForce);
        driven += record.coulomb.dissipation_mJ < -3e-5;
    }
    CAPTURE(loaded, sticking, soft, jams, held, inexact, driven);
    CHECK(sticking > loaded / 10);
    CHECK(inexact <= loaded / 500);
    CHECK(driven <= loaded / 500);
    // A wedged tool that finds no exact forces stays so while the hand holds it there.
    CHECK(jams <= c.soft * loaded);
    CHECK(soft <= loaded / 50);
    CHECK(held <= c.held * loaded);
}

TEST_CASE("friction: a tick ends after 10,000 evaluations of the forces, also while spikes clamp a needle",
          "[step][friction]") {
    const World world = with(meshWorld(starMesh(31, 13, 5, 1.5), centeredBox(0.7, 22, 0.7), at(0, 0, 30)), {0.9, 0.9});
    const Settings settings = settingsFor(Geometry::Mesh);
    int longest = 0, ended = 0;
    for (const int seed : {1, 2, 3}) {
        TickState state(world);
        WanderingHand hand(5, seed);
        for (int tick = 0; tick < 640; ++tick) {
            const TickRecord record = step(world, settings, {hand.next()}, state);
            REQUIRE(!meshesOverlap(world, record.X_WT, state.obstacles()));
            longest = std::max(longest, record.iterations);
            ended += record.iterations > 10000 && record.flags & kUnfinished;
        }
    }
    CHECK(ended > 0);        // others arrive with their last solve
    CHECK(longest < 12000);  // which is not cut off; without an end 100,000
}

TEST_CASE("friction: without coefficients, or switched off, the tick is that of a frictionless world to the bit",
          "[step][friction]") {
    const auto hashOf = [](const Friction& friction, bool on, double scale) {
        const World world = with(meshWorld(centeredBox(3, 3, 16), torusMesh(5, 2, 30, 14), at(0, 0, 30)), friction);
        Settings settings = settingsFor(Geometry::Mesh);
        settings.friction = on;
        settings.frictionScale = scale;
        TickState state(world);
        WanderingHand hand(3, 4);
        std::uint64_t hash = 0;
        for (int tick = 0; tick < 1000; ++tick) hash = hashTick(step(world, settings, {hand.next()}, state), hash);
        return hash;
    };
    const std::uint64_t without = hashOf({}, true, 1);
    CHECK(hashOf({0.4, 0.4}, false, 1) == without);
    CHECK(hashOf({0.4, 0.4}, true, 0) == without);
    const std::uint64_t rough = hashOf({0.4, 0.4}, true, 1);
    CHECK(rough != without);
    CHECK(hashOf({0.4, 0.4}, true, 1) == rough);
    CHECK(hashOf({0.8, 0.8}, true, 0.5) == rough);
}

TEST_CASE("friction: each solver renders by its own law, and none of its answers overlaps", "[step][friction]") {
    const double mu = 0.5, between = std::numbers::pi / 8;  // halfway between two of eight facets
    const World world = blockOnPlane(Geometry::Mesh, {mu, mu});
    for (const Vec3& along : {Vec3(1, 0, 0), Vec3(std::cos(between), std::sin(between), 0)}) {
        double exactForce = 0;
        for (const FrictionSolverInfo& info : frictionSolverTable()) {
            CAPTURE(info.name, along.y());
            Settings settings = settingsFor(Geometry::Mesh);
            settings.frictionSolver = info.name;
            TickState state(world);
            Pose device = world.X_WT_start;
            lead(world, state, settings, device, device.p - Vec3(0, 0, 2));
            TickRecord record;
            double hover = 0, direction = 0, complementarity = 0;
            for (int i = 0; i < 400; ++i) {
                device.p += 0.01 * along;
                record = step(world, settings, {device}, state);
                REQUIRE((record.flags & (kFrictionHeld | kIterationLimit | kNonFinite)) == 0);
                REQUIRE_FALSE(meshesOverlap(world, record.X_WT, {}));
                hover = std::max(hover, record.hover);
                direction = std::max(direction, record.coulomb.direction_mJ);
                complementarity = std::max(complementarity, record.coulomb.complementarity_mJ);
                REQUIRE(record.coulomb.cone_N < 1e-5);
                REQUIRE(record.coulomb.balance_N < 1e-5);
            }
            const double force = friction(record);
            CHECK(record.sliding > 0);
            if (info.name == kExactFrictionSolver) exactForce = force;
            const bool relaxed = info.law.hovers;
            CHECK(force <= mu * record.wrench_C.force.z() * (1 + 1e-5));
            const double least = info.law.facets ? std::cos(std::numbers::pi / info.law.facets) : 1;
            CHECK(force >= least * mu * record.wrench_C.force.z() * (1 - 1e-5));
            // A block that slides by 0.01 mm in a tick hovers at µ 0.01 mm.
            CHECK(hover == Approx(kDistance + (relaxed ? mu * 0.01 : 0)).epsilon(0.1).margin(info.law.accuracy));
            const double tolerance = std::max(1e-5, 100 * info.law.accuracy);
            if (relaxed)
                CHECK(complementarity > 1e-4);
            else
                CHECK(complementarity < std::max(1e-4, tolerance));
            if (info.law.facets == 0) {
                CHECK(force == Approx(exactForce).epsilon(tolerance));
                CHECK(direction < tolerance / 10);
            }
        }
    }
}

TEST_CASE("friction: after ticks of another mode the slip starts at zero and no contact is remembered",
          "[step][friction]") {
    const World world = blockOnPlane(Geometry::Spheres, {0.5, 0.5});
    Settings settings = settingsFor(Geometry::Spheres);
    TickState state(world);
    Pose device = world.X_WT_start;
    lead(world, state, settings, device, device.p - Vec3(0, 0, 2));
    CHECK_FALSE(frictionContacts(state).empty());
    settings.mode = Mode::GodObject;
    lead(world, state, settings, device, device.p + Vec3(5, 0, 0));
    CHECK(frictionContacts(state).empty());
    settings.mode = Mode::Default;
    const TickRecord record = step(world, settings, {device}, state);
    CHECK(record.sticking + record.sliding > 0);
    CHECK(record.slip < 0.01);
}

TEST_CASE("friction: where a baseline has no answer, the exact solver takes over", "[step][friction]") {
    class Answerless final : public FrictionSolver {
      public:
        FrictionResult solve(const FrictionProblem& problem, const Vec6& start) noexcept override {
            forces_.fill(Vec3::Zero());
            return {.x = start, .forces = std::span(forces_).first(problem.contacts.size())};
        }

      private:
        std::array<Vec3, ContactForces::kMaxContacts> forces_;
    };
    const auto rim = [](double a, double t) { return Vec3(6 * std::cos(a), 6 * std::sin(a), 4 * t - 2); };
    const World world =
        with(meshWorld(lathe(36, 2, -2, 2, rim), centeredBox(100, 100, 6), at(0, 0, 5 + kDistance)), {0.5, 0.5});
    const auto forceWith = [&](const char* solver, bool answers, bool& taken) {
        Settings settings = settingsFor(Geometry::Mesh);
        REQUIRE(setSetting(settings, "friction_solver", solver).empty());
        TickState state(world);
        if (!answers) frictionRenderer(state, solver) = std::make_unique<Answerless>();
        Pose device = world.X_WT_start;
        const TickRecord pressed = lead(world, state, settings, device, device.p - Vec3(0, 0, 2));
        CHECK(pressed.wrench_C.force.z() == Approx(2).epsilon(1e-6));
        const TickRecord record = lead(world, state, settings, device, device.p + Vec3(3, 0, 0));
        CHECK((record.flags & kFrictionHeld) == 0);
        taken = record.flags & kIterationLimit;
        CHECK(taken == (record.status == SolveStatus::IterationLimit));
        return record.wrench_C.force;
    };
    bool taken = false;
    const Vec3 exact = forceWith("cone-newton", true, taken);
    CHECK_FALSE(taken);
    CHECK((forceWith("lemke-8", false, taken) - exact).norm() < 1e-6);
    CHECK(taken);
    CHECK((forceWith("gauss-seidel", true, taken) - exact).norm() < 1e-3);
    CHECK_FALSE(taken);
}

TEST_CASE("friction: the shadow solves the tick's friction problem, and changes nothing", "[step][friction]") {
    const double mu = 0.5, between = std::numbers::pi / 8;
    const World world = blockOnPlane(Geometry::Mesh, {mu, mu});
    const auto slide = [&](Settings settings, TickRecord& record) {
        TickState state(world);
        Pose device = world.X_WT_start;
        lead(world, state, settings, device, device.p - Vec3(0, 0, 2));
        std::uint64_t hash = 0;
        for (int i = 0; i < 200; ++i) {
            device.p += 0.01 * Vec3(std::cos(between), std::sin(between), 0);
            record = step(world, settings, {device}, state);
            hash = hashTick(record, hash);
        }
        return hash;
    };
    Settings settings = settingsFor(Geometry::Mesh);
    settings.shadow = kNoSolver;
    TickRecord record;
    const std::uint64_t hash = slide(settings, record);
    CHECK(record.shadowRows == 0);
    settings.shadow = "pqp";
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        settings.frictionSolver = kExactFrictionSolver;
        settings.frictionShadow = info.name;
        CHECK(slide(settings, record) == hash);
        CHECK(record.shadowRows == record.sticking + record.sliding);
        CHECK(record.shadowStatus == SolveStatus::Solved);
        // Facets miss a part of the 1 N of friction and of its direction; a shadow without friction would miss all.
        const double error = record.shadowForceError;
        if (info.law.facets == 0)
            CHECK(error < 1e-6);
        else
            CHECK((error > 1e-3 && error < 0.8 * mu * 2));
        // With the roles exchanged, the error is that of the rendering solver.
        std::swap(settings.frictionSolver, settings.frictionShadow);
        slide(settings, record);
        CHECK((record.shadowForceError > 1e-4) == (error > 1e-4));
    }
    // With two baselines, the exact answer is computed for the error alone.
    settings.frictionSolver = "lemke-8";
    settings.frictionShadow = "gauss-seidel";
    slide(settings, record);
    CHECK(record.shadowForceError < 1e-6);
    settings.shadowWork = 1;
    settings.frictionShadow = "convex-pqp";
    slide(settings, record);
    CHECK(record.shadowStatus == SolveStatus::Invalid);
    CHECK(record.shadowForceError == 0);
}

TEST_CASE("friction: ticks allocate nothing, whatever the settings", "[step][friction]") {
    Random random(11);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int world = 0; world < 20; ++world) {
        const double sliding = 1.2 * unit(random.engine);
        const World w = with(withMeshes(worldOf(blob(300, 15, 6), blob(300, 20, 7), at(0, 45, 0)), blobMesh(15, 24, 13),
                                        blobMesh(20, 22, 11)),
                             {sliding + 0.5 * unit(random.engine), sliding});
        TickState state(w);
        WanderingHand hand(unsigned(world), 25);
        Settings settings = settingsFor(world % 2 ? Geometry::Mesh : Geometry::Spheres);
        std::vector<Pose> targets{Pose{}};
        for (int tick = 0; tick < 500; ++tick) {
            if (tick % 10 == 0) {
                settings.stiffness = std::pow(10, -1 + 2 * unit(random.engine));
                settings.torsion = std::pow(10, 2 + 2 * unit(random.engine));
                settings.frictionScale = 2 * unit(random.engine);
                const auto solvers = frictionSolverTable();
                settings.frictionSolver = solvers[random.engine() % solvers.size()].name;
                settings.frictionShadow = solvers[random.engine() % solvers.size()].name;
                settings.shadow = tick % 20 ? "pqp" : kNoSolver;
                settings.rate = 250 + 3000 * unit(random.engine);
                if (tick % 50 == 0) targets[0] = at(unit(random.engine), unit(random.engine), unit(random.engine));
            }
            const Pose device = hand.next();
            const AllocationCounter allocations;
            const TickRecord record = step(w, settings, {device, state.nextMove(targets)}, state);
            REQUIRE(allocations.count() == 0);
            REQUIRE((record.flags & kNonFinite) == 0);
            REQUIRE(record.wrench_C.isFinite());
        }
    }
}

}  // namespace touchstone::friction_step_tests
