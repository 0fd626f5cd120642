// touchstone new: makes a scene from two mesh files, or from one of another unit.
#include <cstdio>
#include <nlohmann/json.hpp>

#include "engine/edit/scene_edit.hpp"
#include "engine/scene/gltf_read.hpp"
#include "engine/scene/gltf_write.hpp"
#include "engine/scene/mesh_file.hpp"
#include "haptics/sandbox/scene/roles.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/tree_choice.hpp"
#include "tools/touchstone/tree_parts.hpp"

namespace touchstone::app {
namespace {

using engine::Scene;

struct NewOptions {
    std::filesystem::path tool, obstacle, scene, output;
    std::string unit = "mm";  ///< mm, cm, m or in
    double scale = 1;         ///< of the scene
    TreeChoice tree;          ///< of both parts
};

struct Box {
    glm::dvec3 low{1e30}, high{-1e30};
    glm::dvec3 size() const { return high - low; }
};

Box boxOf(const engine::MeshData& mesh) {
    Box box;
    for (const glm::vec3& position : mesh.positions) {
        box.low = glm::min(box.low, glm::dvec3(position));
        box.high = glm::max(box.high, glm::dvec3(position));
    }
    return box;
}

/// Writes the options that were given, and leaves the others to the defaults.
void markTree(nlohmann::json& mark, const TreeChoice& choice, double diagonal) {
    const TreeOptions options = withChoice({}, choice, diagonal);
    if (options.maxError > 0) {
        if (options.maxError < sandbox::kMinError || options.maxError > sandbox::kMaxError)
            throw UsageError("--max-error is outside the range that scenes allow");
        mark["max_error_mm"] = options.maxError;
    }
    if (choice.leaves) mark["leaves"] = options.leaves;
    if (choice.quality) mark["quality"] = *choice.quality;
    if (choice.interior) mark["interior"] = *choice.interior;
}

void addBody(Scene& scene, const std::filesystem::path& file, const glm::dvec3& at, engine::MeshData mesh,
             const engine::Material& material, sandbox::Role role, const TreeChoice& tree) {
    nlohmann::json mark{{"role", sandbox::name(role)}};
    markTree(mark, tree, glm::length(boxOf(mesh).size()) * sandbox::kMmPerMeter);
    const engine::Entity node = addNode(scene, file.stem().string(), {}, {.translation = at});
    addMesh(scene, node, std::make_shared<const engine::MeshData>(std::move(mesh)), addMaterial(scene, material));
    setExtras(scene, node, {{"touchstone", std::move(mark)}});
}

void print(const char* role, const std::filesystem::path& file, const Box& box) {
    const glm::dvec3 mm = box.size() * sandbox::kMmPerMeter;
    std::printf("  %-9s %s, %.4g x %.4g x %.4g mm\n", role, file.filename().string().c_str(), mm.x, mm.y, mm.z);
}

int scaleScene(const NewOptions& options) {
    if (!(options.scale > 0)) throw UsageError("--scale is a positive number");
    Scene scene = engine::readGltf(options.scene);
    engine::applyEdits(scene, sandbox::scaled(scene, options.scale));
    engine::saveScene(scene, options.output);
    std::printf("%s: scaled by %g\n", options.output.string().c_str(), options.scale);
    return kOk;
}

int makeScene(const NewOptions& options) {
    if (options.output.extension() != ".glb" && options.output.extension() != ".gltf")
        throw UsageError("-o names a .glb or .gltf file, not '" + options.output.string() + "'");
    if (!options.scene.empty()) return scaleScene(options);
    if (options.tool.empty() || options.obstacle.empty())
        throw UsageError("new needs --tool and --obstacle, or --scene and --scale");
    const double meters = metresPer(options.unit);
    checkChoice(options.tree);
    if (options.tree.leaves.value_or(sandbox::kMinLeaves) < sandbox::kMinLeaves)
        throw UsageError("--leaves is at least " + std::to_string(sandbox::kMinLeaves) + " in a scene");
    engine::MeshFile tool = engine::readMeshFile(options.tool, meters);
    engine::MeshFile obstacle = engine::readMeshFile(options.obstacle, meters);
    const Box toolBox = boxOf(tool.mesh), obstacleBox = boxOf(obstacle.mesh);

    // Parts keep their coordinates. The tool starts in free space, a tenth of its size above the obstacle.
    const double gap = 0.1 * glm::length(toolBox.size());
    const glm::dvec3 start(0, obstacleBox.high.y + gap - toolBox.low.y, 0);

    Scene scene;
    scene.name = options.output.stem().string();
    addBody(scene, options.tool, start, std::move(tool.mesh), {"gold", {1.0f, 0.77f, 0.34f, 1}, 1, 0.35f},
            sandbox::Role::Tool, options.tree);
    addBody(scene, options.obstacle, {}, std::move(obstacle.mesh), {"silver", {0.95f, 0.95f, 0.97f, 1}, 1, 0.4f},
            sandbox::Role::Obstacle, options.tree);
    engine::writeGltf(scene, options.output);

    std::printf("%s\n", options.output.string().c_str());
    print("tool", options.tool, toolBox);
    print("obstacle", options.obstacle, obstacleBox);
    sandbox::SceneOptions withoutTrees;
    withoutTrees.buildWorld = false;
    for (const auto& warnings : {tool.notes, obstacle.notes, sandbox::openScene(options.output, withoutTrees).warnings})
        for (const std::string& warning : warnings) std::printf("  warning: %s\n", warning.c_str());
    std::printf("try it: touchstone run %s\n", options.output.string().c_str());
    return kOk;
}

constexpr const char* kNewFooter =
    "Examples:\n"
    "  touchstone new --tool shaft.stl --obstacle hole.stl --unit mm -o fit.glb\n"
    "  touchstone new --scene nut.glb --scale 0.001 -o small.glb   millimeters that were taken for meters\n";

}  // namespace

void addNew(CLI::App& program, Action& action) {
    const auto options = std::make_shared<NewOptions>();
    CLI::App* command =
        addCommand(program, "new", "Make a scene from two parts in STL, OBJ or PLY files, or from one of another unit",
                   kNewFooter);
    CLI::Option* tool = command->add_option("--tool", options->tool, "the part that moves with the hand");
    CLI::Option* obstacle = command->add_option("--obstacle", options->obstacle, "the part that is fixed");
    tool->needs(obstacle);
    obstacle->needs(tool);
    command->add_option("--unit", options->unit, "unit of the parts' coordinates: mm, cm, m or in")
        ->capture_default_str();
    CLI::Option* scene = command->add_option("--scene", options->scene, "in place of parts: a scene to copy, scaled");
    scene->excludes(tool)->excludes(obstacle);
    command->add_option("--scale", options->scale, "by which the scene is scaled")->needs(scene);
    addTreeChoice(*command, options->tree);
    command->add_option("-o,--output", options->output, "the scene to write, .glb or .gltf")->required();
    command->callback([options, &action] { action = [options] { return makeScene(*options); }; });
}

}  // namespace touchstone::app
