// touchstone validate: how a scene's nodes were interpreted, the friction of its parts, and whether it can be run.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "engine/scene/cad_clearance.hpp"
#include "engine/scene/step_file.hpp"
#include "engine/scene/text.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/measure/goal_check.hpp"
#include "haptics/sandbox/scene/friction.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "haptics/sandbox/scene/units.hpp"
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

/// The tree of the parts of a STEP file.
int validateStep(const std::filesystem::path& file) {
    const auto found = engine::readStep(std::span(&file, 1), {.meshes = false},
                                        [bar = progressBar("STEP:")](const std::string& what, double fraction) {
                                            return bar({.part = what, .fraction = fraction});
                                        });
    if (!found) throw BuildCancelled();
    const engine::CadAssembly& assembly = found->front();
    std::printf("%s: %s, lengths in %s\n", engine::escaped(file.string()).c_str(),
                engine::escaped(assembly.schema).c_str(), engine::escaped(assembly.unit).c_str());
    std::vector<std::string> groups;  // of the part before, from the root
    std::vector<std::string> warnings = assembly.notes;
    for (const engine::CadPart& part : assembly.parts) {
        std::vector<std::string> names(1);
        for (const char c : part.path) c == '/' ? names.emplace_back() : names.back() += c;
        names.pop_back();
        std::size_t same = 0;
        while (same < std::min(names.size(), groups.size()) && names[same] == groups[same]) ++same;
        for (std::size_t i = same; i < names.size(); ++i)
            std::printf("%*s%s\n", int(2 * i + 2), "", engine::escaped(names[i]).c_str());
        groups = names;
        const engine::CadShape& shape = assembly.shapes[part.shape];
        const glm::dvec3 at = glm::dvec3(part.placement[3]) + 0.0;  // no -0
        std::printf("%*s%s: %zu %s, %.4g mm³, at (%.4g, %.4g, %.4g) mm%s\n", int(2 * names.size() + 2), "",
                    engine::escaped(part.name).c_str(), shape.faces.size(), shape.faces.size() == 1 ? "face" : "faces",
                    shape.volume * 1e9, at.x * 1e3, at.y * 1e3, at.z * 1e3,
                    glm::determinant(glm::dmat3(part.placement)) < 0 ? ", mirrored" : "");
        if (!shape.problem.empty())
            warnings.push_back("the part '" + engine::printable(part.name) + "' " + shape.problem);
    }
    if (const double clearance = engine::leastClearance(assembly); clearance > 0)
        std::printf("  least clearance between cylinders, cones and spheres: %s\n",
                    lengthText(clearance * sandbox::kMmPerMeter).c_str());
    std::printf("%zu %s", assembly.parts.size(), assembly.parts.size() == 1 ? "part" : "parts");
    if (warnings.empty()) {
        std::printf("; touchstone new makes a scene of %s\n", assembly.parts.size() == 1 ? "it" : "them");
    } else {
        std::printf(", with %zu %s:\n", warnings.size(), warnings.size() == 1 ? "warning" : "warnings");
        for (const std::string& warning : warnings) std::printf("  warning: %s\n", engine::escaped(warning).c_str());
    }
    return kOk;
}

int validate(const std::string& pathOrName) {
    if (engine::isStepFile(pathOrName)) return validateStep(pathOrName);
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
    "The exit code is 1 if the scene cannot be run; warnings leave it at 0.\n"
    "For a STEP file, it lists the tree of its parts; touchstone new takes parts by these names.\n\n"
    "Examples:\n  touchstone validate part.glb\n  touchstone validate gearbox.step\n";

}  // namespace

void addValidate(CLI::App& program, Action& action) {
    const auto scene = std::make_shared<std::string>();
    CLI::App* command = addCommand(
        program, "validate", "Report how a scene's nodes were interpreted, and why, and the friction of its parts",
        kValidateFooter);
    command->add_option("SCENE", *scene, std::string(kSceneHelp) + "; or a STEP file")->required();
    command->callback([scene, &action] { action = [scene] { return validate(*scene); }; });
}

}  // namespace touchstone::app
