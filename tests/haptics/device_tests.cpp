#include <unistd.h>
#include <catch2/catch.hpp>
#include <filesystem>

#include "haptics/device/device.hpp"
#include "haptics/device/motion.hpp"
#include "haptics/device/mouse.hpp"

using namespace touchstone;
using Catch::Matchers::Contains;

TEST_CASE("device table: the three devices are found by name, others are not", "[devices]") {
    REQUIRE(deviceTable().size() == 3);
    for (const char* name : {"demo", "mouse", "replay"}) {
        REQUIRE(findDevice(name));
        CHECK(findDevice(name)->name == name);
        CHECK(!findDevice(name)->summary.empty());
    }
    CHECK(findDevice("phantom9") == nullptr);
    CHECK(findDevice("") == nullptr);
}

TEST_CASE("devices: without what they need they say so", "[devices]") {
    CHECK_THROWS_WITH(findDevice("demo")->make({}), Contains("no demonstration"));
    CHECK_THROWS_WITH(findDevice("mouse")->make({}), Contains("needs the window"));
    CHECK_THROWS_WITH(findDevice("replay")->make({}), Contains("replay:FILE"));
    DeviceContext context;
    context.file = "/nowhere.csv";
    CHECK_THROWS_WITH(findDevice("replay")->make(context), Contains("/nowhere.csv"));
}

TEST_CASE("demo and replay: follow the motion and finish at its end", "[devices]") {
    const std::vector<MotionKey> keys{{0, {{0, 0, 0}, Quat::Identity()}}, {4, {{8, 0, 0}, Quat::Identity()}}};
    const auto file =
        std::filesystem::temp_directory_path() / ("touchstone-replay-" + std::to_string(getpid()) + ".csv");
    writeMotion(file, keys);
    DeviceContext context;
    context.demonstration = std::make_shared<RecordedMotion>(keys);
    context.file = file.string();
    for (const char* name : {"demo", "replay"}) {
        const auto device = findDevice(name)->make(context);
        for (int tick = 0; tick < 8; ++tick) {
            const DeviceReading reading = device->read(tick, 1);
            CHECK(reading.valid);
            CHECK(reading.X_WT.p.x() == std::min(2.0 * tick, 8.0));
            CHECK(reading.finished == (tick >= 4));
            device->write({{1, 1, 1}, {1, 1, 1}});
        }
    }
    std::filesystem::remove(file);
}

TEST_CASE("mouse: the hand goes where it is dragged, is held back by force, and stays where it is let go",
          "[devices]") {
    DeviceContext context;
    context.mouse = std::make_shared<MouseTarget>();
    context.X_WT_start = {{100, 0, 0}, Quat::Identity()};
    const auto device = findDevice("mouse")->make(context);
    double t = 0;
    const auto run = [&](int ticks, const Wrench& wrench) {
        DeviceReading reading;
        for (int i = 0; i < ticks; ++i, ++t) {
            reading = device->read(t, 1);
            device->write(wrench);
        }
        CHECK(reading.valid);
        CHECK_FALSE(reading.finished);
        return reading.X_WT.p;
    };
    // Nobody has grabbed it.
    CHECK(run(100, {}) == Vec3(100, 0, 0));
    context.mouse->grab({{110, 0, 0}, Quat::Identity()});
    CHECK((run(1000, {}) - Vec3(110, 0, 0)).norm() < 1e-6);
    // 2 N against 0.5 N/mm give way 4 mm.
    CHECK((run(1000, {{-2, 0, 0}, {0, 0, 0}}) - Vec3(106, 0, 0)).norm() < 1e-6);
    context.mouse->release();
    CHECK((run(1000, {{-2, 0, 0}, {0, 0, 0}}) - Vec3(106, 0, 0)).norm() < 1e-6);
    // A broken target is not followed.
    Pose broken;
    broken.p.y() = std::nan("");
    context.mouse->grab(broken);
    CHECK((run(1000, {}) - Vec3(110, 0, 0)).norm() < 1e-6);
    // Time zero is a new start.
    context.mouse->grab({{0, 50, 0}, Quat::Identity()});
    t = 0;
    CHECK(run(100, {}) == Vec3(100, 0, 0));
}
