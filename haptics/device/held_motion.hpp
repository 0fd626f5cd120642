#pragma once
// A simulated hand that follows a motion and feels the wrench, late if asked: where passivity is measured.
#include <array>

#include "haptics/device/device.hpp"
#include "haptics/device/hand.hpp"
#include "haptics/device/motion.hpp"

namespace touchstone {

/// The wrench of a tick acts on the hand until the next reading, `delay` ticks later. Time 0 puts the hand to the
/// motion's start.
class HeldMotion final : public Device {
  public:
    static constexpr int kMaxDelay = 64;

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
    /// The same with the damping's: what mass and spring have gained, mJ, moving the hand's target not counted. A
    /// wrench that is sampled and held always does a little work where the hand moves in contact; the tool feels
    /// passive as long as damping takes it away again and this stays at or below zero.
    double gain() const { return gain_; }

  private:
    std::shared_ptr<const Motion> motion_;
    Hand hand_;
    int delay_;
    std::array<Wrench, kMaxDelay + 1> queue_{};  // of the last ticks, at tick modulo its size
    int tick_ = 0;
    double work_ = 0, gain_ = 0;
};

/// Row of the device table: hand[:MASS,SPRING,DAMPING,DELAY[,MOTION]] in kg, N/m, N·s/m and ticks, rotation like
/// translation at a lever. Throws std::runtime_error with one sentence when the text or the motion will not do.
std::unique_ptr<Device> makeHand(const DeviceContext& context);

}  // namespace touchstone
