#include "haptics/loop/tick_driver.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace touchstone {
namespace {

/// Whether the change could make the force jump, so that the force must fade out first.
bool needsFade(const Settings& a, const Settings& b) {
    return a.mode != b.mode || a.geometry != b.geometry || a.solver != b.solver || a.friction != b.friction ||
           a.frictionSolver != b.frictionSolver || a.rate != b.rate || a.pause != b.pause;
}

}  // namespace

Session::Session(std::shared_ptr<const World> world_, const Settings& settings_, std::unique_ptr<Device> device_,
                 std::uint64_t number_)
    : world(std::move(world_)),
      settings(settings_),
      device(std::move(device_)),
      state(*world),
      safety(device->limits()),
      number(number_) {
    for (const Obstacle& obstacle : world->obstacles) X_WO.push_back(obstacle.X_WO);
}

SafetyInput safetyInput(const TickRecord& record) noexcept {
    SafetyInput input;
    input.wrench_o = record.wrench_o;                          // guard
    input.solverFailed = (record.flags & kNonFinite) != 0;     // guard
    input.badInput = (record.flags & kBadInput) != 0;          // guard
    input.listOverflow = (record.flags & kListOverflow) != 0;  // guard
    return input;
}

TickDriver::TickDriver(std::unique_ptr<Session> session) : session_(std::move(session)) { startOver(); }

TickDriver::~TickDriver() { session_->device->write({}); }

int TickDriver::ticksIn(double ms) const {
    return std::max(1, static_cast<int>(std::lround(ms * settings().rate / 1000)));
}

void TickDriver::request(const Settings& settings) noexcept {
    if (next_) {
        next_->settings = settings;
    } else if (switching_) {
        settingsAfterSwitch_ = settings;
    } else if (needsFade(session_->settings, settings)) {
        beginSwitch();
        settingsAfterSwitch_ = settings;
    } else {
        session_->settings = settings;
        // A ramp whose target does not change continues.
        const int ticks = ticksIn(kStiffnessRampMs);
        if (settings.stiffness != stiffness_.target()) stiffness_.to(settings.stiffness, ticks);
        if (settings.torsion != torsion_.target()) torsion_.to(settings.torsion, ticks);
    }
}

void TickDriver::moveObstacles(std::span<const Pose> X_WO) noexcept {
    std::vector<Pose>& targets = (next_ ? next_ : session_)->X_WO;
    std::copy_n(X_WO.begin(), std::min(X_WO.size(), targets.size()), targets.begin());
}

void TickDriver::open(std::unique_ptr<Session> session) noexcept {
    assert(!next_ && !retired_);
    next_ = std::move(session);
    beginSwitch();
}

void TickDriver::restart() noexcept {
    restarting_ = true;
    beginSwitch();
}

void TickDriver::beginSwitch() {
    if (switching_) return;  // the present fade also serves this change
    switching_ = true;
    settingsAfterSwitch_ = session_->settings;
    if (forceOut_)
        fade_.to(0, ticksIn(kFadeOutMs));
    else
        fade_.jump(0);
}

void TickDriver::finishSwitch() {
    const bool another = next_ != nullptr;
    if (another) {
        retired_ = std::move(session_);
        session_ = std::move(next_);
        session_->safety.inherit(retired_->safety);  // guard
    } else {
        if (settingsAfterSwitch_.rate != settings().rate) {
            timeBase_ = time();
            ticks_ = 0;
        }
        session_->settings = settingsAfterSwitch_;
    }
    if (another || restarting_) {
        startOver();
    } else {
        stiffness_.jump(settings().stiffness);
        torsion_.jump(settings().torsion);
        fadeIn();
    }
    switching_ = restarting_ = false;
}

void TickDriver::startOver() {
    timeBase_ = 0;
    ticks_ = 0;
    first_ = true;
    finished_ = false;
    X_WT_device_ = X_WT_tool_ = session_->world->X_WT_start;
    session_->safety.begin();  // guard
    if (stopped()) session_->state.reset(X_WT_tool_);
    emergencyStop_.guard(*session_->device, session_->safety.motors());  // guard
    stiffness_.jump(settings().stiffness);
    torsion_.jump(settings().torsion);
    fadeIn();
}

void TickDriver::engage() noexcept {
    if (isEngaged(session_->safety.engagement())) return;
    session_->device->engage(X_WT_tool_);  // guard
    session_->safety.engage();
}

/// Whether the dead-man button is held; true if the settings name no button.
bool TickDriver::holds(const DeviceReading& reading) const {
    if (settings().deadMan == 0) return true;
    return reading.valid ? (reading.buttons >> (settings().deadMan - 1) & 1) != 0 : held_;
}

void TickDriver::fadeIn() {
    fade_.jump(0);
    fade_.to(1, ticksIn(kFadeInMs));
}

TickRecord TickDriver::tick(const TickClocks& clocks, bool audit) noexcept {
    if (switching_ && fade_.value() == 0) finishSwitch();
    Session& session = *session_;

    const DeviceReading reading = session.device->read(time(), 1000.0 / settings().rate);
    ++ticks_;
    finished_ = reading.finished;
    const bool holds = this->holds(reading);
    if (!holds) stop();  // guard
    Settings effective = settings();
    effective.stiffness = stiffness_.next();
    effective.torsion = torsion_.next();
    // The tool is held; the safety stage reports the reason.
    if (!reading.valid || stopped()) effective.pause = true;  // guard
    if (reading.valid) {
        if (first_ && !stopped() && reading.X_WT_device.isValid()) {
            session.state.reset(reading.X_WT_device);
            first_ = false;
        }
        X_WT_device_ = reading.X_WT_device;
    }

    const TickInput input{X_WT_device_, session.state.nextMove(session.X_WO)};
    StepOptions options{.clock = clocks.stage, .audit = audit};
    if (session.listWorker) options.entries = session.listWorker->newest();
    const double start = clocks.cpuMicroseconds ? clocks.cpuMicroseconds() : 0;
    TickRecord record = step(*session.world, effective, input, session.state, options);
    if (clocks.cpuMicroseconds) record.totalUs = clocks.cpuMicroseconds() - start;
    if (session.listWorker) {
        record.listWorkerUs = session.listWorker->takeCpuUs();
        session.listWorker->request({.tickMs = 1000 / settings().rate,
                                     .within = askedPairs(session.state),
                                     .trust = effective.trust,
                                     .slack = std::max(effective.slack, effective.trust),
                                     .geometry = geometryOf(effective)},
                                    record.X_WT, session.state.obstacles());
    }
    X_WT_tool_ = record.X_WT;

    record.periodUs = 1000 * clocks.periodMs;
    SafetyInput checked = safetyInput(record);
    checked.fresh = reading.valid;                               // guard
    checked.fault = reading.fault;                               // guard
    checked.hung = clocks.hung && clocks.hung->exchange(false);  // guard
    checked.fade = fade_.next();                                 // guard
    checked.dt = 1000 / settings().rate;                         // guard
    checked.period = clocks.periodMs;                            // guard
    record.wrench_out = session.safety.pass(checked);
    record.trips = session.safety.acting();
    if (session.safety.zeroed()) {
        // The force is zero already. A pending switch, which waits for zero, happens now; otherwise the force fades in.
        if (switching_)
            fade_.jump(0);
        else
            fadeIn();
    }
    // The process is ending, so motors get no force. A simulated hand continues, so that the results of a run until
    // then stay reproducible.
    if (EmergencyStop::begun() && session.safety.motors()) record.wrench_out = {};  // guard
    session.device->write(record.wrench_out);
    session.device->show(record.X_WT);
    forceOut_ = !record.wrench_out.isZero();

    // Engaging comes after the tick, so that the next reading is the first one after the device was set to the tool.
    if (settings().deadMan > 0 && holds && !held_) engage();  // guard
    held_ = holds;
    return record;
}

}  // namespace touchstone
