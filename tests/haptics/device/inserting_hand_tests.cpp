#include "haptics/device/inserting_hand.hpp"

#include <catch2/catch.hpp>
#include <stdexcept>

#include "tests/support/alloc_count.hpp"

namespace touchstone::inserting_hand_tests {

namespace {

const Pose kStart{{0, 30, 0}, expRotation({0, 0.4, 0})}, kGoal{{0, -20, 0}, Quat::Identity()};

InsertingHand hand(std::uint64_t seed) {
    InsertingParameters parameters;
    parameters.seed = seed;
    return InsertingHand(kStart, kGoal, parameters);
}

/// A floor of 1 N/mm at the given height.
struct Floor {
    double height;
    void push(InsertingHand& one, const Pose& X) const {
        one.write({.force = {0, std::max(0.0, height - X.p.y()), 0}});
    }
};

}  // namespace

TEST_CASE("inserting hand: a random seed determines the hand, and time 0 restarts it", "[hand]") {
    InsertingHand a = hand(3), b = hand(3), c = hand(4);
    CHECK_FALSE(a.read(0, 1).X_WT_device == c.read(0, 1).X_WT_device);
    CHECK_FALSE(a.belief() == c.belief());
    b.read(0, 1);
    for (int i = 1; i < 500; ++i) b.read(i, 1);
    b.read(0, 1);
    for (int i = 1; i < 500; ++i) REQUIRE(a.read(i, 1).X_WT_device == b.read(i, 1).X_WT_device);
}

TEST_CASE("inserting hand: starts near the start pose, and knows the goal roughly", "[hand]") {
    double error = 0;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        InsertingHand one = hand(seed);
        CHECK((one.read(0, 1).X_WT_device.p - kStart.p).norm() < 10);  // 2 mm per axis: five standard deviations
        error += (one.belief().p - kGoal.p).squaredNorm() / 3 / 200;
    }
    const double deviation = InsertingParameters{}.placeError;
    CHECK(std::sqrt(error) ==
          Approx(deviation).epsilon(0.15));  // 600 numbers: one standard deviation of the estimate is 3 %
}

TEST_CASE("inserting hand: presses and searches on a closed floor, then gives up", "[hand]") {
    InsertingHand one = hand(1);
    const Floor floor{0};
    double least = 1e9, most = -1e9, force = 0;
    DeviceReading reading;
    int t = 0;
    const test::AllocationCounter allocations;
    for (; t < 60'000 && !reading.finished; ++t) {
        reading = one.read(t, 1);
        floor.push(one, reading.X_WT_device);
        force = std::max(force, floor.height - reading.X_WT_device.p.y());
        if (one.act() != InsertingHand::Act::Press) continue;
        const double twist = logRotation(reading.X_WT_device.q).y();
        least = std::min(least, twist);
        most = std::max(most, twist);
    }
    CHECK(allocations.count() == 0);
    CHECK(reading.finished);
    CHECK(t > 10'000);
    CHECK(one.act() == InsertingHand::Act::DrawBack);
    CHECK(most - least > 0.8);  // a pitch of eight keys, 0.785
    CHECK(force < 5);
    CHECK(reading.X_WT_device.p.y() > 20);
}

TEST_CASE("inserting hand: lets go at the goal and stays there", "[hand]") {
    InsertingHand one = hand(2);
    const Floor floor{-20};
    DeviceReading reading;
    int t = 0;
    for (; t < 20'000 && !reading.finished; ++t) {
        reading = one.read(t, 1);
        floor.push(one, reading.X_WT_device);
    }
    CHECK(reading.finished);
    CHECK(one.act() == InsertingHand::Act::LetGo);
    CHECK(reading.X_WT_device.p.y() == Approx(-20).margin(0.05));  // no force remains: 0.05 N
}

TEST_CASE("inserting hand: draws back if it touches nothing", "[hand]") {
    InsertingHand one = hand(5);
    DeviceReading reading;
    double low = 0;
    for (int t = 0; t < 20'000 && !reading.finished; ++t) {
        reading = one.read(t, 1);
        low = std::min(low, reading.X_WT_device.p.y());
    }
    CHECK(reading.finished);
    CHECK(low > -40);
    CHECK(low < -30);
}

TEST_CASE("inserting hand: needs a goal and a random seed", "[hand]") {
    const DeviceInfo* insert = findDevice("insert");
    REQUIRE(insert);
    DeviceContext context;
    CHECK_THROWS_WITH(insert->make(context), Catch::Contains("no goal"));
    context.goal = kGoal;
    context.X_WT_start = kStart;
    context.file = "12";
    const auto device = insert->make(context);
    CHECK(device->read(0, 1).X_WT_device == hand(12).read(0, 1).X_WT_device);
    for (const char* wrong : {"x", "1.5", "-2", "1 "}) {
        context.file = wrong;
        CHECK_THROWS_WITH(insert->make(context), Catch::Contains("insert:SEED"));
    }
}

}  // namespace touchstone::inserting_hand_tests
