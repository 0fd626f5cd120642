// touchstone validate: how a scene's nodes were interpreted, the friction of its parts, and whether it can be run.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "engine/scene/text.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/measure/goal_check.hpp"
#include "haptics/sandbox/scene/friction.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

constexpr double kOverlap = 0.001;  // mm: parts that only touch, or are rounded, overlap by less

/// With the unit in which it can be read: "12 nm", "3.4 µm", "0.512 mm".
std::string lengthText(double mm) {
    if (mm < 0.9995e-3) return engine::formatted("%.0f nm", mm * 1e6);
    return mm < 0.0995 ? engine::formatted("%.1f µm", mm * 1e3) : engine::formatted("%.3f mm", mm);
}

/// What may keep the scene from doing what it is made for. Repairs, defaults and a missing demonstration are not among
/// them.
std::vector<std::string> warningsOf(const sandbox::HapticScene& scene) {
    std::vector<std::string> warnings = scene.warnings;
    for (std::string& sentence : sandbox::touchedBySpheres(scene, scene.settings))
        warnings.push_back(std::move(sentence));
    if (!scene.world) return warnings;
    const auto depthAt = [&](const Pose& X_WT) {
        return PenetrationMeter(*scene.world).depth(X_WT, {}, geometryOf(scene.settings));
    };
    const Pose& start = scene.world->X_WT_start;
    const double atStart = depthAt(start);
    bool bySpheres = false;
    for (std::size_t k = 0; k < scene.world->obstacles.size(); ++k)
        bySpheres = bySpheres || !scene.world->byMeshes(k, geometryOf(scene.settings));
    // Meshes that only touch are led apart by the first tick.
    if (atStart > 0 && (bySpheres || startsInside(*scene.world, start, {}, scene.settings)))
        warnings.push_back("tool and obstacles overlap by " + lengthText(atStart) + " at the start: move them apart");
    const auto& goal = scene.roles.goal;
    const bool open = std::any_of(scene.defects.begin(), scene.defects.end(),
                                  [](const std::string& defects) { return !defects.empty(); });
    if (std::string doubt = goal ? sandbox::goalDoubt(*scene.world, *goal) : ""; !doubt.empty())
        warnings.push_back(std::move(doubt));
    else if (const double depth = goal ? depthAt(goal->X_WT) : 0; depth > kOverlap)
        warnings.push_back(
            engine::formatted("tool and obstacles overlap by %s at the goal, whose tolerance is %.3f mm: %s",
                              lengthText(depth).c_str(), goal->tolerance,
                              open ? "repair the open part first, since its spheres reach further than its mesh"
                                   : "touchstone fit says where"));
    return warnings;
}

int validate(const std::string& pathOrName) {
    const std::filesystem::path file = findScene(pathOrName);
    const sandbox::HapticScene scene =
        sandbox::openScene(file, {.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()});

    std::printf("%s\n", engine::escaped(file.string()).c_str());
    for (const std::string& sentence : scene.roles.interpreted) std::printf("  %s\n", sentence.c_str());
    if (scene.world) {
        const World& world = *scene.world;
        const auto describe = [](const std::string& name, const Surface* surface, const SphereTree* tree) {
            if (surface) {
                Eigen::AlignedBox3d box;
                for (const Vec3& point : surface->features.points) box.extend(point);
                std::printf("  %s: %.1f mm across, a closed mesh of %zu triangles\n", name.c_str(),
                            box.diagonal().norm(), surface->features.faces.size());
            }
            if (tree)
                std::printf("  %s: %.1f mm across, %s\n", name.c_str(), tree->certificate.diagonal,
                            sandbox::words(*tree).c_str());
        };
        describe("tool", world.tool.surface.get(), world.tool.spheres.get());
        for (const Obstacle& obstacle : world.obstacles)
            describe(obstacle.name, obstacle.part.surface.get(), obstacle.part.spheres.get());
        const auto markingOf = [&](engine::Entity part) -> const sandbox::BodyMarking& {
            return scene.scene.registry.get<sandbox::BodyMarking>(part);
        };
        for (std::size_t k = 0; k < world.obstacles.size(); ++k)
            std::printf(
                "  tool and %s: %s\n", world.obstacles[k].name.c_str(),
                sandbox::frictionWords(markingOf(scene.roles.tool), markingOf(scene.roles.obstacles[k])).c_str());
    }
    if (scene.demonstration)
        std::printf("  demonstration: %.2f s\n", scene.demonstration->duration() / 1000);
    else
        std::printf("  demonstration: none, so the tool of a headless run rests at its start\n");
    std::printf("  expected outcome: %s\n", scene.outcome.empty() ? "none given" : "given");
    const Settings defaults;
    for (const SettingInfo& info : settingTable())
        if (const std::string value = getSetting(scene.settings, info.key); value != getSetting(defaults, info.key))
            std::printf("  setting %s = %s %s\n", std::string(info.key).c_str(), value.c_str(),
                        std::string(info.unit).c_str());
    for (const std::string& sentence : sandbox::repairSentences(scene)) std::printf("  %s\n", sentence.c_str());
    const std::vector<std::string> warnings = warningsOf(scene);
    const bool complete = scene.missing.empty();
    if (complete && warnings.empty()) std::printf("valid\n");
    if (complete && !warnings.empty())
        std::printf("valid, with %zu %s:\n", warnings.size(), warnings.size() == 1 ? "warning" : "warnings");
    for (const std::string& warning : warnings) std::printf("  warning: %s\n", warning.c_str());
    if (!complete) throw std::runtime_error(file.string() + ": " + scene.missing);
    return kOk;
}

constexpr const char* kValidateFooter =
    "The last lines say \"valid\", or \"valid, with N warnings\" and what they are: content that is ignored, unknown "
    "keys,\n"
    "unlikely sizes, surfaces that are not closed, parts that overlap at the start or at the goal, a goal in mid-air.\n"
    "The exit code is 1 if the scene cannot be run; warnings leave it at 0.\n\n"
    "Example:\n  touchstone validate part.glb\n";

}  // namespace

void addValidate(CLI::App& program, Action& action) {
    const auto scene = std::make_shared<std::string>();
    CLI::App* command = addCommand(
        program, "validate", "Report how a scene's nodes were interpreted, and why, and the friction of its parts",
        kValidateFooter);
    command->add_option("SCENE", *scene, kSceneHelp)->required();
    command->callback([scene, &action] { action = [scene] { return validate(*scene); }; });
}

}  // namespace touchstone::app
