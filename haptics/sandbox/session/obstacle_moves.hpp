#pragma once
// Obstacles that are moved while the loop runs.
#include <vector>

#include "haptics/loop/haptic_loop.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/session/message_log.hpp"

namespace touchstone::sandbox {

/// Tells the loop where the scene has its obstacles, the scene where they are, and the user when one cannot go on.
class ObstacleMoves {
  public:
    /// For a loop that was just told to open a world.
    void reset() { targets_.clear(); }
    /// To be called with every tick.
    void count(const TickRecord& tick) { heldTicks_ = tick.flags & kObstacleHeld ? heldTicks_ + 1 : 0; }
    /// To be called once a frame, after the loop's snapshot was taken. Pre: the loop ticks the scene's world.
    void update(HapticScene& scene, const Settings& settings, HapticLoop& loop, MessageLog& log);

  private:
    std::vector<Pose> targets_;  ///< X_WO that the loop was told; empty: none yet
    int heldTicks_ = 0;          ///< in a row, in which an obstacle could not go on
    bool saidHeld_ = false, saidNothingHolds_ = false;
};

}  // namespace touchstone::sandbox
