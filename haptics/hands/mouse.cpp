#include "haptics/hands/mouse.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace touchstone {

MouseDevice::MouseDevice(std::shared_ptr<MouseTarget> target, const Pose& X_WT_start, const HandParameters& hand)
    : source_(std::move(target)),
      X_WT_start_(X_WT_start),
      X_WT_target_(X_WT_start),
      parameters_(hand),
      hand_(hand, X_WT_start) {}

DeviceReading MouseDevice::read(double t, double dt) noexcept {
    if (t <= 0) {
        X_WT_target_ = X_WT_start_;
        hand_.reset(X_WT_start_);
        wrench_o_ = {};
        source_->update();  // discards targets from before the start
        return {.X_WT_device = X_WT_start_};
    }
    if (source_->update()) {
        const MouseTarget::State& wanted = source_->get();
        if (wanted.grabbed && wanted.X_WT.isValid()) X_WT_target_ = wanted.X_WT;
        if (wanted.strength != strength_ && std::isfinite(wanted.strength)) {
            strength_ = wanted.strength;
            hand_.setParameters(
                parameters_.times(std::clamp(strength_, MouseTarget::kWeakest, MouseTarget::kStrongest)));
        }
    }
    return {.X_WT_device = hand_.advance(X_WT_target_, wrench_o_, dt)};
}

void MouseDevice::engage(const Pose& X_WT) noexcept {
    X_WT_target_ = X_WT;
    hand_.reset(X_WT);
}

std::unique_ptr<Device> makeMouse(const DeviceContext& context) {
    if (!context.mouse)
        throw std::runtime_error("the mouse needs the window of touchstone run: choose the device " +
                                 std::string(context.demonstration ? "demo" : "rest"));
    return std::make_unique<MouseDevice>(context.mouse, context.X_WT_start);
}

}  // namespace touchstone
