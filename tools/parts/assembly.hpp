#pragma once
// Parts that people put together, each with the motion that does it and one that shows what would go wrong.
#include "engine/scene/scene.hpp"

namespace touchstone::app {

struct SceneOptions;

/// A cap is pressed on its holder's rim, turned until the lugs drop in, turned home, drawn up, and pulled and twisted
/// without coming loose. `not-turned`: put in and pulled, it comes out.
engine::Scene makeBayonet(const SceneOptions& options);

/// A gear finds its post, lands on the fixed gear's teeth, is turned until it drops into mesh, and cannot be turned.
/// `lifted`: above the fixed gear it turns freely.
engine::Scene makeGears(const SceneOptions& options);

/// A hook slips under the rim of a ring and hangs in it under load. `missed`: beside the ring it lifts nothing.
engine::Scene makeHook(const SceneOptions& options);

/// A key finds its keyhole, cannot be turned half way in, is pushed home, turned, and pulled without coming out.
/// `not-home`: short of home by the width of the ward, it does not turn.
engine::Scene makeLock(const SceneOptions& options);

}  // namespace touchstone::app
