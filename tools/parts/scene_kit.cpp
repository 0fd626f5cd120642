#include "tools/parts/scene_kit.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/scene/mesh_file.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/collision/clearance.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::app {

using engine::MeshData;
using nlohmann::json;

engine::Material gold() { return {"gold", {1.0f, 0.77f, 0.34f, 1}, 1, 0.35f}; }
engine::Material silver() { return {"silver", {0.95f, 0.95f, 0.97f, 1}, 1, 0.4f}; }

std::shared_ptr<const MeshData> shared(MeshData mesh) { return std::make_shared<const MeshData>(std::move(mesh)); }

engine::Entity addBody(engine::Scene& scene, const char* name, const ToolPose& pose,
                       std::shared_ptr<const MeshData> mesh, const engine::Material& material, json marking) {
    const engine::Entity node =
        addNode(scene, name, {}, {.translation = pose.position / 1000.0, .rotation = pose.rotation});
    if (mesh) addMesh(scene, node, std::move(mesh), addMaterial(scene, material));
    setExtras(scene, node, {{"touchstone", std::move(marking)}});
    return node;
}

ToolPose upright(double y, double angle, double x) { return {{x, y, 0}, glm::angleAxis(angle, glm::dvec3(0, 1, 0))}; }

void addGoal(engine::Scene& scene, const ToolPose& pose, double room, double angle, const json& more) {
    json goal{{"tolerance_m", room / 1000}, {"tolerance_rad", angle}, {"hold_s", 0.5}};
    goal.update(more);
    addBody(scene, "seated", pose, nullptr, {}, {{"role", "goal"}, {"goal", std::move(goal)}});
}

json wayTo(const ToolPose& goal, const std::vector<ToolPose>& way) {
    const glm::dquat back = glm::conjugate(goal.rotation);
    json poses;
    for (const ToolPose& pose : way) {
        const glm::dvec3 p = back * (pose.position - goal.position) / 1000.0;
        const glm::dquat q = back * pose.rotation;
        poses.push_back({{"translation", {p.x, p.y, p.z}}, {"rotation", {q.x, q.y, q.z, q.w}}});
    }
    return poses;
}

json toolMarking(int leaves, json outcome) {
    outcome["max_penetration_mm"] = 0.001;
    json marking{
        {"role", "tool"}, {"stiffness_N_per_m", 1000}, {"torsion_Nm_per_rad", 1}, {"outcome", std::move(outcome)}};
    if (leaves) marking["leaves"] = leaves;
    return marking;
}

json obstacleMarking(int leaves) {
    json marking{{"role", "obstacle"}};
    if (leaves) marking["leaves"] = leaves;
    return marking;
}

json fitExtras(double clearance) { return {{"touchstone", {{"clearance_mm", clearance}}}}; }

std::shared_ptr<const MeshData> stanfordBunny(const std::filesystem::path& file) {
    if (!std::filesystem::exists(file))
        throw engine::SceneError(file.string() +
                                 " is missing: install the package glmark2-data, or name the bunny with --bunny");
    MeshData mesh = engine::readMeshFile(file, 1).mesh;
    glm::vec3 low = mesh.positions.front(), high = low;
    for (const glm::vec3& p : mesh.positions) low = glm::min(low, p), high = glm::max(high, p);
    const glm::vec3 size = high - low, center = (low + high) / 2.0f;
    const float scale = 0.1f / std::max({size.x, size.y, size.z});
    for (glm::vec3& p : mesh.positions) p = (p - center) * scale;
    return shared(std::move(mesh));
}

SphereTree treeOf(const MeshData& mesh, int leaves, const std::filesystem::path& cache) {
    TriangleMesh surface;
    for (const glm::vec3& p : mesh.positions) surface.vertices.push_back(sandbox::toMm(p));
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        surface.triangles.push_back({mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]});
    const TreeOptions options{.leaves = leaves};
    return cache.empty() ? buildSphereTree(surface, options) : cachedSphereTree(surface, options, cache);
}

double travelToContact(const SphereTree& tool, const SphereTree& obstacle, const ToolPose& start,
                       const glm::dvec3& direction) {
    // The gap shrinks at most as fast as the tool moves, so a step of the size of the gap never passes the contact.
    const glm::dquat& q = start.rotation;
    double travel = 0;
    while (travel < 1000) {
        const glm::dvec3 p = start.position + travel * direction;
        const double gap = leastGap(tool, obstacle, {Vec3(p.x, p.y, p.z), sandbox::toEigen(q)});
        if (gap < 1e-4) return travel;
        travel += gap;
    }
    throw engine::SceneError("the tool of the demonstration does not meet the obstacle on its way");
}

}  // namespace touchstone::app
