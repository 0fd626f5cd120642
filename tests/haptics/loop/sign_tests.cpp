// The sign of the tool's quaternion: q and -q are the same rotation.
#include <catch2/catch.hpp>

#include "haptics/loop/step.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/wandering_hand.hpp"

namespace touchstone::sign_tests {

using namespace touchstone::test;

namespace {

/// A box over a plate, both with meshes, and with spheres of about their size.
World boxOnPlate(const Pose& start) {
    return withMeshes(worldOf(blob(40, 2.5f, 1), blob(80, 6, 2), start), centeredBox(4, 3, 2), centeredBox(20, 20, 6));
}

Pose negated(Pose X) {
    X.q.coeffs() = -X.q.coeffs();
    return X;
}

struct Counts {
    int touched = 0, released = 0, turnedOver = 0;
};

/// Walks with a hand whose quaternions have random signs, and beside it with one that has them as they come.
Counts walk(const Settings& settings, const Pose& start, unsigned seed) {
    const World world = boxOnPlate(start);
    TickState state(world), other(world);
    WanderingHand hand(seed, 8);
    Random random(seed);
    Counts counts;
    std::optional<TickRecord> before;
    for (int tick = 0; tick < 1500; ++tick) {
        Pose X = tick == 0 ? start : hand.next();
        X.q = expRotation(0.02 * tick * Vec3(0.48, 0.6, 0.64)) * X.q;  // and turns on and on, in contact as well
        const TickRecord record = step(world, settings, {random.engine() % 2 ? X : negated(X)}, state);
        const TickRecord same = step(world, settings, {X}, other);
        CAPTURE(tick);
        // What a tick does depends on the rotation alone.
        REQUIRE(record.X_WT == same.X_WT);
        REQUIRE(record.X_WT_device == same.X_WT_device);
        REQUIRE(record.wrench_C.force == same.wrench_C.force);
        REQUIRE(record.wrench_C.torque == same.wrench_C.torque);
        if (before)
            REQUIRE(record.X_WT.q.dot(before->X_WT.q) >= 0);
        else
            REQUIRE(record.X_WT.q.w() >= 0);
        if (before) {
            counts.touched += before->wrench_C.isZero() && !record.wrench_C.isZero();
            counts.released += !before->wrench_C.isZero() && record.wrench_C.isZero();
            counts.turnedOver += before->X_WT.q.w() < 0;
        }
        before = record;
        if (tick % 400 == 399) {  // as a recording begins in the middle of a run
            state.resume(record);
            other.resume(record);
            before.reset();
        }
    }
    return counts;
}

}  // namespace

TEST_CASE("step: the sign of the tool's quaternion never jumps, whatever the signs of the device's", "[step]") {
    Counts all;
    for (const char* mode : {"mesh", "spheres", "paper", "god-object", "penalty"})
        for (const char* friction : {"0", "0.4"})
            for (const double turn : {0.0, 3.0, 3.3}) {
                Settings settings = settingsFor(mode == std::string("mesh") ? Geometry::Mesh : Geometry::Spheres);
                if (mode != std::string("mesh") && mode != std::string("spheres"))
                    REQUIRE(setSetting(settings, "mode", mode).empty());
                REQUIRE(setSetting(settings, "friction_coefficient", friction).empty());
                CAPTURE(mode, friction, turn);
                const Pose start{{0, 0, 14}, expRotation(turn * Vec3(0.6, 0, 0.8))};
                const Counts counts = walk(settings, start, 7);
                all.touched += counts.touched;
                all.released += counts.released;
                all.turnedOver += counts.turnedOver;
            }
    // The walks are no trivial ones.
    CHECK(all.touched > 50);
    CHECK(all.released > 50);
    CHECK(all.turnedOver > 1000);
}

}  // namespace touchstone::sign_tests
