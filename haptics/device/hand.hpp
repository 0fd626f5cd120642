#pragma once
// A simulated hand with a device in it: what holds the tool where there is no human.
#include "haptics/math/rigid.hpp"

namespace touchstone {

/// Mass, inertia and damping are those of hand and device together, against the ground; the springs pull to where the
/// hand wants to be. Damping of 1 N·s/m is 1 N·ms/mm, so the field's usual figures hold in this unit system.
struct HandParameters {
    double mass = 0.1;              ///< kg; positive
    double spring = 0.5;            ///< N/mm; positive
    double damping = 14;            ///< N·s/m; about critical for the two above
    double inertia = 250;           ///< kg·mm²; positive
    double torsionSpring = 1012.5;  ///< mN·m/rad; positive
    double torsionDamping = 31820;  ///< mN·m·ms/rad; about critical

    /// Rotation like translation at a lever: inertia m·(50 mm)², spring and damping times (45 mm)².
    static HandParameters fromTranslation(double mass, double spring, double damping);
    /// A hand that pulls so many times as hard and swings no more: springs times `strength`, damping times its root.
    HandParameters times(double strength) const;
};

/// A rigid body on a spring and a damper, in translation of the tool node's origin o and in rotation about it. Solved
/// exactly for a target and a wrench that are constant over a tick, so it is stable for every parameter and tick length
/// and creates no energy. Real time: no allocation, lock or throw.
class Hand {
  public:
    explicit Hand(const HandParameters& parameters, const Pose& X_WT);

    /// Other parameters from the next tick on; pose and velocity stay.
    void setParameters(const HandParameters& parameters) noexcept;
    /// At rest at X_WT.
    void reset(const Pose& X_WT) noexcept;
    /// `dt` ms on, pulled to `X_WT_target`, under the wrench on the hand about o on world axes. Returns the new pose.
    /// An invalid target (Pose::isValid) and a wrench that is not finite leave everything as it was.
    const Pose& advance(const Pose& X_WT_target, const Wrench& wrench_o, double dt) noexcept;

    const HandParameters& parameters() const { return parameters_; }
    const Pose& pose() const { return X_WT_; }
    const Vec3& velocity() const { return v_; }         ///< of o, mm/ms
    const Vec3& angularVelocity() const { return w_; }  ///< world axes, rad/ms
    /// Kinetic energy and that of the springs stretched to `X_WT_target`, mJ.
    double energy(const Pose& X_WT_target) const;

  private:
    /// Exact change over one tick of (u, u') for m u'' + b u' + k u = 0.
    struct Oscillator {
        double uu = 1, uv = 0, vu = 0, vv = 1;
        Oscillator() = default;
        Oscillator(double mass, double damping, double spring, double dt);
        void apply(Vec3& u, Vec3& v) const;
    };

    HandParameters parameters_;
    Pose X_WT_;
    Vec3 v_ = Vec3::Zero();
    Vec3 w_ = Vec3::Zero();
    double dt_ = 0;  // the tick length that the two below are for
    Oscillator translation_;
    Oscillator rotation_;
};

}  // namespace touchstone
