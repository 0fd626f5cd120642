#include "tools/parts/friction_scenes.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "engine/scene/physics_materials.hpp"
#include "engine/scene/rigid_bodies.hpp"
#include "tools/parts/angles.hpp"
#include "tools/parts/hard_cases.hpp"
#include "tools/parts/scene_kit.hpp"

namespace touchstone::app {
namespace {

using engine::Entity;
using engine::MeshData;
using engine::Scene;
using nlohmann::json;

/// The springs of every tool (toolMarking): N/mm and mN·m/rad.
constexpr double kStiffness = 1, kTorsion = 1000;

/// Gives the scene one physics material, which all parts have that are added with addRubbing().
void setMaterial(Scene& scene, const char* name, const engine::FrictionMaterial& friction) {
    json material{{"name", name}};
    engine::writeFriction(material, friction);
    (*scene.extensions)[engine::kRigidBodies]["physicsMaterials"] = json::array({material});
}

/// Adds a body whose collider has the scene's material.
Entity addRubbing(Scene& scene, const char* name, const ToolPose& pose, MeshData mesh, const engine::Material& material,
                  const json& marking) {
    const Entity node = addBody(scene, name, pose, shared(std::move(mesh)), material, marking);
    json body{{"collider", {{"geometry", {{"node", scene.nodes.size() - 1}}}, {"physicsMaterial", 0}}}};
    if (marking.at("role") == "tool") body["motion"] = json::object();
    (*scene.registry.get<engine::NodeMarking>(node).extensions)[engine::kRigidBodies] = body;
    return node;
}

/// Case 21. For some seconds the hand shakes about a pose: about as far as `mm` on each axis and `rad` about each.
Demonstration withShaking(Demonstration motion, const ToolPose& center, double mm, double rad, double seconds) {
    std::mt19937 random(21);
    std::normal_distribution<double> normal;
    glm::dvec3 way(0), speed(0), turn(0), spin(0);
    const auto shake = [&](glm::dvec3& place, glm::dvec3& rate) {
        // A damped oscillator of some 7 Hz that is pushed at random; its places have a deviation of about 1.
        for (int k = 0; k < 3; ++k) rate[k] = 0.95 * rate[k] + 0.014 * normal(random) - 0.002 * place[k];
        place += rate;
    };
    motion.follow(
        seconds,
        [&](double) {
            shake(way, speed), shake(turn, spin);
            ToolPose pose = center;
            pose.position += mm * way;
            const double angle = glm::length(turn);
            if (angle > 0) pose.rotation = about(turn / angle, rad * angle) * pose.rotation;
            return pose;
        },
        0.001);
    return motion;
}

}  // namespace

Scene makeIncline(const SceneOptions& options) {
    const glm::dvec3 block(20, 12, 16), plane(140, 8, 60);
    const double angle = options.slope, press = 5;
    const glm::dquat tilted = about(kZ, angle);
    const glm::dvec3 up = tilted * kX, normal = tilted * kY;
    // The middle of the block, by its place up the plane and its height above it.
    const auto at = [&](double along, double above) {
        return ToolPose{along * up + (block.y / 2 + above) * normal, tilted};
    };
    // The hand presses straight down, as a weight would.
    const auto pressed = [&](double along) {
        ToolPose pose = at(along, 0);
        pose.position.y -= press / kStiffness;
        return pose;
    };
    Demonstration motion(at(-25, 12));
    motion.hold(0.3);
    motion.moveTo(at(-25, 0), 0.4);
    motion.moveTo(pressed(-25), 0.4);
    motion.hold(0.4);
    double place = -25;
    const auto pull = [&](double by, double seconds) {
        motion.moveTo(pressed(place += by), seconds);
        motion.hold(0.3);
    };
    pull(30, 1.5);
    pull(-20, 1);
    pull(4, 0.4);                                 // turns the force around; the block still sticks
    for (int i = 0; i < 4; ++i) pull(1.5, 0.15);  // it breaks away in each of them
    motion.hold(0.3);

    Scene scene;
    scene.name = "incline";
    const engine::FrictionMaterial wood{0.5, 0.4};
    setMaterial(scene, "wood", wood);
    // The block comes to rest where the spring balances sliding friction, within 1 mm, since sphere trees are bumpy.
    const double load = press * std::cos(angle), weight = press * std::sin(angle);
    const glm::dvec3 end = at(place - (wood.dynamicOr() * load + weight) / kStiffness, 0).position / 1000.0;
    const json outcome{{"min_peak_force_N", press},
                       {"max_infeasible_ticks", 0},
                       {"final_position_m", {end.x, end.y, end.z}},
                       {"final_tolerance_m", 0.001}};
    const Entity tool =
        addRubbing(scene, "block", at(-25, 12), box(block, 20), gold(), toolMarking(options.leaves, outcome));
    addRubbing(scene, "plane", {-plane.y / 2 * normal, tilted}, box(plane, 70), silver(),
               obstacleMarking(options.leaves));
    scene.animations.push_back(motion.animation(tool));

    Demonstration start(at(-25, 12));
    start.moveTo(at(0, 0), 0.4);
    start.moveTo(pressed(0), 0.1);
    scene.animations.push_back(
        withShaking(start, pressed(0), 6, 0.2, 5).animation(tool, "hard-21-shake", {{"max_penetration_mm", kTouch}}));
    return scene;
}

Scene makeDrawer(const SceneOptions& options) {
    const DrawerFit& fit = options.drawer;
    const engine::FrictionMaterial wood{0.6, 0.5};
    // The hand pulls with a force along the line z = `beside`; it turns until the corners touch, and by its torque.
    const auto pulled = [&](double out, double force, double beside) {
        const double turn = beside == 0 ? 0 : std::copysign(fit.tilt(), beside);
        return ToolPose{{out + force / kStiffness, 0, -fit.toMiddle() * std::sin(turn)},
                        about(kY, turn + force * beside / kTorsion)};
    };
    const double limit = fit.engaged() / 2 / wood.staticOr(), inside = 0.7 * limit, beyond = 1.35 * limit;
    const double pull = 2.5, out = 0.8 * fit.length;
    Demonstration motion(pulled(0, 0, 0));
    motion.hold(0.3);
    motion.moveTo(pulled(0, 0, inside), 0.3);
    motion.hold(0.2);
    motion.moveTo(pulled(out / 2, pull / 2, inside), 1);  // off center, but it slides
    motion.hold(0.2);
    motion.moveTo(pulled(out / 2, 0, 0), 0.3);
    motion.moveTo(pulled(0, 0, 0), 0.5);
    Demonstration offCenter(pulled(0, 0, 0));
    for (Demonstration* part : {&motion, &offCenter}) {
        part->moveTo(pulled(0, 0, beyond), 0.3);
        part->hold(0.2);
        part->moveTo(pulled(0, pull, beyond), 1);  // it jams
        part->hold(0.5);
    }
    motion.moveTo(pulled(0, 0, beyond), 0.5);
    motion.moveTo(pulled(0, 0, 0), 0.3);
    motion.moveTo(pulled(out, 0, 0), 0.8);
    motion.hold(0.5);

    Scene scene;
    scene.name = "drawer";
    scene.extras = fitExtras(fit.clearance);
    setMaterial(scene, "wood", wood);
    const json outcome{{"min_peak_force_N", 0.98 * pull},
                       {"min_peak_torque_mNm", 0.98 * pull * beyond},
                       {"max_infeasible_ticks", 0},
                       {"max_final_lag_mm", 0.01},
                       {"final_position_m", {out / 1000, 0, 0}}};
    const Entity tool =
        addRubbing(scene, "drawer", pulled(0, 0, 0), drawer(fit), gold(), toolMarking(options.leaves, outcome));
    // Rails stand on the base and are as high as the drawer, so that it is held evenly over its height.
    const double length = fit.length + 2 * fit.recess, base = -fit.height / 2 - fit.clearance, top = -base,
                 side = fit.width / 2 + fit.clearance + fit.rail / 2;
    const MeshData rail = box({length, top - base, fit.rail}, length);
    for (const double z : {-side, side})
        addRubbing(scene, z < 0 ? "left rail" : "right rail", {{-fit.toMiddle(), (base + top) / 2, z}}, rail, silver(),
                   obstacleMarking(options.leaves));
    addRubbing(scene, "base", {{-fit.toMiddle(), base - fit.rail / 2, 0}},
               box({length, fit.rail, 2 * side + fit.rail}, length), silver(), obstacleMarking(options.leaves));
    scene.animations.push_back(motion.animation(tool));
    // Jammed, the drawer only turns through its play, about a point on its center line.
    const double play = (fit.length + fit.bar) / 2 * std::tan(fit.tilt()) / 1000;
    scene.animations.push_back(
        offCenter.animation(tool, "off-center",
                            {{"max_penetration_mm", kTouch},
                             {"min_peak_force_N", 0.98 * pull},
                             {"tool_within_m", {{"min", {-1e-4, -1e-4, -play}}, {"max", {1e-4, 1e-4, play}}}}}));
    scene.animations.push_back(withShaking(Demonstration(pulled(0, 0, 0)), pulled(0, 0, 0), 5, 0.2, 5)
                                   .animation(tool, "hard-21-shake", {{"max_penetration_mm", kTouch}}));
    return scene;
}

}  // namespace touchstone::app
