#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletDynamicsCommon.h>

#include "tools/touchstone/referee/rigid_engine.hpp"

namespace touchstone::app {
namespace {

btVector3 vectorOf(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Vec3 vectorOf(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

/// A mesh that keeps its triangles.
struct Part {
    TriangleMesh mesh;
    std::unique_ptr<btTriangleIndexVertexArray> triangles;
    std::unique_ptr<btGImpactMeshShape> shape;

    Part(const TriangleMesh& from, double margin) : mesh(from) {
        triangles = std::make_unique<btTriangleIndexVertexArray>(
            static_cast<int>(mesh.triangles.size()), reinterpret_cast<int*>(mesh.triangles.data()),
            static_cast<int>(sizeof mesh.triangles[0]), static_cast<int>(mesh.vertices.size()), mesh.vertices[0].data(),
            static_cast<int>(sizeof mesh.vertices[0]));
        shape = std::make_unique<btGImpactMeshShape>(triangles.get());
        shape->setMargin(margin);
        shape->updateBound();
    }
};

class Bullet final : public RigidEngine {
  public:
    explicit Bullet(const EngineScene& scene) : step_(scene.step) {
        btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher_);
        world_.setGravity({0, 0, 0});
        world_.getSolverInfo().m_numIterations = 50;
        world_.getSolverInfo().m_restitution = 0;
        const auto add = [&](const TriangleMesh& mesh, double mass, const btVector3& inertia, const Pose& X) {
            Part& part = *parts_.emplace_back(std::make_unique<Part>(mesh, scene.margin));
            btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, part.shape.get(), inertia);
            info.m_friction = std::sqrt(scene.friction);  // it multiplies those of both parts
            info.m_restitution = 0;
            info.m_startWorldTransform = btTransform(btQuaternion(X.q.x(), X.q.y(), X.q.z(), X.q.w()), vectorOf(X.p));
            btRigidBody& body = *bodies_.emplace_back(std::make_unique<btRigidBody>(info));
            body.setActivationState(DISABLE_DEACTIVATION);
            world_.addRigidBody(&body);
            return &body;
        };
        for (const TriangleMesh& obstacle : scene.obstacles) add(obstacle, 0, {0, 0, 0}, Pose{});
        tool_ = add(scene.tool, scene.mass, btVector3(1, 1, 1) * scene.inertia, scene.X_WC);
        double reach = 0;
        for (const Vec3& p : scene.tool.vertices) reach = std::max(reach, p.norm());
        tool_->setCcdMotionThreshold(reach / 5);
        tool_->setCcdSweptSphereRadius(reach / 5);
    }
    ~Bullet() override {
        for (const auto& body : bodies_) world_.removeRigidBody(body.get());
    }

    BodyState state() const override {
        const btTransform X = tool_->getWorldTransform();
        const btQuaternion q = X.getRotation();
        return {{vectorOf(X.getOrigin()), Quat(q.w(), q.x(), q.y(), q.z())},
                vectorOf(tool_->getLinearVelocity()),
                vectorOf(tool_->getAngularVelocity())};
    }
    void step(const Vec3& force, const Vec3& torque) override {
        tool_->applyCentralForce(vectorOf(force));
        tool_->applyTorque(vectorOf(torque));
        world_.stepSimulation(step_, 0);
    }

  private:
    const double step_;
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    btDbvtBroadphase broadphase_;
    btSequentialImpulseConstraintSolver solver_;
    btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
    std::vector<std::unique_ptr<Part>> parts_;
    std::vector<std::unique_ptr<btRigidBody>> bodies_;
    btRigidBody* tool_ = nullptr;
};

}  // namespace

std::unique_ptr<RigidEngine> makeBullet(const EngineScene& scene) { return std::make_unique<Bullet>(scene); }

}  // namespace touchstone::app
