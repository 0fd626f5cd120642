#pragma once
// Parts that people assemble, each with a motion that succeeds and one that shows a typical failure.
#include "engine/scene/scene.hpp"

namespace touchstone::app {

struct SceneOptions;

/// A cap is pressed on its holder's rim, turned until the lugs drop in, turned to the stop, drawn up, and pulled and
/// twisted without coming loose. `not-turned`: the cap is inserted and pulled, and comes out.
engine::Scene makeBayonet(const SceneOptions& options);

/// A gear finds its post, lands on the fixed gear's teeth, is turned until it drops into mesh, and then cannot be
/// turned. `lifted`: above the fixed gear it turns freely.
engine::Scene makeGears(const SceneOptions& options);

/// A hook slips under the rim of a ring and hangs in it under load. `missed`: beside the ring it carries no load.
engine::Scene makeHook(const SceneOptions& options);

/// A key finds its keyhole, cannot be turned halfway in, is fully inserted, turned, and pulled without coming out.
/// `not-home`: inserted short of the stop by the width of the ward, it does not turn.
engine::Scene makeLock(const SceneOptions& options);

}  // namespace touchstone::app
