#pragma once
// From a scene with roles to the world that the tick runs in.
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/collision/sphere_tree.hpp"
#include "haptics/hands/motion.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/sandbox/scene/outcome.hpp"
#include "haptics/sandbox/scene/roles.hpp"
#include "haptics/sandbox/scene/scene_unit.hpp"
#include "haptics/surface/surface.hpp"

namespace touchstone::sandbox {

/// Progress of building the sphere trees of a scene.
struct SceneStatus {
    std::string part;                ///< part whose tree is being built
    std::size_t number = 1, of = 1;  ///< the part's number, and the number of parts
    double fraction = 0;             ///< of all parts, 0 to 1
    double secondsLeft = -1;         ///< estimate for this part; negative while there is none
};

/// Called while trees are built; returning false cancels, which throws BuildCancelled.
using SceneProgress = std::function<bool(const SceneStatus&)>;

struct SceneOptions {
    std::filesystem::path treeCache;  ///< folder that keeps sphere trees; empty: no cache
    SceneProgress progress;
    int leaves = 0;          ///< maximum leaf count of every part, in place of the scene's; 0: the scene's
    bool buildWorld = true;  ///< false: everything except the world, which stays null
    bool trees = true;       ///< false: a world of meshes alone, which no tick may run in
    /// Trees of all parts. Otherwise only of those that touch by spheres: all with a Geometry::Spheres, or those of an
    /// open mesh and those whose file asks for spheres.
    bool allTrees = false;
    /// From the scene's settings to those of the run, if they differ.
    std::function<Settings(const Settings&)> adjust = {};
};

/// $TOUCHSTONE_CACHE, else $XDG_CACHE_HOME/touchstone, else ~/.cache/touchstone; empty when none of them is set.
std::filesystem::path treeCacheFolder();

struct SceneWorld {
    std::shared_ptr<const World> world;
    std::vector<NamedMotion> motions;   ///< in file order; the first one is the demonstration
    std::vector<std::string> defects;   ///< as in HapticScene
    std::vector<std::string> repairs;   ///< as in HapticScene
    std::vector<bool> reshaped;         ///< as in HapticScene
    std::optional<UnitQuestion> unit;   ///< as in HapticScene
    std::vector<std::string> warnings;  ///< unusual sizes, holes in a surface, ignored animations
};

/// Makes surfaces, builds trees or reads them from the cache, and finds the motions. The tool starts at the first pose
/// of the demonstration; without one, at its node. world->obstacles has the order of roles.obstacles. Throws
/// engine::SceneError with one sentence if there is no tool, no obstacle, or a part without triangles.
SceneWorld buildWorld(const engine::Scene& scene, const SceneRoles& roles, const Settings& settings,
                      const SceneOptions& options = {});

/// A scene that is ready to be drawn and, if it has a world, to be run.
struct HapticScene {
    engine::Scene scene;
    SceneRoles roles;
    Settings settings;                   ///< the defaults, changed by the scene
    std::shared_ptr<const World> world;  ///< null if it was not requested or the scene is incomplete, see `missing`
    std::vector<Pose> X_WO;              ///< where the obstacles are now; empty: where `world` starts them
    std::vector<NamedMotion> motions;    ///< in file order
    std::shared_ptr<const Motion> demonstration;  ///< the first motion; null if the scene has none
    ExpectedOutcome outcome;                      ///< expected of the demonstration
    std::vector<ExpectedOutcome> outcomes;        ///< expected of each motion
    /// By body of the world, see bodyOf(): why it cannot be touched by its mesh, as "3 holes (40 open edges)"; empty if
    /// it can.
    std::vector<std::string> defects;
    std::vector<std::string> repairs;   ///< by body: what the repair of its mesh changed, in words; empty if nothing
    std::vector<bool> reshaped;         ///< by body: whether that changed the surface that is touched
    std::optional<UnitQuestion> unit;   ///< what to ask if the sizes of the parts suggest a wrong unit
    std::string missing;                ///< one sentence: which roles are missing; empty if the scene is complete
    std::vector<std::string> warnings;  ///< from the file, the roles and the world
};

/// Where an obstacle of the world is now. Pre: there is a world.
const Pose& obstaclePose(const HapticScene& scene, std::size_t obstacle);
/// The world that starts the obstacles where they are now: scene.world itself while none has moved.
std::shared_ptr<const World> worldNow(const HapticScene& scene);

/// Initial tool pose: the first pose of the demonstration; without one, the pose of the tool node. Pre: there is a
/// tool.
Pose startPose(const HapticScene& scene);

/// The sphere tree of the tool or of an obstacle; null for other nodes, without a world, and if it was not built.
const SphereTree* treeOf(const HapticScene& scene, engine::Entity node);

/// The number of a node among the bodies of the world: 0 for the tool, 1 + i for obstacle i; nothing for other nodes.
std::optional<std::size_t> bodyOf(const HapticScene& scene, engine::Entity node);
/// The mesh by which the tool or an obstacle can be touched; null for other nodes, without a world, and for a part that
/// is not closed.
const Surface* surfaceOf(const HapticScene& scene, engine::Entity node);

/// Whether anything touches this body of the world by its mesh, or by its spheres, in a geometry of the tick. The tool
/// can be touched by both.
bool touchedByMesh(const World& world, std::size_t body, Geometry geometry);
bool touchedBySpheres(const World& world, std::size_t body, Geometry geometry);
/// One sentence for each part that is touched by its spheres although these settings ask for meshes: which part, and
/// what is wrong with its mesh.
std::vector<std::string> touchedBySpheres(const HapticScene& scene, const Settings& settings);
/// One sentence for each part whose mesh was repaired: which part, and what changed.
std::vector<std::string> repairSentences(const HapticScene& scene);
/// Those of them about parts whose surface that changed, which a user feels.
std::vector<std::string> reshapedSentences(const HapticScene& scene);

/// Where the tool's own file has its coordinates; nothing if that is not known.
std::optional<FileFrame> toolFile(const HapticScene& scene);

/// Name of the scene in reports: the file's without folder and extension; without a file, that of the glTF scene.
std::string sceneName(const HapticScene& scene);

/// Call this after nodes were moved that movesRigidly(), or goal or motions changed. Updates roles, motions and
/// outcomes of the scene, and returns a world with the same trees at their new poses; null if the scene has no world.
/// Does not change scene.world. Throws engine::SceneError if a goal does not suit the motions.
std::shared_ptr<const World> worldAsPlaced(HapticScene& scene);

/// Reads a file and does all of the above. Any thread may call it, since the result is complete and shares nothing.
/// Throws engine::SceneError; BuildCancelled if it is cancelled.
HapticScene openScene(const std::filesystem::path& file, const SceneOptions& options = {});
/// The same for a scene in memory, e.g. after applyMarking().
HapticScene openScene(engine::Scene scene, const SceneOptions& options = {});

}  // namespace touchstone::sandbox
