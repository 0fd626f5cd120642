// The loop with the fake service: what the hand feels.
#include "haptics/device/device_table.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "haptics/sandbox/devices/inverse3.hpp"
#include "tests/support/arm_matrix.hpp"
#include "tests/support/fake_inverse/fake_inverse.hpp"
#include "tests/support/ground_world.hpp"

namespace touchstone::inverse3_loop_tests {

using namespace touchstone::test;

TEST_CASE("inverse3 loop: the hand feels the ground, and no torque is asked of the device", "[device]") {
    FakeInverse fake;
    const auto world = groundBelow();
    DeviceContext context;
    context.X_WT_start = world->X_WT_start;
    context.file = fake.options() + ",stale=500";
    auto device = sandbox::makeInverse3(context);
    LoopOptions options;
    options.realTime.raise = false;
    options.watchdogMs = 0;
    HapticLoop loop(world, Settings{}, std::move(device), options);
    const auto stale = [](const LoopSnapshot& s) { return (s.record.trips & bit(Trip::StaleReading)) != 0; };
    const auto engaged = [&](const LoopSnapshot& s) {
        if (!isEngaged(s.engagement)) loop.engage();
        return isEngaged(s.engagement);
    };
    const auto until = [&](const std::function<bool(const LoopSnapshot&)>& done) {
        return within([&] { return loop.poll() && done(loop.snapshot()); });
    };
    REQUIRE(until([&](const LoopSnapshot& s) { return s.ticks > 5 && !stale(s) && engaged(s); }));
    // The tool begins 1 mm above the ground. 13 mm down is up to 10 mm deep, where springs of 0.5 and 1 N/mm balance.
    fake.hand({0, -13, 0});
    REQUIRE(until([&](const LoopSnapshot& s) {
        return engaged(s) && std::abs(fake.state().force.y() - 10.0 / 3) < 0.1 &&
               std::abs(fake.state().position.y() + 19.0 / 3) < 0.2;
    }));
    CHECK(std::abs(fake.state().force.x()) < 0.1);
    CHECK(std::abs(fake.state().force.z()) < 0.1);
    fake.hand({0, -13, 0}, {0, 0, 0.3});  // one end of the tool is pressed deeper
    REQUIRE(until([&](const LoopSnapshot& s) { return engaged(s) && s.record.wrench_o.torque.norm() > 20; }));
    CHECK(loop.snapshot().record.wrench_out.torque.isZero(0));
    CHECK((loop.snapshot().record.trips & bit(Trip::TorqueClamped)) == 0);
    fake.fault("disconnect");
    REQUIRE(until([&](const LoopSnapshot& s) { return s.engagement == Engagement::Faulted; }));
    CHECK(fake.state().force.isZero(0));
    const std::uint64_t ticks = loop.snapshot().ticks;
    CHECK(until([&](const LoopSnapshot& s) { return s.ticks > ticks + 100; }));  // the scene continues
}

}  // namespace touchstone::inverse3_loop_tests
