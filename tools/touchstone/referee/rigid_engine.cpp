#include "tools/touchstone/referee/rigid_engine.hpp"

#include <array>

namespace touchstone::app {

std::span<const EngineInfo> engineTable() {
    static const std::vector<EngineInfo> table{
#ifdef TOUCHSTONE_BULLET
        {"Bullet", TOUCHSTONE_BULLET,
         "GImpact meshes of both parts, sequential impulses, 50 iterations, double precision, swept sphere of a fifth "
         "of "
         "the tool against tunneling",
         makeBullet},
#endif
#ifdef TOUCHSTONE_ODE
        {"ODE", TOUCHSTONE_ODE,
         "trimeshes of both parts, QuickStep, 50 iterations, ERP 0.2, CFM 1e-6, at most 256 contacts", makeOde},
#endif
#ifdef TOUCHSTONE_MUJOCO
        {"MuJoCo", TOUCHSTONE_MUJOCO,
         "convex hull of each part, Newton solver, elliptic cones, solref of two steps; a hole is filled by its hull",
         makeMujoco},
#endif
    };
    return table;
}

}  // namespace touchstone::app
