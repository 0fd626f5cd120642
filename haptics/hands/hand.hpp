#pragma once
// A simulated hand that holds a device. It moves the tool where there is no human.
#include "haptics/math/rigid.hpp"

namespace touchstone {

/// Mass, inertia and damping are those of hand and device together, relative to the ground. The springs pull toward the
/// target of the hand. A damping of 1 N·s/m is 1 N·ms/mm, so the usual values of the literature hold in this unit
/// system.
struct HandParameters {
    double mass = 0.1;              ///< kg; positive
    double spring = 0.5;            ///< N/mm; positive
    double damping = 14;            ///< N·s/m; about critical for the mass and spring above
    double inertia = 250;           ///< kg·mm²; positive
    double torsionSpring = 1012.5;  ///< mN·m/rad; positive
    double torsionDamping = 31820;  ///< mN·m·ms/rad; about critical

    /// Derives the rotation from the translation with a lever: inertia m·(50 mm)², spring and damping times (45 mm)².
    static HandParameters fromTranslation(double mass, double spring, double damping);
    /// A hand that pulls `strength` times as hard at the same damping ratio: the springs are multiplied by `strength`,
    /// the damping by its square root.
    HandParameters times(double strength) const;
};

/// A rigid body on a spring and a damper, in translation of the tool node's origin o and in rotation about it. The
/// motion is solved exactly for a target and a wrench that are constant over a tick, so it is stable for all parameters
/// and tick lengths and creates no energy. Real time: no allocation, lock or throw.
class Hand {
  public:
    explicit Hand(const HandParameters& parameters, const Pose& X_WT);

    /// Sets the parameters from the next tick on. Pose and velocity stay.
    void setParameters(const HandParameters& parameters) noexcept;
    /// Puts the hand at rest at X_WT.
    void reset(const Pose& X_WT) noexcept;
    /// Advances by `dt` ms. The springs pull to `X_WT_target`; `wrench_o` acts on the hand about o, in world axes.
    /// Returns the new pose. An invalid target (Pose::isValid) or a non-finite wrench changes nothing.
    const Pose& advance(const Pose& X_WT_target, const Wrench& wrench_o, double dt) noexcept;

    const HandParameters& parameters() const { return parameters_; }
    const Pose& pose() const { return X_WT_; }
    const Vec3& velocity() const { return v_; }         ///< of o, mm/ms
    const Vec3& angularVelocity() const { return w_; }  ///< world axes, rad/ms
    /// Kinetic energy plus the energy of the springs to `X_WT_target`, mJ.
    double energy(const Pose& X_WT_target) const;

  private:
    /// Exact transition of (u, u') over one tick for m u'' + b u' + k u = 0.
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
    double dt_ = 0;  // tick length for which the two oscillators below were computed
    Oscillator translation_;
    Oscillator rotation_;
};

}  // namespace touchstone
