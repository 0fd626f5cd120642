#pragma once
// The outcome that a scene expects of its demonstration, and the check whether a run meets it.
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "haptics/loop/step.hpp"
#include "haptics/sandbox/scene/roles.hpp"

namespace touchstone::sandbox {

/// The tool counts as in contact above this force, N.
inline constexpr double kContactForce = 0.02;

/// A contact that carries force counts as hovering if its gap is larger than this, mm.
inline constexpr double kHover = 0.01;
/// Length of the period at the end of a run over which noise is judged, ms.
inline constexpr double kHoldMs = 500;

/// A key of extras.touchstone.outcome, for docs and messages.
struct OutcomeKey {
    std::string_view key, unit;
    std::string_view what;  ///< one line
};
std::span<const OutcomeKey> outcomeTable();

struct OutcomeCheck {
    std::string name;  ///< the key, with a suffix if the key makes several checks
    double limit = 0, value = 0;
    bool met = false;
};

/// The expected outcome of a scene. Each limit applies either in every tick or at the end of the demonstration.
struct ExpectedOutcome {
    struct Limit {
        int row = 0;  ///< of outcomeTable()
        double value = 0;
    };
    std::vector<Limit> limits;
    std::optional<GoalRegion> seated;    ///< goal region that the tool must hold at the end
    std::optional<GoalRegion> reached;   ///< goal region that the tool must hold at some time
    std::optional<Gauge> gauge;          ///< whose readings the depth limits apply to
    std::optional<Vec3> boxMin, boxMax;  ///< box that the tool node's origin must not leave, scene frame, mm
    std::optional<Vec3> finalPosition;   ///< position of the tool node's origin at the end, scene frame, mm
    double finalTolerance = 0.1;         ///< mm

    bool empty() const { return limits.empty() && !seated && !reached && !boxMin && !finalPosition; }
};

/// Reads roles.outcome. Unknown keys become warnings; a wrong type or a missing goal is an engine::SceneError naming
/// file, node and key.
ExpectedOutcome readOutcome(const engine::Scene& scene, const SceneRoles& roles, std::vector<std::string>& warnings);
/// The same from extras.touchstone.outcome of an animation, which replaces roles.outcome; nothing if the animation has
/// none.
std::optional<ExpectedOutcome> readOutcome(const engine::Scene& scene, std::size_t animation, const SceneRoles& roles,
                                           std::vector<std::string>& warnings);

/// Watches a run tick by tick.
class OutcomeJudge {
  public:
    explicit OutcomeJudge(ExpectedOutcome expected) : expected_(std::move(expected)) {}
    /// `penetration`: of the true gaps, mm; `dt`: length of the tick, ms.
    void add(const TickRecord& record, double penetration, double dt);
    /// `ended`: the motion ran to its end; if it did not, only the limits for every tick are checked.
    std::vector<OutcomeCheck> checks(bool ended) const;

    /// Greatest or last values so far.
    struct Seen {
        double penetration = 0, hover = 0, force = 0, torque = 0, forceChange = 0;
        double infeasible = 0, badInput = 0, contact = 0, ticks = 0;
        double finalLag = 0, heldMs = 0, longestHeldMs = 0, outside = 0;
        GaugeReading depth;
        double hoverMs = 0, longestHoverMs = 0;
        double leastPenetration = INFINITY, penetrationGrowth = 0;
        std::vector<Wrench> recent;  ///< of the last kHoldMs: a ring buffer whose oldest entry is `oldest`
        std::size_t oldest = 0;
        Pose X_WT;
        Vec3 lastForce = Vec3::Zero();
    };

  private:
    ExpectedOutcome expected_;
    Seen seen_;
};

}  // namespace touchstone::sandbox
