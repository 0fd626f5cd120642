#pragma once
// The most recent ticks as time series, for the plots and their CSV export.
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "engine/view/plots.hpp"
#include "haptics/loop/step.hpp"

namespace touchstone::sandbox {

/// What the plots draw; the fields of record/tick_fields that they show are listed in the .cpp.
enum class Channel {
    TotalUs,
    CollisionUs,
    SolveUs,
    ShadowUs,
    PeriodUs,  ///< wall time since the previous tick began
    Late,      ///< 1 if the previous tick was late
    Pairs,
    Rows,
    Iterations,
    ShadowIterations,
    ResidualGap,        ///< greatest constraint violation, mm
    ResidualForce,      ///< stationarity residual: imbalance of forces, N
    Force,              ///< |F| that the tick computed, N
    ForceOut,           ///< |F| that the safety stage sent to the device, N
    Torque,             ///< |T| about C, mN·m
    ShadowForceError,   ///< N
    ShadowTorqueError,  ///< mN·m
    Separation,         ///< distance from tool pose to device pose at the tool node's origin, mm
    Penetration,        ///< deepest overlap of the listed pairs, mm
    Hover,              ///< greatest true gap over loaded contacts, mm
    Sticking,           ///< contacts with friction that stick
    Sliding,            ///< contacts with friction that slide
    FrictionForce,      ///< |sum of all friction forces|, N
    Slip,               ///< greatest slip of a loaded contact in the tick, mm
    ConeViolation,      ///< of Coulomb's law, N
    Complementarity,    ///< force under a gap, mJ
};
inline constexpr std::size_t kChannelCount = 26;

/// Keeps every channel of the newest ticks in ring buffers, and the last two records in full.
class TickHistory {
  public:
    static constexpr std::size_t kCapacity = 1 << 15;  ///< 32 s at 1 kHz, 3 s at 10 kHz

    explicit TickHistory(std::size_t capacity = kCapacity);

    void push(const TickRecord& record);
    void clear();
    std::size_t size() const { return count_; }
    /// Ticks pushed since construction, including those that clear() removed.
    std::uint64_t pushed() const { return pushed_; }
    /// Oldest first; valid until the next push().
    engine::RingView view(Channel channel) const;
    /// Number of the i-th tick in the buffers, oldest first.
    std::uint64_t tick(std::size_t i) const { return ticks_[(next_ + capacity_ - count_ + i) % capacity_]; }

    /// The newest tick and the one before it; null unless their numbers are consecutive.
    const TickRecord* newest() const { return consecutive() ? &newest_.record : nullptr; }
    const TickRecord* before() const { return consecutive() ? &before_.record : nullptr; }

  private:
    bool consecutive() const { return count_ > 1 && newest_.record.tick == before_.record.tick + 1; }

    std::size_t capacity_, next_ = 0, count_ = 0;
    std::uint64_t pushed_ = 0;
    std::array<std::vector<float>, kChannelCount> series_;
    std::vector<std::uint64_t> ticks_;
    RecordedTick newest_, before_;  // without their inputs, which no channel shows
};

/// Times of a stretch of ticks.
struct StretchTimes {
    std::size_t ticks = 0, late = 0;                        ///< late: ended after the deadline
    float p50 = 0, p99 = 0, most = 0;                       ///< CPU time of the tick, shadow included, µs
    float periodP99 = 0, periodMost = 0;                    ///< tick period, wall time, µs
    float collision = 0, solve = 0, shadow = 0, total = 0;  ///< means, µs
};
/// Percentiles are by nearest rank, as in the reports. Copies the stretch: a fraction of a millisecond for 32,768
/// ticks.
StretchTimes stretchTimes(const TickHistory& history, engine::Stretch stretch);

/// Writes a stretch as CSV, one line for each tick, oldest first; columns have the names of record/tick_fields. Throws
/// std::runtime_error with one sentence when the file cannot be written.
void writeTicks(const TickHistory& history, engine::Stretch stretch, const std::filesystem::path& file);

}  // namespace touchstone::sandbox
