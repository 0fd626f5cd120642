#include "haptics/loop/world.hpp"

namespace touchstone {

bool World::hasSpheres() const {
    for (std::size_t k = 0; k < obstacles.size(); ++k)
        if (!hasSpheres(k)) return false;
    return true;
}

Friction World::friction(std::size_t obstacle, const Settings& settings) const {
    if (!settings.friction) return {};
    const double every = settings.frictionCoefficient;
    const Friction pair = every > 0 ? Friction{every, every} : friction(obstacle);
    return {settings.frictionScale * pair.atRest, settings.frictionScale * pair.sliding};
}

}  // namespace touchstone
