#include "haptics/device/mouse.hpp"

#include <stdexcept>

namespace touchstone {

MouseDevice::MouseDevice(std::shared_ptr<MouseTarget> target, const Pose& X_WT_start, const HandParameters& hand)
    : source_(std::move(target)), X_WT_start_(X_WT_start), X_WT_target_(X_WT_start), hand_(hand, X_WT_start) {}

DeviceReading MouseDevice::read(double t, double dt) noexcept {
    if (t <= 0) {
        X_WT_target_ = X_WT_start_;
        hand_.reset(X_WT_start_);
        wrench_o_ = {};
        source_->update();  // what was asked for before the start is forgotten
        return {.X_WT = X_WT_start_};
    }
    if (source_->update() && source_->get().grabbed && source_->get().X_WT.isFinite())
        X_WT_target_ = source_->get().X_WT;
    return {.X_WT = hand_.advance(X_WT_target_, wrench_o_, dt)};
}

std::unique_ptr<Device> makeMouse(const DeviceContext& context) {
    if (!context.mouse)
        throw std::runtime_error(
            "the mouse needs the window: leave out --headless, or choose --device demo or replay:FILE");
    return std::make_unique<MouseDevice>(context.mouse, context.X_WT_start);
}

}  // namespace touchstone
