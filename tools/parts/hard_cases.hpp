#pragma once
// Motions that a haptic tick fails at, each with the outcome that is asked of it. Their names begin with hard-NN, the
// number of the case.
#include <nlohmann/json.hpp>

#include "engine/scene/scene.hpp"
#include "haptics/collision/sphere_tree.hpp"
#include "tools/parts/scenes.hpp"

namespace touchstone::app {

inline constexpr double kTouch = 0.001;  ///< mm: what counts as not entering

/// What is asked of every contact that slides, and of one that snaps or spins faster than the tool may follow.
nlohmann::json slides();
nlohmann::json snaps();

/// Cases 1, 2, 3, 5, 6, 7, 8, 11, 13 and 14: two bodies of the same tree, the tool coming from +x and first touching at
/// x = `contact`, mm, in the pose of the meshes.
void addBunnyCases(engine::Scene& scene, engine::Entity tool, const SphereTree& tree, double contact);

/// Of the ball's centre, mm: where it starts above the plate, how far below it is driven, how near it may come to the
/// plate's middle, and where it touches.
struct PlateHeights {
    double above, past, side, pressed;
};
/// Cases 4, 15 and 16: a ball over a 60 mm plate about the origin.
void addPlateCases(engine::Scene& scene, engine::Entity tool, const PlateHeights& y);

/// Case 10: a ball in four slots between pairs of walls.
engine::Scene makePinch(const SceneOptions& options);

}  // namespace touchstone::app
