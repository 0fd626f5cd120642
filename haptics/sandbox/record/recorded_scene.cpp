#include "haptics/sandbox/record/recorded_scene.hpp"

#include <fstream>
#include <iterator>
#include <utility>

#include "haptics/math/hash.hpp"

namespace touchstone::sandbox {
namespace {

std::string treeHash(const SphereTree* tree) {
    if (!tree) return {};
    const TreeLevel& leaves = tree->levels.front();
    Hash hash;
    for (const auto* values : {&leaves.x, &leaves.y, &leaves.z, &leaves.r})
        hash.add(values->data(), sizeof(float) * static_cast<std::size_t>(leaves.count));
    return hexadecimal(hash.value());
}

std::string surfaceHash(const Surface* surface) {
    if (!surface) return {};
    Hash hash;
    for (const Vec3& p : surface->features.points) hash.add(p.data(), sizeof(double) * 3);
    for (const SurfaceFeatures::Face& face : surface->features.faces)
        hash.add(face.points.data(), sizeof(face.points[0]) * face.points.size());
    return hexadecimal(hash.value());
}

/// Says which part differs, if both have it.
std::string difference(const RecordedScene::Body& then, const RecordedScene::Body& now, const std::string& name) {
    const auto differ = [](const std::string& a, const std::string& b) { return !a.empty() && !b.empty() && a != b; };
    if (differ(then.tree, now.tree)) return "the sphere tree of " + name + " differs";
    if (differ(then.surface, now.surface)) return "the mesh of " + name + " differs";
    if (then.tree.empty() && now.surface.empty()) return name + " had a closed mesh and has none";
    return {};
}

}  // namespace

std::string hashOf(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in) return {};
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    return hexadecimal(Hash().add(bytes.data(), bytes.size()).value());
}

RecordedScene recordedScene(const std::filesystem::path& file, const World& world) {
    std::error_code error;
    RecordedScene scene;
    scene.file = file.empty() ? file : std::filesystem::absolute(file, error).lexically_normal();
    scene.hash = hashOf(file);
    scene.tool = {"tool", treeHash(world.tool.get()), surfaceHash(world.toolSurface.get()), world.X_WT_start};
    for (const Obstacle& obstacle : world.obstacles)
        scene.obstacles.push_back(
            {obstacle.name, treeHash(obstacle.tree.get()), surfaceHash(obstacle.surface.get()), obstacle.X_WO});
    return scene;
}

std::shared_ptr<const World> recordedWorld(const RecordedScene& scene, const std::shared_ptr<const World>& now,
                                           std::string& why) {
    World world = *now;
    const RecordedScene found = recordedScene({}, world);
    why = difference(scene.tool, found.tool, "the tool");
    if (why.empty() && world.obstacles.size() != scene.obstacles.size())
        why = "it had " + std::to_string(scene.obstacles.size()) + " obstacles and has " +
              std::to_string(world.obstacles.size());
    for (std::size_t i = 0; why.empty() && i < world.obstacles.size(); ++i) {
        why = difference(scene.obstacles[i], found.obstacles[i], world.obstacles[i].name);
        world.obstacles[i].X_WO = scene.obstacles[i].X_WB;
    }
    if (!why.empty()) return nullptr;
    world.X_WT_start = scene.tool.X_WB;
    return std::make_shared<const World>(std::move(world));
}

}  // namespace touchstone::sandbox
