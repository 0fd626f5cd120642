#pragma once
// What a scene says should come out of its demonstration, and whether it did.
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "haptics/loop/step.hpp"
#include "haptics/sandbox/scene/roles.hpp"

namespace touchstone::sandbox {

/// Above this force the tool is said to be in contact, N.
inline constexpr double kContactForce = 0.02;

/// A contact that carries force stands off the surface if its gap is above this, mm.
inline constexpr double kHover = 0.01;
/// Noise is judged over this much of the end of a run, ms.
inline constexpr double kHoldMs = 500;

/// A key of extras.touchstone.outcome, for docs and messages.
struct OutcomeKey {
    std::string_view key, unit;
    std::string_view what;  ///< one sentence
};
std::span<const OutcomeKey> outcomeTable();

struct OutcomeCheck {
    std::string name;  ///< the key, with an ending where it makes several checks
    double limit = 0, value = 0;
    bool met = false;
};

/// The expected outcome of a scene. Limits hold at all times, or are judged when the demonstration has ended.
struct ExpectedOutcome {
    struct Limit {
        int row = 0;  ///< of outcomeTable()
        double value = 0;
    };
    std::vector<Limit> limits;
    std::optional<GoalRegion> seated;    ///< the goal region that has to be held at the end
    std::optional<GoalRegion> reached;   ///< the goal region that has to be held at some time
    std::optional<Gauge> gauge;          ///< that the limits on depth are of
    std::optional<Vec3> boxMin, boxMax;  ///< where the tool node's origin may be, scene frame, mm
    std::optional<Vec3> finalPosition;   ///< of the tool node's origin, scene frame, mm
    double finalTolerance = 0.1;         ///< mm

    bool empty() const { return limits.empty() && !seated && !reached && !boxMin && !finalPosition; }
};

/// Reads roles.outcome. Unknown keys become warnings; a wrong type or a missing goal is an engine::SceneError naming
/// file, node and key.
ExpectedOutcome readOutcome(const engine::Scene& scene, const SceneRoles& roles, std::vector<std::string>& warnings);
/// The same from extras.touchstone.outcome of an animation, which stands in place of roles.outcome; nothing without it.
std::optional<ExpectedOutcome> readOutcome(const engine::Scene& scene, std::size_t animation, const SceneRoles& roles,
                                           std::vector<std::string>& warnings);

/// Watches a run tick by tick.
class OutcomeJudge {
  public:
    explicit OutcomeJudge(ExpectedOutcome expected) : expected_(std::move(expected)) {}
    /// `penetration`: of the true gaps, mm; `dt`: length of the tick, ms.
    void add(const TickRecord& record, double penetration, double dt);
    /// `ended`: the motion ran to its end; if not, only what has to hold at all times is judged.
    std::vector<OutcomeCheck> checks(bool ended) const;

    /// Greatest or last values so far.
    struct Seen {
        double penetration = 0, hover = 0, force = 0, torque = 0, forceChange = 0;
        double infeasible = 0, badInput = 0, contact = 0, ticks = 0;
        double finalLag = 0, heldMs = 0, longestHeldMs = 0, outside = 0;
        GaugeReading depth;
        double hoverMs = 0, longestHoverMs = 0;
        double leastPenetration = INFINITY, penetrationGrowth = 0;
        std::vector<Wrench> lately;  ///< of the last kHoldMs, a ring whose oldest is `oldest`
        std::size_t oldest = 0;
        Pose X_WT;
        Vec3 lastForce = Vec3::Zero();
    };

  private:
    ExpectedOutcome expected_;
    Seen seen_;
};

}  // namespace touchstone::sandbox
