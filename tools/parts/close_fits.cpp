#include "tools/parts/close_fits.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "tools/parts/angles.hpp"
#include "tools/parts/hard_cases.hpp"
#include "tools/parts/scene_kit.hpp"
#include "tools/parts/turned.hpp"

namespace touchstone::app {
namespace {

using engine::Entity;
using engine::Scene;
using nlohmann::json;

json neverOverlaps() { return {{"max_penetration_mm", kTouch}, {"max_infeasible_ticks", 0}}; }

/// The tool must also follow the device to the end.
json comesOut() {
    json outcome = neverOverlaps();
    outcome["max_final_lag_mm"] = 0.01;
    return outcome;
}

/// Case 20. Ten times, a jump to a pose about the center, some 10 mm and 0.5 rad away, and a walk at random from there.
Demonstration withWalk(Demonstration motion, const ToolPose& center) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    const auto stray = [&](const ToolPose& from, double mm, double rad) {
        ToolPose pose = from;
        for (int k = 0; k < 3; ++k) pose.position[k] += mm * normal(random);
        for (const glm::dvec3& axis : {kX, kY, kZ}) pose.rotation = about(axis, rad * normal(random)) * pose.rotation;
        return pose;
    };
    for (int jump = 0; jump < 10; ++jump) {
        ToolPose pose = stray(center, 6, 0.3);
        motion.jumpTo(pose);
        motion.follow(
            0.1, [&](double) { return pose = stray(pose, 0.2, 0.005); }, 0.001);
    }
    return motion;
}

/// Case 20 of a part that is half way in its hole, and comes out in the end.
void addWalk(Scene& scene, Entity tool, const ToolPose& clear, const ToolPose& half) {
    Demonstration start(clear);
    start.moveTo(half, 0.4);
    Demonstration walk = withWalk(start, half);
    walk.moveTo(clear, 0.3);
    walk.hold(0.2);
    scene.animations.push_back(walk.animation(tool, "hard-20-walk", comesOut()));
}

void addPegCases(Scene& scene, Entity tool, const PegFit& fit) {
    const double bottom = -fit.depth - 3;
    const ToolPose clear = upright(15, 0);
    Demonstration strokes(clear);
    strokes.hold(0.1);
    for (const double turn : {1.0, -1.0, 1.0}) {
        strokes.moveTo(upright(bottom, turn), 0.3);
        strokes.moveTo(clear, 0.3);
    }
    strokes.hold(0.2);
    scene.animations.push_back(strokes.animation(tool, "hard-17-reverse", comesOut()));

    // Near the mouth the peg is levered until both ends of its short engagement bind, and pressed on.
    const auto levered = [&](double depth, const glm::dvec3& axis, double angle) {
        return ToolPose{{0, -depth, 0}, about(axis, angle)};
    };
    Demonstration jam(clear);
    jam.hold(0.1);
    jam.moveTo(upright(-4, 0), 0.4);
    for (const glm::dvec3& axis : {kX, kZ}) {
        jam.moveTo(levered(4, axis, 0.1), 0.2);
        jam.moveTo(levered(15, axis, 0.1), 0.3);
        jam.moveTo(levered(15, axis, -0.1), 0.2);
        jam.moveTo(levered(4, axis, 0), 0.3);
    }
    jam.moveTo(upright(bottom, 0), 0.4);
    jam.hold(0.8);
    json home = neverOverlaps();
    home.update({{"seated", true}, {"min_peak_force_N", 9}, {"min_peak_torque_mNm", 90}});
    scene.animations.push_back(jam.animation(tool, "hard-19-jam", home));

    addWalk(scene, tool, clear, upright(-fit.depth / 2, 0));
}

/// Poses on the way down the bolt, by the turns that the hand has made.
struct WayDown {
    double clear, top, pitch, first;  ///< mm, mm, mm and rad
    double hand = 1;                  ///< of the thread: 1 right, -1 left

    ToolPose before() const { return upright(clear, hand * first); }
    ToolPose after(double turns, double above) const {
        return upright(top - pitch * turns + above, hand * (first - kTau * turns));
    }
};

void addNutCases(Scene& scene, Entity tool, const WayDown& way, double press) {
    constexpr double kTurns = 3, kSeconds = 1;
    Demonstration on(way.before());
    on.moveTo(way.after(0, -press), 0.2);
    on.follow(kSeconds, [&](double t) { return way.after(kTurns * t / kSeconds, -press); });

    Demonstration reverse = on;
    reverse.moveTo(way.after(kTurns, press), 0.1);
    reverse.follow(kSeconds, [&](double t) { return way.after(kTurns * (1 - t / kSeconds), press); });
    reverse.moveTo(way.before(), 0.1);
    reverse.hold(0.2);
    scene.animations.push_back(reverse.animation(tool, "hard-17-reverse", comesOut()));

    const auto askew = [&](ToolPose pose) {
        pose.rotation = about(kZ, 0.2) * pose.rotation;
        return pose;
    };
    Demonstration cross(askew(way.before()));
    cross.hold(0.1);
    cross.moveTo(askew(way.after(0, -press)), 0.3);
    cross.follow(
        0.8, [&](double t) { return askew(upright(way.top - press, way.hand * (way.first - 1.5 * kTau * t / 0.8))); });
    cross.moveTo(askew(upright(way.clear, way.hand * (way.first - 1.5 * kTau))), 0.2);
    cross.hold(0.2);
    // Askew, no thread catches: the nut stays where the flat tip and the chamfers hold it.
    json outcome = comesOut();
    outcome.update(
        {{"min_peak_force_N", 0.8 * press},
         {"tool_within_m", {{"min", {-0.003, (way.top - way.pitch) / 1000, -0.003}}, {"max", {0.003, 0.1, 0.003}}}}});
    scene.animations.push_back(cross.animation(tool, "hard-18-cross", outcome));

    scene.animations.push_back(withWalk(on, way.after(kTurns, 0)).animation(tool, "hard-20-walk", neverOverlaps()));
}

}  // namespace

Scene makePeg(const SceneOptions& options) {
    const PegFit& fit = options.peg;
    const double clear = 15, aside = 0.7 * fit.chamfer, pressed = 3, bottom = -fit.depth - (fit.through ? 0 : pressed);
    Demonstration motion(upright(clear, 0, aside));
    motion.hold(0.3);
    motion.moveTo(upright(-pressed, 0, aside), 0.4);  // chamfer on chamfer
    motion.hold(0.2);
    motion.moveTo(upright(-pressed, 0), 0.4);
    motion.moveTo(upright(bottom, 0), 0.6);
    motion.hold(0.2);
    motion.follow(1.5, [&](double t) { return upright(bottom, kPi / 2 * std::sin(kTau * t / 1.5)); });
    motion.hold(0.8);

    Scene scene;
    scene.name = "peg";
    scene.extras = fitExtras(fit.clearance);
    json outcome{{"seated", true}, {"max_infeasible_ticks", 0}};
    if (!fit.through) outcome["min_peak_force_N"] = 2.9;
    const Entity tool =
        addBody(scene, "peg", upright(clear, 0, aside), shared(peg(fit)), gold(), toolMarking(options.leaves, outcome));
    addBody(scene, "hole", {}, shared(pegHole(fit)), silver(), obstacleMarking(options.leaves));
    // The walls leave this much room, and the play tilts the peg by no more.
    const double angle = 3 * fit.clearance / (fit.breadth > 0 ? std::min(fit.breadth, fit.diameter) / 2 : fit.depth);
    const int fold = fit.breadth == 0 ? 0 : fit.breadth == fit.diameter ? 4 : 2;
    addGoal(scene, upright(-fit.depth, 0), 1.5 * fit.clearance, angle, {{"fold", fold}});
    scene.animations.push_back(motion.animation(tool));
    addPegCases(scene, tool, fit);
    return scene;
}

void addSplineCases(Scene& scene, Entity tool, const SplineFit& fit) {
    const auto at = [&](double depth, double angle) { return upright(fit.length / 2 - depth, angle); };
    Demonstration strokes(at(-15, 0));
    strokes.hold(0.1);
    for (const double twist : {0.1, -0.1, 0.1}) {
        strokes.moveTo(at(fit.depth / 4, 0), 0.2);
        strokes.moveTo(at(fit.depth + 3, twist), 0.3);
        strokes.moveTo(at(-15, 0), 0.4);
    }
    strokes.hold(0.2);
    scene.animations.push_back(strokes.animation(tool, "hard-17-reverse", comesOut()));

    addWalk(scene, tool, at(-15, 0), at(fit.depth / 2, 0));
}

Scene makeNut(const SceneOptions& options) {
    const ThreadFit& fit = options.nut;
    // The nut is tight when it has turned through its play on the plate; the hand turns further. Within the first turn
    // the thread catches, and the others lead down to the plate.
    const double turns = std::floor(fit.standing() / fit.lead()), seconds = turns / 3, press = 10,
                 tight = -fit.playAngle() - 0.1, onTip = fit.lead() * turns;
    const WayDown way{onTip + 6, onTip, fit.lead(), tight + kTau * turns, fit.left ? -1.0 : 1.0};
    const glm::dvec3 aside(0.4, 0, 0);
    ToolPose start = way.before(), tip = way.after(0, -press);
    start.position += aside, tip.position += aside;
    Demonstration motion(start);
    motion.hold(0.3);
    motion.moveTo(tip, 0.4);
    motion.moveTo(way.after(0, -press), 0.3);
    motion.hold(0.2);
    motion.follow(seconds, [&](double t) { return way.after(turns * t / seconds, -press); });
    motion.hold(0.8);

    Scene scene;
    scene.name = "nut";
    scene.extras = fitExtras(fit.clearance);
    const json outcome{{"seated", true}, {"min_peak_torque_mNm", 90}, {"max_infeasible_ticks", 0}};
    const Entity tool = addBody(scene, "nut", start, shared(nut(fit)), gold(), toolMarking(options.leaves, outcome));
    addBody(scene, "bolt", {}, shared(bolt(fit)), silver(), obstacleMarking(options.leaves));
    TurnedSolid plate;
    plate.add({fit.diameter / 2 + 0.75, fit.acrossFlats(), -fit.plate(), 0});
    addBody(scene, "plate", {}, shared(plate.mesh(2)), silver(), obstacleMarking(options.leaves));
    addGoal(scene, {}, 1.5 * fit.clearance, 1.2 * fit.playAngle(), {{"lead_m", way.hand * fit.lead() / 1000}});
    scene.animations.push_back(motion.animation(tool));
    addNutCases(scene, tool, way, press);
    return scene;
}

}  // namespace touchstone::app
