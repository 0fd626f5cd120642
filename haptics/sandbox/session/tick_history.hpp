#pragma once
// The last ticks as time series, for the plots and for a table.
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "engine/view/plots.hpp"
#include "haptics/loop/step.hpp"

namespace touchstone::sandbox {

enum class Channel {
    TotalUs,
    CollisionUs,
    SolveUs,
    ShadowUs,
    PeriodUs,  ///< by the clock, since the tick before began
    Late,      ///< 1 where the tick before ended after its deadline
    Pairs,
    Rows,
    Iterations,
    ShadowIterations,
    ResidualGap,        ///< deepest row that the answer violates, mm
    ResidualForce,      ///< what is missing to the balance of forces, N
    Force,              ///< |F| of the tick, N
    ForceOut,           ///< |F| behind the safety stage, N
    Torque,             ///< |T| about C, mN·m
    ShadowForceError,   ///< N
    ShadowTorqueError,  ///< mN·m
    Separation,         ///< of graphic tool and device at the tool node's origin, mm
    Penetration,        ///< mm
    Hover,              ///< mm
};
inline constexpr std::size_t kChannelCount = 20;

/// A channel in a table: name with unit, and its value in a tick that came after another.
struct ChannelInfo {
    Channel channel;
    const char* column;
    double (*of)(const TickRecord& now, const TickRecord& before);
};
/// In the order of Channel.
std::span<const ChannelInfo, kChannelCount> channelTable();

/// Keeps the newest ticks of every channel in rings of one size, and the last two records whole.
class TickHistory {
  public:
    static constexpr std::size_t kCapacity = 1 << 15;  ///< 32 s at 1 kHz, 3 s at 10 kHz

    explicit TickHistory(std::size_t capacity = kCapacity);

    void push(const TickRecord& record);
    void clear();
    std::size_t size() const { return count_; }
    /// Ticks pushed since the beginning, those that clear() forgot included.
    std::uint64_t pushed() const { return pushed_; }
    /// Oldest first; valid until the next push().
    engine::RingView view(Channel channel) const;
    /// Number of the i-th tick kept, oldest first.
    std::uint64_t tick(std::size_t i) const { return ticks_[(next_ + capacity_ - count_ + i) % capacity_]; }

    /// The newest tick and the one before it, if nothing came between: null where there are no such two.
    const TickRecord* newest() const { return consecutive() ? &newest_ : nullptr; }
    const TickRecord* before() const { return consecutive() ? &before_ : nullptr; }

  private:
    bool consecutive() const { return count_ > 1 && newest_.tick == before_.tick + 1; }

    std::size_t capacity_, next_ = 0, count_ = 0;
    std::uint64_t pushed_ = 0;
    std::array<std::vector<float>, kChannelCount> series_;
    std::vector<std::uint64_t> ticks_;
    TickRecord newest_, before_;
};

/// What a stretch of ticks took.
struct StretchTimes {
    std::size_t ticks = 0, late = 0;                        ///< late: ended after their deadline
    float p50 = 0, p99 = 0, most = 0;                       ///< of the tick, shadow included, µs of processor time
    float periodP99 = 0, periodMost = 0;                    ///< from tick to tick by the clock, µs
    float collision = 0, solve = 0, shadow = 0, total = 0;  ///< means, µs
};
/// Nearest rank, as in the reports. Copies the stretch: a fraction of a millisecond for 32,768 ticks.
StretchTimes stretchTimes(const TickHistory& history, engine::Stretch stretch);

/// A stretch as CSV, a tick a line, oldest first, units in the names of the columns. Throws std::runtime_error with one
/// sentence when the file cannot be written.
void writeTicks(const TickHistory& history, engine::Stretch stretch, const std::filesystem::path& file);

}  // namespace touchstone::sandbox
