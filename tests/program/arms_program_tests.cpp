// The program with arms that push back, as a user runs it without a window.
#include <sstream>

#include "tests/program/program.hpp"

namespace touchstone::arms_program_tests {

using namespace touchstone::test;
using Catch::Contains;

namespace {

const std::string kDhd = "TOUCHSTONE_LIBDHD=" TOUCHSTONE_BINARY_DIR "/fakes/dhd/libdhd.so.3";

}  // namespace

TEST_CASE("arms: an arm of Force Dimension that pushes down in a headless run feels a force up", "[device]") {
    const Program touchstone;
    // In the library's axes, z is up; the block is 10 mm above the slab.
    const Answer answer = touchstone("run hello --headless --seconds 1.5 --device forcedimension:stale=200",
                                     kDhd + " FAKE_DHD_HAND='0 0 -0.02' FAKE_DHD_LOG='" + touchstone.file("log") + "'");
    INFO(answer.out << answer.err);
    CHECK((answer.code == 0 || answer.code == 3));  // 3: the limits of the scene's demonstration are not this push's
    std::istringstream log(textOf(touchstone.file("log")));
    double x = 0, y = 0, z = 0;
    int moves = -1, misuses = -1;
    log >> x >> y >> z >> moves >> misuses;
    CHECK(z > 2);
    CHECK(std::hypot(x, y) < 0.1 * z);
    CHECK(moves == 0);
    CHECK(misuses == 0);
}

TEST_CASE("arms: a headless run does not move an arm unasked", "[device]") {
    const Program touchstone;
    const std::string uncalibrated =
        kDhd + " FAKE_DHD_FAULT=uncalibrated FAKE_DHD_LOG='" + touchstone.file("log") + "'";
    const Answer refused = touchstone("run hello --headless --seconds 0.1 --device forcedimension", uncalibrated);
    CHECK(refused.code == 1);
    CHECK_THAT(refused.err, Contains("not initialized") && Contains("forcedimension:init=auto"));
    CHECK_THAT(textOf(touchstone.file("log")), Contains(" 0 0\n"));
    const Answer agreed =
        touchstone("run hello --headless --seconds 0.1 --device forcedimension:init=auto", uncalibrated);
    INFO(agreed.err);
    CHECK((agreed.code == 0 || agreed.code == 3));
    CHECK_THAT(textOf(touchstone.file("log")), Contains(" 1 0\n"));
}

TEST_CASE("arms: a headless run says what was wrong with its device", "[device]") {
    const Program touchstone;
    const auto saidBy = [&](const std::string& device, const std::string& environment) {
        const Answer answer = touchstone("run hello --headless --seconds 0.3 --device " + device, environment);
        INFO(answer.out << answer.err);
        CHECK((answer.code == 0 || answer.code == 3));
        const std::size_t at = answer.out.find("the device, at the end: ");
        return at == std::string::npos ? "" : answer.out.substr(at, answer.out.find('\n', at) - at);
    };
    CHECK(saidBy("forcedimension:stale=200", kDhd) == "");
    CHECK_THAT(saidBy("forcedimension:stale=200", kDhd + " FAKE_DHD_FAULT=no-power"), Contains("power"));
    CHECK_THAT(saidBy("forcedimension:stale=200", kDhd + " FAKE_DHD_FAULT=com"), Contains("communication"));
    CHECK_THAT(saidBy("lab:5991", ""), Contains("Waiting for the arm's first datagram"));
}

TEST_CASE("arms: doctor reports on each", "[device]") {
    const Program touchstone;
    CHECK_THAT(touchstone("doctor", "TOUCHSTONE_LIBDHD=/no/libdhd.so").out,
               Contains("forcedimension: ") && Contains("/no/libdhd.so: cannot open shared object") &&
                   Contains("Install the vendor's SDK") && Contains("lab: ") && Contains("127.0.0.1:5005"));
    CHECK_THAT(touchstone("doctor", kDhd).out, Contains("fake sigma.7 runs"));
    CHECK_THAT(touchstone("doctor", kDhd + " FAKE_DHD_FAULT=uncalibrated").out,
               Contains("note") && Contains("The device is not initialized: clear its way"));
}

}  // namespace touchstone::arms_program_tests
