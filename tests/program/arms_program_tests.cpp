// The program with arms that push back, as a user runs it without a window.
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/program/csv_table.hpp"
#include "tests/program/program.hpp"

namespace touchstone::arms_program_tests {

using namespace touchstone::test;
using Catch::Contains;

namespace {

const std::string kSpnav = "TOUCHSTONE_LIBSPNAV=" TOUCHSTONE_BINARY_DIR "/fakes/libfake_spnav.so FAKE_SPNAV=held";
const std::string kHd = "TOUCHSTONE_LIBHD=" TOUCHSTONE_BINARY_DIR "/fakes/libfake_hd.so";
const std::string kDhd = "TOUCHSTONE_LIBDHD=" TOUCHSTONE_BINARY_DIR "/fakes/dhd/libdhd.so.3";

std::vector<double> column(const std::string& file, const std::string& name) {
    std::vector<double> values;
    for (const auto& row : tableOf(file)) values.push_back(std::stod(row.at(name)));
    return values;
}

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

TEST_CASE("devices: what a person moves runs once, paced by the clock, with or without motors", "[device]") {
    const Program touchstone;
    struct {
        const char* device;
        std::string environment;
    } const live[]{{"spacemouse", kSpnav},
                   {"spacemouse:200", kSpnav},
                   {"lab:5992", ""},
                   {"phantom:,stale=200", kHd},
                   {"forcedimension:stale=200", kDhd}};
    for (const auto& [device, environment] : live)
        for (const char* way : {"", " --paced", " --record recording", " --shadow pqp"}) {
            INFO(device << way);
            fs::remove_all(touchstone.file("recording"));
            const Answer answer = touchstone(
                "run hello --headless --seconds 0.2 --report report.json --device " + std::string(device) + way,
                environment);
            INFO(answer.out << answer.err);
            CHECK((answer.code == 0 || answer.code == 3));
            const auto report = nlohmann::json::parse(textOf(touchstone.file("report.json")));
            CHECK(report.at("ticks") == 200);
            CHECK(report.at("overruns").is_number());  // only what is paced has late ticks
            if (fs::exists(touchstone.file("recording"))) {
                const Answer again = touchstone("run --headless --device replay:recording");
                CHECK_THAT(again.out, Contains("all of 200 ticks have the recorded bits"));
            }
        }
    // What nothing or a program moves is not paced.
    for (const char* device : {"rest", "demo", "hand"}) {
        INFO(device);
        touchstone("run hello --headless --seconds 0.2 --report report.json --device " + std::string(device));
        const auto report = nlohmann::json::parse(textOf(touchstone.file("report.json")));
        CHECK((!report.contains("overruns") || report.at("overruns").is_null()));
    }
}

TEST_CASE("devices: a cap that is held still moves the tool until its zero or the end of its daemon", "[device]") {
    const Program touchstone;
    struct {
        const char *cap, *way;
        bool ends, dies;
    } const cases[]{{"held", "", false, false},
                    {"held:900", "", true, false},
                    {"held:900", " --paced", true, false},
                    {"dies:900", "", true, true}};
    for (const auto& [cap, way, ends, dies] : cases) {
        INFO(cap << way);
        const Answer answer =
            touchstone("run hello --headless --seconds 1.4 --ticks ticks.csv --report report.json --device spacemouse" +
                           std::string(way),
                       kSpnav + " FAKE_SPNAV=" + cap);
        INFO(answer.out << answer.err);
        const std::vector<double> x = column(touchstone.file("ticks.csv"), "device_x_mm"),
                                  period = column(touchstone.file("ticks.csv"), "period_us");
        REQUIRE(x.size() == 1400);
        // From the first event on it moves by 0.05 mm in each tick, 50 mm/s; then it rests.
        std::size_t first = 1, last = x.size();
        while (first < x.size() && x[first] == x[first - 1]) ++first;
        while (last > first && x[last - 1] == x[last - 2]) --last;
        double pushed = 0;  // s by the clock of the ticks
        int paused = 0;
        for (std::size_t i = first; i < last; ++i) {
            paused += std::abs(x[i] - x[i - 1] - 0.05) > 1e-9;
            pushed += 1e-6 * period[i];
        }
        CHECK(paused == 0);
        CHECK(pushed > 0.6);  // longer than any pause of a hand; the rest for what comes before the first tick
        CHECK((last < x.size()) == ends);
        const auto report = nlohmann::json::parse(textOf(touchstone.file("report.json")));
        CHECK((report.at("device_trouble") ==
               (dies ? "The SpaceMouse's daemon is gone: start spacenavd and choose the device again" : "")));
        CHECK((report.value("safety_fault", "") == "device fault") == dies);
    }
}

TEST_CASE("run: a long run without a window says how far it is and when it ends, on the error stream alone",
          "[program][long]") {
    const Program touchstone;
    const Answer answer =
        touchstone("run hello --headless --seconds 60 --device spacemouse", kSpnav + " timeout -s INT 6");
    INFO(answer.out << answer.err);
    CHECK_THAT(answer.err, Contains(" of 60.0 s of the motion, ") && Contains(" s left\n"));
    CHECK(std::count(answer.err.begin(), answer.err.end(), '\n') == 1);  // the next comes after twice the time
    CHECK_THAT(answer.out, !Contains("of the motion"));
}

TEST_CASE("devices: a headless run has the workspace that a window saved", "[device]") {
    const Program touchstone;
    const std::string scene = std::string(TOUCHSTONE_BINARY_DIR) + "/scenes/hello.gltf";
    const std::string environment =
        kDhd + " FAKE_DHD_HAND='0 0.004 0.02' TOUCHSTONE_CONFIG='" + touchstone.file("config") + "'";
    fs::create_directories(touchstone.file("config"));
    const auto motion = [&](const std::string& workspace) {
        std::ofstream(touchstone.file("config/workspaces.json"))
            << "{\"forcedimension in " << fs::canonical(scene).string() << "\": " << workspace << "}";
        const Answer answer = touchstone(
            "run hello --headless --seconds 1 --ticks ticks.csv --device forcedimension:stale=200", environment);
        INFO(answer.out << answer.err);
        CHECK((answer.code == 0 || answer.code == 3));
        CHECK((answer.err.find("The workspace that was saved for forcedimension") != std::string::npos) ==
              (workspace != "{}"));
        Vec3 way;
        for (int i = 0; i < 3; ++i) {
            const auto p = column(touchstone.file("ticks.csv"), std::string("device_") + "xyz"[i] + "_mm");
            way[i] = p.back() - p.front();
        }
        return way;
    };
    const Vec3 plain = motion("{}");
    REQUIRE(plain.y() == Approx(20).margin(1));  // up at the device, whose z it is
    REQUIRE(plain.x() == Approx(4).margin(1));
    // The hand swings to its place by a spring, so two runs end within a tenth of a millimeter.
    CHECK((motion(R"({"scale": 0.5})") - 0.5 * plain).norm() < 0.2);
    // A quarter turn about the scene's y: right becomes away from the user.
    CHECK((motion(R"({"axes_xyzw": [0, 0.70710678, 0, 0.70710678]})") - Vec3(0, plain.y(), -plain.x())).norm() < 0.2);
    CHECK((motion(R"({"offset_mm": [0, 3, 0]})") - plain - Vec3(0, 3, 0)).norm() < 0.2);
    const Answer broken = (std::ofstream(touchstone.file("config/workspaces.json")) << "{",
                           touchstone("run hello --headless --seconds 1 --device forcedimension", environment));
    CHECK(broken.code == 1);
    CHECK_THAT(broken.err, Contains("workspaces.json") && Contains("is not a JSON object"));
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
