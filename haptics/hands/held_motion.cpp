#include "haptics/hands/held_motion.hpp"

#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "haptics/hands/demo.hpp"
#include "haptics/math/numbers.hpp"

namespace touchstone {

HeldMotion::HeldMotion(std::shared_ptr<const Motion> motion, const HandParameters& hand, int delay)
    : motion_(std::move(motion)), hand_(hand, motion_->at(0)), delay_(delay) {
    assert(delay >= 0 && delay <= kMaxDelay);
}

DeviceReading HeldMotion::read(double t, double dt) noexcept {
    const bool finished = t >= motion_->duration();
    const Pose target = motion_->at(t);
    if (!target.isValid())
        return {.X_WT_device = target, .finished = finished};  // the tick flags the pose, and the hand stays
    if (t <= 0 || !hand_.pose().isValid()) {
        hand_.reset(target);
        queue_.fill({});
        tick_ = 0;
        work_ = gain_ = 0;
        return {.X_WT_device = hand_.pose(), .finished = finished};
    }
    const Pose before = hand_.pose();
    // write() has already advanced tick_. Without a delay, the wrench of the previous tick acts.
    const int size = static_cast<int>(queue_.size());
    const Wrench& felt = queue_[static_cast<std::size_t>((tick_ - 1 - delay_ + 2 * size) % size)];
    gain_ -= hand_.energy(target);
    const Pose& after = hand_.advance(target, felt, dt);
    gain_ += hand_.energy(target);
    work_ += felt.force.dot(after.p - before.p) + felt.torque.dot(logRotation(after.q * before.q.conjugate()));
    return {.X_WT_device = after, .finished = finished};
}

void HeldMotion::write(const Wrench& wrench_o) noexcept {
    queue_[static_cast<std::size_t>(tick_)] = wrench_o;
    tick_ = (tick_ + 1) % static_cast<int>(queue_.size());
}

std::unique_ptr<Device> makeHand(const DeviceContext& context) {
    std::array<double, 4> values{0.1, 500, 14, 0};
    std::string_view rest = context.file;
    for (double& value : values) {
        if (rest.empty()) break;
        const std::string_view field = rest.substr(0, rest.find(','));
        const auto number = readNumber(field, 0, 1e9);
        if (!number)
            throw std::runtime_error(
                "'" + std::string(field) +
                "' is not a number from 0 to 1e9: write --device hand:MASS,SPRING,DAMPING,DELAY[,MOTION] in kg, "
                "N/m, N·s/m and ticks");
        value = *number;
        rest.remove_prefix(std::min(rest.size(), field.size() + 1));
    }
    const auto [mass, spring, damping, delay] = values;
    if (!(mass > 0 && mass < 1e3 && spring > 0 && delay <= HeldMotion::kMaxDelay && delay == std::floor(delay)))
        throw std::runtime_error(
            "a hand needs mass and spring above 0, damping of 0 or more, and a whole number of ticks of delay up to " +
            std::to_string(HeldMotion::kMaxDelay));
    return std::make_unique<HeldMotion>(chosenMotion(context, std::string(rest)),
                                        HandParameters::fromTranslation(mass, spring / 1000, damping),
                                        static_cast<int>(delay));
}

}  // namespace touchstone
