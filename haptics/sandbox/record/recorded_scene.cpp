#include "haptics/sandbox/record/recorded_scene.hpp"

#include <fstream>
#include <iterator>
#include <utility>

#include "haptics/math/hash.hpp"

namespace touchstone::sandbox {
namespace {

std::string treeHash(const SphereTree& tree) {
    const TreeLevel& leaves = tree.levels.front();
    Hash hash;
    for (const auto* values : {&leaves.x, &leaves.y, &leaves.z, &leaves.r})
        hash.add(values->data(), sizeof(float) * static_cast<std::size_t>(leaves.count));
    return hexadecimal(hash.value());
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
    scene.tool = {"tool", treeHash(*world.tool), world.X_WT_start};
    for (const Obstacle& obstacle : world.obstacles)
        scene.obstacles.push_back({obstacle.name, treeHash(*obstacle.tree), obstacle.X_WO});
    return scene;
}

std::shared_ptr<const World> recordedWorld(const RecordedScene& scene, const std::shared_ptr<const World>& now,
                                           std::string& why) {
    const auto differs = [&](const std::string& body) { return "the sphere tree of " + body + " differs"; };
    World world = *now;
    if (treeHash(*world.tool) != scene.tool.tree)
        why = differs("the tool");
    else if (world.obstacles.size() != scene.obstacles.size())
        why = "it had " + std::to_string(scene.obstacles.size()) + " obstacles and has " +
              std::to_string(world.obstacles.size());
    for (std::size_t i = 0; why.empty() && i < world.obstacles.size(); ++i) {
        if (treeHash(*world.obstacles[i].tree) != scene.obstacles[i].tree) why = differs(world.obstacles[i].name);
        world.obstacles[i].X_WO = scene.obstacles[i].X_WB;
    }
    if (!why.empty()) return nullptr;
    world.X_WT_start = scene.tool.X_WB;
    return std::make_shared<const World>(std::move(world));
}

}  // namespace touchstone::sandbox
