// Writes motions of bundled scenes as cases for step_motions:
//   export_motions SCENES OUT SCENE[,motion=NAME][,geometry=spheres][,mode=paper]…
// Without a motion it is the demonstration. Prints the lines that step_motions should print.
#include <cstdio>
#include <sstream>

#include "haptics/builder/tree_file.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/builds/motion_case.hpp"

namespace {

namespace fs = std::filesystem;
using namespace touchstone;
using namespace touchstone::builds;

constexpr double kSeconds = 4;  // of simulated time

MotionPart partOf(const sandbox::HapticScene& scene, engine::Entity node, const SphereTree* tree, bool byMesh,
                  const fs::path& treeFile) {
    MotionPart part;
    part.mesh = sandbox::bakedTriangles(scene.scene, node);
    part.byMesh = byMesh;
    part.bySpheres = tree != nullptr;
    if (tree) saveTree(*tree, treeFile);
    return part;
}

void exportCase(const fs::path& scenes, const fs::path& out, const std::string& name) {
    std::string scene, motion, geometry, mode;
    std::istringstream words(name);
    std::getline(words, scene, ',');
    for (std::string word; std::getline(words, word, ',');) {
        const std::string key = word.substr(0, word.find('=')), value = word.substr(word.find('=') + 1);
        (key == "motion" ? motion : key == "geometry" ? geometry : mode) = value;
    }
    fs::path file = scenes / (scene + ".glb");
    if (!fs::exists(file)) file = scenes / (scene + ".gltf");

    sandbox::SceneOptions options;
    options.treeCache = sandbox::treeCacheFolder();
    options.adjust = [&](const Settings& ofScene) {
        Settings settings = mode == "paper" ? sandbox::withMode(ofScene, Mode::Paper) : ofScene;
        if (!geometry.empty()) setSetting(settings, "geometry", geometry);
        settings.shadow = kNoSolver;
        return settings;
    };
    const sandbox::HapticScene opened = sandbox::openScene(file, options);
    const Settings settings = options.adjust(opened.settings);
    const World& world = *opened.world;

    MotionCase all;
    const fs::path folder = out / name;
    fs::create_directories(folder);
    all.parts.push_back(partOf(opened, opened.roles.tool, world.tool.spheres.get(), world.tool.surface != nullptr,
                               folder / "0.spheres"));
    const auto touch = [](MotionPart& written, const Part& part) {
        written.prefersSpheres = part.prefersSpheres;
        written.rubs = part.material.has_value();
        written.material = part.material.value_or(Material{});
    };
    touch(all.parts[0], world.tool);
    all.parts[0].X_WO = world.X_WT_start;
    for (std::size_t k = 0; k < world.obstacles.size(); ++k) {
        const Obstacle& obstacle = world.obstacles[k];
        all.parts.push_back(partOf(opened, opened.roles.obstacles[k], obstacle.part.spheres.get(),
                                   obstacle.part.surface != nullptr, folder / (std::to_string(k + 1) + ".spheres")));
        touch(all.parts.back(), obstacle.part);
        all.parts.back().X_WO = obstacle.X_WO;
    }
    for (const SettingInfo& info : settingTable())
        all.settings.push_back(std::string(info.key) + "=" + getSetting(settings, info.key));
    if (settingsOf(all) != settings) throw std::runtime_error("the settings of " + scene + " are not all in the table");
    sandbox::HeadlessOptions headless;
    headless.device = motion.empty() ? "demo" : "demo:" + motion;
    headless.seconds = kSeconds;
    headless.timing = false;
    const sandbox::HeadlessRun run = sandbox::runHeadless(opened, settings, headless);
    std::shared_ptr<const Motion> path = opened.demonstration;
    for (const NamedMotion& named : opened.motions)
        if (named.name == motion) path = named.motion;
    // A record has the pose with its rotation normalized; the tick gets it as the motion gives it.
    for (std::uint64_t tick = 0; tick < run.report.ticks; ++tick)
        all.device.push_back(path->at(1000.0 * double(tick) / settings.rate));
    writeCase(folder / "case", all);
    std::printf("%s %016llx %016llx\n", name.c_str(), static_cast<unsigned long long>(worldHash(world)),
                static_cast<unsigned long long>(run.report.hash));
}

}  // namespace

int main(int argc, char** argv) {
    try {
        for (int i = 3; i < argc; ++i) exportCase(argv[1], argv[2], argv[i]);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "export_motions: %s\n", error.what());
        return 1;
    }
}
