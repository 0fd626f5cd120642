#pragma once
// From a scene with roles to what the tick steps against.
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/device/motion.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/sandbox/scene/outcome.hpp"
#include "haptics/sandbox/scene/roles.hpp"

namespace touchstone::sandbox {

/// How far the trees of a scene are.
struct SceneStatus {
    std::string part;                ///< name of the part whose tree is being built
    std::size_t number = 1, of = 1;  ///< it is this one of so many
    double fraction = 0;             ///< of all parts, 0 to 1
    double secondsLeft = -1;         ///< for this part, an estimate; negative while there is none
};

/// Called while trees are built; false cancels, and BuildCancelled comes out.
using SceneProgress = std::function<bool(const SceneStatus&)>;

struct SceneOptions {
    std::filesystem::path treeCache;  ///< folder for sphere trees; empty for none
    SceneProgress progress;
    int leaves = 0;          ///< of every part, in place of what the scene asks; 0: as it asks
    bool buildTrees = true;  ///< false: all but the trees, and the world stays null
};

/// $TOUCHSTONE_CACHE, else $XDG_CACHE_HOME/touchstone, else ~/.cache/touchstone; empty when none of them is set.
std::filesystem::path treeCacheFolder();

/// All meshes that belong to a role node as one mesh in the node's rigid frame, mm, scale and mirroring baked in. Where
/// there are colliders below the node, their geometry is taken instead of what is drawn.
TriangleMesh bakedTriangles(const engine::Scene& scene, engine::Entity roleNode);

/// The whole scene as one mesh in the scene's frame, mm.
TriangleMesh bakedTriangles(const engine::Scene& scene);

/// A mesh whose unit is `mmPerUnit` long, in mm.
TriangleMesh toTriangles(const engine::MeshData& mesh, double mmPerUnit);

struct SceneWorld {
    std::shared_ptr<const World> world;
    std::vector<NamedMotion> motions;   ///< in file order; the first is the demonstration
    std::vector<std::string> warnings;  ///< odd sizes, holes in a surface, animations left out
};

/// Builds the trees (through the cache) and finds the motions. The tool starts at the first pose of the
/// demonstration, else where its node stands. world->obstacles has the order of roles.obstacles. Throws
/// engine::SceneError with one sentence when the tool or every obstacle is missing or a part has no triangles.
SceneWorld buildWorld(const engine::Scene& scene, const SceneRoles& roles, const SceneOptions& options = {});

/// A scene ready to be drawn, and to be run when it has a world.
struct HapticScene {
    engine::Scene scene;
    SceneRoles roles;
    Settings settings;                            ///< the defaults with what the scene sets
    std::shared_ptr<const World> world;           ///< null when not asked for, or when `missing` says what it lacks
    std::vector<Pose> X_WO;                       ///< where the obstacles are now; empty: where `world` starts them
    std::vector<NamedMotion> motions;             ///< in file order
    std::shared_ptr<const Motion> demonstration;  ///< the first of them; null if the scene has none
    ExpectedOutcome outcome;                      ///< of the demonstration
    std::vector<ExpectedOutcome> outcomes;        ///< of each of the motions
    std::string missing;                ///< one sentence: which roles are still to be given; empty when complete
    std::vector<std::string> warnings;  ///< all of them: file, roles, world
};

/// Where an obstacle of the world is now. Pre: there is a world.
const Pose& obstaclePose(const HapticScene& scene, std::size_t obstacle);
/// The world that starts the obstacles where they are now: scene.world itself while none has moved.
std::shared_ptr<const World> worldNow(const HapticScene& scene);

/// What a run with this device is to show: the outcome of the motion that demo or demo:NAME follows; null for others.
const ExpectedOutcome* outcomeFor(const HapticScene& scene, const std::string& deviceChoice);

/// Where the tool begins: the first pose of the demonstration, else where its node stands. Pre: there is a tool.
Pose startPose(const HapticScene& scene);

/// The tree of the tool or of an obstacle; null for other nodes and without a world.
const SphereTree* treeOf(const HapticScene& scene, engine::Entity node);

/// Name of the scene for reports: its file's without folder and extension, else that of the glTF scene.
std::string sceneName(const HapticScene& scene);

/// After nodes were moved that movesRigidly(): goal and motions of the scene anew, and a world with the same trees
/// where they now stand; null if there was none. scene.world stays the old one.
std::shared_ptr<const World> worldAsPlaced(HapticScene& scene);

/// Reads a file and does all of the above; safe on a thread of its own, since the result is complete and shares
/// nothing. Throws engine::SceneError; BuildCancelled on cancel.
HapticScene openScene(const std::filesystem::path& file, const SceneOptions& options = {});
/// The same for a scene in memory, e.g. after setRole().
HapticScene openScene(engine::Scene scene, const SceneOptions& options = {});

}  // namespace touchstone::sandbox
