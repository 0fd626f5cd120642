// Gears and threads with fillets of micrometers in the hands of somebody without a plan.
#include <catch2/catch.hpp>
#include <numbers>

#include "haptics/loop/step.hpp"
#include "tests/support/exact_judge.hpp"
#include "tests/support/fine_parts.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/wandering_hand.hpp"

namespace touchstone::fine_parts_tests {

using namespace touchstone::test;

namespace {

struct Case {
    const char* name;
    TriangleMesh tool, obstacle;
    Vec3 beside;  ///< a place of the tool's origin where the parts mesh or all but touch
};

TriangleMesh written(const TriangleMesh& mesh) { return withSlivers(roundedTo(mesh, 1e-4), 0.2, 7); }

std::vector<Case> cases(int teeth, int pieces) {
    const auto gear = [&](double fillet) { return extruded(gearOutline(teeth, 16, 20, fillet, pieces), 20); };
    const TriangleMesh post = extruded(gearOutline(3 * teeth, 4.8, 5, 1e-3, pieces), 30);
    const TriangleMesh bolt = threadMesh(5, 6, 1, 3, 20, 2e-3, pieces);
    return {
        {"gears", gear(3e-3), gear(2e-3), {36.5, 0, 0}},
        {"gear beside a post", gear(3e-3), post, {25.2, 0, 0}},
        {"gears, rounded with slivers", written(gear(3e-3)), written(gear(0.02)), {36.5, 0, 0}},
        {"bolt and gear, rounded with slivers", written(bolt), written(gear(1e-3)), {23, 0, 0}},
        {"bolts", bolt, written(bolt), {11.2, 0, 0}},
    };
}

/// Steps a hand that leaps every 150th tick; after each tick no triangles of the files overlap, by exact predicates.
void walk(const Case& c, int ticks, unsigned seed) {
    CAPTURE(c.name, seed);
    const World world = meshWorld(c.tool, c.obstacle, Pose{{60, 0, 0}, Quat::Identity()});
    const ExactJudge judge(c.tool, c.obstacle);
    WanderingHand hand(seed, 8, [&](std::mt19937& random) {
        std::uniform_real_distribution<double> uniform(-1, 1);
        const double around = std::numbers::pi * uniform(random);
        return Pose{expRotation(around * Vec3::UnitZ()) * (c.beside + Vec3(0, 0, 5 * uniform(random))),
                    expRotation(std::numbers::pi * uniform(random) * Vec3::UnitZ())};
    });
    TickState state(world);
    const Settings settings = settingsFor(Geometry::Mesh);
    int loaded = 0;
    for (int tick = 0; tick < ticks; ++tick) {
        const TickRecord record = step(world, settings, {hand.next()}, state);
        CAPTURE(tick, record.flags, record.linearizations);
        REQUIRE((record.flags & (kNonFinite | kListOverflow | kOverlapping | kBadInput)) == 0);
        REQUIRE_FALSE(judge.overlap(record.X_WT));
        loaded += !record.wrench_C.isZero();
    }
    CHECK(loaded > ticks / 10);
}

}  // namespace

TEST_CASE("fine parts: nothing enters in any tick, whatever the hand does", "[step]") {
    for (const Case& c : cases(6, 3)) walk(c, 300, 1);
}

TEST_CASE("fine parts: nothing enters in any tick, whatever many hands do", "[step][long]") {
    for (const Case& c : cases(20, 5))
        for (const unsigned seed : {2u, 3u, 4u}) walk(c, 1200, seed);
}

}  // namespace touchstone::fine_parts_tests
