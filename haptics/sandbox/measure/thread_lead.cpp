#include "haptics/sandbox/measure/thread_lead.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "haptics/loop/step.hpp"

namespace touchstone::sandbox {
namespace {

constexpr double kForce = 10;                           // N along the axis
constexpr double kWindUp = 0.1;                         // rad by which the springs turn under the thread's torque
constexpr double kTurned = 5 * std::numbers::pi / 180;  // rad; parts have facets of up to that
constexpr int kTurnSteps = 60;                          // into which it is divided
constexpr int kPressing = 100;                          // ticks until all the force presses
constexpr int kMostTicks = 20;                          // of one turn, until the tool rests
constexpr double kResting = 1e-7;                       // mm, and rad: a tool that moves by less rests
constexpr double kHeld = 0.5;                           // of the force: with less of it nothing holds the tool
constexpr double kFaceted = 0.93;                       // of the lead: flatter facets are named

Pose screwed(const GoalRegion& goal, double leads) {
    const double sign = std::copysign(1.0, goal.lead);
    return goal.X_WT *
           Pose{{0, leads * std::abs(goal.lead), 0}, expRotation({0, sign * 2 * std::numbers::pi * leads, 0})};
}

/// A hand that pulls the tool along the goal's axis with a force, and holds it at an angle about it.
class AxialHand {
  public:
    AxialHand(const World& world, const GoalRegion& goal, double contactDistance, double force)
        : world_(world), state_(world), force_(force) {
        settings_.contactDistance = contactDistance;
        settings_.shadow = kNoSolver;
        settings_.friction = false;
        settings_.torsion = kForce * std::abs(goal.lead) / (2 * std::numbers::pi) / kWindUp;
        axis_ = goal.X_WT.q * Vec3::UnitY();
        hand_ = record_.X_WT = screwed(goal, 1);
        state_.reset(hand_);
    }
    void turn(double angle) { hand_.q = expRotation(angle * axis_) * hand_.q; }
    /// Returns whether the tool moved.
    bool tick(double share) {
        const Pose before = record_.X_WT;
        const double along = (before.p - hand_.p).dot(axis_) + share * force_ / settings_.stiffness;
        record_ = step(world_, settings_, {.X_WT_device = {hand_.p + along * axis_, hand_.q}}, state_);
        const Vec6 moved = incrementBetween(before, record_.X_WT);
        return moved.cwiseAbs().maxCoeff() > kResting;
    }
    double force() const { return record_.wrench_C.force.dot(axis_); }
    double torque() const { return record_.wrench_C.torque.dot(axis_); }

  private:
    const World& world_;
    Settings settings_;
    TickState state_;
    TickRecord record_;
    Pose hand_;
    Vec3 axis_;
    double force_;
};

}  // namespace

std::string facetClause(const ThreadLead& lead) {
    char text[80];
    std::snprintf(text, sizeof text, "facets rise by %.2f to %.2f of the lead", lead.least, lead.most);
    return text +
           std::string(lead.least < kFaceted
                           ? ", so they decide from which friction on the thread holds: more of them, or numbers "
                             "without a common divisor, come nearer to the lead"
                           : "");
}

std::optional<ThreadLead> threadLead(const World& world, const GoalRegion& goal, double contactDistance,
                                     const MeasureProgress& progress) {
    if (goal.lead == 0) return {};
    ThreadLead found{.least = INFINITY, .most = 0};
    for (const double force : {-kForce, kForce}) {
        AxialHand hand(world, goal, contactDistance, force);
        for (int i = 1; i <= kPressing; ++i) hand.tick(double(i) / kPressing);
        for (int i = 0; i < kTurnSteps; ++i) {
            if (progress && !progress(((force > 0) + double(i) / kTurnSteps) / 2)) return {};
            // The way that the force drives it: friction has to hold it there.
            hand.turn(std::copysign(kTurned / kTurnSteps, force * goal.lead));
            for (int k = 0; k < kMostTicks && (hand.tick(1) || k < 2); ++k) {
            }
            if (std::abs(hand.force()) < kHeld * kForce) return {};
            const double rise = -hand.torque() / hand.force() * 2 * std::numbers::pi / goal.lead;
            found.least = std::min(found.least, rise), found.most = std::max(found.most, rise);
        }
    }
    return found;
}

}  // namespace touchstone::sandbox
