#include "haptics/system/tick_history.hpp"

#include <algorithm>

namespace touchstone::system {

TickHistory::TickHistory(std::size_t capacity) : capacity_(capacity) {
    for (auto& series : series_) series.resize(capacity);
}

void TickHistory::push(const TickRecord& record) {
    const auto put = [&](Channel channel, double value) {
        series_[static_cast<std::size_t>(channel)][next_] = static_cast<float>(value);
    };
    put(Channel::CollisionUs, record.collisionUs);
    put(Channel::SolveUs, record.solveUs);
    put(Channel::ShadowUs, record.shadowUs);
    put(Channel::TotalUs, record.totalUs);
    put(Channel::Pairs, record.pairs);
    put(Channel::Rows, record.rows);
    put(Channel::Force, record.wrench_C.force.norm());
    put(Channel::ForceOut, record.wrench_out.force.norm());
    put(Channel::Torque, record.wrench_C.torque.norm());
    put(Channel::ShadowForceError, record.shadowForceError);
    put(Channel::ShadowTorqueError, record.shadowTorqueError);
    put(Channel::Separation, (record.X_WT.p - record.X_WT_device.p).norm());
    put(Channel::Penetration, record.penetration);
    put(Channel::Hover, record.hover);
    next_ = (next_ + 1) % capacity_;
    count_ = std::min(count_ + 1, capacity_);
}

engine::RingView TickHistory::view(Channel channel) const {
    return {series_[static_cast<std::size_t>(channel)].data(), capacity_, next_, count_};
}

}  // namespace touchstone::system
