#pragma once
// Whether the tool fits where it should go: the room that the meshes leave it, beside what the geometry of the tick
// needs.
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "haptics/sandbox/measure/background.hpp"
#include "haptics/sandbox/measure/goal_check.hpp"
#include "haptics/sandbox/measure/thread_lead.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// A clearance that the tool reaches by moving a little from a pose: the largest one, or one that is larger than at the
/// poses before.
struct FitRoom {
    double clearance = 0;      ///< mm on each side, at most fitRange(); negative: the parts overlap
    double asPlaced = 0;       ///< mm, at the pose itself, before the tool moved; negative: they overlap there
    Pose X_WT;                 ///< where the tool has that clearance
    Vec3 p_W = Vec3::Zero();   ///< where the parts are nearest there, mm
    std::size_t obstacle = 0;  ///< the nearest one
    double depth = 0;          ///< of the pose on the way, mm before the goal
};

/// How far the tool may move from a pose to have more room, mm; a turn of 1 rad counts as its reach. 1 mm, less for a
/// tool with a reach below 25 mm, and at the goal no more than its tolerance. Larger clearances are not measured.
double fitRange(const World& world);

struct FitCheck {
    std::vector<FitRoom> rooms;        ///< at the goal and on the way in, or along the demonstration
    std::optional<FitRoom> goal;       ///< nothing without a goal
    std::optional<FitRoom> least;      ///< nothing if all the rooms are fitRange()
    FreePlaces free;                   ///< beside a goal where the parts overlap
    std::optional<ThreadLead> thread;  ///< of a goal with a lead to which the tool fits, between meshes
    double error = 0;                  ///< mm that the geometry of the settings takes from the room
    bool spheres = false;              ///< the error is of sphere trees
    std::string verdict;               ///< completes "the tool ..." to a sentence
    std::string cause;                 ///< why it does not fit, as a clause; empty if it does
    std::vector<std::pair<std::string, std::string>> advice;  ///< settings to take instead, as setSetting() reads them
    bool fits() const { return !least || least->clearance > error; }
};

/// What a fit is checked of. Shares what it needs of a scene, so that another thread may check it.
struct FitQuestion {
    std::shared_ptr<const World> world;
    std::optional<GoalRegion> goal;
    std::shared_ptr<const Motion> demonstration;  ///< null if there is none; not used with a goal
    bool facets = true;                           ///< whether those of a thread are measured, which takes seconds
};
/// Throws std::runtime_error with one sentence if the scene has no world, its parts are not closed, or nothing says
/// where the tool should fit.
FitQuestion fitQuestion(const HapticScene& scene);

/// Measures the room between the meshes at the goal and at poses on the way to it (GoalRegion::way; otherwise straight
/// out, with the turns of a thread), or, without a goal, at the poses of the tool that a run of the demonstration
/// passes. Exact distances of the meshes; the best pose nearby is found by linearization with shrinking steps, so that
/// the clearance is a lower bound. Ends at the first pose where the parts overlap. Allocates; takes up to some seconds.
/// Nothing if `progress` ended it.
std::optional<FitCheck> checkFit(const FitQuestion& question, const Settings& settings,
                                 const MeasureProgress& progress = {});

/// One sentence about a tool that is pressed away from its goal: how far above it, with what force, how it is tilted,
/// beside the axis or turned, and, if it does not fit, why; empty if the tool is at the goal, is not pressed, or there
/// is no goal. With `why` it takes as long as checkFit().
std::string stuckSentence(const HapticScene& scene, const TickRecord& last, const Settings& settings, bool why = true);

/// Detects that a tool has been pressed away from its goal for 2 s and moved by less than 0.5 mm.
class StuckWatch {
  public:
    /// True once for each place where it is stuck. `ms`: any clock.
    bool add(const GoalRegion& goal, const TickRecord& record, double ms);

  private:
    Vec3 p_ = Vec3::Zero();
    double since_ = 0;
    bool told_ = false;
};

}  // namespace touchstone::sandbox
