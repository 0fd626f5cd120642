#pragma once
// The scene of the window's tests, and waiting with a time limit.
#include <chrono>
#include <functional>
#include <thread>

#include "engine/scene/gltf_write.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::test {

/// A red cube of 10 mm moves 2 mm into a blue slab within 0.2 s and stays there.
inline engine::Scene holdScene() {
    engine::Scene scene;
    const engine::Entity tool =
        addBox(scene, "cube", glm::vec3(0.01f), {{"role", "tool"}, {"leaves", 64}}, {.translation = {0, 0.015, 0}});
    const engine::Entity slab = addBox(scene, "slab", {0.06f, 0.01f, 0.06f}, {{"role", "obstacle"}, {"leaves", 128}});
    const auto paint = [&](engine::Entity node, glm::vec4 color) {
        engine::Material material;
        material.baseColor = color;
        scene.registry.get<engine::MeshInstance>(node).primitives[0].material = addMaterial(scene, material);
    };
    paint(tool, {0.8f, 0.02f, 0.02f, 1});
    paint(slab, {0.02f, 0.02f, 0.8f, 1});
    scene.animations.push_back(translation(tool, {0, 0.2}, {{0, 0.015, 0, 0}, {0, 0.008, 0, 0}}));
    updateWorldTransforms(scene);
    return scene;
}

/// The same scene, written to a file.
inline std::filesystem::path holdFile(const TempFolder& folder) {
    const std::filesystem::path file = folder.path() / "hold.glb";
    writeGltf(holdScene(), file);
    return file;
}

/// Calls `step` until it returns true; false after a minute, which only a hang exceeds.
inline bool patiently(const std::function<bool()>& step) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < end) {
        if (step()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
}

}  // namespace touchstone::test
