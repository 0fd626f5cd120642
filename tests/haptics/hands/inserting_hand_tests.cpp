#include "haptics/hands/hand_table.hpp"
#include "haptics/hands/inserting_hand.hpp"

#include <catch2/catch.hpp>
#include <optional>
#include <stdexcept>
#include <vector>

#include "tests/support/alloc_count.hpp"

namespace touchstone::inserting_hand_tests {

namespace {

const Pose kStart{{0, 30, 0}, expRotation({0, 0.4, 0})};
const GoalRegion kGoal{.X_WT = {{0, -20, 0}, Quat::Identity()}, .tolerance = 0.2, .toleranceAngle = 0.05};

InsertingHand hand(std::uint64_t seed, const GoalRegion& goal = kGoal) {
    InsertingParameters parameters;
    parameters.seed = seed;
    return InsertingHand(kStart, goal, parameters);
}

/// A floor of 1 N/mm at the given height, on which the tool stays.
struct Floor {
    double height;
    Pose push(InsertingHand& one, Pose X) const {
        one.write({.force = {0, std::max(0.0, height - X.p.y()), 0}});
        X.p.y() = std::max(X.p.y(), height);
        one.show(X);
        return X;
    }
};

constexpr Floor kNoFloor{-1e6};

struct End {
    int t = 0;
    bool finished = false;
    Pose X_WT;
    double lowest = 1e9;
};

/// Runs the hand to its end, or for a minute.
End run(InsertingHand& one, const Floor& floor) {
    End end;
    for (; end.t < 60'000 && !end.finished; ++end.t) {
        const DeviceReading reading = one.read(end.t, 1);
        end.finished = reading.finished;
        end.X_WT = floor.push(one, reading.X_WT_device);
        end.lowest = std::min(end.lowest, end.X_WT.p.y());
    }
    return end;
}

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
        error += (one.belief().p - kGoal.X_WT.p).squaredNorm() / 3 / 200;
    }
    const double deviation = InsertingParameters{}.placeError;
    CHECK(std::sqrt(error) ==
          Approx(deviation).epsilon(0.15));  // 600 numbers: one standard deviation of the estimate is 3 %
}

TEST_CASE("inserting hand: knows the mouth of a hole as well as the goal, however deep", "[hand]") {
    GoalRegion deep = kGoal;
    deep.depth = 160;
    const Vec3 mouth(0, deep.depth, 0);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const Vec3 error = hand(seed, deep).belief() * mouth - deep.X_WT * mouth;
        CHECK((error - (hand(seed).belief().p - kGoal.X_WT.p)).norm() < 1e-9);
    }
    deep.way = {{{160, 0, 0}, Quat::Identity()}};  // in along x
    const Vec3 side(deep.depth, 0, 0);
    const Vec3 error = hand(1, deep).belief() * side - deep.X_WT * side;
    CHECK((error - (hand(1).belief().p - kGoal.X_WT.p)).norm() < 1e-9);
}

TEST_CASE("inserting hand: presses and searches on a closed floor, then gives up", "[hand]") {
    InsertingHand one = hand(1);
    const Floor floor{0};
    double least = 1e9, most = -1e9, force = 0, highest = -1e9;
    DeviceReading reading;
    int t = 0, retreats = 0;
    const test::AllocationCounter allocations;
    for (; t < 60'000 && !reading.finished; ++t) {
        reading = one.read(t, 1);
        floor.push(one, reading.X_WT_device);
        force = std::max(force, floor.height - reading.X_WT_device.p.y());
        retreats += one.act() == InsertingHand::Act::Retreat;
        if (retreats > 0 && one.act() != InsertingHand::Act::DrawBack)
            highest = std::max(highest, reading.X_WT_device.p.y());
        if (one.act() != InsertingHand::Act::Press || reading.X_WT_device.p.y() > floor.height) continue;
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
    CHECK(retreats > 0);
    CHECK(highest < 8);  // it begins again 5 mm above the floor, not at the start
    CHECK(reading.X_WT_device.p.y() > 20);
}

TEST_CASE("inserting hand: lets go where a stop is near the goal, and stays there", "[hand]") {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        InsertingHand one = hand(seed);
        const End end = run(one, {-20.05});
        INFO(seed);
        CHECK(end.finished);
        CHECK(one.act() == InsertingHand::Act::Release);
        CHECK(kGoal.contains(end.X_WT));
        CHECK(end.t < 10'000);
    }
}

TEST_CASE("inserting hand: needs no stop at the goal, and does not fall through", "[hand]") {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        InsertingHand one = hand(seed);
        const End end = run(one, kNoFloor);
        INFO(seed);
        CHECK(end.finished);
        CHECK(one.act() == InsertingHand::Act::Release);
        CHECK(kGoal.contains(end.X_WT));
        CHECK(end.lowest > -25);
    }
}

TEST_CASE("inserting hand: turns to the nearest equivalent orientation", "[hand]") {
    GoalRegion goal = kGoal;
    goal.fold = 8;  // of the start's 0.4 rad, 0.785 is as far as 0.385 away from 0, and a step is 0.785
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        InsertingHand one = hand(seed, goal);
        const End end = run(one, kNoFloor);
        CHECK(goal.contains(end.X_WT));
        CHECK_FALSE(kGoal.contains(end.X_WT));
    }
    goal.fold = 0;
    InsertingHand round = hand(1, goal);
    const End end = run(round, kNoFloor);
    CHECK(goal.contains(end.X_WT));
    CHECK(std::abs(kGoal.twist(end.X_WT)) > 0.2);  // a round tool needs no turn
}

TEST_CASE("inserting hand: follows the way that the goal gives", "[hand]") {
    GoalRegion goal = kGoal;
    goal.way = {
        {{0, 25, 0}}, {{0, -3, 0}}, {{0, -3, 0}, expRotation({0, 1.2, 0})}, {{9, -3, 0}, expRotation({0, 1.2, 0})}};
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        InsertingHand one = hand(seed, goal);
        std::vector<double> nearest(goal.way.size(), 1e9);
        End end;
        for (; end.t < 60'000 && !end.finished; ++end.t) {
            const DeviceReading reading = one.read(end.t, 1);
            end.finished = reading.finished;
            const Pose X_GT = goal.X_WT.inverse() * kNoFloor.push(one, reading.X_WT_device);
            for (std::size_t i = 0; i < goal.way.size(); ++i) {
                const Vec6 way = incrementBetween(goal.way[i], X_GT);
                nearest[i] = std::min(nearest[i], way.head<3>().norm() + 45 * way.tail<3>().norm());
            }
            end.X_WT = goal.X_WT * X_GT;
        }
        INFO(seed);
        CHECK(end.finished);
        CHECK(goal.contains(end.X_WT));
        for (const double mm : nearest) CHECK(mm < 6);
    }
}

TEST_CASE("goal: a path is simplified to the poses that it needs", "[hand]") {
    std::vector<Pose> path;
    for (int i = 0; i <= 100; ++i) path.push_back({{0.1 * i, 0, 0}});
    for (int i = 1; i <= 100; ++i) path.push_back({{10, 0.1 * i, 0}});
    for (int i = 1; i <= 100; ++i) path.push_back({{10, 10, 0}, expRotation({0, 0, 0.025 * i})});
    const std::vector<Pose> kept = simplified(path, 0.1);
    REQUIRE(kept.size() == 7);  // three straight pieces; 2.5 rad in four
    CHECK(kept[1].p == Vec3(10, 0, 0));
    CHECK(kept[2].p.isApprox(Vec3(10, 10, 0)));
    CHECK(kept.back() == path.back());
    CHECK(simplified({}, 1).empty());
}

TEST_CASE("goal: the tool leaves along +y, or along the way", "[hand]") {
    GoalRegion goal = kGoal;
    CHECK(goal.outAtGoal() == Vec3::UnitY());
    CHECK(goal.outAtStart() == Vec3::UnitY());
    const Quat turned = expRotation({0, 1, 0});
    goal.way = {{{30, -8, 0}, turned}, {{0, -8, 0}, turned}, {{0, 0, 0}, turned}};  // aside, up, and locked by a turn
    CHECK((goal.outAtStart() - Vec3::UnitX()).norm() < 1e-12);
    CHECK((goal.outAtGoal() + Vec3::UnitY()).norm() < 1e-12);
}

TEST_CASE("inserting hand: needs a goal and a random seed", "[hand]") {
    const DeviceInfo* insert = findDevice("insert", handTable());
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

TEST_CASE("inserting hand: presses less on a tool that friction holds, until the tool follows", "[hand]") {
    // The share of the search on a floor of 1 N/mm with less than 1 N, and how far it moved the tool aside, mm.
    const auto search = [](std::uint64_t seed, double friction, double& aside) {
        InsertingHand one = hand(seed);
        Pose tool = kStart;
        int ticks = 0, light = 0;
        std::optional<Vec3> landed;
        for (int t = 0; t < 10000; ++t) {
            const Pose device = one.read(t, 1).X_WT_device;
            const double normal = std::max(0.0, -device.p.y());
            Vec3 lag = device.p - tool.p;
            lag.y() = 0;
            const double limit = normal > 0 ? friction * normal : 0;
            if (lag.norm() > limit) tool.p += lag * (1 - limit / lag.norm());
            tool.p.y() = std::max(device.p.y(), 0.0);
            if (limit < 0.5) tool.q = device.q;  // on an edge, friction holds it in twist as well
            one.write({.force = tool.p - device.p, .torque = 1000 * logRotation(tool.q * device.q.conjugate())});
            one.show(tool);
            if (normal > 1 && !landed) landed = tool.p;
            if (landed && one.act() != InsertingHand::Act::Press) break;
            if (!landed || t < 4000) continue;
            ++ticks;
            light += normal < 1;
            aside = std::max(aside, (tool.p - *landed).norm());
        }
        REQUIRE(ticks > 0);
        return double(light) / ticks;
    };
    int eased = 0;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        CAPTURE(seed);
        double aside = 0;
        CHECK(search(seed, 0, aside) < 0.05);
        CHECK(aside > 0.5);
        aside = 0;
        if (search(seed, 0.9, aside) < 0.05) continue;  // the search did not lead it far enough
        ++eased;
        CHECK(aside > 0.1);
    }
    CHECK(eased >= 10);
}

}  // namespace touchstone::inserting_hand_tests
