// The worked example of docs/extending.md: it compiles and works, and the page quotes it word for word.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>

#include "haptics/device/device.hpp"

using namespace touchstone;

namespace touchstone {
std::unique_ptr<Device> makeLab(const DeviceContext& context);
}

namespace {

constexpr std::uint16_t kPort = 50733;

std::string textOf(const char* file) {
    std::ifstream in(std::string(TOUCHSTONE_SOURCE_DIR) + file);
    return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

TEST_CASE("extending: the example of a device is quoted word for word", "[device]") {
    const std::string example = textOf("/docs/examples/lab_device.cpp");
    REQUIRE(example.size() > 1000);
    CHECK(textOf("/docs/extending.md").find("```cpp\n" + example + "```\n") != std::string::npos);
}

TEST_CASE("extending: the example is a device", "[device]") {
    DeviceContext context;
    context.X_WT_start.p = {100, 0, 0};
    context.file = std::to_string(kPort);
    const auto device = makeLab(context);
    CHECK_THROWS_WITH(makeLab(context), Catch::Contains("is taken"));
    CHECK_FALSE(device->read(0, 1).valid);

    const int lab = socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in there{};
    there.sin_family = AF_INET;
    there.sin_port = htons(kPort);
    there.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(connect(lab, reinterpret_cast<const sockaddr*>(&there), sizeof there) == 0);
    const auto send = [&](double x) {
        const std::array<double, 7> m{x, 0, 0, 1, 0, 0, 0};
        REQUIRE(::send(lab, m.data(), sizeof m, 0) == sizeof m);
    };
    send(5);
    CHECK(device->read(1, 1).X_WT_device.p == Vec3(100, 0, 0));  // the first reading maps to the tool's pose
    send(8);
    const DeviceReading reading = device->read(2, 1);
    CHECK(reading.valid);
    CHECK(reading.X_WT_device.p == Vec3(103, 0, 0));

    device->write({.force = {1, 2, 3}, .torque = {4, 5, 6}});
    std::array<double, 6> felt{};
    REQUIRE(recv(lab, felt.data(), sizeof felt, 0) == sizeof felt);
    CHECK(felt == std::array<double, 6>{1, 2, 3, 4, 5, 6});

    for (int t = 3; t < 23; ++t) device->read(t, 1);
    CHECK_FALSE(device->read(23, 1).valid);  // the lab no longer sends poses
    close(lab);
}
