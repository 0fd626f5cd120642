// What the close fits show of the method, beyond the outcomes of their scenes.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

#include "haptics/sandbox/measure/error_split.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tests/scenes/scene_files.hpp"
#include "tools/parts/scenes.hpp"

namespace touchstone::close_fits_tests {

namespace {

constexpr double kPi = std::numbers::pi;

/// A tick of the nut while it turns: mm, rad counted over full turns, N and mN·m on the hand along the bolt.
struct Turned {
    double y, angle, force, torque;
    Pose device, before;  ///< where the device was, and the nut one tick before
};

sandbox::HapticScene nutScene(int segments, int nutSegments) {
    app::SceneOptions options;
    options.nut.segments = segments, options.nut.nutSegments = nutSegments;
    const auto table = app::sceneTable();
    const auto nut = std::find_if(table.begin(), table.end(), [](const auto& info) { return info.name == "nut"; });
    return sandbox::openScene(nut->make(options));
}

std::vector<Turned> nutTicks(const sandbox::HapticScene& scene, const char* motion) {
    sandbox::HeadlessOptions options;
    options.device = std::string("demo:") + motion;
    options.timing = false;
    std::vector<Turned> ticks;
    Pose before;
    double deepest = 0;
    options.onTick = [&](const TickRecord& record, double penetration) {
        deepest = std::max(deepest, penetration);
        const Quat& q = record.X_WT.q;
        double angle = 2 * std::atan2(q.y(), q.w());
        if (!ticks.empty()) angle += 2 * kPi * std::round((ticks.back().angle - angle) / (2 * kPi));
        ticks.push_back({record.X_WT.p.y(), angle, record.wrench_C.force.y(), record.wrench_C.torque.y(),
                         record.X_WT_device, std::exchange(before, record.X_WT)});
    };
    Settings settings = scene.settings;
    settings.shadow = kNoSolver;
    sandbox::runHeadless(scene, settings, options);
    REQUIRE(deepest == 0);
    return ticks;
}

/// Those between two heights on the way down or up.
std::vector<Turned> between(const std::vector<Turned>& ticks, double low, double high, bool down) {
    std::vector<Turned> part;
    for (std::size_t i = 1; i < ticks.size(); ++i)
        if (ticks[i].y > low && ticks[i].y < high && (down ? -1 : 1) * (ticks[i].angle - ticks[i - 1].angle) > 1e-4)
            part.push_back(ticks[i]);
    return part;
}

/// The advance in a full turn from each of these ticks on, mm: smallest and largest.
std::pair<double, double> advance(const std::vector<Turned>& ticks) {
    double least = 1e300, most = 0;
    std::size_t k = 1;
    for (const Turned& from : ticks) {
        while (k < ticks.size() && std::abs(ticks[k].angle - from.angle) < 2 * kPi) ++k;
        if (k == ticks.size()) break;
        const Turned &a = ticks[k - 1], &b = ticks[k];
        const double share = (2 * kPi - std::abs(a.angle - from.angle)) / std::abs(b.angle - a.angle);
        const double way = std::abs(std::lerp(a.y, b.y, share) - from.y);
        least = std::min(least, way), most = std::max(most, way);
    }
    return {least, most};
}

/// The mean of torque over force, mm: by energy it is the pitch over 2 pi where nothing rubs.
double lever(const std::vector<Turned>& ticks) {
    double force = 0, torque = 0;
    for (const Turned& tick : ticks) force += tick.force, torque += tick.torque;
    return -torque / force;
}

}  // namespace

TEST_CASE("close fits: a nut advances by its pitch with each turn, on and off, and turns as easily as energy allows",
          "[scenes][long]") {
    const std::vector<Turned> ticks =
        nutTicks(test::openBundled(TOUCHSTONE_BINARY_DIR "/scenes/nut.glb"), "hard-17-reverse");
    for (const bool down : {true, false}) {
        INFO((down ? "on" : "off"));
        // Above 9.5 mm the thread has only begun to catch; below 6 mm the nut is turned back.
        const std::vector<Turned> part = between(ticks, 6, 9.5, down);
        REQUIRE(part.size() > 400);
        const auto [least, most] = advance(part);
        CHECK(least == Approx(2).epsilon(1e-3));
        CHECK(most == Approx(2).epsilon(1e-3));
        CHECK(std::abs(part.front().force) == Approx(10).margin(0.5));
        // Facets that pass each other make the torque ripple by a few percent about its mean.
        CHECK(lever(part) == Approx(2 / (2 * kPi)).epsilon(0.005));
    }
}

TEST_CASE("close fits: the torque of a nut ripples as much as that of the reference on the same meshes",
          "[scenes][reference][long]") {
    // The bundled nut, one with as many segments as the bolt, and one with a number that shares no divisor with it.
    const auto [segments, nutSegments, margin] =
        GENERATE(std::tuple(156, 168, 0.02), std::tuple(156, 156, 0.02), std::tuple(156, 157, 0.05));
    const sandbox::HapticScene scene = nutScene(segments, nutSegments);
    const std::vector<Turned> part = between(nutTicks(scene, "hard-17-reverse"), 6, 9.5, true);
    REQUIRE(part.size() > 400);
    // By energy alone, the torque is that of the force along the pitch.
    const auto beyond = [](double torque, double force) { return torque + force * 2 / (2 * kPi); };
    const auto rms = [](const std::vector<double>& of) {
        return std::sqrt(std::inner_product(of.begin(), of.end(), of.begin(), 0.0) / double(of.size()));
    };
    std::vector<double> all, truth, off;
    for (const Turned& tick : part) all.push_back(beyond(tick.torque, tick.force));
    MeshReferenceOptions options;
    options.shell = scene.settings.contactDistance;
    options.margin = 0.05;  // the play
    const MeshReference reference = sandbox::meshReferenceOf(scene, options);
    for (std::size_t i = 0; i < part.size(); i += part.size() / 40) {
        const MeshReferenceAnswer answer =
            reference.solve({part[i].device, part[i].before, scene.settings.stiffness, scene.settings.torsion});
        if (!answer.converged) continue;
        truth.push_back(beyond(answer.wrench_C.torque.y(), answer.wrench_C.force.y()));
        off.push_back(std::abs(all[i] - truth.back()));
    }
    REQUIRE(off.size() > 30);
    std::nth_element(off.begin(), off.begin() + std::ptrdiff_t(off.size() / 2), off.end());
    CAPTURE(segments, nutSegments, rms(all), rms(truth), off[off.size() / 2]);
    CHECK(rms(all) > 0.03);
    CHECK(rms(all) == Approx(rms(truth)).margin(margin));  // of every tick, the few that stand out included
    CHECK(off[off.size() / 2] < 0.02);
}

}  // namespace touchstone::close_fits_tests
