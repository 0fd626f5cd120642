// The thread that finds pairs ahead of the tool: what it finds, and that ticks give the same results with it.
#include "haptics/loop/neighbor_list_worker.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <memory>
#include <thread>

#include "haptics/loop/step.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::neighbor_list_worker_tests {

using namespace touchstone::test;

TEST_CASE("neighbor list worker: finds the pairs ahead of a moving tool that a tick may need", "[thread]") {
    const World world = worldOf(blob(300, 20, 7), blob(300, 20, 8), at(0, 32, 0));
    NeighborListWorker worker(world);
    REQUIRE(worker.newest().size() == 1);
    REQUIRE(worker.newest()[0]->within.margin < 0);
    const LeafPairFinder finder(*world.tool.spheres, *world.obstacles[0].part.spheres);
    const auto wait = [&](auto&& until) {
        for (int i = 0; i < 5000 && !until(*worker.newest()[0]); ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return until(*worker.newest()[0]);
    };
    // 0.1 mm a tick: the tool will have moved 0.15 mm when the entries arrive.
    const auto ask = [&](double y) {
        const Pose X_WO[] = {world.obstacles[0].X_WO};
        worker.request({}, at(0, y + 0.1, 0), X_WO);
        worker.request({.tickMs = 1, .within = 0.5, .trust = 0.5, .slack = 0.2}, at(0, y, 0), X_WO);
    };
    ask(32);
    REQUIRE(wait([&](const PairEntries& e) { return finder.reserve(e, {at(0, 31.85, 0), 0.5}) >= 0; }));
    REQUIRE(worker.takeCpuUs() > 0);
    ask(25);
    REQUIRE(wait([&](const PairEntries& e) { return finder.reserve(e, {at(0, 24.85, 0), 0.5}) >= 0; }));
    // It publishes the same entries as a finder in this thread.
    LeafPairFinder own(*world.tool.spheres, *world.obstacles[0].part.spheres);
    PairEntries expected(*world.tool.spheres, *world.obstacles[0].part.spheres);
    const PairEntries& found = *worker.newest()[0];
    REQUIRE(own.find(found, expected));
    REQUIRE(found.count == expected.count);
    for (int i = 0; i < found.count; ++i) {
        REQUIRE(found.at[i].tool == expected.at[i].tool);
        REQUIRE(found.at[i].obstacle == expected.at[i].obstacle);
        REQUIRE(found.gap[i] == expected.gap[i]);
    }
}

TEST_CASE("obstacles: lists found by another thread, and an audit, change no result", "[step][obstacle]") {
    const Settings settings = settingsFor(GENERATE(Geometry::Spheres, Geometry::Mesh));
    // Two bodies of about 20 mm radius that have leaves as well as meshes.
    const World world = withMeshes(worldOf(blob(300, 15, 6), blob(300, 20, 7), at(0, 45, 0)), blobMesh(15, 24, 13),
                                   blobMesh(20, 22, 11));
    const auto drive = [&](bool helped, bool audit) {
        TickState state(world);
        std::unique_ptr<NeighborListWorker> worker;
        if (helped) worker = std::make_unique<NeighborListWorker>(world);
        std::uint64_t sum = 0;
        for (int tick = 0; tick < 400; ++tick) {
            const std::vector<Pose> targets{tick < 200 ? at(0, 20, 5, Vec3(0.5, 0, 0)) : at(5, -10, 0)};
            const TickInput input{at(0, std::max(36.0, 45 - 0.06 * tick), 0), state.nextMove(targets)};
            StepOptions options{.audit = audit};
            if (worker) options.entries = worker->newest();
            const TickRecord r = step(world, settings, input, state, options);
            sum = hashTick(r, sum);
            if (!worker) continue;
            worker->request({.tickMs = 1,
                             .within = askedPairs(state),
                             .trust = settings.trust,
                             .slack = settings.slack,
                             .geometry = settings.geometry},
                            r.X_WT, state.obstacles());
            std::this_thread::sleep_for(std::chrono::microseconds(300));
        }
        return sum;
    };
    const std::uint64_t plain = drive(false, false);
    CHECK(drive(true, false) == plain);
    CHECK(drive(false, true) == plain);
}

}  // namespace touchstone::neighbor_list_worker_tests
