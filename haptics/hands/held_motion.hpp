#pragma once
// A simulated hand that follows a motion and feels the wrench, optionally with a delay. Used to measure passivity.
#include <array>

#include "haptics/device/device.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/hands/hand.hpp"
#include "haptics/hands/motion.hpp"

namespace touchstone {

/// The wrench of a tick acts on the hand for one tick, `delay` ticks later. A reading at time 0 puts the hand at the
/// start of the motion.
class HeldMotion final : public Device {
  public:
    static constexpr int kMaxDelay = 64;  ///< ticks; the size of the queue of wrenches

    /// Pre: 0 <= delay <= kMaxDelay.
    HeldMotion(std::shared_ptr<const Motion> motion, const HandParameters& hand, int delay = 0);
    DeviceReading read(double t, double dt) noexcept override;
    void write(const Wrench& wrench_o) noexcept override;
    DeviceLimits limits() const noexcept override { return {.motors = false}; }
    std::optional<double> duration() const noexcept override { return motion_->duration(); }
    std::optional<DeviceDynamics> dynamics() const noexcept override {
        return {{hand_.parameters().damping, static_cast<double>(delay_)}};
    }

    /// Work of the wrench on the hand since time 0, ∫(F·v + T·ω)dt, mJ.
    double work() const { return work_; }
    /// Energy that mass and spring have gained since time 0, mJ: the work of the wrench minus the dissipation of the
    /// damping, without the work of moving the hand's target. A wrench that is sampled and held always does a little
    /// work when the hand moves in contact. The tool feels passive as long as the damping dissipates it and this value
    /// stays at or below zero.
    double gain() const { return gain_; }

  private:
    std::shared_ptr<const Motion> motion_;
    Hand hand_;
    int delay_;
    std::array<Wrench, kMaxDelay + 1> queue_{};  // wrenches of the last ticks, at the index tick modulo size
    int tick_ = 0;
    double work_ = 0, gain_ = 0;
};

/// Row of the device table: hand[:MASS,SPRING,DAMPING,DELAY[,MOTION]] in kg, N/m, N·s/m and ticks; see
/// HandParameters::fromTranslation() for the rotation. Throws std::runtime_error with one sentence if the text is
/// invalid or the scene has no such motion.
std::unique_ptr<Device> makeHand(const DeviceContext& context);

}  // namespace touchstone
