#include "haptics/sandbox/scene/scene_world.hpp"

#include <algorithm>
#include <map>
#include <sstream>

#include "engine/scene/folders.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_read.hpp"
#include "engine/scene/text.hpp"
#include "engine/scene/transforms.hpp"
#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/mesh_words.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/friction.hpp"
#include "haptics/sandbox/scene/scene_motion.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

using engine::Entity;
using engine::Scene;

std::string nameOf(const Scene& scene, Entity node) {
    const std::string& given = scene.registry.get<engine::Name>(node).value;
    return given.empty() ? nodeLabel(scene, node) : engine::printable(given);
}

/// One sentence on the roles that are missing; empty if the scene is complete.
std::string missingRoles(const SceneRoles& roles) {
    const std::string how = ": set extras.touchstone.role of a node, or choose the role in the window";
    if (!roles.tool) return "no node is the tool" + how;
    if (roles.obstacles.empty()) return "no node is an obstacle" + how;
    return {};
}

Pose startOf(const Scene& scene, Entity tool, const Motion* demonstration) {
    return demonstration ? demonstration->at(0) : toPose(engine::worldPose(scene.registry, tool));
}

const char* const kTooFar =
    " more than 1 km from the scene's origin, where contacts are not rendered: check its unit, since glTF is in "
    "meters, or move everything to the origin";

// Rounding of vertices that is named, as a share of the diagonal: 1.5 µm on a part of 50 mm.
constexpr double kNotedRounding = 3e-5;

/// Refuses poses that are too far away: the tick would hold the tool.
void requireValid(const Scene& scene, Entity node, const Pose& X, const char* where) {
    if (!X.isValid()) engine::failIn(scene.file, nodeLabel(scene, node), where + std::string(kTooFar));
}

/// Makes the parts of a world, one after the other; bodies of the same shape share surface and tree.
class PartMaker {
  public:
    PartMaker(const Scene& scene, const SceneOptions& options, std::vector<std::string>& warnings)
        : scene_(scene), options_(options), warnings_(warnings) {}

    struct Shape {
        std::shared_ptr<const Surface> surface;  ///< null if the mesh is not closed
        std::string defects, repairs;            ///< as in HapticScene
        bool reshaped = false;                   ///< as in HapticScene
    };
    Shape shape(Entity node) {
        const TriangleMesh mesh = meshOf(node);
        if (!options_.buildWorld) return {};
        const auto [made, isNew] = shapes_.try_emplace(treeKey(mesh, {}));
        if (!isNew) return made->second;
        const RepairedMesh body = repairMesh(mesh);
        made->second.repairs = words(body);
        made->second.reshaped = changedSurface(body);
        if (!body.closed()) {
            made->second.defects = words(defectsOf(body));
            return made->second;
        }
        try {
            made->second.surface = std::make_shared<const Surface>(surfaceFeatures(body));
        } catch (const std::invalid_argument& error) {
            engine::failIn(scene_.file, nodeLabel(scene_, node), error.what());
        }
        return made->second;
    }

    /// Pre: `parts` calls are made.
    std::shared_ptr<const SphereTree> tree(Entity node, std::size_t parts) {
        const TriangleMesh mesh = bakedTriangles(scene_, node);
        TreeOptions treeOptions = scene_.registry.get<BodyMarking>(node).tree;
        if (options_.leaves > 0) {
            treeOptions.leaves = options_.leaves;
            treeOptions.maxError = 0;
        }
        auto& tree = trees_[treeKey(mesh, treeOptions)];
        if (!tree) tree = build(mesh, treeOptions, node, parts);
        ++done_;
        if (!tree->certificate.note.empty())
            warnings_.push_back(nodeLabel(scene_, node) + ": " + tree->certificate.note);
        return tree;
    }

    /// About the sizes of the parts made so far.
    std::optional<UnitQuestion> unit() const { return unitQuestion(labels_, sizes_); }

  private:
    TriangleMesh meshOf(Entity node) {
        TriangleMesh mesh = bakedTriangles(scene_, node);
        const std::string label = nodeLabel(scene_, node);
        if (mesh.triangles.empty())
            engine::failIn(scene_.file, label, "it has a role but no triangles: give it or a node below it a mesh");
        checkSize(label, mesh, singleRounding(scene_, node));
        return mesh;
    }

    std::shared_ptr<const SphereTree> build(const TriangleMesh& surface, const TreeOptions& treeOptions, Entity node,
                                            std::size_t parts) {
        const std::string part = nameOf(scene_, node);
        const BuildProgress progress = [&](const BuildStatus& status) {
            return !options_.progress ||
                   options_.progress({.part = part,
                                      .number = done_ + 1,
                                      .of = parts,
                                      .fraction = (double(done_) + status.fraction) / double(parts),
                                      .secondsLeft = status.secondsLeft});
        };
        try {
            if (options_.treeCache.empty())
                return std::make_shared<const SphereTree>(buildSphereTree(surface, treeOptions, progress));
            CacheReport cache;
            auto tree = std::make_shared<const SphereTree>(
                cachedSphereTree(surface, treeOptions, options_.treeCache, progress, &cache));
            if (!cache.remark.empty()) warnings_.push_back(nodeLabel(scene_, node) + ": " + cache.remark);
            return tree;
        } catch (const std::invalid_argument& error) {
            engine::failIn(scene_.file, nodeLabel(scene_, node), error.what());
        }
    }

    void checkSize(const std::string& label, const TriangleMesh& surface, double rounding) {
        Eigen::AlignedBox3d box;
        for (const Vec3& vertex : surface.vertices) {
            if (!(vertex.array().abs() <= kLargestCoordinate).all())
                engine::failIn(
                    scene_.file, label,
                    "its mesh reaches more than 1 km from the node: check its unit, since glTF is in meters");
            box.extend(vertex);
        }
        const double size = box.diagonal().norm();
        labels_.push_back(label);
        sizes_.push_back(size);
        if (rounding > kNotedRounding * size)
            warnings_.push_back(
                engine::formatted("%s: the vertices of its mesh lie so far from their origin that floats hold them to "
                                  "%.2g mm only: export the part near its origin and move its node",
                                  label.c_str(), rounding));
        if (size >= kSmallestPart && size <= kLargestPart) return;
        std::ostringstream text;
        text << label << " is " << size << " mm across, outside " << kSmallestPart << " mm to " << kLargestPart / 1000
             << " m: is its unit right? glTF is in meters, and touchstone new reads other files with --unit mm, cm, "
                "m or in";
        warnings_.push_back(text.str());
    }

    const Scene& scene_;
    const SceneOptions& options_;
    std::size_t done_ = 0;
    std::vector<std::string>& warnings_;
    std::vector<std::string> labels_;
    std::vector<double> sizes_;  // mm
    std::map<std::uint64_t, Shape> shapes_;
    std::map<std::uint64_t, std::shared_ptr<const SphereTree>> trees_;
};

/// Label of a body of the world.
std::string labelOf(const HapticScene& scene, std::size_t body) {
    return engine::escaped(nodeLabel(scene.scene, body == 0 ? scene.roles.tool : scene.roles.obstacles[body - 1]));
}

}  // namespace

std::filesystem::path treeCacheFolder() { return engine::userFolder("TOUCHSTONE_CACHE", "XDG_CACHE_HOME", ".cache"); }

SceneWorld buildWorld(const Scene& scene, const SceneRoles& roles, const Settings& settings,
                      const SceneOptions& options) {
    if (const std::string missing = missingRoles(roles); !missing.empty()) engine::failIn(scene.file, "", missing);
    if (roles.obstacles.size() > kMaxObstacles)
        engine::failIn(scene.file, "",
                       std::to_string(roles.obstacles.size()) + " obstacles are more than the " +
                           std::to_string(kMaxObstacles) + " that are supported: join some of them into one node");
    SceneWorld made;
    made.motions = findMotions(scene, roles.tool, roles.obstacles, made.warnings);
    auto world = std::make_shared<World>();
    PartMaker parts(scene, options, made.warnings);
    const auto partOf = [&](Entity node) {
        PartMaker::Shape shape = parts.shape(node);
        made.defects.push_back(std::move(shape.defects));
        made.repairs.push_back(std::move(shape.repairs));
        made.reshaped.push_back(shape.reshaped);
        const auto& body = scene.registry.get<BodyMarking>(node);
        return Part{.surface = std::move(shape.surface), .prefersSpheres = body.spheres, .material = materialOf(body)};
    };
    world->tool = partOf(roles.tool);
    for (const Entity obstacle : roles.obstacles) {
        world->obstacles.push_back({.name = nameOf(scene, obstacle),
                                    .part = partOf(obstacle),
                                    .X_WO = toPose(engine::worldPose(scene.registry, obstacle))});
        requireValid(scene, obstacle, world->obstacles.back().X_WO, "it is");
    }
    world->X_WT_start = startOf(scene, roles.tool, made.motions.empty() ? nullptr : made.motions.front().motion.get());
    requireValid(scene, roles.tool, world->X_WT_start, "it starts");
    made.unit = parts.unit();
    if (made.unit) made.warnings.push_back(scaleHint(scene, *made.unit));
    if (!options.buildWorld) return made;

    const bool all = options.allTrees || geometryOf(settings) == Geometry::Spheres;
    std::vector<std::size_t> bySpheres;
    for (std::size_t k = 0; options.trees && k < world->obstacles.size(); ++k)
        if (all || !world->hasMeshes(k) || world->tool.prefersSpheres || world->obstacles[k].part.prefersSpheres)
            bySpheres.push_back(k);
    if (!bySpheres.empty()) world->tool.spheres = parts.tree(roles.tool, 1 + bySpheres.size());
    for (const std::size_t k : bySpheres)
        world->obstacles[k].part.spheres = parts.tree(roles.obstacles[k], 1 + bySpheres.size());
    made.world = std::move(world);
    return made;
}

Pose startPose(const HapticScene& scene) { return startOf(scene.scene, scene.roles.tool, scene.demonstration.get()); }

std::optional<std::size_t> bodyOf(const HapticScene& scene, Entity node) {
    if (!node) return std::nullopt;
    if (node == scene.roles.tool) return 0;
    const auto& obstacles = scene.roles.obstacles;
    const auto found = std::find(obstacles.begin(), obstacles.end(), node);
    if (found == obstacles.end()) return std::nullopt;
    return 1 + static_cast<std::size_t>(found - obstacles.begin());
}

const SphereTree* treeOf(const HapticScene& scene, Entity node) {
    const auto body = bodyOf(scene, node);
    if (!scene.world || !body) return nullptr;
    return (*body == 0 ? scene.world->tool.spheres : scene.world->obstacles[*body - 1].part.spheres).get();
}

const Surface* surfaceOf(const HapticScene& scene, Entity node) {
    const auto body = bodyOf(scene, node);
    if (!scene.world || !body) return nullptr;
    return (*body == 0 ? scene.world->tool.surface : scene.world->obstacles[*body - 1].part.surface).get();
}

const Pose& obstaclePose(const HapticScene& scene, std::size_t obstacle) {
    return scene.X_WO.empty() ? scene.world->obstacles[obstacle].X_WO : scene.X_WO[obstacle];
}

std::shared_ptr<const World> worldNow(const HapticScene& scene) {
    const std::vector<Obstacle>& obstacles = scene.world->obstacles;
    const auto isThere = [](const Pose& X, const Obstacle& obstacle) { return obstacle.X_WO == X; };
    if (std::equal(scene.X_WO.begin(), scene.X_WO.end(), obstacles.begin(), isThere)) return scene.world;
    auto world = std::make_shared<World>(*scene.world);
    for (std::size_t k = 0; k < scene.X_WO.size(); ++k) world->obstacles[k].X_WO = scene.X_WO[k];
    return world;
}

namespace {
/// Reads the outcomes of the scene's motions.
void readOutcomes(HapticScene& scene, std::vector<std::string>& warnings) {
    scene.outcome = readOutcome(scene.scene, scene.roles, warnings);
    scene.outcomes.clear();
    for (std::size_t i = 0; i < scene.scene.animations.size(); ++i)
        if (movesTool(scene.scene.animations[i], scene.roles.tool))
            scene.outcomes.push_back(readOutcome(scene.scene, i, scene.roles, warnings).value_or(scene.outcome));
    if (!scene.outcomes.empty()) scene.outcome = scene.outcomes.front();
}
}  // namespace

std::shared_ptr<const World> worldAsPlaced(HapticScene& scene) {
    updateWorldTransforms(scene.scene);
    scene.roles = assignRoles(scene.scene);
    if (!scene.world) return nullptr;
    std::vector<std::string> known;  // these warnings were given when the scene was opened
    scene.motions = findMotions(scene.scene, scene.roles.tool, scene.roles.obstacles, known);
    scene.demonstration = scene.motions.empty() ? nullptr : scene.motions.front().motion;
    readOutcomes(scene, known);
    auto world = std::make_shared<World>(*scene.world);
    for (std::size_t i = 0; i < world->obstacles.size(); ++i)
        world->obstacles[i].X_WO = toPose(engine::worldPose(scene.scene.registry, scene.roles.obstacles[i]));
    world->X_WT_start = startPose(scene);
    return world;
}

bool touchedByMesh(const World& world, std::size_t body, Geometry geometry) {
    if (body > 0) return world.byMeshes(body - 1, geometry);
    for (std::size_t i = 0; i < world.obstacles.size(); ++i)
        if (world.byMeshes(i, geometry)) return true;
    return false;
}

bool touchedBySpheres(const World& world, std::size_t body, Geometry geometry) {
    if (body > 0) return !world.byMeshes(body - 1, geometry);
    for (std::size_t i = 0; i < world.obstacles.size(); ++i)
        if (!world.byMeshes(i, geometry)) return true;
    return false;
}

std::vector<std::string> touchedBySpheres(const HapticScene& scene, const Settings& settings) {
    std::vector<std::string> sentences;
    if (!scene.world || geometryOf(settings) != Geometry::Mesh) return sentences;
    for (std::size_t body = 0; body < scene.defects.size(); ++body)
        if (!scene.defects[body].empty())
            sentences.push_back(labelOf(scene, body) + " is touched by its spheres, not its mesh, which has " +
                                scene.defects[body] + (body == 0 ? ": all contact is of spheres" : ""));
    return sentences;
}

std::vector<std::string> repairSentences(const HapticScene& scene) {
    std::vector<std::string> sentences;
    for (std::size_t body = 0; body < scene.repairs.size(); ++body)
        if (!scene.repairs[body].empty())
            sentences.push_back(labelOf(scene, body) + " was repaired: " + scene.repairs[body]);
    return sentences;
}

std::optional<FileFrame> toolFile(const HapticScene& scene) {
    const BodyMarking* tool = scene.roles.tool ? scene.scene.registry.find<BodyMarking>(scene.roles.tool) : nullptr;
    return tool ? tool->file : std::nullopt;
}

std::vector<std::string> reshapedSentences(const HapticScene& scene) {
    std::vector<std::string> sentences;
    for (std::size_t body = 0; body < scene.repairs.size(); ++body)
        if (scene.reshaped[body]) sentences.push_back(labelOf(scene, body) + " was repaired: " + scene.repairs[body]);
    return sentences;
}

std::string sceneName(const HapticScene& scene) {
    return scene.scene.file.empty() ? scene.scene.name : scene.scene.file.stem().string();
}

namespace {
HapticScene assembled(Scene scene, const SceneOptions& options) {
    HapticScene opened;
    opened.scene = std::move(scene);
    updateWorldTransforms(opened.scene);
    opened.roles = assignRoles(opened.scene);
    opened.settings = sceneSettings(opened.scene, opened.roles);
    opened.warnings = opened.scene.warnings;
    opened.warnings.insert(opened.warnings.end(), opened.roles.warnings.begin(), opened.roles.warnings.end());
    readOutcomes(opened, opened.warnings);
    opened.missing = missingRoles(opened.roles);
    if (!opened.missing.empty()) return opened;

    const Settings settings = options.adjust ? options.adjust(opened.settings) : opened.settings;
    SceneWorld built = buildWorld(opened.scene, opened.roles, settings, options);
    opened.world = std::move(built.world);
    opened.motions = std::move(built.motions);
    opened.defects = std::move(built.defects);
    opened.repairs = std::move(built.repairs);
    opened.reshaped = std::move(built.reshaped);
    opened.unit = std::move(built.unit);
    if (!opened.motions.empty()) opened.demonstration = opened.motions.front().motion;
    opened.warnings.insert(opened.warnings.end(), built.warnings.begin(), built.warnings.end());
    return opened;
}
}  // namespace

HapticScene openScene(Scene scene, const SceneOptions& options) {
    HapticScene opened = assembled(std::move(scene), options);
    for (std::string& warning : opened.warnings)
        warning = engine::escaped(warning);  // warnings may quote text of the file
    return opened;
}

HapticScene openScene(const std::filesystem::path& file, const SceneOptions& options) {
    return openScene(engine::readGltf(file), options);
}

}  // namespace touchstone::sandbox
