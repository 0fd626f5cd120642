#include "tools/parts/scenes.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tools/parts/angles.hpp"
#include "tools/parts/assembly.hpp"
#include "tools/parts/close_fits.hpp"
#include "tools/parts/friction_scenes.hpp"
#include "tools/parts/hard_cases.hpp"
#include "tools/parts/paper_motions.hpp"
#include "tools/parts/scene_kit.hpp"

namespace touchstone::app {
namespace {

using engine::Entity;
using engine::MeshData;
using engine::Scene;
using nlohmann::json;

/// One bunny nudges another from behind: touch, slide, press deep, rotate, leave.
Scene makeBunnies(const SceneOptions& options) {
    const int leaves = options.leaves ? options.leaves : 4096;
    const std::shared_ptr<const MeshData> mesh = stanfordBunny(options.bunny);
    const SphereTree tree = treeOf(*mesh, leaves, options.treeCache);
    const glm::dvec3 x(1, 0, 0), z(0, 0, 1);
    const double contact = 130 - travelToContact(tree, tree, {130.0 * x}, -x);
    const auto at = [&](double depth, double y = 0, double sideways = 0) {
        return ToolPose{{contact - depth, y, sideways}};
    };

    Demonstration motion(at(-8));
    motion.moveTo(at(0.3), 0.25);
    motion.follow(1.85, [&](double t) { return at(0.55 - 0.25 * std::cos(kTau * t / 1.85)); });
    motion.moveTo(at(5), 0.2);
    motion.follow(1.5,
                  [&](double t) { return at(5, 4 * std::cos(kTau * t / 1.5) - 4, 10 * std::sin(kTau * t / 1.5)); });
    const double pressed = 12;  // as deep as a device can render: 165 of 170 mN·m
    motion.moveTo(at(pressed), 0.35);
    motion.follow(1, [&](double t) { return at(pressed, 0, 10 * std::sin(2 * kTau * t)); });
    motion.moveTo(at(8), 0.32);
    motion.follow(1.5, [&](double t) {
        ToolPose pose = at(8);
        pose.rotation = about(x, 0.6 * std::sin(kTau * t / 1.5)) * about(z, 0.3 * std::sin(2 * kTau * t / 1.5));
        return pose;
    });
    motion.moveTo(at(-20), 0.5);
    motion.hold(0.2);

    Scene scene;
    scene.name = "bunnies";
    const json outcome{{"min_peak_force_N", 8}, {"min_contact_fraction", 0.8}, {"max_final_lag_mm", 0.01}};
    const Entity tool = addBody(scene, "gold bunny", at(-8), mesh, gold(), toolMarking(leaves, outcome));
    addBody(scene, "silver bunny", {}, mesh, silver(), obstacleMarking(leaves));
    scene.animations.push_back(motion.animation(tool));
    addBunnyCases(scene, tool, tree, contact);
    addBunnyFigures(scene, tool, tree);
    return scene;
}

/// A splined shaft finds its hole: press, turn until the keys drop in, insert, wiggle, rest.
Scene makeSpline(const SceneOptions& options) {
    const SplineFit& fit = options.fit;
    const glm::dvec3 y(0, 1, 0);
    const double misaligned = std::numbers::pi / fit.keys;
    // The tool's origin is the middle of the shaft.
    MeshData shaft = splinedShaft(fit);
    for (glm::vec3& p : shaft.positions) p.y -= static_cast<float>(fit.length / 2000);
    const auto at = [&](double depth, double angle) {
        return ToolPose{{0, fit.length / 2 - depth, 0}, about(y, angle)};
    };

    const double pressed = 6, bottom = fit.depth + 1;
    Demonstration motion(at(-15, misaligned));
    motion.hold(0.3);
    motion.moveTo(at(pressed, misaligned), 0.6);
    motion.hold(0.3);
    motion.moveTo(at(pressed, 0), 1);
    motion.hold(0.2);
    motion.moveTo(at(bottom, 0), (bottom - pressed) / 60);
    motion.hold(0.2);
    motion.follow(1, [&](double t) { return at(bottom, 0.15 * std::sin(2 * kTau * t)); });
    motion.hold(1);

    Scene scene;
    scene.name = "spline";
    scene.extras = fitExtras(fit.clearance);
    const json outcome{{"seated", true}, {"min_peak_force_N", 5}};
    const Entity tool = addBody(scene, "shaft", at(-15, misaligned), shared(std::move(shaft)), gold(),
                                toolMarking(options.leaves, outcome));
    addBody(scene, "hole", {}, shared(splinedHole(fit)), silver(), obstacleMarking(options.leaves));
    addBody(scene, "seated", at(fit.depth, 0), nullptr, {},
            {{"role", "goal"},
             {"goal",
              {{"tolerance_m", fit.clearance / 1000},
               {"tolerance_rad", std::min(0.05, 4 * fit.clearance / fit.diameter)},  // twice the play
               {"hold_s", 0.5},
               {"depth_m", fit.depth / 1000},
               {"fold", fit.keys}}}});
    scene.animations.push_back(motion.animation(tool));
    json hard = snaps();
    hard.update(outcome);
    scene.animations.push_back(motion.animation(tool, "hard-12-peg", hard));
    addSplineFigure(scene, tool, fit);
    if (fit.clearance < 0.1) addSplineCases(scene, tool, fit);
    return scene;
}

/// A ball is driven at a thin plate, faster each time, and must never come out below.
Scene makePlate(const SceneOptions& options) {
    const int leaves = options.leaves ? options.leaves : 4096;
    const int ballLeaves = options.leaves ? options.leaves : 256;  // few leaf spheres suffice for a ball
    const double radius = 12, thickness = 1;
    const double above = thickness / 2 + radius + 20, past = thickness / 2 + radius + 60;  // of the ball's center
    const double below = 8;  // of the ball's center in the demonstration, which a device can render: 20.5 of 22 N
    Demonstration motion({{0, above, 0}});
    motion.hold(0.2);
    for (const double metersPerSecond : {0.2, 0.5, 1.0}) {  // in its cases up to 10
        motion.moveTo({{0, -below, 0}}, (above + below) / 1000 / metersPerSecond);
        motion.hold(0.2);
        motion.moveTo({{0, above, 0}}, 0.3);
        motion.hold(0.2);
    }

    Scene scene;
    scene.name = "plate";
    // The ball stays on its side of the plate: its center never comes closer than the radius, less a small allowance
    // for chords and rounding.
    const double side = (thickness / 2 + radius - 0.1) / 1000;
    const json outcome{{"min_peak_force_N", below + radius},
                       {"max_final_lag_mm", 0.01},
                       {"tool_within_m", {{"min", {-0.03, side, -0.03}}, {"max", {0.03, 0.1, 0.03}}}}};
    const Entity tool =
        addBody(scene, "ball", {{0, above, 0}}, shared(sphere(radius)), gold(), toolMarking(ballLeaves, outcome));
    addBody(scene, "plate", {}, shared(box({60, thickness, 60}, 2)), silver(), obstacleMarking(leaves));
    scene.animations.push_back(motion.animation(tool));
    addPlateCases(scene, tool, {.above = above, .past = past, .side = side * 1000, .pressed = thickness / 2 + radius});
    return scene;
}

/// A rod is driven down into the narrowing gap between a bunny's ears while it swings from ear to ear.
Scene makeWedge(const SceneOptions& options) {
    const int leaves = options.leaves ? options.leaves : 4096;
    const double radius = 9, length = 40, swing = 6;
    // Seen from above the ears form a V. The rod lies along its middle, one end near the corner, and swings across.
    const glm::dvec3 along(0.46, 0, -0.89), across(0.89, 0, 0.46);
    const glm::dvec3 start(-17, 52 + radius, -13);  // just above the tips of the ears, 50 mm up
    const glm::dquat lying = about(glm::normalize(glm::cross({0, 1, 0}, along)), kTau / 4);
    const auto at = [&](double depth, double t) {
        return ToolPose{start - glm::dvec3(0, depth, 0) + swing * std::sin(3 * kTau * t) * across, lying};
    };
    const auto driven = [&](double depth) {
        const double seconds = 1;
        Demonstration motion(at(0, 0));
        motion.hold(0.2);
        motion.follow(seconds, [&](double t) { return at(depth * t / seconds, t); });
        motion.follow(seconds, [&](double t) { return at(depth, seconds + t); });
        motion.moveTo(at(0, 0), 0.6);
        motion.hold(0.2);
        return motion;
    };

    Scene scene;
    scene.name = "wedge";
    json outcome{{"min_peak_force_N", 11}, {"max_final_lag_mm", 0.01}, {"min_contact_fraction", 0.4}};
    const Entity tool =
        addBody(scene, "rod", at(0, 0), shared(cylinder(radius, length, 1)), gold(), toolMarking(leaves, outcome));
    addBody(scene, "silver bunny", {}, stanfordBunny(options.bunny), silver(), obstacleMarking(leaves));
    scene.animations.push_back(driven(28).animation(tool));  // as deep as a device can render: 140 of 170 mN·m
    outcome["min_peak_force_N"] = 12;
    json hard = snaps();
    hard.update(outcome);
    scene.animations.push_back(driven(44).animation(tool, "hard-09-wedge", hard));
    return scene;
}

/// One pebble is pressed on another, slides over it, turns on it and leaves: the same motion for any number of
/// triangles.
Scene makePebbles(const SceneOptions& options) {
    const auto at = [](double depth, double sideways = 0) { return ToolPose{{sideways, 60 - depth, 0}}; };
    Demonstration motion(at(-8));
    motion.hold(0.1);
    motion.moveTo(at(4), 0.3);
    motion.follow(1.2, [&](double t) { return at(4, 12 * std::sin(kTau * t / 1.2)); });
    motion.follow(1.2, [&](double t) {
        ToolPose pose = at(4);
        pose.rotation = about(kY, 0.6 * std::sin(kTau * t / 1.2)) * about(kZ, 0.3 * std::sin(2 * kTau * t / 1.2));
        return pose;
    });
    motion.moveTo(at(-15), 0.3);
    motion.hold(0.2);

    Scene scene;
    scene.name = "pebbles";
    const json outcome{{"min_peak_force_N", 3},
                       {"min_contact_fraction", 0.7},
                       {"max_final_lag_mm", 0.01},
                       {"max_infeasible_ticks", 0}};
    const Entity tool = addBody(scene, "gold pebble", at(-8), shared(pebble(options.triangles, 1)), gold(),
                                toolMarking(options.leaves, outcome));
    addBody(scene, "silver pebble", {}, shared(pebble(options.triangles, 2)), silver(),
            obstacleMarking(options.leaves));
    scene.animations.push_back(motion.animation(tool));
    return scene;
}

constexpr SceneVariant kSplineFiles[] = {
    {"spline", [](SceneOptions& options) { options.fit.clearance = 0.2; }},
    {"spline-01", [](SceneOptions& options) { options.fit.clearance = 0.1; }},
    {"spline-05",
     [](SceneOptions& options) {
         options.fit.clearance = 0.5;
         options.leaves = 8192;
     }},
    {"spline-002", [](SceneOptions& options) { options.fit.clearance = 0.02; }},
    {"spline-001", [](SceneOptions& options) { options.fit.clearance = 0.01; }},
};
constexpr SceneVariant kPegFiles[] = {{"peg-h7", [](SceneOptions&) {}}};
constexpr SceneVariant kDentalFiles[] = {
    {"dental", [](SceneOptions&) {}},
    {"dental-inflamed",
     [](SceneOptions& options) {
         options.pocket.depth = 5.5;
         options.pocket.width = 0.9;
         options.pocket.stiffness = 300;
     }},
};

constexpr SceneInfo kScenes[] = {
    {"bunnies", "one Stanford bunny touches, slides along, presses into and turns against another", makeBunnies},
    {"spline", "a splined shaft is turned until it drops into its hole and is pushed home", makeSpline, kSplineFiles},
    {"plate", "a ball is driven at a 1 mm plate at 0.2, 0.5 and 1 m/s, in its cases at up to 10", makePlate},
    {"wedge", "a rod is wedged between the ears of a bunny", makeWedge},
    {"pinch", "a ball between walls that leave too little room for it, or barely enough", makePinch},
    {"dental", "a periodontal probe measures how deep the pocket between tooth and gum is", makeDental, kDentalFiles},
    {"bayonet", "a cap with lugs is inserted into its holder, turned and locked", makeBayonet},
    {"gears", "a gear slides down a post into mesh with a fixed gear", makeGears},
    {"hook", "a hook goes through an eye and carries load", makeHook},
    {"lock", "a key is inserted into its lock, turned and held", makeLock},
    {"peg", "a round peg finds a hole that leaves it 0.01 mm on each side", makePeg, kPegFiles},
    {"nut", "a nut is screwed onto its bolt until it sits on a plate", makeNut},
    {"incline", "a block on an incline sticks, breaks away and slides", makeIncline},
    {"drawer", "a drawer slides in its rails, and jams when it is pulled too far off its center", makeDrawer},
    {"pebbles", "one bumpy pebble is pressed on another, slides and turns on it", makePebbles, {}, false},
};

}  // namespace

std::span<const SceneInfo> sceneTable() { return kScenes; }

std::vector<SceneVariant> bundledVariants(const SceneInfo& scene) {
    if (!scene.isBundled) return {};
    if (scene.variants.empty()) return {{scene.name, [](SceneOptions&) {}}};
    return {scene.variants.begin(), scene.variants.end()};
}

}  // namespace touchstone::app
