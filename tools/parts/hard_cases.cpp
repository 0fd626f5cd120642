#include "tools/parts/hard_cases.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "haptics/collision/clearance.hpp"
#include "tools/parts/angles.hpp"
#include "tools/parts/scene_kit.hpp"

namespace touchstone::app {
namespace {

using nlohmann::json;

glm::dquat degreesAbout(const glm::dvec3& axis, double degrees) { return about(axis, glm::radians(degrees)); }

std::string numbered(const char* name, double value) {
    char text[64];
    std::snprintf(text, sizeof text, "%s-%g", name, value);
    return text;
}

json with(json outcome, const json& more) {
    outcome.update(more);
    return outcome;
}

/// 5 µm on each axis and 0.1 mrad about each, normally distributed.
ToolPose shaken(ToolPose pose, std::mt19937& random) {
    std::normal_distribution<double> position(0, 0.005), angle(0, 1e-4);
    for (int k = 0; k < 3; ++k) pose.position[k] += position(random);
    for (const glm::dvec3& axis : {kX, kY, kZ}) pose.rotation = about(axis, angle(random)) * pose.rotation;
    return pose;
}

}  // namespace

json slides() { return {{"max_penetration_mm", kTouch}, {"max_hover_mm", 0.01}, {"max_dforce_N_per_ms", 0.1}}; }
json snaps() {
    return {{"max_penetration_mm", kTouch}, {"max_hover_mm", 0.5}, {"max_hover_ms", 10}, {"max_dforce_N_per_ms", 0.6}};
}

void addBunnyCases(engine::Scene& scene, engine::Entity tool, const SphereTree& tree, double contact) {
    const auto at = [&](double depth, double sideways = 0, const glm::dquat& rotation = {1, 0, 0, 0}) {
        return ToolPose{{contact - depth, 0, sideways}, rotation};
    };
    const auto add = [&](const Demonstration& motion, const std::string& name, const json& outcome) {
        scene.animations.push_back(motion.animation(tool, name, outcome));
    };
    // From free space into the obstacle, at 40 mm/s.
    const auto pressedBy = [&](double depth) {
        Demonstration motion(at(-2));
        motion.hold(0.05);
        motion.moveTo(at(depth), (depth + 2) / 40);
        motion.hold(0.05);
        return motion;
    };

    Demonstration slide = pressedBy(5);
    slide.follow(1, [&](double t) { return at(5, 10 * std::sin(kTau * t)); });
    add(slide, "hard-01-slide", with(slides(), {{"min_peak_force_N", 2}}));

    Demonstration deep(at(-2));
    deep.moveTo(at(40), 0.42);
    deep.follow(1, [&](double t) { return at(40, 10 * std::sin(2 * kTau * t)); });
    add(deep, "hard-02-deep", with(snaps(), {{"min_peak_force_N", 20}}));

    for (const double metersPerSecond : {0.5, 2.0, 5.0}) {
        Demonstration approach(at(-25));
        approach.hold(0.05);
        approach.moveTo(at(25), 0.05 / metersPerSecond);
        approach.hold(0.2);
        // The motion of the device itself adds its speed times the stiffness of 1 N/mm.
        json outcome = with(snaps(), {{"min_peak_force_N", 10}});
        outcome["max_dforce_N_per_ms"] = metersPerSecond + 0.6;
        add(approach, numbered("hard-03-approach", metersPerSecond), outcome);
    }

    Demonstration teleport = pressedBy(3);
    teleport.jumpTo(at(53));
    teleport.hold(0.2);
    teleport.jumpTo(at(-10));
    teleport.hold(0.2);
    json jump = with(snaps(), {{"min_peak_force_N", 10}, {"max_final_lag_mm", 1e-9}});
    jump.erase("max_dforce_N_per_ms");  // the device itself moves 50 mm in one tick
    add(teleport, "hard-05-teleport", jump);

    Demonstration rotate = pressedBy(8);
    rotate.follow(
        1, [&](double t) { return at(8, 0, about(kX, 0.3 * std::sin(2 * kTau * t)) * about(kZ, std::sin(kTau * t))); });
    add(rotate, "hard-06-rotate", with(snaps(), {{"min_peak_force_N", 3}}));

    // The device turns about C, so that its own motion adds nothing to the force: the center of the bunny's bounding
    // box is the node's origin.
    for (const double degrees : {1.0, 3.0, 10.0}) {
        const double turn = 0.36 / degrees;
        Demonstration spin = pressedBy(6);
        for (const glm::dvec3& axis : {kX, kZ}) {
            spin.follow(
                turn, [&](double t) { return at(6, 0, degreesAbout(axis, 1000 * degrees * t)); }, 0.001);
            spin.hold(0.1);
        }
        // The contacts that the solver sees lie within the margin of 0.5 mm; if a cap stops the tool before a contact,
        // the curvature of the leaves adds up to 6 µm as they turn past each other.
        add(spin, numbered("hard-07-spin", degrees), with(snaps(), {{"min_peak_force_N", 3}, {"max_hover_mm", 0.51}}));
    }

    Demonstration beta = pressedBy(7);
    beta.follow(1, [&](double t) { return at(7, 0, degreesAbout(kY, 126 * t)); });
    add(beta, "hard-08-beta", with(snaps(), {{"min_peak_force_N", 3}}));

    const glm::dquat before = degreesAbout(kX, 150), after = degreesAbout(kX, 210);
    const double touch = 130 - travelToContact(tree, tree, {130.0 * kX, before}, -kX);
    Demonstration wrap(ToolPose{{touch + 2, 0, 0}, before});
    wrap.moveTo({{touch - 7, 0, 0}, before}, 9 / 40.0);
    wrap.moveTo({{touch - 7, 0, 0}, after}, 0.5);
    wrap.hold(0.05);
    add(wrap, "hard-08-wrap", with(snaps(), {{"min_peak_force_N", 1}}));

    for (const double depth : {3.0, 10.0}) {
        Demonstration inside(at(depth));
        inside.hold(0.3);
        const double given = -leastGap(tree, tree, {Vec3(contact - depth, 0, 0), Quat::Identity()});
        add(inside, numbered("hard-11-inside", depth),
            {{"max_penetration_mm", given + kTouch}, {"max_penetration_growth_mm", kTouch}});
    }

    Demonstration hold = pressedBy(3.2);
    hold.hold(1);
    add(hold, "hard-13-hold", with(slides(), {{"max_hold_noise_N", 1e-4}, {"max_hold_noise_mNm", 0.01}}));

    std::mt19937 random(1);
    Demonstration noisy = pressedBy(3.2);
    noisy.follow(
        1, [&](double) { return shaken(at(3.2), random); }, 0.001);
    add(noisy, "hard-13-noise",
        with(slides(), {{"max_hover_mm", 0.01}, {"max_hold_noise_N", 0.02}, {"max_hold_noise_mNm", 0.5}}));

    Demonstration press(at(-2));
    press.hold(0.15);  // until the force ramp has ended
    press.moveTo(at(8), 0.1);
    press.hold(0.4);
    press.moveTo(at(-2), 0.1);
    press.hold(0.6);
    add(press, "hard-14-press", with(snaps(), {{"max_final_lag_mm", 1e-9}}));
}

void addPlateCases(engine::Scene& scene, engine::Entity tool, const PlateHeights& y) {
    const json above{{"tool_within_m", {{"min", {-0.03, y.side / 1000, -0.03}}, {"max", {0.03, 0.1, 0.03}}}}};
    for (const double metersPerSecond : {0.2, 1.0, 3.0, 10.0}) {
        Demonstration through({{0, y.above, 0}});
        through.hold(0.05);
        through.moveTo({{0, -y.past, 0}}, (y.above + y.past) / 1000 / metersPerSecond);
        through.hold(0.1);
        json outcome = with(with(snaps(), above), {{"min_peak_force_N", y.past - 1}});
        outcome["max_dforce_N_per_ms"] = metersPerSecond + 0.6;
        scene.animations.push_back(through.animation(tool, numbered("hard-04-plate", metersPerSecond), outcome));
    }

    Demonstration flight({{-600, 300, 0}});
    flight.hold(0.05);
    flight.moveTo({{600, 300, 0}, about(kZ, 3)}, 1.2 / 5);
    scene.animations.push_back(flight.animation(
        tool, "hard-15-flight",
        {{"max_peak_force_N", 0}, {"max_peak_torque_mNm", 0}, {"max_final_lag_mm", 0}, {"max_penetration_mm", 0}}));

    const double pressed = y.pressed - 20;
    Demonstration edge({{10, y.pressed + 2, 0}});
    edge.hold(0.05);
    edge.moveTo({{10, pressed, 0}}, 0.44);
    edge.moveTo({{60, pressed, 0}}, 1.25);
    edge.hold(0.1);
    scene.animations.push_back(
        edge.animation(tool, "hard-16-edge", with(snaps(), {{"min_peak_force_N", 19}, {"max_final_lag_mm", 1e-9}})));
}

engine::Scene makePinch(const SceneOptions& options) {
    const int leaves = options.leaves ? options.leaves : 256;
    const double radius = 10, thickness = 4, spacing = 60;
    const auto ballMesh = shared(sphere(radius)), wallMesh = shared(box({thickness, 40, 40}, 4));
    const SphereTree ball = treeOf(*ballMesh, leaves, options.treeCache);
    const SphereTree wall = treeOf(*wallMesh, 4 * leaves, options.treeCache);
    // Distance between the centers of wall and ball at which their leaf spheres touch.
    const double right = 40 - travelToContact(wall, ball, {40.0 * kX}, -kX);
    const double left = 40 - travelToContact(wall, ball, {-40.0 * kX}, kX);

    engine::Scene scene;
    scene.name = "pinch";
    Demonstration motion({{0, 60, 0}});
    motion.hold(0.1);
    motion.moveTo({}, 0.6);
    motion.follow(0.5, [&](double t) { return ToolPose{{2 * std::sin(2 * kTau * t), 0, 0}}; });
    motion.moveTo({{0, 60, 0}}, 0.6);
    const engine::Entity tool = addBody(scene, "ball", {{0, 60, 0}}, ballMesh, gold(),
                                        toolMarking(leaves, {{"max_final_lag_mm", 0.01}, {"min_peak_force_N", 1}}));
    scene.animations.push_back(motion.animation(tool));
    int slot = 0;
    for (const double overlap : {-0.05, 0.01, 0.1, 0.5}) {
        const double z = spacing * slot++;
        addBody(scene, "right wall", {{right - overlap, 0, z}}, wallMesh, silver(), obstacleMarking(4 * leaves));
        addBody(scene, "left wall", {{-left + overlap, 0, z}}, wallMesh, silver(), obstacleMarking(4 * leaves));
        Demonstration pinch({{0, 0, z}});
        pinch.follow(0.3, [&](double t) {
            return ToolPose{{2 * std::sin(5 * kTau * t), 3 * std::sin(2 * kTau * t), z}};
        });
        scene.animations.push_back(pinch.animation(tool, numbered("hard-10-pinch", overlap),
                                                   {{"max_penetration_mm", std::max(0.0, overlap) + kTouch}}));
    }
    return scene;
}

}  // namespace touchstone::app
