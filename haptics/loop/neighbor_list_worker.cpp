#include "haptics/loop/neighbor_list_worker.hpp"

#include <algorithm>
#include <chrono>

#include "haptics/threads/rt_thread.hpp"

namespace touchstone {
namespace {

constexpr double kLeadMs = 2, kLead = 2;  // of the course is left when it finds anew, and as much more as finding took
constexpr double kUseMs = 2;              // is how long a course serves beside,
constexpr double kLongest = 2.5;          // mm, at most
constexpr double kRenew = 0.4;            // of the slack is spent when it finds anew, too
constexpr double kResting = 0.02;         // of the slack a tick is rest
constexpr double kStraight = 0.25;        // of the slack may the tool be off the way through where it was
constexpr double kRest = 0.8, kLeastRestMs = 0.1;  // between looks at the mailbox, in ticks: none has to wake it

}  // namespace

NeighborListWorker::NeighborListWorker(const World& world)
    : X_OT_(world.obstacles.size()), messages_({.asked = {}, .X_OT = X_OT_, .X_OT_before = X_OT_}) {
    for (const Obstacle& obstacle : world.obstacles) {
        parts_.push_back(std::make_unique<Part>(*world.tool, obstacle));
        newest_.push_back(&parts_.back()->entries.get());
        X_OT_[parts_.size() - 1] = obstacle.X_WO.inverse() * world.X_WT_start;
    }
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

NeighborListWorker::~NeighborListWorker() = default;

std::span<const PairEntries* const> NeighborListWorker::newest() noexcept {
    for (std::size_t k = 0; k < parts_.size(); ++k)
        if (parts_[k]->entries.update()) newest_[k] = &parts_[k]->entries.get();
    return newest_;
}

void NeighborListWorker::request(const Request& request, const Pose& X_WT, std::span<const Pose> X_WO) noexcept {
    Message& message = messages_.back();
    message.asked = request;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
        message.X_OT_before[k] = X_OT_[k];
        message.X_OT[k] = X_OT_[k] = X_WO[k].inverse() * X_WT;
    }
    messages_.publish();
}

void NeighborListWorker::run(const std::stop_token& stop) {
    double spent = threadCpuMicroseconds();
    while (!stop.stop_requested()) {
        if (!messages_.update() || messages_.get().asked.within.margin < 0) {
            const double ms = std::max(kRest * messages_.get().asked.tickMs, kLeastRestMs);
            std::this_thread::sleep_for(std::chrono::duration<double, std::milli>(ms));
            continue;
        }
        serve(messages_.get());
        const double now = threadCpuMicroseconds();
        cpuUs_.fetch_add(now - spent, std::memory_order_relaxed);
        spent = now;
    }
}

void NeighborListWorker::serve(const Message& message) {
    const Request& r = message.asked;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
        Part* const part = parts_[k].get();
        const Pose& X_OT = message.X_OT[k];
        const Vec3& center = part->extent.center;
        Course tick = Course::between(message.X_OT_before[k], X_OT, center);
        tick.X_OT = X_OT;
        const double fastest = kLongest / std::max(part->extent.length(tick), 1e-9);  // ticks
        const Course string = Course::between(part->behind, X_OT, center);
        const double length = part->extent.length(string);
        if (length > r.slack) part->behind = string.times(1 - r.slack / length).end(center);
        // What fits tightly goes back and forth: from where it came, if all lies on one way.
        const auto along = [&](double ms) {
            const Course ahead = tick.times(std::min(ms / r.tickMs, fastest));
            const Course way = Course::between(part->behind, ahead.end(center), center);
            return deviation(way, X_OT, part->extent) <= kStraight * r.slack ? way : ahead;
        };
        const double leadMs = kLeadMs + kLead * part->findMs;
        const Course next = along(leadMs + kUseMs);
        // Where it rests, the course that brought it there is too long: most of its entries are in vain.
        const bool tooLong = part->extent.length(tick) < kResting * r.slack &&
                             part->extent.length(part->published.course) > part->extent.length(next) + r.slack;
        const double left = part->finder.reserve(part->published, {along(leadMs), r.within});
        if (!tooLong && left >= (1 - kRenew) * r.slack) continue;
        PairEntries& entries = part->entries.back();
        // Steps may get as long as they may be.
        Within within = r.within;
        within.curve = std::max(within.curve, r.trust * r.trust / 2);
        within.most = std::max(within.most, r.trust);
        const Coverage asked{next, within.wider(r.slack)};
        const double began = threadCpuMicroseconds();
        if (!part->finder.find(asked, entries)) continue;  // too deep: the tick sees to it
        part->findMs = 1e-3 * (threadCpuMicroseconds() - began);
        part->entries.publish();
        part->published = asked;
    }
}

}  // namespace touchstone
