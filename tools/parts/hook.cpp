#include "tools/parts/hook.hpp"

#include <cmath>

#include "tools/parts/angles.hpp"
#include "tools/parts/wire.hpp"

namespace touchstone::app {

engine::MeshData hook(const HookAndEye& fit) {
    std::vector<glm::dvec3> line{{0, fit.shank, 0}};
    // From the axis above the bow out to the bow, as gently as half the shank allows.
    const double bend = 0.6 * fit.shank;
    for (int i = 0; i <= 24; ++i)
        line.emplace_back(fit.bow * (1 - std::cos(kPi * i / 24)) / 2, bend * (1 - i / 24.0), 0);
    line.pop_back();  // where the bow begins
    const auto bow = arc({}, kX, kY, fit.bow, 0, -kPi, fit.spacing);
    line.insert(line.end(), bow.begin(), bow.end());
    line.emplace_back(-fit.bow, fit.tip, 0);
    return wire(line, fit.wire / 2, false, fit.spacing);
}

engine::MeshData eyeRing(const HookAndEye& fit) {
    auto ring = arc({}, kY, kZ, fit.eye, 0, 2 * kPi, fit.spacing);
    ring.pop_back();
    return wire(ring, fit.wire / 2, true, fit.spacing);
}

engine::MeshData eyeStem(const HookAndEye& fit) {
    const glm::dvec3 line[] = {-fit.eye * kY, -2.5 * fit.eye * kY};
    return wire(line, fit.wire / 2, false, fit.spacing);
}

}  // namespace touchstone::app
