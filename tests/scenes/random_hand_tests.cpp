// Every scene in the hands of somebody without a plan: between meshes nothing overlaps, whatever the hand does.
#include <catch2/catch.hpp>

#include "haptics/loop/step.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tests/scenes/scene_files.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/scene_judge.hpp"
#include "tests/support/wandering_hand.hpp"

namespace touchstone::random_hand_tests {

using namespace touchstone::test;

namespace {

struct Plan {
    int ticks = 0;
    unsigned seed = 0;
    bool moving = false;    ///< the obstacles move too
    int judged = 25;        ///< the exact judge looks at each tick of this number
    bool swapping = false;  ///< the geometry changes to spheres now and then
};

/// Share of the ticks with force on the hand.
double play(const sandbox::HapticScene& scene, const Plan& plan) {
    const World& world = *scene.world;
    const SceneJudge judge(scene);
    const double duration = scene.demonstration->duration();
    WanderingHand hand(plan.seed, world.reach() / 2, [&](std::mt19937& engine) {
        return scene.demonstration->at(std::uniform_real_distribution<double>(0, duration)(engine));
    });
    Random random(plan.seed + 1000);
    TickState state(world);
    std::vector<Pose> targets;
    if (plan.moving)
        for (const Obstacle& obstacle : world.obstacles) targets.push_back(obstacle.X_WO);
    // Between meshes, a tick may end with two searches of each list beyond the sum (SearchBudget).
    const auto mostTests = kSearchLimits.tick + 2 * kSearchLimits.list * std::int64_t(world.obstacles.size());
    std::int64_t tests = 0;
    double longestMs = 0;  // of processor time; reported and not judged
    int loaded = 0, moved = 0, shortened = 0;
    for (int tick = 0; tick < plan.ticks; ++tick) {
        if (plan.moving && tick % 100 == 0)
            for (std::size_t k = 0; k < targets.size(); ++k)
                targets[k] = Pose{0.8 * random.vector(), expRotation(0.03 * random.vector())} * world.obstacles[k].X_WO;
        const bool bySpheres = plan.swapping && tick % 230 >= 180;
        Settings settings = sandbox::withGeometry(scene.settings, bySpheres ? Geometry::Spheres : Geometry::Mesh);
        settings.shadow = kNoSolver;
        const Pose before = state.obstacles()[0], device = hand.next();
        const double began = threadCpuMicroseconds();
        const TickRecord record = step(world, settings, {device, state.nextMove(targets)}, state);
        longestMs = std::max(longestMs, 1e-3 * (threadCpuMicroseconds() - began));
        tests = std::max(tests, searches(state).spent());
        shortened += searches(state).isShortened();
        if (!bySpheres) REQUIRE(searches(state).spent() <= mostTests);
        CAPTURE(plan.seed, plan.moving, bySpheres, tick, record.flags, record.linearizations);
        REQUIRE((record.flags & (kNonFinite | kListOverflow | kOverlapping | kBadInput)) == 0);
        REQUIRE((record.X_WT.isFinite() && record.wrench_C.isFinite()));
        if (!bySpheres) REQUIRE_FALSE(meshesOverlap(world, record.X_WT, state.obstacles()));
        if (!bySpheres && tick % plan.judged == 0) REQUIRE_FALSE(judge.overlap(record.X_WT, state.obstacles()));
        loaded += !record.wrench_C.isZero();
        moved += !(state.obstacles()[0] == before);
    }
    if (plan.moving) CHECK(moved > plan.ticks / 100);
    CAPTURE(longestMs, tests);
    CHECK(shortened < plan.ticks / 10);
    return double(loaded) / plan.ticks;
}

}  // namespace

TEST_CASE("random hands: between meshes nothing overlaps in any scene, with obstacles at rest and moving",
          "[scenes][slow][long]") {
    const bool moving = GENERATE(false, true);
    for (const std::filesystem::path& file : sceneFiles()) {
        INFO(file.stem());
        const double touched = play(openBundled(file), {.ticks = 3000, .seed = 1, .moving = moving});
        CHECK(touched > 0.2);
    }
}

TEST_CASE("random hands: the geometry can change while the tool is in contact, in any scene", "[scenes][slow][long]") {
    for (const std::filesystem::path& file : sceneFiles()) {
        INFO(file.stem());
        play(openBundled(file, true), {.ticks = 2000, .seed = 2, .swapping = true});
    }
}

TEST_CASE("random hands: between meshes nothing overlaps in some scenes, for a moment", "[scenes][slow]") {
    for (const char* name : {"bunnies", "dental", "plate"}) {
        INFO(name);
        const sandbox::HapticScene scene = openBundled(TOUCHSTONE_BINARY_DIR "/scenes/" + std::string(name) + ".glb");
        play(scene, {.ticks = 450, .seed = 3});
        play(scene, {.ticks = 450, .seed = 4, .moving = true});
    }
}

TEST_CASE("random hands: the geometry can change while friction holds the tool", "[scenes][slow]") {
    for (const char* name : {"drawer", "incline"}) {
        INFO(name);
        const std::string file = TOUCHSTONE_BINARY_DIR "/scenes/" + std::string(name) + ".glb";
        const double touched = play(openBundled(file, true), {.ticks = 690, .seed = 2, .swapping = true});
        CHECK(touched > 0.2);  // in all of three rounds with both geometries
    }
}

TEST_CASE("random hands: rails that move do not run into a drawer that friction holds", "[scenes][slow]") {
    // Some ticks find no forces with friction after a rail has pushed the drawer.
    play(openBundled(TOUCHSTONE_BINARY_DIR "/scenes/drawer.glb"), {.ticks = 3000, .seed = 1, .moving = true});
}

}  // namespace touchstone::random_hand_tests
