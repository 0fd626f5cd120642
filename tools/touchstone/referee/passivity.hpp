#pragma once
// Stiffness that stays passive with a simulated hand, against the rate of the ticks.
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "haptics/loop/step.hpp"

namespace touchstone::app {

/// A hand (HandParameters: mass, spring and damper) presses the tool 4 mm into a part along -y and rests. The force of
/// a tick holds until the next; the hand moves continuously in between. Returns for each rate `rate_Hz`, and the
/// greatest stiffness within the range of the setting with which the hand is at rest at the end, after 1 s:
/// `rests_N_per_mm`, and with which it also never gets back more energy than it gave: `passive_N_per_mm`. The device
/// itself has no damping, and the safety stage has no part in it. Pre: a world whose tool is above a part.
std::vector<nlohmann::ordered_json> greatestStiffness(const World& world, Settings settings,
                                                      std::span<const int> rates);

}  // namespace touchstone::app
