#pragma once
// Obstacles that are moved while the loop runs.
#include <vector>

#include "haptics/loop/haptic_loop.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/session/message_log.hpp"

namespace touchstone::sandbox {

/// Sends the obstacle poses of the scene to the loop, writes their actual poses back, and reports one that is blocked.
class ObstacleMoves {
  public:
    /// Call after the loop was told to open a world.
    void reset() { targets_.clear(); }
    /// Call with every tick.
    void count(const TickRecord& tick) { heldTicks_ = tick.flags & kObstacleHeld ? heldTicks_ + 1 : 0; }
    /// Call once a frame, after taking the loop's snapshot. Pre: the loop ticks the scene's world.
    void update(HapticScene& scene, const Settings& settings, HapticLoop& loop, MessageLog& log);

  private:
    std::vector<Pose> targets_;  ///< X_WO last sent to the loop; empty: none
    int heldTicks_ = 0;          ///< consecutive ticks in which an obstacle was blocked
    bool saidHeld_ = false, saidNothingHolds_ = false;
};

}  // namespace touchstone::sandbox
