#pragma once
// Motions that are difficult for a haptic tick, each with its required outcome. Their names begin with hard-NN, the
// number of the case.
#include <nlohmann/json.hpp>

#include "engine/scene/scene.hpp"
#include "haptics/collision/sphere_tree.hpp"
#include "tools/parts/scenes.hpp"

namespace touchstone::app {

inline constexpr double kTouch = 0.001;  ///< mm: a penetration up to this counts as none

/// The required outcome of a sliding contact, and of one that snaps or spins faster than the tool may follow.
nlohmann::json slides();
nlohmann::json snaps();

/// Cases 1, 2, 3, 5, 6, 7, 8, 11, 13 and 14: two bodies with the same tree; the tool comes from +x and first touches at
/// x = `contact`, mm, in the pose of the meshes.
void addBunnyCases(engine::Scene& scene, engine::Entity tool, const SphereTree& tree, double contact);

/// Positions of the ball's center, mm: its start above the plate, how far below the plate it is driven, its smallest
/// allowed distance from the plate's middle, and its height at contact.
struct PlateHeights {
    double above, past, side, pressed;
};
/// Cases 4, 15 and 16: a ball over a 60 mm plate about the origin.
void addPlateCases(engine::Scene& scene, engine::Entity tool, const PlateHeights& y);

/// Case 10: a ball in four slots between pairs of walls.
engine::Scene makePinch(const SceneOptions& options);

}  // namespace touchstone::app
