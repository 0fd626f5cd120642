#include <unistd.h>
#include <catch2/catch.hpp>
#include <filesystem>

#include "haptics/hands/hand_table.hpp"
#include "haptics/hands/held_motion.hpp"
#include "haptics/hands/motion.hpp"
#include "haptics/hands/mouse.hpp"

namespace touchstone::hand_table_tests {

using Catch::Matchers::Contains;

/// The row of the table, which it must have.
const DeviceInfo& hand(const char* name) {
    const DeviceInfo* found = findDevice(name, handTable());
    REQUIRE(found);
    return *found;
}

TEST_CASE("hand table: finds each hand by name, and no other", "[devices]") {
    for (const DeviceInfo& row : handTable()) {
        CHECK(findDevice(row.name, handTable()) == &row);
        CHECK(!row.summary.empty());
    }
    CHECK(findDevice("phantom", handTable()) == nullptr);
    CHECK(findDevice("", handTable()) == nullptr);
}

TEST_CASE("devices: those that the wrench moves report their damping", "[devices]") {
    DeviceContext context;
    context.demonstration = std::make_shared<RecordedMotion>(std::vector<MotionKey>{{0, {}}, {4, {}}});
    context.file = "0.1,500,2.5,3";
    const auto held = hand("hand").make(context)->dynamics();
    REQUIRE(held);
    CHECK(held->damping == 2.5);
    CHECK(held->delay == 3);
    context.mouse = std::make_shared<MouseTarget>();
    CHECK(hand("mouse").make(context)->dynamics()->damping == HandParameters{}.damping);
    context.file.clear();
    CHECK_FALSE(hand("demo").make(context)->dynamics());  // no wrench moves it
    CHECK(leastDamping(1, 1000, 0) == Approx(0.5));       // 1 N/mm at 1 kHz: 0.5 N·s/m
    CHECK(leastDamping(1, 10'000, 1) == Approx(0.15));
}

TEST_CASE("devices: report a missing requirement", "[devices]") {
    // Each names a device that works in its place.
    CHECK_THROWS_WITH(hand("demo").make({}), Contains("no demonstration") && Contains("the device rest"));
    CHECK_THROWS_WITH(hand("hand").make({}), Contains("no demonstration") && Contains("the device rest"));
    CHECK_THROWS_WITH(hand("mouse").make({}), Contains("needs the window") && Contains("the device rest"));
    DeviceContext moving, window;
    moving.demonstration = std::make_shared<RecordedMotion>(std::vector<MotionKey>{{0, {}}, {4, {}}});
    CHECK_THROWS_WITH(hand("mouse").make(moving), Contains("the device demo"));
    window.mouse = std::make_shared<MouseTarget>();
    CHECK_THROWS_WITH(hand("demo").make(window), Contains("the device mouse"));
    CHECK_THROWS_WITH(hand("replay").make({}), Contains("replay:FILE"));
    DeviceContext context;
    context.file = "/nowhere.csv";
    CHECK_THROWS_WITH(hand("replay").make(context), Contains("/nowhere.csv"));
}

TEST_CASE("demo and replay: follow the motion and finish at its end", "[devices]") {
    const std::vector<MotionKey> keys{{0, {{0, 0, 0}, Quat::Identity()}}, {4, {{8, 0, 0}, Quat::Identity()}}};
    const auto file =
        std::filesystem::temp_directory_path() / ("touchstone-replay-" + std::to_string(getpid()) + ".csv");
    writeMotion(file, keys);
    DeviceContext context;
    context.demonstration = std::make_shared<RecordedMotion>(keys);
    const std::vector<NamedMotion> motions{{"", context.demonstration}, {"again", context.demonstration}};
    context.motions = motions;
    for (const auto& [name, after] : {std::pair{"demo", std::string()}, {"demo", "again"}, {"replay", file.string()}}) {
        context.file = after;
        const auto device = hand(name).make(context);
        for (int tick = 0; tick < 8; ++tick) {
            const DeviceReading reading = device->read(tick, 1);
            CHECK(reading.valid);
            CHECK(reading.X_WT_device.p.x() == std::min(2.0 * tick, 8.0));
            CHECK(reading.finished == (tick >= 4));
            device->write({{1, 1, 1}, {1, 1, 1}});
        }
    }
    std::filesystem::remove(file);
}

TEST_CASE("rest: holds the tool where it starts, and its motion ends at once", "[devices]") {
    DeviceContext context;
    context.X_WT_start = {{1, 2, 3}, Quat(Eigen::AngleAxisd(0.5, Vec3::UnitZ()))};
    const auto device = hand("rest").make(context);
    for (const double t : {0.0, 1.0, 1e6}) {
        device->write({{5, 5, 5}, {5, 5, 5}});
        const DeviceReading reading = device->read(t, 1);
        CHECK(reading.X_WT_device == context.X_WT_start);
        CHECK((reading.valid && reading.finished));
    }
    CHECK(device->duration() == 0);
}

TEST_CASE("mouse: the hand follows the drag, force holds it back, and it stays where it is released", "[devices]") {
    DeviceContext context;
    context.mouse = std::make_shared<MouseTarget>();
    context.X_WT_start = {{100, 0, 0}, Quat::Identity()};
    const auto device = hand("mouse").make(context);
    double t = 0;
    const auto run = [&](int ticks, const Wrench& wrench) {
        DeviceReading reading;
        for (int i = 0; i < ticks; ++i, ++t) {
            reading = device->read(t, 1);
            device->write(wrench);
        }
        CHECK(reading.valid);
        CHECK_FALSE(reading.finished);
        return reading.X_WT_device.p;
    };
    // Nothing has grabbed it.
    CHECK(run(100, {}) == Vec3(100, 0, 0));
    context.mouse->grab({{110, 0, 0}, Quat::Identity()});
    CHECK((run(1000, {}) - Vec3(110, 0, 0)).norm() < 1e-6);
    // 2 N displace a spring of 0.5 N/mm by 4 mm.
    CHECK((run(1000, {{-2, 0, 0}, {0, 0, 0}}) - Vec3(106, 0, 0)).norm() < 1e-6);
    context.mouse->release();
    CHECK((run(1000, {{-2, 0, 0}, {0, 0, 0}}) - Vec3(106, 0, 0)).norm() < 1e-6);
    // A non-finite target is ignored.
    Pose broken;
    broken.p.y() = std::nan("");
    context.mouse->grab(broken);
    CHECK((run(1000, {}) - Vec3(110, 0, 0)).norm() < 1e-6);
    // Time zero restarts it.
    context.mouse->grab({{0, 50, 0}, Quat::Identity()});
    t = 0;
    CHECK(run(100, {}) == Vec3(100, 0, 0));
}

TEST_CASE("mouse: force holds a stronger hand back less", "[devices]") {
    const auto target = std::make_shared<MouseTarget>();
    MouseDevice device(target, {});
    device.read(0, 1);
    const Wrench wrench{{2, 0, 0}, Vec3::Zero()};
    for (const double strength : {1.0, 4.0, 0.25}) {
        target->grab({}, strength);
        device.write(wrench);
        Pose pose;
        for (int i = 1; i < 5000; ++i) pose = device.read(i, 1).X_WT_device;
        // 2 N on a spring of 0.5 N/mm times the strength.
        CHECK(pose.p.x() == Approx(2 / (0.5 * strength)).epsilon(1e-9));
    }
    target->release(1e9);  // beyond the range of a hand: clamped to the bound, and the last target stays
    Pose pose;
    for (int i = 5000; i < 10000; ++i) pose = device.read(i, 1).X_WT_device;
    CHECK(pose.p.x() == Approx(2 / (0.5 * MouseTarget::kStrongest)).epsilon(1e-9));
}

TEST_CASE("hand device: follows the motion, feels the wrench after its delay, and counts the work", "[devices]") {
    // With 0.5 N/mm and about critical damping, 1 N along x moves the resting hand by 2 mm, and 1 N over 2 mm is 2 mJ.
    const auto still = std::make_shared<RecordedMotion>(std::vector<MotionKey>{{0, {}}, {1000, {}}});
    const int delay = GENERATE(0, 3);
    HeldMotion held(still, {}, delay);
    held.read(0, 1);
    for (int tick = 1; tick <= 1000; ++tick) {
        held.write({{1, 0, 0}, Vec3::Zero()});
        const Vec3 p = held.read(tick, 1).X_WT_device.p;
        if (tick <= delay) REQUIRE(p.norm() == 0);
        if (tick == delay + 1) REQUIRE(p.x() > 0);
    }
    CHECK(held.work() == Approx(2).margin(1e-6));
    CHECK(held.gain() == Approx(1).margin(1e-6));  // half of it is stored in the spring, the damper took the other half
}

TEST_CASE("hand device: impossible parameters are refused in one sentence", "[devices]") {
    DeviceContext context;
    context.demonstration = std::make_shared<RecordedMotion>(std::vector<MotionKey>{{0, {}}, {10, {}}});
    const auto with = [&](const char* text) {
        context.file = text;
        return hand("hand").make(context);
    };
    CHECK(with(""));
    CHECK(with("0.1,500,5,2"));
    CHECK_THROWS_WITH(with("0.1,fast"), Contains("'fast' is not a number"));
    CHECK_THROWS_WITH(with("0,500"), Contains("mass"));
    CHECK_THROWS_WITH(with("0.1,500,5,0.5"), Contains("whole number"));
    CHECK_THROWS_WITH(with("0.1,500,5,2,no-such"), Contains("no motion 'no-such'"));
}

}  // namespace touchstone::hand_table_tests
