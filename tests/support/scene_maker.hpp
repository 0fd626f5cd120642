#pragma once
// Small scenes for tests, in memory and on disk.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/scene/scene.hpp"
#include "engine/scene/transforms.hpp"
#include "tests/support/temp_folder.hpp"

namespace touchstone::test {

/// An axis-aligned box about the origin, meters, counter-clockwise seen from outside.
inline std::shared_ptr<const engine::MeshData> boxMesh(const glm::vec3& size) {
    auto mesh = std::make_shared<engine::MeshData>();
    for (int i = 0; i < 8; ++i)
        mesh->positions.push_back(size * glm::vec3(i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f));
    mesh->indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                     2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    mesh->normals = smoothNormals(*mesh);
    return mesh;
}

inline engine::Entity addBox(engine::Scene& scene, const std::string& name, const glm::vec3& size,
                             const nlohmann::json& mark = nullptr, const engine::LocalTransform& local = {},
                             engine::Entity parent = {}) {
    const engine::Entity node = addNode(scene, name, parent, local);
    addMesh(scene, node, boxMesh(size));
    if (!mark.is_null()) setExtras(scene, node, {{"touchstone", mark}});
    return node;
}

/// Gives a node every triangle of its mesh twice.
inline void drawTwice(engine::Scene& scene, engine::Entity node) {
    auto& primitive = scene.registry.get<engine::MeshInstance>(node).primitives[0];
    auto mesh = std::make_shared<engine::MeshData>(*primitive.mesh);
    const std::vector<std::uint32_t> once = mesh->indices;
    mesh->indices.insert(mesh->indices.end(), once.begin(), once.end());
    primitive.mesh = mesh;
}

/// Gives a node KHR_physics_rigid_bodies.
inline void addPhysics(engine::Scene& scene, engine::Entity node, const nlohmann::json& body) {
    engine::NodeMarking* marking = scene.registry.find<engine::NodeMarking>(node);
    if (!marking) marking = &scene.registry.add(node, engine::NodeMarking{});
    (*marking->extensions)["KHR_physics_rigid_bodies"] = body;
}

inline engine::Animation translation(engine::Entity node, std::vector<double> times, std::vector<glm::dvec4> values) {
    return {"motion",
            {{node, engine::AnimationPath::Translation, engine::Interpolation::Linear, std::move(times),
              std::move(values)}}};
}

/// A cube of 10 mm moves down from 5 mm above a slab of 10 mm, is pushed 2 mm in, slides 4 mm, and leaves; 0.8 s.
inline engine::Scene pressScene() {
    engine::Scene scene;
    scene.name = "press";
    const double touch = 0.010;  // height of the cube's center when it touches
    const engine::Entity tool = addBox(scene, "cube", glm::vec3(0.01f),
                                       {{"role", "tool"},
                                        {"leaves", 64},
                                        {"outcome",
                                         {{"max_penetration_mm", 0.001},
                                          {"min_peak_force_N", 1.5},
                                          {"min_contact_fraction", 0.25},
                                          {"max_final_lag_mm", 0.01}}}},
                                       {.translation = {0, touch + 0.005, 0}});
    addBox(scene, "slab", {0.06f, 0.01f, 0.06f}, {{"role", "obstacle"}, {"leaves", 512}});
    const auto at = [&](double x, double depth) { return glm::dvec4(x, touch - depth, 0, 0); };
    scene.animations.push_back(
        translation(tool, {0, 0.2, 0.6, 0.8}, {at(0, -0.005), at(0, 0.002), at(0.004, 0.002), at(0.004, -0.005)}));
    updateWorldTransforms(scene);
    return scene;
}

/// The same with friction of both parts. The cube slides in a direction between the facets of a friction pyramid.
inline engine::Scene rubScene(double coefficient = 0.4) {
    engine::Scene scene = pressScene();
    for (const engine::Entity node : scene.nodes)
        for (const char* key : {"staticFriction", "dynamicFriction"})
            (*scene.registry.get<engine::NodeMarking>(node).extras)["touchstone"][key] = coefficient;
    for (glm::dvec4& p : scene.animations[0].channels[0].values) p.z = 0.41 * p.x;
    return scene;
}

/// The same with a goal: the cube is put down on the slab and stays for `hold` seconds.
inline engine::Scene downScene(double hold = 0.3) {
    engine::Scene scene = pressScene();
    const engine::Entity goal = addNode(scene, "down", {}, {.translation = {0, 0.010, 0}});
    setExtras(scene, goal,
              {{"touchstone",
                {{"role", "goal"}, {"goal", {{"tolerance_m", 0.003}, {"tolerance_rad", 0.5}, {"hold_s", hold}}}}}});
    updateWorldTransforms(scene);
    return scene;
}

}  // namespace touchstone::test
