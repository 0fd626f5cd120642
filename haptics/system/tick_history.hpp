#pragma once
// The last ticks as time series for the plots.
#include <array>
#include <cstddef>
#include <vector>

#include "engine/view/plots.hpp"
#include "haptics/loop/step.hpp"

namespace touchstone::system {

enum class Channel {
    CollisionUs,
    SolveUs,
    ShadowUs,
    TotalUs,
    Pairs,
    Rows,
    Force,              ///< |F| of the tick, N
    ForceOut,           ///< |F| behind the safety stage, N
    Torque,             ///< |T| about C, mN·m
    ShadowForceError,   ///< N
    ShadowTorqueError,  ///< mN·m
    Separation,         ///< of graphic tool and device at the tool node's origin, mm
    Penetration,        ///< mm
    Hover,              ///< mm
};
inline constexpr std::size_t kChannelCount = 14;

/// Keeps the newest ticks of every channel in rings of one size.
class TickHistory {
  public:
    static constexpr std::size_t kCapacity = 1 << 15;  ///< 32 s at 1 kHz, 3 s at 10 kHz

    explicit TickHistory(std::size_t capacity = kCapacity);

    void push(const TickRecord& record);
    void clear() { next_ = count_ = 0; }
    std::size_t size() const { return count_; }
    /// Oldest first; valid until the next push().
    engine::RingView view(Channel channel) const;

  private:
    std::size_t capacity_, next_ = 0, count_ = 0;
    std::array<std::vector<float>, kChannelCount> series_;
};

}  // namespace touchstone::system
