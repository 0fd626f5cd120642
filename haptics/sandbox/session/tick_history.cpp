#include "haptics/sandbox/session/tick_history.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "haptics/files/output_file.hpp"

namespace touchstone::sandbox {
namespace {

using Record = const TickRecord&;

constexpr std::array<ChannelInfo, kChannelCount> kChannels{{
    {Channel::TotalUs, "total_us", [](Record r, Record) { return r.totalUs; }},
    {Channel::CollisionUs, "collision_us", [](Record r, Record) { return r.collisionUs; }},
    {Channel::SolveUs, "solve_us", [](Record r, Record) { return r.solveUs; }},
    {Channel::ShadowUs, "shadow_us", [](Record r, Record) { return r.shadowUs; }},
    {Channel::PeriodUs, "period_us", [](Record r, Record) { return r.periodUs; }},
    {Channel::Late, "late_before", [](Record r, Record b) { return double(r.overruns > b.overruns); }},
    {Channel::Pairs, "pairs", [](Record r, Record) { return double(r.pairs); }},
    {Channel::Rows, "rows", [](Record r, Record) { return double(r.rows); }},
    {Channel::Iterations, "iterations", [](Record r, Record) { return double(r.iterations); }},
    {Channel::ShadowIterations, "shadow_iterations", [](Record r, Record) { return double(r.shadowIterations); }},
    {Channel::ResidualGap, "kkt_primal_mm", [](Record r, Record) { return r.kkt.primal_mm; }},
    {Channel::ResidualForce, "kkt_stationarity_N", [](Record r, Record) { return r.kkt.stationarity_N; }},
    {Channel::Force, "force_N", [](Record r, Record) { return r.wrench_C.force.norm(); }},
    {Channel::ForceOut, "force_out_N", [](Record r, Record) { return r.wrench_out.force.norm(); }},
    {Channel::Torque, "torque_mNm", [](Record r, Record) { return r.wrench_C.torque.norm(); }},
    {Channel::ShadowForceError, "shadow_force_error_N", [](Record r, Record) { return r.shadowForceError; }},
    {Channel::ShadowTorqueError, "shadow_torque_error_mNm", [](Record r, Record) { return r.shadowTorqueError; }},
    {Channel::Separation, "separation_mm", [](Record r, Record) { return (r.X_WT.p - r.X_WT_device.p).norm(); }},
    {Channel::Penetration, "penetration_mm", [](Record r, Record) { return r.penetration; }},
    {Channel::Hover, "hover_mm", [](Record r, Record) { return r.hover; }},
}};
static_assert([] {
    for (std::size_t i = 0; i < kChannelCount; ++i)
        if (static_cast<std::size_t>(kChannels[i].channel) != i) return false;
    return true;
}());

std::vector<float> copyOf(const engine::RingView& view, engine::Stretch stretch) {
    std::vector<float> values;
    for (const auto piece : engine::samplesIn(view, stretch)) values.insert(values.end(), piece.begin(), piece.end());
    return values;
}

/// Reorders `values`. Pre: there are some.
float percentileOf(std::vector<float>& values, double percent) {
    const auto rank = static_cast<std::ptrdiff_t>(std::ceil(percent / 100 * static_cast<double>(values.size()))) - 1;
    std::nth_element(values.begin(), values.begin() + rank, values.end());
    return values[static_cast<std::size_t>(rank)];
}

}  // namespace

std::span<const ChannelInfo, kChannelCount> channelTable() { return kChannels; }

TickHistory::TickHistory(std::size_t capacity) : capacity_(capacity), ticks_(capacity) {
    for (auto& series : series_) series.resize(capacity);
}

void TickHistory::push(const TickRecord& record) {
    before_ = count_ > 0 ? newest_ : record;
    newest_ = record;
    for (std::size_t i = 0; i < kChannelCount; ++i)
        series_[i][next_] = static_cast<float>(kChannels[i].of(newest_, before_));
    ticks_[next_] = record.tick;
    next_ = (next_ + 1) % capacity_;
    count_ = std::min(count_ + 1, capacity_);
    ++pushed_;
}

void TickHistory::clear() { next_ = count_ = 0; }

engine::RingView TickHistory::view(Channel channel) const {
    return {series_[static_cast<std::size_t>(channel)].data(), capacity_, next_, count_};
}

StretchTimes stretchTimes(const TickHistory& history, engine::Stretch stretch) {
    StretchTimes times;
    std::vector<float> total = copyOf(history.view(Channel::TotalUs), stretch);
    times.ticks = total.size();
    if (total.empty()) return times;
    const auto mean = [&](Channel channel) {
        double sum = 0;
        for (const auto piece : engine::samplesIn(history.view(channel), stretch))
            sum = std::accumulate(piece.begin(), piece.end(), sum);
        return static_cast<float>(sum / static_cast<double>(times.ticks));
    };
    times.collision = mean(Channel::CollisionUs);
    times.solve = mean(Channel::SolveUs);
    times.shadow = mean(Channel::ShadowUs);
    times.total = mean(Channel::TotalUs);
    for (const auto piece : engine::samplesIn(history.view(Channel::Late), stretch))
        times.late +=
            static_cast<std::size_t>(std::count_if(piece.begin(), piece.end(), [](float v) { return v > 0; }));
    times.p50 = percentileOf(total, 50);
    times.p99 = percentileOf(total, 99);
    times.most = *std::max_element(total.begin(), total.end());
    std::vector<float> period = copyOf(history.view(Channel::PeriodUs), stretch);
    times.periodP99 = percentileOf(period, 99);
    times.periodMost = *std::max_element(period.begin(), period.end());
    return times;
}

void writeTicks(const TickHistory& history, engine::Stretch stretch, const std::filesystem::path& file) {
    std::ostringstream out;
    out << "tick";
    for (const ChannelInfo& info : kChannels) out << ',' << info.column;
    out << '\n';
    const std::size_t end = history.size() - std::min(stretch.skip, history.size());
    for (std::size_t i = end - std::min(stretch.window, end); i < end; ++i) {
        out << history.tick(i);
        for (const ChannelInfo& info : kChannels) out << ',' << history.view(info.channel)[i];
        out << '\n';
    }
    writeFile(file, "the ticks", out.view());
}

}  // namespace touchstone::sandbox
