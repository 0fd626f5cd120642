#include "haptics/loop/neighbor_list_worker.hpp"

#include <algorithm>
#include <chrono>

#include "haptics/math/tick_tuning.hpp"
#include "haptics/surface/feature_pair_finder.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone {

PairEntries NeighborListWorker::Part::memory() const {
    if (!leaves) return features->entries();
    PairEntries ofLeaves = leaves->entries();
    if (!features) return ofLeaves;
    PairEntries ofFeatures = features->entries();
    return ofLeaves.capacity > ofFeatures.capacity ? std::move(ofLeaves) : std::move(ofFeatures);
}

NeighborListWorker::NeighborListWorker(const World& world)
    : world_(world), X_OT_(world.obstacles.size()), messages_({.request = {}, .X_OT = X_OT_, .X_OT_before = X_OT_}) {
    for (const Obstacle& obstacle : world.obstacles) {
        parts_.push_back(std::make_unique<Part>(
            world.hasSpheres(parts_.size())
                ? std::make_unique<LeafPairFinder>(*world.tool.spheres, *obstacle.part.spheres, world.p_TC())
                : nullptr,
            world.hasMeshes(parts_.size())
                ? std::make_unique<FeaturePairFinder>(*world.tool.surface, *obstacle.part.surface)
                : nullptr));
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
    message.request = request;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
        message.X_OT_before[k] = X_OT_[k];
        message.X_OT[k] = X_OT_[k] = X_WO[k].inverse() * X_WT;
    }
    messages_.publish();
}

void NeighborListWorker::run(const std::stop_token& stop) {
    double spent = threadCpuMicroseconds();
    while (!stop.stop_requested()) {
        if (!messages_.update() || messages_.get().request.within.margin < 0) {
            const double ms = std::max(kPollTicks * messages_.get().request.tickMs, kMinPollMs);
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
    const Request& r = message.request;
    for (std::size_t k = 0; k < parts_.size(); ++k) {
        Part* const part = parts_[k].get();
        const Pose& X_OT = message.X_OT[k];
        PairFinder& finder = world_.byMeshes(k, r.geometry) ? *part->features : *part->leaves;
        const Extent& extent = finder.extent();
        const Vec3& center = extent.center;
        const bool sparse = finder.ofFeatures() && part->found < kSparse;
        const double slack = finder.slack(r.slack) * (sparse ? 2 : 1);
        StraightMotion tick = StraightMotion::between(message.X_OT_before[k], X_OT, center);
        tick.X_OT = X_OT;
        const double most = finder.ofFeatures() ? kMaxMeshSearch : kMaxSearch;
        const double maxTicks = most / std::max(extent.length(tick), 1e-9);
        const StraightMotion string = StraightMotion::between(part->trailing, X_OT, center);
        const double length = extent.length(string);
        if (length > slack) part->trailing = string.times(1 - slack / length).end(center);
        // A tool in a close fit moves back and forth. The motion searched begins at the trailing pose if all of it
        // lies on one straight path.
        const auto motionFor = [&](double ms) {
            const StraightMotion expected = tick.times(std::min(ms / r.tickMs, maxTicks));
            const StraightMotion whole = StraightMotion::between(part->trailing, expected.end(center), center);
            return deviation(whole, X_OT, extent) <= kStraight * slack ? whole : expected;
        };
        const double leadMs = kLeadMs + kLeadPerSearch * part->findMs;
        const StraightMotion next = motionFor(leadMs + kUseMs);
        // The motion that brought a resting tool here is too long, see kResting.
        const bool tooLong = extent.length(tick) < kResting * slack &&
                             extent.length(part->published.motion) > extent.length(next) + slack;
        const double left =
            part->publisher != &finder ? -1 : finder.reserve(part->published, {motionFor(leadMs), r.within});
        if (!tooLong && left >= (1 - kUsedSlack) * part->slack) continue;
        PairEntries& entries = part->entries.back();
        // The entries must serve steps as long as trust allows.
        Within within = r.within;
        within.curve = std::max(within.curve, r.trust * r.trust / 2);
        within.most = std::max(within.most, r.trust);
        const Coverage asked{next, within.wider(slack)};
        const double began = threadCpuMicroseconds();
        if (!finder.find(asked, entries)) continue;  // more pairs than memory: the tick searches itself
        part->findMs = 1e-3 * (threadCpuMicroseconds() - began);
        part->found = entries.count;
        part->slack = slack;
        part->entries.publish();
        part->published = asked;
        part->publisher = &finder;
    }
}

}  // namespace touchstone
