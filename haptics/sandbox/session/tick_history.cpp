#include "haptics/sandbox/session/tick_history.hpp"

#include <algorithm>
#include <sstream>

#include "haptics/files/output_file.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/record/tick_fields.hpp"

namespace touchstone::sandbox {
namespace {

/// The field of record/tick_fields that a channel plots.
struct ChannelField {
    Channel channel;
    const char* field;
};
constexpr std::array<ChannelField, kChannelCount> kChannels{{
    {Channel::TotalUs, "total_us"},
    {Channel::CollisionUs, "collision_us"},
    {Channel::SolveUs, "solve_us"},
    {Channel::ShadowUs, "shadow_us"},
    {Channel::PeriodUs, "period_us"},
    {Channel::Late, "late_before"},
    {Channel::Pairs, "pairs"},
    {Channel::Rows, "rows"},
    {Channel::Iterations, "iterations"},
    {Channel::ShadowIterations, "shadow_iterations"},
    {Channel::ResidualGap, "kkt_primal_mm"},
    {Channel::ResidualForce, "kkt_stationarity_N"},
    {Channel::Force, "force_N"},
    {Channel::ForceOut, "force_out_N"},
    {Channel::Torque, "torque_mNm"},
    {Channel::ShadowForceError, "shadow_force_error_N"},
    {Channel::ShadowTorqueError, "shadow_torque_error_mNm"},
    {Channel::Separation, "separation_mm"},
    {Channel::Penetration, "penetration_listed_mm"},
    {Channel::Hover, "hover_mm"},
    {Channel::Sticking, "sticking"},
    {Channel::Sliding, "sliding"},
    {Channel::FrictionForce, "friction_N"},
    {Channel::Slip, "slip_mm"},
    {Channel::ConeViolation, "coulomb_cone_N"},
    {Channel::Complementarity, "coulomb_complementarity_mJ"},
}};
static_assert([] {
    for (std::size_t i = 0; i < kChannelCount; ++i)
        if (static_cast<std::size_t>(kChannels[i].channel) != i) return false;
    return true;
}());

/// In the order of Channel.
const std::vector<NumericField>& channelFields() {
    static const std::vector<NumericField> fields = [] {
        std::vector<NumericField> found;
        for (const ChannelField& channel : kChannels) found.emplace_back(channel.field);
        return found;
    }();
    return fields;
}

std::vector<float> copyOf(const engine::RingView& view, engine::Stretch stretch) {
    std::vector<float> values;
    for (const auto piece : engine::samplesIn(view, stretch)) values.insert(values.end(), piece.begin(), piece.end());
    return values;
}

}  // namespace

TickHistory::TickHistory(std::size_t capacity) : capacity_(capacity), ticks_(capacity) {
    for (auto& series : series_) series.resize(capacity);
}

void TickHistory::push(const TickRecord& record) {
    before_.record = count_ > 0 ? newest_.record : record;
    newest_.record = record;
    for (std::size_t i = 0; i < kChannelCount; ++i)
        series_[i][next_] = static_cast<float>(channelFields()[i].of({newest_, before_}));
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
    const auto meanOf = [&](Channel channel) {
        return static_cast<float>(mean(copyOf(history.view(channel), stretch)));
    };
    times.collision = meanOf(Channel::CollisionUs);
    times.solve = meanOf(Channel::SolveUs);
    times.shadow = meanOf(Channel::ShadowUs);
    times.total = meanOf(Channel::TotalUs);
    for (const auto piece : engine::samplesIn(history.view(Channel::Late), stretch))
        times.late +=
            static_cast<std::size_t>(std::count_if(piece.begin(), piece.end(), [](float v) { return v > 0; }));
    times.p50 = *percentile(total, 50);
    times.p99 = *percentile(total, 99);
    times.most = *std::max_element(total.begin(), total.end());
    std::vector<float> period = copyOf(history.view(Channel::PeriodUs), stretch);
    times.periodP99 = *percentile(period, 99);
    times.periodMost = *std::max_element(period.begin(), period.end());
    return times;
}

void writeTicks(const TickHistory& history, engine::Stretch stretch, const std::filesystem::path& file) {
    std::ostringstream out;
    out << "tick";
    for (const NumericField& field : channelFields()) out << ',' << field.name();
    out << '\n';
    const std::size_t end = history.size() - std::min(stretch.skip, history.size());
    for (std::size_t i = end - std::min(stretch.window, end); i < end; ++i) {
        out << history.tick(i);
        for (const ChannelField& channel : kChannels) out << ',' << history.view(channel.channel)[i];
        out << '\n';
    }
    writeFile(file, "the ticks", out.view());
}

}  // namespace touchstone::sandbox
