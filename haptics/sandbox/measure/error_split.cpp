#include "haptics/sandbox/measure/error_split.hpp"

#include "haptics/collision/neighbor_list.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"

namespace touchstone::sandbox {
namespace {

constexpr int kTicks = 2000;         // at most, until convergence
constexpr int kLinearizations = 64;  // at most, in each of these ticks
constexpr double kRest = 1e-6;       // travel between two ticks below which the tool is at rest, mm

/// The error between the tool poses a and b while the device is at one pose.
AnswerError between(const World& world, const Settings& settings, const Pose& device, const Pose& a, const Pose& b) {
    const Vec6 x = incrementBetween({a * world.p_TC(), a.q}, {b * world.p_TC(), b.q});
    // Torque is not linear in the tool's rotation, so the torques themselves are compared.
    const Vec3 turn = logRotation(a.q * device.q.conjugate()) - logRotation(b.q * device.q.conjugate());
    return {.position = x.head<3>().norm(),
            .rotation = x.tail<3>().norm(),
            .force = settings.stiffness * x.head<3>().norm(),
            .torque = settings.torsion * turn.norm()};
}

}  // namespace

MeshReference meshReferenceOf(const HapticScene& scene, const MeshReferenceOptions& options) {
    std::vector<MeshObstacle> obstacles;
    for (std::size_t i = 0; i < scene.roles.obstacles.size(); ++i)
        obstacles.push_back({bakedTriangles(scene.scene, scene.roles.obstacles[i]), scene.world->obstacles[i].X_WO});
    return MeshReference(bakedTriangles(scene.scene, scene.roles.tool), scene.world->p_TC(), obstacles, options);
}

ErrorSplit splitError(const World& world, const Settings& settings, const MeshReference& reference,
                      const TickRecord& before, const TickRecord& now) {
    Settings exact = settings;
    exact.solver = kExactSolver;
    exact.shadow = kNoSolver;
    TickState state(world);
    state.resume(before);
    const Pose once = step(world, exact, {now.X_WT_device}, state).X_WT;

    Settings patient = exact;
    patient.mode = Mode::Default;
    patient.linearizations = kLinearizations;
    patient.travelBudget = 1e6;
    ErrorSplit split;
    split.X_WT_converged = once;
    bool atRest = false;
    for (int tick = 0; tick < kTicks && !atRest; ++tick) {
        const TickRecord record = step(world, patient, {now.X_WT_device}, state);
        atRest = travel(split.X_WT_converged, record.X_WT, world.p_TC(), world.reach()) < kRest;
        split.X_WT_converged = record.X_WT;
    }
    split.truth = reference.solve({.X_WT_device = now.X_WT_device,
                                   .X_WT_start = split.X_WT_converged,
                                   .stiffness = settings.stiffness,
                                   .torsion = settings.torsion});
    split.converged = atRest && split.truth.converged;
    const auto share = [&](const Pose& a, const Pose& b) { return between(world, settings, now.X_WT_device, a, b); };
    split.total = share(now.X_WT, split.truth.X_WT);
    split.geometry = share(split.X_WT_converged, split.truth.X_WT);
    split.linearization = share(once, split.X_WT_converged);
    split.solver = share(now.X_WT, once);
    return split;
}

}  // namespace touchstone::sandbox
