// The worked examples of docs/extending.md: they compile and work, and the page quotes them word for word.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <iterator>

#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"
#include "tests/support/temp_folder.hpp"

namespace touchstone {
std::unique_ptr<Device> makeGamepad(const DeviceContext& context);
}

namespace touchstone::gamepad_device_tests {

namespace {

std::string textOf(const char* file) {
    std::ifstream in(std::string(TOUCHSTONE_SOURCE_DIR) + file);
    return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("extending: the examples are quoted word for word", "[device]") {
    for (const char* file : {"/docs/examples/gamepad_device.cpp", "/tests/package/consumer.cpp"}) {
        const std::string example = textOf(file);
        CAPTURE(file);
        REQUIRE(example.size() > 1000);
        CHECK(textOf("/docs/extending.md").find("```cpp\n" + example + "```\n") != std::string::npos);
    }
}

TEST_CASE("extending: the example is a device", "[device]") {
    const test::TempFolder folder;
    DeviceContext context;
    context.X_WT_start.p = {100, 0, 0};
    context.file = (folder.path() / "js0").string();
    CHECK_THROWS_WITH(makeGamepad(context), Catch::Contains("connect the gamepad"));

    REQUIRE(mkfifo(context.file.c_str(), 0600) == 0);
    const int pad = open(context.file.c_str(), O_RDWR);
    const auto send = [&](std::int16_t value, std::uint8_t type, std::uint8_t number) {
        std::uint8_t event[8]{};
        std::memcpy(event + 4, &value, sizeof value);
        event[6] = type;
        event[7] = number;
        REQUIRE(::write(pad, event, sizeof event) == sizeof event);
    };
    const auto device = makeGamepad(context);
    CHECK(device->read(0, 1).X_WT_device.p == Vec3(100, 0, 0));
    send(32767, 2, 0);
    send(-32767, 2, 4);
    send(1, 1, 3);
    CHECK((device->read(1, 1).X_WT_device.p - Vec3(100.05, 0.05, 0)).norm() < 1e-12);
    CHECK(device->read(2, 1).buttons == 8);
    send(0, 2, 0);
    send(0, 2 | 0x80, 4);  // the state at the start is marked
    const Vec3 rests = device->read(3, 1).X_WT_device.p;
    CHECK(device->read(4, 1).X_WT_device.p == rests);
    device->engage({.p = {1, 2, 3}});
    CHECK(device->read(5, 1).X_WT_device.p == Vec3(1, 2, 3));
    close(pad);
}

}  // namespace touchstone::gamepad_device_tests
