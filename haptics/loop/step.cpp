#include "haptics/loop/step.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <utility>

#include "haptics/loop/tick_memory.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {
namespace {

/// Whether the tables have the solvers that the settings name.
bool hasSolvers(const Settings& settings) {
    return findSolver(settings.solver) && findFrictionSolver(settings.frictionSolver) &&
           (settings.shadow == kNoSolver ||
            (findSolver(settings.shadow) && findFrictionSolver(settings.frictionShadow)));
}

/// Runs the mode's tick. If it returns false, the tool stays where it is, without force.
bool advance(Tick& tick, const Pose& device, Wrench& wrench) {
    TickState::Impl& state = tick.state;
    const Pose before = state.graphic;
    constexpr decltype(&defaultTick) kTicks[] = {defaultTick, paperTick, penaltyTick, godObjectTick};  // by Mode
    const bool done = kTicks[static_cast<std::size_t>(tick.settings.mode)](tick, device, wrench);
    if (done && state.graphic.isFinite() && wrench.isFinite()) return true;
    if (done) tick.record.flags |= kNonFinite;
    state.graphic = before;
    return false;
}

/// The same with a moving obstacle that may push the tool. If the tool cannot move out of its way, the obstacle stays.
bool advancePushed(Tick& tick, const Pose& device, int k, const Pose& target, Wrench& wrench) {
    TickState::Impl& s = tick.state;
    const Settings& set = tick.settings;
    const Pose graphic = s.graphic, X_WO = s.X_WO[k], before = s.inObstacle(k, graphic);
    const TouchingPairs touching = s.touching;
    const double maxMove = std::min(set.trust / 2, kObstacleSpeed * 1000 / set.rate);
    if (s.lists[k]->ofFeatures()) {
        s.X_OW_before = s.X_OW[k];
        s.pushing = k;
    }
    s.moveObstacle(k, target, s.paces[k] * maxMove);
    bool fits = advance(tick, device, wrench);
    if (set.mode != Mode::Default) return fits;
    if (fits && !s.lists[k]->ofFeatures()) {  // a step between features that would touch has failed
        const Pose after = s.inObstacle(k, s.graphic);
        fits = s.lists[k]->complete({after, 0}, set.slack) &&
               !s.lists[k]->remeasure(before, after, kOverlapTolerance).deeper;
    }
    s.pushing = -1;
    s.paces[k] = std::clamp(fits ? 2 * s.paces[k] : s.paces[k] / 2, kSmallestPace, 1.0);
    if (fits) return true;

    s.place(k, X_WO);
    s.graphic = graphic;
    s.touching = touching;
    s.obstacleTravel = 0;
    s.forces.restartTick();
    const TickRecord tried = std::exchange(tick.record, {});
    tick.record.tick = tried.tick;
    tick.record.flags = kObstacleHeld;
    tick.record.collisionUs = tried.collisionUs;  // the refused attempt also took time
    tick.record.solveUs = tried.solveUs;
    tick.record.shadowUs = tried.shadowUs;
    return advance(tick, device, wrench);
}

}  // namespace

TickRecord step(const World& world, const Settings& settings, const TickInput& input, TickState& state) noexcept {
    return step(world, settings, input, state, {});
}

TickRecord step(const World& world, const Settings& settings, const TickInput& input, TickState& tickState,
                const StepOptions& options) noexcept {
    TickState::Impl& state = *tickState.impl;
    assert(world.tool.spheres == state.world->tool.spheres && world.tool.surface == state.world->tool.surface);
    TickRecord record;
    record.tick = state.tick++;
    state.asked = {};
    state.searches->beginTick();
    state.given = input;
    state.settings = settings;
    state.startGiven = std::exchange(state.start, std::nullopt);
    Tick tick{state, settings, options.clock, options.audit, record};
    state.use(geometryOf(settings), settings.contactDistance);
    for (std::size_t k = 0; k < state.lists.size(); ++k)
        state.lists[k]->offer(k < options.entries.size() ? options.entries[k] : nullptr);

    Wrench wrench;
    Pose device = state.device;
    const Quat before = state.graphic.q;
    bool hold = true;
    const auto& [obstacle, target] = input.move;
    const bool badMove = obstacle >= int(state.lists.size()) || (obstacle >= 0 && !target.isValid());
    const bool lacksSpheres = settings.mode != Mode::Default && !world.hasSpheres();
    if (!state.hasValidStart || !input.X_WT_device.isValid() || badMove || lacksSpheres || !hasSolvers(settings)) {
        record.flags |= kBadInput;
    } else {
        // With the tool's sign, so that the tool's does not jump where it follows the device.
        device = state.referencePose({input.X_WT_device.p, withSignOf(before, input.X_WT_device.q.normalized())});
        if (settings.pause) {
            record.flags |= kPaused;
        } else {
            state.noteStart();
            state.obstacleTravel = 0;
            hold =
                !(obstacle < 0 ? advance(tick, device, wrench) : advancePushed(tick, device, obstacle, target, wrench));
            if (state.checkOverlaps()) record.flags |= kOverlapping;
        }
    }
    if (hold) wrench = {};
    if (hold || settings.mode != Mode::Default) {
        state.forces.forget();
        state.touching.clear();
    }
    if (settings.mode != Mode::Default) {  // what default mode remembers of its last tick
        for (int k = 0; k < int(state.motions.size()); ++k) state.motions[k] = state.inObstacle(k, state.graphic);
    }
    state.forces.endTick();
    state.graphic.q = withSignOf(before, state.graphic.q);
    state.wrench = wrench;
    state.device = device;
    state.loaded = !hold && tick.loaded && !wrench.isZero();  // as resume() finds it in a record

    record.X_WT_device = state.nodePose(device);
    record.X_WT = state.nodePose(state.graphic);
    record.touching = state.touching;
    record.wrench_C = wrench;
    record.wrench_o = wrench;
    record.wrench_o.torque += (device.p - record.X_WT_device.p).cross(wrench.force);
    return record;
}

bool hasFriction(const World& world, const Settings& settings) {
    if (settings.mode != Mode::Default) return false;
    for (std::size_t k = 0; k < world.obstacles.size(); ++k)
        if (world.friction(k, settings).any()) return true;
    return false;
}

std::uint64_t hashTick(const TickRecord& record, std::uint64_t hash) {
    const auto mix = [&](std::uint64_t word) {
        for (int byte = 0; byte < 8; ++byte, word >>= 8) hash = (hash ^ (word & 0xff)) * 0x100000001b3ull;
    };
    const auto mixAll = [&](const auto& values) {
        for (int i = 0; i < values.size(); ++i) mix(std::bit_cast<std::uint64_t>(double(values[i])));
    };
    mix(record.tick);
    for (const Pose* pose : {&record.X_WT_device, &record.X_WT}) {
        mixAll(pose->p);
        mixAll(pose->q.coeffs());
    }
    mixAll(record.wrench_C.force);
    mixAll(record.wrench_C.torque);
    mix(record.flags);
    mix(std::uint64_t(record.status));
    return hash;
}

}  // namespace touchstone
