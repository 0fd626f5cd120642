#pragma once
// Physics engines as users would take them for haptics: the tool is a body that a spring and a damper pull to the
// device.
#include <memory>
#include <span>
#include <vector>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone::app {

/// Units of everything here: mm, g, ms, rad; so forces are in N and torques in mN·m.
struct EngineScene {
    TriangleMesh tool = {};                    ///< from its center C
    std::vector<TriangleMesh> obstacles = {};  ///< in world coordinates; they never move
    Pose X_WC = {};                            ///< of the tool at the start; C is its center of mass
    double mass = 0, inertia = 0;              ///< g; g·mm² about every axis
    double friction = 0;                       ///< coefficient
    double margin = 0;                         ///< mm around a part in which engines find contacts
    double step = 1;                           ///< ms
};

struct BodyState {
    Pose X_WC;
    Vec3 v = Vec3::Zero(), w = Vec3::Zero();  ///< mm/ms and rad/ms, in world coordinates
};

class RigidEngine {
  public:
    virtual ~RigidEngine() = default;
    virtual BodyState state() const = 0;
    /// One step of EngineScene::step, with this force and torque about C on the tool.
    virtual void step(const Vec3& force, const Vec3& torque) = 0;
};

struct EngineInfo {
    const char* name;
    const char* version;
    const char* choices;  ///< one line: shapes, solver, parameters
    /// Throws std::runtime_error with one sentence if the engine refuses the parts.
    std::unique_ptr<RigidEngine> (*make)(const EngineScene&);
};

std::unique_ptr<RigidEngine> makeBullet(const EngineScene& scene);
std::unique_ptr<RigidEngine> makeOde(const EngineScene& scene);
std::unique_ptr<RigidEngine> makeMujoco(const EngineScene& scene);

/// The engines that were installed when the program was built.
std::span<const EngineInfo> engineTable();

}  // namespace touchstone::app
