// The device lab against a program that drives an arm, in normal operation and for each fault.
#include "haptics/device/lab.hpp"

#include <limits>

#include "haptics/device/device_table.hpp"
#include "haptics/device/lab_link.hpp"
#include "tests/support/alloc_count.hpp"
#include "tests/support/arm_matrix.hpp"
#include "tests/support/lab_arm.hpp"

namespace touchstone::lab_tests {

using namespace touchstone::test;
using Catch::Contains;
using State = DeviceStatus::State;

namespace {

constexpr std::uint16_t kPort = 50733;

std::unique_ptr<Device> openLab(const std::string& options = ",stale=500") {
    DeviceContext context;
    context.X_WT_start.p = {100, 0, 0};
    context.file = std::to_string(kPort) + options;
    return makeLab(context);
}

std::string refusal(const std::string& text) {
    DeviceContext context;
    context.file = text;
    try {
        makeLab(context);
    } catch (const std::runtime_error& e) {
        return e.what();
    }
    return {};
}

const Wrench kPush{{0, 2, 0}, {0, 0, 20}};

/// An arm and the device, ticked by turns. The arm holds its pose.
struct Coupled {
    Ticked ticked{openLab()};
    std::unique_ptr<LabArm> arm = std::make_unique<LabArm>(kPort);
    LabWrench felt;
    bool silent = false;

    Coupled() { ticked.wrench = kPush; }
    void turn() {
        if (!silent) arm->send();
        ticked.tick();
        if (const auto wrench = arm->receive()) felt = *wrench;
    }
    bool until(const std::function<bool()>& done) {
        return within([&] {
            turn();
            return done();
        });
    }
    void turns(int count) {
        for (int i = 0; i < count; ++i) until([] { return true; });
    }
    bool pushes() const { return felt.wrench.force == kPush.force && felt.wrench.torque == kPush.torque; }
    bool rests() const { return felt.wrench.isZero(); }
    /// The force is zero, and returns only after engaging.
    void comesBackOnlyEngaged() {
        REQUIRE(until([&] { return ticked.reading.valid && !ticked.reading.fault; }));
        turns(30);
        CHECK(rests());
        CHECK(felt.state == LabState::Fault);
        CHECK(ticked.status().state == State::Fault);
        ticked.device->engage(ticked.reading.X_WT_device);
        CHECK(until([&] { return pushes(); }));
        CHECK(felt.state == LabState::Engaged);
        CHECK(ticked.status().state == State::Running);
    }
};

template <std::size_t N>
std::array<std::uint8_t, N> with(std::array<std::uint8_t, N> bytes, std::size_t at, std::uint8_t value) {
    bytes[at] = value;
    return bytes;
}

}  // namespace

// -- The datagram --------------------------------------------------------------------------------------------------

TEST_CASE("lab datagram: the bytes are those of the documentation", "[device]") {
    LabPose pose;
    pose.fault = true;
    pose.session = 0x01020304;
    pose.buttons = 5;
    pose.sequence = 0x1122334455667788;
    pose.time = 7;
    pose.X_DS = {{1, -2, 0.5}, Quat(0.5, 0.5, -0.5, 0.5)};
    const auto bytes = labBytes(pose);
    const std::uint8_t head[]{'T',  'S',  'L',  'P',  1,    0,    1,    0,    4, 3, 2, 1, 5, 0, 0, 0,
                              0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11, 7, 0, 0, 0, 0, 0, 0, 0};
    CHECK(std::equal(std::begin(head), std::end(head), bytes.begin()));
    const std::uint8_t one[]{0, 0, 0, 0, 0, 0, 0xF0, 0x3F}, minusTwo[]{0, 0, 0, 0, 0, 0, 0, 0xC0};
    CHECK(std::equal(std::begin(one), std::end(one), bytes.begin() + 32));
    CHECK(std::equal(std::begin(minusTwo), std::end(minusTwo), bytes.begin() + 40));
    const std::uint8_t half[]{0, 0, 0, 0, 0, 0, 0xE0, 0x3F}, minusHalf[]{0, 0, 0, 0, 0, 0, 0xE0, 0xBF};
    for (const int at : {56, 72, 80}) CHECK(std::equal(std::begin(half), std::end(half), bytes.begin() + at));
    CHECK(std::equal(std::begin(minusHalf), std::end(minusHalf), bytes.begin() + 64));  // y

    LabPose read;
    LabRejected why{};
    REQUIRE(readLabPose(bytes, bytes.size(), read, why));
    CHECK(read.fault);
    CHECK(read.session == pose.session);
    CHECK(read.sequence == pose.sequence);
    CHECK(read.X_DS == pose.X_DS);

    const LabWrench wrench{LabState::Engaged, 9, 8, 7, {{1, 2, 3}, {4, 5, 6}}};
    const auto answer = labBytes(wrench);
    const std::uint8_t answerHead[]{'T', 'S', 'L', 'W', 1, 0, 1, 0, 9, 0, 0, 0, 0, 0, 0, 0, 8, 0, 0, 0};
    CHECK(std::equal(std::begin(answerHead), std::end(answerHead), answer.begin()));
    LabWrench readWrench;
    REQUIRE(readLabWrench(answer, answer.size(), readWrench, why));
    CHECK(readWrench.wrench.force == wrench.wrench.force);
    CHECK(readWrench.wrench.torque == wrench.wrench.torque);
    CHECK(readWrench.time == 7);
}

TEST_CASE("lab datagram: what is not a pose is rejected with its reason", "[device]") {
    LabPose pose;
    const auto good = labBytes(pose);
    LabRejected why{};
    const auto reason = [&](std::span<const std::uint8_t> bytes, std::size_t size) {
        CHECK_FALSE(readLabPose(bytes, size, pose, why));
        return why;
    };
    CHECK(reason({}, 0) == LabRejected::Size);
    for (std::size_t size = 0; size < good.size(); ++size)
        CHECK(reason(std::span(good).first(size), size) == LabRejected::Size);
    CHECK(reason(good, good.size() + 1) == LabRejected::Size);
    CHECK(reason(good, 65507) == LabRejected::Size);
    CHECK(reason(with(good, 3, 'W'), good.size()) == LabRejected::Magic);
    CHECK(reason(with(good, 4, 2), good.size()) == LabRejected::Version);
    CHECK(reason(with(good, 4, 2), good.size() + 8) == LabRejected::Version);
    const double bad = GENERATE(std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e7);
    LabPose far;
    far.X_DS.p.y() = bad;
    CHECK(reason(labBytes(far), good.size()) == LabRejected::Pose);
    LabPose turned;
    turned.X_DS.q.y() = bad;
    CHECK(reason(labBytes(turned), good.size()) == LabRejected::Pose);
    turned.X_DS.q.coeffs().setZero();
    CHECK(reason(labBytes(turned), good.size()) == LabRejected::Pose);
}

// -- Opening -------------------------------------------------------------------------------------------------------

TEST_CASE("lab: wrong options, a taken port and a foreign address are refused by name", "[device]") {
    CHECK_THAT(refusal("0"), Contains("'0' is not a port"));
    CHECK_THAT(refusal("50.5"), Contains("'50.5'"));
    CHECK_THAT(refusal("50733,listen=home"), Contains("'listen=home' is not an option"));
    CHECK_THAT(refusal("50733,force=-1"), Contains("'force=-1'"));
    CHECK_THAT(refusal("50733,listen=192.0.2.1"), Contains("192.0.2.1") && Contains("no such address"));
    const auto device = openLab();
    CHECK_THAT(refusal(std::to_string(kPort)), Contains("50733") && Contains("is taken"));
    const LabOptions options = labOptions("6000,listen=127.0.0.2,peer=127.0.0.3,stale=9,force=2,torque=30");
    CHECK(options.port == 6000);
    CHECK(options.listen == "127.0.0.2");
    CHECK(options.peer == "127.0.0.3");
    CHECK(options.staleMs == 9);
    CHECK(options.limits.peakForce == 2);
    CHECK(options.limits.continuousForce == 2);
    CHECK(options.limits.continuousTorque == 30);
    CHECK(labOptions("").listen == "127.0.0.1");
}

TEST_CASE("lab: doctor says whether the default port is free", "[device]") {
    CHECK(examineLab().works);
    DeviceContext context;
    context.file = "5005,stale=30";
    const auto taken = makeLab(context);
    CHECK_FALSE(examineLab().works);
    CHECK_THAT(examineLab().text, Contains("5005"));
}

// -- Normal operation ----------------------------------------------------------------------------------------------

TEST_CASE("lab: maps the arm's motion and sends the wrench with the echo of the pose", "[device]") {
    Coupled lab;
    CHECK(lab.ticked.status().state == State::Connecting);
    CHECK_THAT(lab.ticked.status().text, Contains("Waiting") && Contains("127.0.0.1:50733"));
    lab.arm->pose.X_DS.p = {5, 0, 0};
    REQUIRE(lab.until([&] { return lab.ticked.reading.valid; }));
    CHECK(lab.ticked.reading.X_WT_device.p == Vec3(100, 0, 0));  // the first reading maps to the tool's pose
    lab.arm->pose.X_DS = {{8, 1, 0}, expRotation(Vec3(0, 0.2, 0))};
    lab.arm->pose.buttons = 4;
    CHECK(lab.until([&] {
        return (lab.ticked.reading.X_WT_device.p - Vec3(103, 1, 0)).norm() < 1e-9 &&
               lab.ticked.reading.X_WT_device.q.angularDistance(expRotation(Vec3(0, 0.2, 0))) < 1e-9 &&
               lab.ticked.reading.buttons == 4 && lab.pushes();
    }));
    CHECK(lab.felt.session == lab.arm->pose.session);
    CHECK(lab.felt.sequence == lab.arm->pose.sequence);
    CHECK(lab.felt.time == lab.arm->pose.time);
    CHECK(lab.felt.state == LabState::Engaged);
    CHECK(lab.ticked.status().state == State::Running);
}

TEST_CASE("lab: the wrench is finite and within the limits", "[device]") {
    Coupled lab;
    lab.ticked.wrench = {{300, 400, 0}, {0, 0, 1e9}};
    CHECK(lab.until([&] { return (lab.felt.wrench.force - Vec3(4.8, 6.4, 0)).norm() < 1e-9; }));
    CHECK((lab.felt.wrench.torque - Vec3(0, 0, 100)).norm() < 1e-9);
    lab.ticked.wrench.force.x() = NAN;
    CHECK(lab.until([&] { return lab.rests(); }));
}

TEST_CASE("lab: reading and writing allocate nothing", "[device]") {
    Coupled lab;
    REQUIRE(lab.until([&] { return lab.pushes(); }));
    for (int i = 0; i < 5; ++i) lab.arm->send();
    lab.arm->sendBytes(std::array<std::uint8_t, 1000>{});
    const AllocationCounter counter;
    lab.ticked.device->read(lab.ticked.t, 1);
    lab.ticked.device->write(kPush);
    CHECK(counter.count() == 0);
}

// -- The safety matrix ---------------------------------------------------------------------------------------------

TEST_CASE("lab: silence means zero force, and the arm that returns is engaged deliberately", "[device]") {
    Coupled lab;
    REQUIRE(lab.until([&] { return lab.pushes(); }));
    lab.silent = true;
    REQUIRE(lab.until([&] { return !lab.ticked.reading.valid && lab.rests(); }));
    REQUIRE(lab.until([&] { return lab.ticked.status().state == State::Lost; }));
    CHECK_THAT(lab.ticked.status().text, Contains("sends no poses"));
    SECTION("goes on") {}
    SECTION("was started again, with another session") {
        lab.arm->pose.session = 2;
        lab.arm->pose.sequence = 0;
    }
    SECTION("was started again, with the same session") { lab.arm->pose.sequence = 0; }
    SECTION("as another sender") { lab.arm = std::make_unique<LabArm>(kPort, 3); }
    lab.silent = false;
    lab.comesBackOnlyEngaged();
    CHECK_THAT(lab.ticked.status().details, Contains("began again: 1"));
}

TEST_CASE("lab: a fault that the arm reports is a fault of the device", "[device]") {
    Coupled lab;
    REQUIRE(lab.until([&] { return lab.pushes(); }));
    lab.arm->pose.fault = true;
    REQUIRE(lab.until([&] { return lab.ticked.reading.fault && lab.rests(); }));
    CHECK(lab.ticked.status().state == State::Fault);
    CHECK_THAT(lab.ticked.status().text, Contains("reports a fault"));
    lab.ticked.device->engage({});  // not while it lasts
    lab.turns(10);
    CHECK(lab.rests());
    lab.arm->pose.fault = false;
    lab.comesBackOnlyEngaged();
}

TEST_CASE("lab: bad datagrams are counted by name and change nothing", "[device]") {
    Coupled lab;
    REQUIRE(lab.until([&] { return lab.pushes(); }));
    const LabArm foreign(kPort, lab.arm->pose.session);
    LabPose pose = lab.arm->pose;
    pose.sequence += 1'000'000;
    pose.X_DS.p = {900, 0, 0};
    std::string words;
    SECTION("too small") {
        lab.arm->sendBytes(std::array<std::uint8_t, 5>{});
        words = "of the wrong size: 1";
    }
    SECTION("empty") {
        lab.arm->sendBytes({});
        words = "of the wrong size: 1";
    }
    SECTION("too large") {
        std::array<std::uint8_t, kLabPoseBytes + 1> bytes{};
        const auto good = labBytes(pose);
        std::copy(good.begin(), good.end(), bytes.begin());
        lab.arm->sendBytes(bytes);
        words = "of the wrong size: 1";
    }
    SECTION("as large as they come") {
        std::vector<std::uint8_t> bytes(65507, 0xFF);
        lab.arm->sendBytes(bytes);
        words = "not a pose of this protocol: 1";
    }
    SECTION("magic") {
        lab.arm->sendBytes(with(labBytes(pose), 0, 'X'));
        words = "not a pose of this protocol: 1";
    }
    SECTION("version") {
        lab.arm->sendBytes(with(labBytes(pose), 4, 7));
        words = "of another version of the protocol: 1";
    }
    SECTION("NaN") {
        pose.X_DS.p.z() = NAN;
        lab.arm->sendBytes(labBytes(pose));
        words = "with an invalid pose: 1";
    }
    SECTION("replayed") {
        pose.sequence = lab.arm->pose.sequence;
        lab.arm->sendBytes(labBytes(pose));
        words = "old or repeated: 1";
    }
    SECTION("out of order") {
        pose.sequence = lab.arm->pose.sequence - 1;
        lab.arm->sendBytes(labBytes(pose));
        words = "old or repeated: 1";
    }
    SECTION("another session") {
        pose.session += 1;
        lab.arm->sendBytes(labBytes(pose));
        words = "of another session: 1";
    }
    SECTION("another sender") {
        foreign.sendBytes(labBytes(pose));
        words = "from another sender: 1";
    }
    lab.turns(3);
    CHECK_THAT(lab.ticked.status().details, Contains(words));
    CHECK(lab.ticked.status().state == State::Running);
    CHECK(lab.ticked.reading.X_WT_device.p.x() < 200);
    CHECK(lab.pushes());
    CHECK_FALSE(foreign.receive());
}

TEST_CASE("lab: only bad datagrams are silence", "[device]") {
    Coupled lab;
    REQUIRE(lab.until([&] { return lab.pushes(); }));
    lab.arm->pose.X_DS.p.x() = NAN;
    REQUIRE(lab.until([&] { return lab.ticked.status().state == State::Lost && lab.rests(); }));
    CHECK_THAT(lab.ticked.status().text, Contains("the last datagram rejected: with an invalid pose"));
    lab.arm->pose.X_DS.p.x() = 0;
    lab.comesBackOnlyEngaged();
}

TEST_CASE("lab: a flood does not delay a tick, and only other addresses than the peer's are foreign", "[device]") {
    Ticked ticked(openLab(",peer=127.0.0.2"));
    LabArm arm(kPort);
    for (int i = 0; i < 3 * LabLink::kMostPerRead; ++i) arm.send();
    ticked.tick();
    CHECK_FALSE(ticked.reading.valid);
    CHECK_THAT(ticked.status().details, Contains("from another sender: " + std::to_string(LabLink::kMostPerRead)));
    CHECK_THAT(ticked.status().text, Contains("Waiting") && Contains("from another sender"));
}

TEST_CASE("lab: reconnecting forgets the arm at once", "[device]") {
    Coupled lab;
    REQUIRE(lab.until([&] { return lab.pushes(); }));
    lab.ticked.device->control()->reconnect();
    lab.silent = true;
    lab.turn();
    CHECK(lab.ticked.status().state == State::Connecting);
    lab.silent = false;
    lab.comesBackOnlyEngaged();
}

TEST_CASE("lab: releasing the forces tells the arm at once", "[device]") {
    Coupled lab;
    REQUIRE(lab.until([&] { return lab.pushes(); }));
    lab.ticked.device->releaseForces();
    std::optional<LabWrench> last;
    CHECK(within([&] { return (last = lab.arm->receive()).has_value(); }));
    CHECK(last->wrench.isZero());
    CHECK(last->state == LabState::Stopped);
    lab.turns(10);
    CHECK(lab.rests());
}

TEST_CASE("lab: two holders share one port", "[device]") {
    Coupled lab;
    REQUIRE(lab.until([&] { return lab.pushes(); }));
    Ticked second(openLab());
    second.wrench = {{1, 0, 0}, {0, 0, 0}};
    CHECK(within([&] {
        lab.arm->send();
        second.tick();
        const auto wrench = lab.arm->receive();
        return wrench && wrench->wrench.force == Vec3(1, 0, 0);
    }));
}

}  // namespace touchstone::lab_tests
