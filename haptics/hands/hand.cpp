#include "haptics/hands/hand.hpp"

#include <cassert>
#include <cmath>

namespace touchstone {
namespace {

// 1 kg·mm/ms² = 1000 N: masses become N·ms²/mm, inertias mN·m·ms²/rad.
constexpr double kPerKilogram = 1000;

}  // namespace

HandParameters HandParameters::fromTranslation(double mass, double spring, double damping) {
    constexpr double kGyration = 50 * 50, kLever = 45 * 45;  // mm²
    return {.mass = mass,
            .spring = spring,
            .damping = damping,
            .inertia = mass * kGyration,
            .torsionSpring = spring * kLever,
            .torsionDamping = damping * kLever};
}

HandParameters HandParameters::times(double strength) const {
    const double root = std::sqrt(strength);
    HandParameters other = *this;
    other.spring *= strength;
    other.torsionSpring *= strength;
    other.damping *= root;
    other.torsionDamping *= root;
    return other;
}

Hand::Oscillator::Oscillator(double mass, double damping, double spring, double dt) {
    const double decay = damping / (2 * mass);
    const double stiffness = spring / mass;
    const double discriminant = decay * decay - stiffness;
    // u(t) = e^-γt (c u + s (v + γ u)). The variables c and s include the exponential, so that nothing overflows.
    double c, s;
    const double rate = std::sqrt(std::abs(discriminant));
    if (rate * dt < 1e-4) {  // critical damping within rounding, since sin(x)/x = 1 - x²/6
        c = std::exp(-decay * dt);
        s = c * dt;
    } else if (discriminant < 0) {
        const double e = std::exp(-decay * dt);
        c = e * std::cos(rate * dt);
        s = e * std::sin(rate * dt) / rate;
    } else {
        // γ - rate is computed as a quotient, because the difference cancels for strong damping.
        const double slow = std::exp(-stiffness / (decay + rate) * dt), fast = std::exp(-(decay + rate) * dt);
        c = (slow + fast) / 2;
        s = (slow - fast) / (2 * rate);
    }
    uu = c + decay * s;
    uv = s;
    vu = -stiffness * s;
    vv = c - decay * s;
}

void Hand::Oscillator::apply(Vec3& u, Vec3& v) const {
    const Vec3 u0 = u;
    u = uu * u0 + uv * v;
    v = vu * u0 + vv * v;
}

Hand::Hand(const HandParameters& parameters, const Pose& X_WT) : parameters_(parameters), X_WT_(X_WT) {
    assert(parameters.mass > 0 && parameters.spring > 0 && parameters.damping >= 0);
    assert(parameters.inertia > 0 && parameters.torsionSpring > 0 && parameters.torsionDamping >= 0);
}

void Hand::reset(const Pose& X_WT) noexcept {
    X_WT_ = X_WT;
    v_ = w_ = Vec3::Zero();
}

const Pose& Hand::advance(const Pose& X_WT_target, const Wrench& wrench_o, double dt) noexcept {
    if (!X_WT_target.isValid() || !wrench_o.isFinite() || !(dt > 0)) return X_WT_;
    const HandParameters& h = parameters_;
    if (dt != dt_) {
        translation_ = Oscillator(kPerKilogram * h.mass, h.damping, h.spring, dt);
        rotation_ = Oscillator(kPerKilogram * h.inertia, h.torsionDamping, h.torsionSpring, dt);
        dt_ = dt;
    }

    // Relative to the equilibrium of spring and wrench, each motion is a free oscillation.
    const Vec3 balance = X_WT_target.p + wrench_o.force / h.spring;
    Vec3 u = X_WT_.p - balance;
    translation_.apply(u, v_);
    X_WT_.p = balance + u;

    // The rotation of the tick is solved in the flat space of rotation vectors and then applied to the orientation.
    // That creates no energy: in a space with the curvature of the rotations, the third side of a triangle is never
    // longer than in flat space.
    const Vec3 start = logRotation(X_WT_.q * X_WT_target.q.conjugate());
    const Vec3 twistBalance = wrench_o.torque / h.torsionSpring;
    Vec3 turn = start - twistBalance;
    rotation_.apply(turn, w_);
    X_WT_.q = (expRotation(turn + twistBalance - start) * X_WT_.q).normalized();
    return X_WT_;
}

void Hand::setParameters(const HandParameters& parameters) noexcept {
    parameters_ = parameters;
    dt_ = 0;  // recomputes the oscillators in the next tick
}

double Hand::energy(const Pose& X_WT_target) const {
    const HandParameters& h = parameters_;
    const Vec3 stretch = X_WT_.p - X_WT_target.p;
    const Vec3 twist = logRotation(X_WT_.q * X_WT_target.q.conjugate());
    return 0.5 * (kPerKilogram * (h.mass * v_.squaredNorm() + h.inertia * w_.squaredNorm()) +
                  h.spring * stretch.squaredNorm() + h.torsionSpring * twist.squaredNorm());
}

}  // namespace touchstone
