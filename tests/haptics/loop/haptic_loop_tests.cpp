#include "haptics/loop/haptic_loop.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <functional>
#include <thread>

#include "haptics/loop/step.hpp"
#include "tests/support/ground_world.hpp"

namespace touchstone::haptic_loop_tests {

namespace {

std::shared_ptr<const World> groundWorld() { return test::groundBelow(Vec3::UnitZ(), 20); }

/// Shared with the test's thread.
struct Watch {
    std::atomic<int> living = 0;
    std::atomic<bool> freedOnLoop = false;
    std::atomic<double> lastForce = 0;
    bool motors = false;
    std::atomic<int> engaged = 0;
};

/// Presses 5 mm deep.
class PressingDevice final : public Device {
  public:
    explicit PressingDevice(Watch& watch) : watch_(watch) { ++watch_.living; }
    ~PressingDevice() override {
        --watch_.living;
        if (std::this_thread::get_id() == reader_) watch_.freedOnLoop = true;
    }
    DeviceReading read(double t, double) noexcept override {
        reader_ = std::this_thread::get_id();
        return {.X_WT_device = {{0, 0, t < 1 ? 20.0 : 0.0}, Quat::Identity()}};
    }
    void write(const Wrench& wrench) noexcept override { watch_.lastForce = wrench.force.norm(); }
    DeviceLimits limits() const noexcept override { return {.motors = watch_.motors}; }
    void engage(const Pose&) noexcept override { ++watch_.engaged; }

  private:
    Watch& watch_;
    std::thread::id reader_;
};

// The user's privileges must not matter, and other work on the machine should continue.
const LoopOptions kOptions{.realTime = {.raise = false}, .ringCapacity = 1 << 14, .shares = {}, .watchdogMs = 0};

/// Polls until the snapshot satisfies the condition. The time limit only detects a loop that hangs.
bool waitFor(HapticLoop& loop, const std::function<bool(const LoopSnapshot&)>& wanted) {
    const auto start = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
        if (loop.poll() && wanted(loop.snapshot())) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

}  // namespace

TEST_CASE("haptic loop: a tick counts the late ticks before it", "[loop][thread]") {
    /// Every tenth reading takes several tick periods.
    class SlowDevice final : public Device {
      public:
        DeviceReading read(double, double) noexcept override {
            if (++reads_ % 10 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
            return {.X_WT_device = {{0, 0, 20}, Quat::Identity()}};
        }
        void write(const Wrench&) noexcept override {}

      private:
        int reads_ = 0;
    };
    HapticLoop loop(groundWorld(), {}, std::make_unique<SlowDevice>(), kOptions);
    REQUIRE(waitFor(loop, [](const LoopSnapshot& s) { return s.ticks >= 100; }));
    TickRecord record, before;
    REQUIRE(loop.pop(before));
    CHECK(before.overruns == 0);
    for (int i = 1; i < 100 && loop.pop(record); ++i, before = record) {
        CHECK(record.periodUs > 0);
        CHECK(record.overruns >= before.overruns);
        if (i % 10 != 0) continue;  // only ticks after a slow reading
        CHECK(record.overruns > before.overruns);
        CHECK(record.periodUs > 4999);
    }
}

TEST_CASE("haptic loop: ticks, delivers every tick in order, and leaves zero force behind", "[loop][thread]") {
    Watch watch;
    {
        HapticLoop loop(groundWorld(), {}, std::make_unique<PressingDevice>(watch), kOptions);
        REQUIRE(waitFor(loop, [](const LoopSnapshot& s) { return s.ticks >= 200 && s.fade == 1; }));
        CHECK(loop.snapshot().record.wrench_out.force.z() == Approx(5).epsilon(0.01));
        CHECK(watch.lastForce > 4.9);
        CHECK(loop.snapshot().session == 0);
        CHECK(loop.snapshot().dropped == 0);
        TickRecord record;
        std::uint64_t expected = 0;
        while (expected < 200 && loop.pop(record)) REQUIRE(record.tick == expected++);
        CHECK(expected == 200);
        CHECK(record.totalUs > 0);
    }
    CHECK(watch.lastForce == 0);
    CHECK(watch.living == 0);
}

TEST_CASE("haptic loop: the newest of many settings wins, and the work of live ticks is limited", "[loop][thread]") {
    Watch watch;
    HapticLoop loop(groundWorld(), {}, std::make_unique<PressingDevice>(watch), kOptions);
    Settings settings;
    for (int i = 1; i <= 1000; ++i) {
        settings.stiffness = 1 + i / 1000.0;
        loop.setSettings(settings);
    }
    REQUIRE(waitFor(loop, [](const LoopSnapshot& s) { return s.settings.stiffness == 2; }));
    REQUIRE(waitFor(loop, [](const LoopSnapshot& s) { return s.record.wrench_out.force.z() > 9.9; }));
    CHECK(loop.snapshot().settings.shadowWork <= settings.shadowWork);

    settings.rate = 4000;
    settings.mode = Mode::Paper;
    loop.setSettings(settings);
    CHECK(
        waitFor(loop, [](const LoopSnapshot& s) { return s.settings.rate == 4000 && s.settings.mode == Mode::Paper; }));

    settings.trust = 99;
    CHECK_THROWS_AS(loop.setSettings(settings), std::invalid_argument);
    CHECK_THROWS_AS(loop.open(groundWorld(), settings, std::make_unique<PressingDevice>(watch)), std::invalid_argument);
}

TEST_CASE("haptic loop: a new session replaces the old one between ticks, which another thread frees",
          "[loop][thread]") {
    Watch watch;
    {
        HapticLoop loop(groundWorld(), {}, std::make_unique<PressingDevice>(watch), kOptions);
        for (std::uint64_t number = 1; number <= 4; ++number) {
            Settings settings;
            settings.stiffness = 1 + static_cast<double>(number);
            loop.open(groundWorld(), settings, std::make_unique<PressingDevice>(watch));
            // Settings given after a session belong to it, in whatever order the two reach the loop.
            settings.margin = 0.6;
            loop.setSettings(settings);
            if (number == 2) continue;  // the next session comes before this one is taken, or while it opens
            REQUIRE(waitFor(loop, [&](const LoopSnapshot& s) { return s.session == number; }));
            REQUIRE(waitFor(loop, [&](const LoopSnapshot& s) {
                return s.settings.stiffness == settings.stiffness && s.settings.margin == 0.6;
            }));
        }
        CHECK(waitFor(loop, [&](const LoopSnapshot&) { return watch.living == 1; }));
    }
    CHECK(watch.living == 0);
    CHECK_FALSE(watch.freedOnLoop);
}

TEST_CASE("haptic loop: a restart resets to tick zero", "[loop][thread]") {
    Watch watch;
    HapticLoop loop(groundWorld(), {}, std::make_unique<PressingDevice>(watch), kOptions);
    REQUIRE(waitFor(loop, [](const LoopSnapshot& s) { return s.ticks > 150; }));
    loop.restart();
    CHECK(waitFor(loop, [](const LoopSnapshot& s) { return s.record.tick + 150 < s.ticks; }));
}

TEST_CASE("haptic loop: a full ring counts dropped records, and a start is made up for", "[loop][thread]") {
    Watch watch;
    LoopOptions options = kOptions;
    options.ringCapacity = 16;
    HapticLoop loop(groundWorld(), {}, std::make_unique<PressingDevice>(watch), options);
    REQUIRE(waitFor(loop, [](const LoopSnapshot& s) { return s.ticks >= 50; }));
    CHECK(loop.snapshot().dropped == loop.snapshot().ticks - 16);

    loop.forgetHistory();
    const std::uint64_t asked = loop.snapshot().ticks;
    REQUIRE(waitFor(loop, [&](const LoopSnapshot& s) { return s.ticks >= asked + 10; }));
    const std::uint64_t full = loop.snapshot().record.tick;
    CHECK(waitFor(loop, [&](const LoopSnapshot&) {
        for (RecordedTick tick; loop.pop(tick);)
            if (tick.start && tick.record.tick > full) return true;
        return false;
    }));
}

TEST_CASE("haptic loop: motors have no force before engage() and after stop()", "[loop][thread]") {
    Watch watch;
    watch.motors = true;
    HapticLoop loop(groundWorld(), {}, std::make_unique<PressingDevice>(watch), kOptions);
    const auto reaches = [&](Engagement wanted) {
        return waitFor(loop, [&](const LoopSnapshot& s) { return s.engagement == wanted; });
    };
    REQUIRE(waitFor(loop, [](const LoopSnapshot& s) { return s.ticks > 20; }));
    CHECK(loop.snapshot().engagement == Engagement::Stopped);
    CHECK(watch.lastForce == 0);
    loop.engage();
    CHECK(reaches(Engagement::Engaging));
    CHECK(watch.engaged == 1);
    loop.engage();
    loop.stop();  // the newest request wins
    CHECK(reaches(Engagement::Stopped));
    CHECK(watch.lastForce == 0);
    CHECK(watch.engaged == 1);
}

TEST_CASE("haptic loop: the watchdog releases a device whose driver hangs, a fault once ticks continue",
          "[loop][thread]") {
    struct Hand {
        std::atomic<bool> hangs = false;
        std::atomic<int> releaseForces = 0;
        std::atomic<double> force = 0;
        std::atomic<bool> disobeyed = false;  // a force after its release
    } hand;
    /// Presses as soon as it is engaged.
    class HangingDevice final : public Device {
      public:
        explicit HangingDevice(Hand& hand) : hand_(hand) {}
        DeviceReading read(double, double) noexcept override {
            while (hand_.hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
            z_ = std::max(z_ - 0.01, 2.0);
            return {.X_WT_device = {{0, 0, z_}, Quat::Identity()}};
        }
        void write(const Wrench& wrench) noexcept override {
            hand_.force = wrench.force.norm();
            if (hand_.releaseForces > 0 && hand_.force > 0) hand_.disobeyed = true;
        }
        void releaseForces() noexcept override {
            hand_.force = 0;
            ++hand_.releaseForces;
        }
        void engage(const Pose& X_WT) noexcept override { z_ = X_WT.p.z(); }

      private:
        Hand& hand_;
        double z_ = 20;
    };
    LoopOptions options = kOptions;
    options.watchdogMs = 1000;  // a busy machine delays threads
    HapticLoop loop(groundWorld(), {}, std::make_unique<HangingDevice>(hand), options);
    loop.engage();
    REQUIRE(waitFor(loop, [&](const LoopSnapshot&) { return hand.force > 2; }));
    CHECK_FALSE(loop.hangs());
    const auto until = [](const auto& wanted) {
        for (int i = 0; i < 60'000 && !wanted(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return wanted();
    };
    hand.hangs = true;
    REQUIRE(until([&] { return hand.releaseForces == 1; }));
    CHECK(hand.force == 0);
    CHECK(loop.hangs());
    hand.hangs = false;
    CHECK(waitFor(loop, [](const LoopSnapshot& s) { return s.engagement == Engagement::Faulted; }));
    CHECK(loop.snapshot().cause == Trip::TickHung);
    CHECK(loop.snapshot().trips[static_cast<std::size_t>(Trip::TickHung)].events == 1);
    CHECK(until([&] { return !loop.hangs(); }));
    CHECK_FALSE(hand.disobeyed);
    CHECK(hand.releaseForces == 1);
    hand.releaseForces = 0;
    loop.engage();
    CHECK(waitFor(loop, [&](const LoopSnapshot&) { return hand.force > 2; }));
}

TEST_CASE("haptic loop: each start comes with the obstacle poses of its tick", "[loop][thread]") {
    Watch watch;
    HapticLoop loop(groundWorld(), {}, std::make_unique<PressingDevice>(watch), kOptions);
    RecordedTick tick;
    double last = 0;
    const auto follow = [&](int more) {
        return waitFor(loop, [&](const LoopSnapshot&) {
            while (loop.pop(tick)) {
                if (!tick.start) continue;
                REQUIRE(loop.obstaclesAtStart().size() == 1);
                last = loop.obstaclesAtStart()[0].p.x();
                if (--more == 0) return true;
            }
            return false;
        });
    };
    REQUIRE(follow(1));
    CHECK(last == 0);
    const Pose aside{{3, 0, -1000}, Quat::Identity()};
    loop.moveObstacles(std::span(&aside, 1));
    REQUIRE(waitFor(loop, [&](const LoopSnapshot& s) { return !s.X_WO.empty() && s.X_WO[0].p.x() == 3; }));
    loop.restart();
    REQUIRE(follow(1));
    CHECK(last == 3);
    loop.forgetHistory();
    REQUIRE(follow(1));
    CHECK(last == 3);
}

}  // namespace touchstone::haptic_loop_tests
