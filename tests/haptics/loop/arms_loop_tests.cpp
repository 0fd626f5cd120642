// The loop with an arm of Force Dimension and with an arm over the network: the hand feels the ground.
#include <atomic>
#include <thread>

#include "haptics/device/device_table.hpp"
#include "haptics/device/lab.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "tests/support/arm_matrix.hpp"
#include "tests/support/fake_dhd/fake_dhd_device.hpp"
#include "tests/support/ground_world.hpp"
#include "tests/support/lab_arm.hpp"

namespace touchstone::arms_loop_tests {

using namespace touchstone::test;

namespace {

LoopOptions unraised() {
    LoopOptions options;
    options.realTime.raise = false;
    options.watchdogMs = 0;
    return options;
}

/// Begins 1 mm above the ground, engaged.
struct Running {
    std::shared_ptr<const World> world = groundBelow();
    HapticLoop loop;

    explicit Running(std::unique_ptr<Device> device) : loop(world, Settings{}, std::move(device), unraised()) {
        REQUIRE(until([&](const LoopSnapshot& s) { return s.ticks > 5 && engaged(s); }));
    }
    bool engaged(const LoopSnapshot& s) {
        if (s.record.trips & bit(Trip::StaleReading)) return false;
        if (!isEngaged(s.engagement)) loop.engage();
        return isEngaged(s.engagement);
    }
    bool until(const std::function<bool(const LoopSnapshot&)>& done) {
        return within([&] { return loop.poll() && done(loop.snapshot()); });
    }
};

/// A program in the lab with a hand of 0.5 N/mm on a weightless arm, which moves at once to where the forces balance.
class LabHand {
  public:
    explicit LabHand(std::uint16_t port) : thread_([this, port](const std::stop_token& stop) { run(stop, port); }) {}
    void press(double depth) { goal_ = -depth; }
    double force() const { return force_; }
    double height() const { return height_; }

  private:
    void run(const std::stop_token& stop, std::uint16_t port) {
        LabArm arm(port);
        double y = 0;
        while (!stop.stop_requested()) {
            if (const auto wrench = arm.receive()) force_ = wrench->wrench.force.y();
            y += 0.05 * (goal_ + force_ / 0.5 - y);
            height_ = y;
            arm.send({0, y, 0});
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }

    std::atomic<double> goal_ = 0, force_ = 0, height_ = 0;
    std::jthread thread_;
};

}  // namespace

TEST_CASE("arms loop: the hand on an arm of Force Dimension feels the ground", "[device]") {
    const FakeDhd fake;
    std::optional<Running> running(std::in_place, openForceDimension("stale=500", groundBelow()->X_WT_start));
    // 13 mm down is 10 mm deep, where springs of 0.5 and 1 N/mm balance.
    fake.hand({0, -13, 0});
    CHECK(running->until([&](const LoopSnapshot& s) {
        return running->engaged(s) && std::abs(fake.force().y() - 10.0 / 3) < 0.1 &&
               std::abs(fake.position().y() + 19.0 / 3) < 0.2;
    }));
    CHECK(std::abs(fake.force().x()) < 0.1);
    running.reset();
    CHECK(fake.released());
    CHECK(fake.state().open == 0);
    CHECK(fake.state().misuses == 0);
}

TEST_CASE("arms loop: the hand on an arm over the network feels the ground", "[device]") {
    constexpr std::uint16_t kPort = 50734;
    DeviceContext context;
    context.X_WT_start = groundBelow()->X_WT_start;
    context.file = std::to_string(kPort) + ",stale=500";
    auto device = makeLab(context);
    LabHand hand(kPort);
    Running running(std::move(device));
    hand.press(13);
    CHECK(running.until([&](const LoopSnapshot& s) {
        return running.engaged(s) && std::abs(hand.force() - 10.0 / 3) < 0.1 &&
               std::abs(hand.height() + 19.0 / 3) < 0.2;
    }));
    running.loop.stop();
    CHECK(running.until([&](const LoopSnapshot&) { return hand.force() == 0; }));
}

}  // namespace touchstone::arms_loop_tests
