#include "haptics/sandbox/trials/phases.hpp"

#include <algorithm>
#include <cmath>

#include "haptics/sandbox/scene/outcome.hpp"

namespace touchstone::sandbox {

const char* name(Phase phase) {
    constexpr const char* kNames[] = {"approach", "search", "align", "insert", "seated"};
    return kNames[static_cast<int>(phase)];
}

const char* name(TrialEnd end) {
    constexpr const char* kNames[] = {"seated", "jam", "abort", "time limit"};
    return kNames[static_cast<int>(end)];
}

void PhaseWatch::add(const TickRecord& tick, double dt) {
    const double force = tick.wrench_C.force.norm();
    const Pose X_GT = goal_.X_WT.inverse() * tick.X_WT;
    elapsed_ += dt;
    depth_ = goal_.depth - out_.dot(X_GT.p);
    if (!touched_ && force > kContactForce) {
        touched_ = elapsed_;
        touchedDepth_ = depth_;
    }
    phase_ = updateRest(tick, dt) ? Phase::Seated : phaseOf(X_GT);
    ms_[static_cast<std::size_t>(phase_)] += dt;
    updateJam(force, dt);
    if (end_) return;
    if (restMs_ >= std::max(goal_.hold, limits_.minHold))
        end_ = TrialEnd::Seated;
    else if (touched_ && depth_ < touchedDepth_ - limits_.retraction)
        end_ = TrialEnd::Abort;
}

bool PhaseWatch::updateRest(const TickRecord& tick, double dt) {
    const bool released = touched_ && goal_.contains(tick.X_WT) && tick.wrench_C.force.norm() <= limits_.releaseForce &&
                          tick.wrench_C.torque.norm() <= limits_.releaseTorque;
    if (!released) {
        restPose_.reset();
        restMs_ = 0;
        return false;
    }
    const auto moved = [&] {
        const Vec6 way = incrementBetween(*restPose_, tick.X_WT);
        return way.head<3>().norm() > limits_.restMotion || way.tail<3>().norm() > limits_.restRotation;
    };
    if (!restPose_ || moved()) {
        restPose_ = tick.X_WT;
        restMs_ = 0;
    }
    restMs_ += dt;
    return true;
}

Phase PhaseWatch::phaseOf(const Pose& X_GT) const {
    if (!touched_) return Phase::Approach;
    const double tilt = std::acos(std::clamp(out_.dot(X_GT.q * out_), -1.0, 1.0));
    // Hysteresis: once inserted, the tool must retreat to half the depth to count as out, so the phase does not
    // flicker.
    const double engaged = phase_ >= Phase::Insert ? limits_.engaged / 2 : limits_.engaged;
    const double aside = (X_GT.p - out_.dot(X_GT.p) * out_).norm();
    // The origin of a tool that leans on the rim is off the axis, by at most the tilt times the depth of the hole.
    const bool over = aside <= goal_.tolerance + limits_.tilt * goal_.depth;
    if (goal_.depth > 0 && depth_ >= engaged && tilt <= limits_.tilt && over) return Phase::Insert;
    return aside <= goal_.tolerance ? Phase::Align : Phase::Search;
}

void PhaseWatch::updateJam(double force, double dt) {
    const bool home = goal_.depth - depth_ <= goal_.tolerance;
    if (phase_ != Phase::Insert || home || force <= limits_.jamForce || depth_ > jamDepth_ + limits_.jamProgress) {
        jamDepth_ = depth_;
        jamMs_ = 0;
        jammed_ = false;
        return;
    }
    jamMs_ += dt;
    if (jamMs_ < limits_.jamMs || jammed_) return;
    jammed_ = true;
    ++jams_;
}

}  // namespace touchstone::sandbox
