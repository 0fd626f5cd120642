#include "haptics/sandbox/session/obstacle_moves.hpp"

#include <algorithm>
#include <utility>

#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {

void ObstacleMoves::update(HapticScene& scene, const Settings& settings, HapticLoop& loop, MessageLog& log) {
    constexpr int kSayAfter = 20;  // ticks: an obstacle that gets there by shorter moves needs no message
    const std::vector<engine::Entity>& obstacles = scene.roles.obstacles;
    scene.X_WO = loop.snapshot().X_WO;

    std::vector<Pose> targets;
    for (const engine::Entity obstacle : obstacles)
        targets.push_back(toPose(engine::worldPose(scene.scene.registry, obstacle)));
    if (targets != targets_) {
        if (!targets_.empty() && settings.mode != Mode::Default && !std::exchange(saidNothingHolds_, true))
            log.say(Message::Kind::Warning, "In " + getSetting(settings, "mode") +
                                                " mode obstacles are not stopped by the tool and can be moved into it");
        loop.moveObstacles(targets_ = targets);
    }

    const auto [held, target] = std::mismatch(scene.X_WO.begin(), scene.X_WO.end(), targets_.begin(), targets_.end());
    if (held == scene.X_WO.end() || target == targets_.end()) {
        saidHeld_ = false;
    } else if (heldTicks_ >= kSayAfter && !std::exchange(saidHeld_, true)) {
        const engine::Entity obstacle = obstacles[static_cast<std::size_t>(held - scene.X_WO.begin())];
        log.say(Message::Kind::Warning,
                scene.scene.registry.get<engine::Name>(obstacle).value +
                    " is blocked because the tool cannot move out of its way: move the obstacle back, or the tool");
    }
}

}  // namespace touchstone::sandbox
