#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <stdexcept>

#include "tools/touchstone/referee/rigid_engine.hpp"

namespace touchstone::app {
namespace {

constexpr int kContacts = 256;  // of a pair of parts
constexpr int kIterations = 50;

struct OdePart {
    TriangleMesh mesh;
    std::vector<dTriIndex> indices;
    dTriMeshDataID data = dGeomTriMeshDataCreate();

    explicit OdePart(const TriangleMesh& from) : mesh(from) {
        for (const auto& triangle : mesh.triangles)
            for (const std::uint32_t i : triangle) indices.push_back(static_cast<dTriIndex>(i));
        dGeomTriMeshDataBuildDouble(data, mesh.vertices[0].data(), sizeof mesh.vertices[0],
                                    static_cast<int>(mesh.vertices.size()), indices.data(),
                                    static_cast<int>(indices.size()), 3 * sizeof(dTriIndex));
    }
    ~OdePart() { dGeomTriMeshDataDestroy(data); }
};

class Ode final : public RigidEngine {
  public:
    explicit Ode(const EngineScene& scene) : step_(scene.step), friction_(scene.friction) {
        // Its usual handlers end the program.
        dSetErrorHandler([](int, const char*, va_list) {});
        dSetDebugHandler([](int, const char*, va_list) {});
        dSetMessageHandler([](int, const char*, va_list) {});
        static const int started = dInitODE2(0);
        if (!started) throw std::runtime_error("ODE does not start");
        world_ = dWorldCreate();
        space_ = dSimpleSpaceCreate(nullptr);
        contacts_ = dJointGroupCreate(0);
        dWorldSetERP(world_, 0.2);
        dWorldSetCFM(world_, 1e-6);
        dWorldSetQuickStepNumIterations(world_, kIterations);
        dWorldSetContactSurfaceLayer(world_, scene.margin / 10);
        const auto add = [&](const TriangleMesh& mesh) {
            const OdePart& part = *parts_.emplace_back(std::make_unique<OdePart>(mesh));
            return dCreateTriMesh(space_, part.data, nullptr, nullptr, nullptr);
        };
        for (const TriangleMesh& obstacle : scene.obstacles) add(obstacle);
        geom_ = add(scene.tool);
        tool_ = dBodyCreate(world_);
        dMass mass;
        dMassSetParameters(&mass, scene.mass, 0, 0, 0, scene.inertia, scene.inertia, scene.inertia, 0, 0, 0);
        dBodySetMass(tool_, &mass);
        dGeomSetBody(geom_, tool_);
        const Pose& X = scene.X_WC;
        const dQuaternion q{X.q.w(), X.q.x(), X.q.y(), X.q.z()};
        dBodySetPosition(tool_, X.p.x(), X.p.y(), X.p.z());
        dBodySetQuaternion(tool_, q);
    }
    ~Ode() override {
        dJointGroupDestroy(contacts_);
        dSpaceDestroy(space_);
        dWorldDestroy(world_);
    }

    BodyState state() const override {
        const dReal *p = dBodyGetPosition(tool_), *q = dBodyGetQuaternion(tool_), *v = dBodyGetLinearVel(tool_),
                    *w = dBodyGetAngularVel(tool_);
        return {{Vec3(p[0], p[1], p[2]), Quat(q[0], q[1], q[2], q[3])}, Vec3(v[0], v[1], v[2]), Vec3(w[0], w[1], w[2])};
    }
    void step(const Vec3& force, const Vec3& torque) override {
        dBodyAddForce(tool_, force.x(), force.y(), force.z());
        dBodyAddTorque(tool_, torque.x(), torque.y(), torque.z());
        dSpaceCollide(space_, this, [](void* self, dGeomID a, dGeomID b) { static_cast<Ode*>(self)->touch(a, b); });
        dWorldQuickStep(world_, step_);
        dJointGroupEmpty(contacts_);
        noteTransform();
    }

  private:
    void touch(dGeomID a, dGeomID b) {
        if (!dGeomGetBody(a) && !dGeomGetBody(b)) return;
        const int count = dCollide(a, b, kContacts, &found_[0].geom, sizeof(dContact));
        for (int i = 0; i < count; ++i) {
            found_[static_cast<std::size_t>(i)].surface = {};
            found_[static_cast<std::size_t>(i)].surface.mode = dContactApprox1;
            found_[static_cast<std::size_t>(i)].surface.mu = friction_;
            dJointAttach(dJointCreateContact(world_, contacts_, &found_[static_cast<std::size_t>(i)]), dGeomGetBody(a),
                         dGeomGetBody(b));
        }
    }
    /// The collision of meshes wants to know where the tool was before.
    void noteTransform() {
        const dReal *p = dGeomGetPosition(geom_), *R = dGeomGetRotation(geom_);
        const dMatrix4 last{R[0], R[1], R[2], 0, R[4], R[5], R[6], 0, R[8], R[9], R[10], 0, p[0], p[1], p[2], 1};
        dGeomTriMeshSetLastTransform(geom_, last);
    }

    const double step_, friction_;
    dWorldID world_;
    dSpaceID space_;
    dJointGroupID contacts_;
    std::vector<std::unique_ptr<OdePart>> parts_;
    dGeomID geom_;
    dBodyID tool_;
    std::array<dContact, kContacts> found_;
};

}  // namespace

std::unique_ptr<RigidEngine> makeOde(const EngineScene& scene) { return std::make_unique<Ode>(scene); }

}  // namespace touchstone::app
