#include "haptics/sandbox/record/recorded_scene.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "engine/scene/folders.hpp"
#include "haptics/collision/sphere_tree.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/surface/surface.hpp"

namespace touchstone::sandbox {
namespace {

namespace fs = std::filesystem;

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

FoundFile findByContent(const fs::path& name, const std::string& hash, const std::vector<fs::path>& places,
                        const std::vector<fs::path>& folders) {
    FoundFile other;
    const auto has = [&](const fs::path& file, bool counts) {
        std::error_code error;
        if (!fs::is_regular_file(file, error)) return false;
        if (!hash.empty() && hashOf(file) == hash) return true;
        if (counts && other.file.empty()) other.file = file;
        return false;
    };
    std::error_code error;
    for (const fs::path& place : places) {
        const fs::path file = fs::is_directory(place, error) ? place / name : place;
        if (has(file, true)) return {file, true};
    }
    for (const fs::path& folder : folders) {
        std::vector<fs::path> scenes;
        for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
            if (const fs::path extension = entry.path().extension(); extension == ".glb" || extension == ".gltf")
                scenes.push_back(entry.path());
        std::sort(scenes.begin(), scenes.end());
        for (const fs::path& file : scenes)
            if (has(file, false)) return {file, true};
    }
    return other;
}

fs::path bundledScenes() { return engine::dataFolder("scenes", engine::programFolder() / "scenes"); }

fs::path findRecordedScene(const RecordedScene& scene, const fs::path& recording, const fs::path& named,
                           const std::string& advice, const fs::path& bundled) {
    std::error_code error;
    const fs::path name = scene.file.filename(), was = scene.file.parent_path();
    fs::path folder = fs::weakly_canonical(fs::absolute(recording, error) / ".", error);
    if (!folder.has_filename()) folder = folder.parent_path();
    std::vector<fs::path> places, folders{folder, folder.parent_path(), was, bundled};
    if (!named.empty()) places.push_back(named);
    if (!named.empty()) folders.insert(folders.begin(), named);
    // If recording and scene were moved or copied together, the ends of their paths have not changed.
    constexpr int kFolders = 4;
    for (int up = 0; up < kFolders && folder.has_relative_path(); ++up, folder = folder.parent_path()) {
        places.push_back(folder);
        fs::path below, above = was;
        for (int down = 0; down < kFolders && above.has_filename(); ++down, above = above.parent_path()) {
            below = below.empty() ? above.filename() : above.filename() / below;
            if (const fs::path place = folder / below; fs::is_directory(place, error)) places.push_back(place);
        }
    }
    places.push_back(scene.file);
    places.push_back(bundled);
    if (const FoundFile found = findByContent(name, scene.hash, places, folders); !found.file.empty())
        return found.file;
    throw std::runtime_error("the scene " + name.string() + " (content hash " + scene.hash + ") of the recording '" +
                             recording.string() + "' is missing: it is not beside the recording, at '" +
                             scene.file.string() + "' or among the bundled scenes; " + advice);
}

RecordedScene recordedScene(const std::filesystem::path& file, const World& world) {
    std::error_code error;
    RecordedScene scene;
    scene.file = file.empty() ? file : std::filesystem::absolute(file, error).lexically_normal();
    scene.hash = hashOf(file);
    scene.tool = {"tool", treeHash(world.tool.spheres.get()), surfaceHash(world.tool.surface.get()), world.X_WT_start};
    for (const Obstacle& obstacle : world.obstacles)
        scene.obstacles.push_back({obstacle.name, treeHash(obstacle.part.spheres.get()),
                                   surfaceHash(obstacle.part.surface.get()), obstacle.X_WO});
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
