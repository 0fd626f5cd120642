#pragma once
// Changes of the goal in the window, as edits.
#include <vector>

#include "engine/edit/scene_edit.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"

namespace touchstone::sandbox {

/// Tolerances of a goal that the window adds.
inline constexpr double kNewGoalMm = 1, kNewGoalRad = 0.1, kNewGoalHoldMs = 200;

/// The edits that make the tool pose X_WT the goal: the scene's goal moves there and keeps its tolerances; without one,
/// a node with the role goal is added below the obstacle that is nearest to the tool, so that it moves with that
/// obstacle; its depth is how far the tool reaches into the obstacle along the tool's +y, if that is more than
/// kNewGoalMm. An obstacle on its way to its place in the scene takes the goal along. `geometry`: by what the parts are
/// measured. Pre: the scene has a world.
std::vector<engine::SceneEdit> goalHere(const HapticScene& scene, const Pose& X_WT, Geometry geometry);

/// The edit that gives the scene's goal the tolerances, hold time and depth of `goal`. Pre: the scene has a goal.
engine::SceneEdit goalWith(const HapticScene& scene, const GoalRegion& goal);

}  // namespace touchstone::sandbox
