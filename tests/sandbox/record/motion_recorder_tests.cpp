#include <algorithm>
#include <catch2/catch.hpp>

#include "haptics/sandbox/record/motion_recorder.hpp"
#include "haptics/sandbox/scene/scene_motion.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tests/support/random.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::motion_recorder_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

/// A tick at 1 kHz in which the tool is where the device is.
RecordedTick tickAt(const Pose& X_WT) {
    RecordedTick tick;
    tick.record.X_WT = tick.record.X_WT_device = X_WT;
    return tick;
}
Pose at(double x, double angle = 0) { return {{x, 0, 0}, Quat(Eigen::AngleAxisd(angle, Vec3::UnitZ()))}; }

double apart(const Pose& a, const Pose& b) { return (a.p - b.p).norm(); }
double turned(const Pose& a, const Pose& b) { return logRotation(a.q * b.q.conjugate()).norm(); }

}  // namespace

TEST_CASE("motion recorder: thinned keys stay within the stated error of every sample, also as an animation",
          "[motion]") {
    // A hand: slow swings, a fast flick, tremor of 2 µm, rest.
    const auto pose = [](int t) {
        if (t > 3000) t = 3000;
        const double s = 0.001 * t, flick = t > 1000 && t < 1050 ? t - 1000 : t >= 1050 ? 50 : 0;
        return Pose{{20 * std::sin(2 * s), 5 * s * s + 0.8 * flick, 0.002 * std::sin(0.9 * t)},
                    expRotation({0.4 * std::sin(3 * s), 0.2 * s, 0.01 * flick})};
    };
    MotionThinner thinner;
    for (int t = 0; t <= 5000; ++t) thinner.add(t, pose(t));
    const std::vector<MotionKey> keys = thinner.keys();
    CHECK(keys.front().t == 0);
    CHECK(keys.back().t == 5000);
    CHECK(keys.size() < 1000);  // the tremor alone needs none
    const RecordedMotion motion(keys);

    // The tool has a parent that turns and scales.
    engine::Scene scene;
    const engine::Entity parent = addNode(
        scene, "parent", {},
        {.translation = {0.1, -0.2, 0.05}, .rotation = glm::dquat(glm::dvec3(0.3, -0.8, 0.4)), .scale = {2, 2, 2}});
    const engine::Entity tool = addBox(scene, "tool", glm::vec3(0.01f), nullptr, {.scale = {0.5, 1, 0.5}}, parent);
    updateWorldTransforms(scene);
    engine::Animation animation = animationOf(scene, tool, keys);
    for (engine::AnimationChannel& channel : animation.channels) channel.target = tool;
    const SceneMotion played(scene, animation, tool);
    CHECK(played.duration() == 5000);
    for (int t = 0; t <= 5000; ++t) {
        REQUIRE(apart(motion.at(t), pose(t)) <= kMotionErrorMm + 1e-9);
        REQUIRE(turned(motion.at(t), pose(t)) <= kMotionErrorRad + 1e-9);
        // Single precision of 0.3 m and of a quaternion, half a unit in the last place of each component, and of times,
        // at up to 40 mm/ms.
        REQUIRE(apart(played.at(t), motion.at(t)) <= 1e-4);
        REQUIRE(turned(played.at(t), motion.at(t)) <= 1e-6);
    }
}

TEST_CASE("motion recorder: rest takes two keys, and rest before the first movement is shortened", "[motion]") {
    MotionRecorder recorder;
    for (int i = 0; i < 5000; ++i) recorder.add(tickAt(at(3)));
    CHECK_FALSE(recorder.moved());
    CHECK(recorder.duration() == MotionRecorder::kLeadMs);
    for (int i = 1; i <= 100; ++i) recorder.add(tickAt(at(3 + 0.1 * i)));
    for (int i = 0; i < 5000; ++i) recorder.add(tickAt(at(13)));  // the end is kept: a goal may ask for rest
    CHECK(recorder.moved());
    CHECK(recorder.duration() == Approx(MotionRecorder::kLeadMs + 5100));
    const std::vector<MotionKey> keys = recorder.keys();
    REQUIRE(keys.size() <= 5);
    const RecordedMotion motion(keys);
    CHECK(apart(motion.at(0), at(3)) == 0);
    CHECK(apart(motion.at(250), at(8)) <= kMotionErrorMm);
    CHECK(apart(motion.at(300), at(13)) <= kMotionErrorMm);
}

TEST_CASE("motion recorder: a device that presses at the start begins at the tool, out of the obstacle", "[motion]") {
    MotionRecorder recorder;
    RecordedTick pressed = tickAt(at(-2));
    pressed.record.X_WT = at(0);
    for (int i = 0; i < 10; ++i) recorder.add(pressed);
    for (int i = 0; i < 100; ++i) {
        pressed.record.X_WT_device = at(-2 - 0.01 * i);
        recorder.add(pressed);
    }
    const RecordedMotion motion(recorder.keys());
    CHECK(motion.at(0).p == at(0).p);
    const double join = 2 / MotionRecorder::kJoinMmPerMs;
    CHECK(apart(motion.at(join / 2), at(-1)) <= kMotionErrorMm);
    CHECK(apart(motion.at(join), at(-2)) <= kMotionErrorMm);
    CHECK(apart(motion.at(1e9), at(-2.99)) == 0);
}

TEST_CASE("motion recorder: a pause takes no time, and the motion goes on in a straight line", "[motion]") {
    const auto flag = GENERATE(std::uint32_t(kPaused), std::uint32_t(kBadInput));  // also a stop, or a lost device
    MotionRecorder recorder;
    for (int i = 0; i <= 100; ++i) recorder.add(tickAt(at(0.1 * i)));
    const double before = recorder.duration();
    for (int i = 0; i < 3000; ++i) {
        RecordedTick tick = tickAt(at(10 + i));
        tick.record.flags = flag;
        recorder.add(tick);
    }
    CHECK(recorder.duration() == before);
    for (int i = 0; i <= 100; ++i) recorder.add(tickAt(at(14 + 0.1 * i)));
    const double join = 4 / MotionRecorder::kJoinMmPerMs;
    CHECK(recorder.duration() == Approx(before + join + 101));
    const RecordedMotion motion(recorder.keys());
    CHECK(apart(motion.at(before + join / 2), at(12)) <= kMotionErrorMm);
    CHECK(apart(motion.at(before + join + 101), at(24)) <= kMotionErrorMm);
}

TEST_CASE("motion recorder: another device that takes over elsewhere is joined, and invalid poses are left out",
          "[motion]") {
    MotionRecorder recorder;
    for (int i = 0; i <= 100; ++i) recorder.add(tickAt(at(0.1 * i, 0.001 * i)));
    recorder.add(tickAt(at(NAN)));
    recorder.add(tickAt(at(1e9)));
    RecordedTick other = tickAt(at(11, 0.1));
    other.session = 1;
    other.start = TickStart{};
    const double before = recorder.duration();
    recorder.add(other);
    CHECK(recorder.duration() == Approx(before + 1 / MotionRecorder::kJoinMmPerMs + 1));
    for (const MotionKey& key : recorder.keys()) CHECK(key.X_WT.isValid());
    // A turn in place also takes time.
    other.session = 2;
    other.record.X_WT_device = at(11, 0.3);
    const double next = recorder.duration();
    recorder.add(other);
    CHECK(recorder.duration() == Approx(next + 0.2 / MotionRecorder::kJoinRadPerMs + 1));
}

}  // namespace touchstone::motion_recorder_tests
