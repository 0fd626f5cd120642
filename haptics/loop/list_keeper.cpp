#include "haptics/loop/list_keeper.hpp"

#include <algorithm>
#include <chrono>

#include "haptics/loop/rt_thread.hpp"

namespace touchstone {
namespace {

constexpr double kLeadMs = 1.5;   // how far ahead it finds: about as long as finding takes in a tight fit
constexpr double kReach = 3;      // ms of travel, beyond the margin
constexpr double kMostReach = 4;  // the same in slacks
constexpr double kRenew = 0.4;    // of the slack travelled: time for new entries
constexpr auto kRest = std::chrono::microseconds(100);  // between looks at the mailbox: a tick must not have to wake it

}  // namespace

ListKeeper::ListKeeper(const World& world) {
    for (const Obstacle& obstacle : world.obstacles) {
        parts_.push_back(std::make_unique<Part>(*world.tool, obstacle));
        newest_.push_back(&parts_.back()->entries.get());
    }
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

ListKeeper::~ListKeeper() = default;

std::span<const PairEntries* const> ListKeeper::newest() noexcept {
    for (std::size_t k = 0; k < parts_.size(); ++k)
        if (parts_[k]->entries.update()) newest_[k] = &parts_[k]->entries.get();
    return newest_;
}

void ListKeeper::run(const std::stop_token& stop) {
    double spent = threadCpuMicroseconds();
    while (!stop.stop_requested()) {
        if (!requests_.update() || requests_.get().margin < 0) {
            std::this_thread::sleep_for(kRest);
            continue;
        }
        serve(requests_.get());
        const double now = threadCpuMicroseconds();
        cpuUs_.fetch_add(now - spent, std::memory_order_relaxed);
        spent = now;
    }
}

void ListKeeper::serve(const Request& r) {
    const double ahead = kLeadMs / r.tickMs;  // ticks
    for (const auto& part : parts_) {
        const Vec3 way = r.X_WT.p - r.X_WT_before.p, turn = logRotation(r.X_WT.q * r.X_WT_before.q.conjugate());
        const Pose X_WT{r.X_WT.p + ahead * way, (expRotation(ahead * turn) * r.X_WT.q).normalized()};
        const Pose X_OT = part->X_OW * X_WT;
        const double speed = travel(r.X_WT_before, r.X_WT, part->center, part->reach) / r.tickMs;  // mm/ms
        const double slack = std::clamp(kReach * speed, r.slack, kMostReach * r.slack), margin = r.margin + slack;
        const double left = part->margin - travel(part->X_OT, X_OT, part->center, part->reach);
        if (part->margin >= 0 && left >= margin - kRenew * slack) continue;
        PairEntries& entries = part->entries.back();
        if (!part->finder.find(X_OT, margin, entries)) continue;  // too deep: the tick sees to it
        part->entries.publish();
        part->X_OT = X_OT;
        part->margin = margin;
    }
}

}  // namespace touchstone
