#include "tools/parts/assembly.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/parts/angles.hpp"
#include "tools/parts/scene_kit.hpp"
#include "tools/parts/scenes.hpp"

namespace touchstone::app {
namespace {

using engine::Entity;
using engine::Scene;
using nlohmann::json;

}  // namespace

Scene makeBayonet(const SceneOptions& options) {
    const BayonetFit& fit = options.bayonet;
    const double clear = 15, pressed = -2, down = -fit.depth - 3, misaligned = 0.4, over = 0.15;
    const double turned = -fit.turn - over;
    Demonstration motion(upright(clear, misaligned, 1.5));
    motion.hold(0.3);
    motion.moveTo(upright(1, misaligned, 1.5), 0.5);  // the body on the rim, beside the bore
    motion.moveTo(upright(1, misaligned), 0.4);
    motion.moveTo(upright(pressed, misaligned), 0.3);  // the lugs on the rim, beside their slots
    motion.moveTo(upright(pressed, 0), 0.8);
    motion.moveTo(upright(down, 0), 0.3);
    Demonstration notTurned = motion;
    motion.moveTo(upright(down, turned), 1);
    motion.moveTo(upright(fit.locked() + 15, turned), 0.4);
    motion.moveTo(upright(fit.locked() + 15, -fit.turn + over), 0.4);
    motion.hold(0.7);
    notTurned.hold(0.2);
    notTurned.moveTo(upright(clear, 0), 0.8);
    notTurned.hold(0.2);

    Scene scene;
    scene.name = "bayonet";
    scene.extras = fitExtras(fit.clearance);
    const json outcome{{"seated", true}, {"min_peak_force_N", 14}, {"min_peak_torque_mNm", 100}};
    const Entity tool = addBody(scene, "cap", upright(clear, misaligned, 1.5), shared(bayonetCap(fit)), gold(),
                                toolMarking(options.leaves, outcome));
    addBody(scene, "holder", {}, shared(bayonetHolder(fit)), silver(), obstacleMarking(options.leaves));
    const ToolPose locked = upright(fit.locked(), -fit.turn);
    const json way = wayTo(locked, {upright(clear, 0), upright(-fit.depth, 0), upright(-fit.depth, -fit.turn)});
    addGoal(scene, locked, 1.5 * fit.clearance, 0.06, {{"fold", fit.lugs}, {"way", way}});
    scene.animations.push_back(motion.animation(tool));
    scene.animations.push_back(notTurned.animation(
        tool, "not-turned",
        {{"max_penetration_mm", 0.001}, {"min_peak_force_N", 2}, {"max_peak_force_N", 8}, {"max_final_lag_mm", 0.01}}));
    return scene;
}

Scene makeGears(const SceneOptions& options) {
    const GearPair& fit = options.gears;
    const double seated = fit.width / 2, onTeeth = 1.5 * fit.width, home = meshAngle(fit);
    const double clear = onTeeth + fit.width / 2 + fit.chamfer + 10, misaligned = home + kTau / 2 / fit.looseTeeth;
    const auto at = [&](double y, double angle, double beside = 0) {
        return upright(y, angle, fit.distance() + beside);
    };
    Demonstration motion(at(clear, misaligned, 1.2));
    motion.hold(0.3);
    motion.moveTo(at(onTeeth + 3, misaligned, 1.2), 0.6);  // the post's chamfer leads the bore
    motion.moveTo(at(onTeeth + 1, misaligned), 0.4);
    Demonstration lifted = motion;
    motion.moveTo(at(onTeeth - 4, misaligned), 0.3);  // teeth on teeth
    motion.moveTo(at(onTeeth - 4, home), 1);
    motion.moveTo(at(seated - 3, home), 0.4);
    motion.follow(1, [&](double t) { return at(seated - 3, home + 0.15 * std::sin(2 * kTau * t)); });
    motion.moveTo(at(seated - 3, home + 0.15), 0.3);
    motion.hold(0.7);
    lifted.moveTo(at(onTeeth + 1, misaligned + 1.5), 0.8);
    lifted.hold(0.2);

    Scene scene;
    scene.name = "gears";
    scene.extras = fitExtras(fit.clearance);
    const json outcome{{"seated", true}, {"min_peak_force_N", 3}, {"min_peak_torque_mNm", 100}};
    const Entity tool = addBody(scene, "loose gear", at(clear, misaligned, 1.2), shared(looseGear(fit)), gold(),
                                toolMarking(options.leaves, outcome));
    addBody(scene, "fixed gear", {}, shared(fixedGear(fit)), silver(), obstacleMarking(options.leaves));
    addBody(scene, "post", {{fit.distance(), 0, 0}}, shared(gearPost(fit)), silver(), obstacleMarking(options.leaves));
    // Two modules beyond the pitch circles all around, one beyond the tips.
    const double thick = 8, low = -fit.module * (fit.fixedTeeth + 4) / 2,
                 high = fit.distance() + fit.module * (fit.looseTeeth + 4) / 2,
                 wide = fit.module * (std::max(fit.fixedTeeth, fit.looseTeeth) + 4);
    addBody(scene, "base", {{(low + high) / 2, -thick / 2, 0}}, shared(box({high - low, thick, wide}, 2)), silver(),
            obstacleMarking(options.leaves ? options.leaves : 4096));
    addGoal(scene, at(seated, home), 1.5 * fit.clearance, 0.06, {{"fold", fit.looseTeeth}});
    scene.animations.push_back(motion.animation(tool));
    scene.animations.push_back(lifted.animation(
        tool, "lifted", {{"max_penetration_mm", 0.001}, {"max_peak_torque_mNm", 20}, {"max_final_lag_mm", 0.01}}));
    return scene;
}

Scene makeHook(const SceneOptions& options) {
    const HookAndEye& fit = options.hook;
    const int leaves = options.leaves ? options.leaves : 1024;
    const double hung = fit.hung(), load = 20;
    const auto at = [](double x, double y, double z) { return ToolPose{{x, y, z}}; };
    const double out = fit.bow + fit.wire + 8, in = fit.bow / 3, low = fit.eye - fit.bow;
    // The tip is beside the wire of the ring and too high: pushed on, it slips under.
    Demonstration motion(at(out, low + 4, 3));
    motion.hold(0.3);
    motion.moveTo(at(in, low + 4, 3), 0.8);
    motion.moveTo(at(0, low + 4, 3), 0.2);
    motion.moveTo(at(0, hung + load, 3), 0.6);
    motion.follow(1, [&](double t) { return at(0, hung + load, 3 * std::cos(kTau * t / 2)); });
    motion.moveTo(at(0, hung + load, 0), 0.2);
    motion.hold(0.7);
    Demonstration missed(at(out, low + 4, 3));
    missed.hold(0.3);
    missed.moveTo(at(out, low + 4, fit.eye + fit.wire + 1), 0.4);
    missed.moveTo(at(0, low + 4, fit.eye + fit.wire + 1), 0.6);
    missed.moveTo(at(0, hung + load, fit.eye + fit.wire + 1), 0.6);
    missed.hold(0.2);
    Demonstration takenOff(at(0, hung, 0));
    takenOff.moveTo(at(0, low, 0), 0.5);
    takenOff.moveTo(at(out, low, 0), 0.5);
    takenOff.hold(0.1);

    Scene scene;
    scene.name = "hook";
    const json outcome{{"seated", true}, {"min_peak_force_N", load - 1}};
    const Entity tool =
        addBody(scene, "hook", at(out, low + 4, 3), shared(hook(fit)), gold(), toolMarking(leaves, outcome));
    addBody(scene, "eye", {}, shared(eyeRing(fit)), silver(), obstacleMarking(leaves));
    addBody(scene, "stem", {}, shared(eyeStem(fit)), silver(), obstacleMarking(leaves / 4));
    addBody(scene, "base", {{0, -2.5 * fit.eye - 2, 0}}, shared(box({40, 4, 40}, 2)), silver(),
            obstacleMarking(leaves));
    addGoal(scene, at(0, hung, 0), 0.5, 0.05, {{"way", "taken-off"}});
    scene.animations.push_back(motion.animation(tool));
    scene.animations.push_back(
        missed.animation(tool, "missed", {{"max_peak_force_N", 0.01}, {"max_final_lag_mm", 0.01}}));
    scene.animations.push_back(
        takenOff.animation(tool, "taken-off", {{"max_peak_force_N", 0.01}, {"max_final_lag_mm", 0.01}}));
    return scene;
}

Scene makeLock(const SceneOptions& options) {
    const LockFit& fit = options.lock;
    const double tip = fit.bitLength / 2 + fit.pilot, home = fit.home(), half = home + 0.6 * fit.bitLength;
    const double clear = tip + 8, misaligned = 0.6, over = 0.15;
    Demonstration motion(upright(clear, misaligned, 1.2));
    motion.hold(0.3);
    motion.moveTo(upright(tip - 2.5, misaligned, 1.2), 0.5);  // the stem on the plate, beside the hole
    motion.moveTo(upright(tip - 2.5, misaligned), 0.4);
    motion.moveTo(upright(fit.bitLength / 2 - 3, misaligned), 0.3);  // the bit on the plate, beside the slot
    motion.moveTo(upright(fit.bitLength / 2 - 3, 0), 0.8);
    motion.moveTo(upright(half, 0), 0.3);
    Demonstration notHome = motion;
    motion.moveTo(upright(half, -over), 0.3);
    motion.moveTo(upright(half, 0), 0.3);
    motion.moveTo(upright(home - 3, 0), 0.4);
    motion.moveTo(upright(home - 3, -fit.turn - over), 1);
    motion.moveTo(upright(home + 15, -fit.turn - over), 0.4);
    motion.hold(0.7);
    notHome.moveTo(upright(home + fit.wardWidth, 0), 0.4);
    notHome.moveTo(upright(home + fit.wardWidth, -fit.turn), 1);
    notHome.hold(0.2);

    Scene scene;
    scene.name = "lock";
    scene.extras = fitExtras(fit.clearance);
    const json outcome{{"seated", true}, {"min_peak_force_N", 14}, {"min_peak_torque_mNm", 100}};
    const Entity tool = addBody(scene, "key", upright(clear, misaligned, 1.2), shared(key(fit)), gold(),
                                toolMarking(options.leaves, outcome));
    addBody(scene, "lock", {}, shared(lock(fit)), silver(), obstacleMarking(options.leaves));
    const ToolPose locked = upright(home + fit.play(), -fit.turn);
    const double inside = home + fit.play() / 2;
    addGoal(scene, locked, 1.5 * fit.clearance, 0.06,
            {{"way", wayTo(locked, {upright(clear, 0), upright(inside, 0), upright(inside, -fit.turn)})}});
    scene.animations.push_back(motion.animation(tool));
    // The key is held in place within the clearance: nearly all of the turn is lag, at 1 N·m/rad.
    scene.animations.push_back(notHome.animation(
        tool, "not-home", {{"max_penetration_mm", 0.001}, {"min_peak_torque_mNm", 1000 * (fit.turn - 0.15)}}));
    return scene;
}

}  // namespace touchstone::app
