#pragma once
// The computed scenes of the program: parts, roles, demonstration, expected outcome.
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

#include "engine/scene/scene.hpp"
#include "tools/parts/bayonet.hpp"
#include "tools/parts/dental.hpp"
#include "tools/parts/drawer.hpp"
#include "tools/parts/gears.hpp"
#include "tools/parts/hook.hpp"
#include "tools/parts/lock.hpp"
#include "tools/parts/nut.hpp"
#include "tools/parts/peg.hpp"
#include "tools/parts/shapes.hpp"

namespace touchstone::app {

struct SceneOptions {
    SplineFit fit;     ///< of `spline`
    PocketFit pocket;  ///< of `dental`
    BayonetFit bayonet;
    GearPair gears;
    HookAndEye hook;
    LockFit lock;
    PegFit peg;
    ThreadFit nut;
    double slope = 0.35;  ///< of `incline`, rad: the angle of its plane
    DrawerFit drawer;
    int triangles = 20'000;  ///< of each part of `pebbles`
    int leaves = 0;          ///< of each body's sphere tree; 0: the default of the scene
    std::filesystem::path bunny = "/usr/share/glmark2/models/bunny.obj";  ///< of `bunnies` and `wedge`
    std::filesystem::path treeCache;                                      ///< folder for sphere trees; empty for none
};

/// A scene file of the program, made with its own choice of options.
struct SceneVariant {
    std::string_view name;  ///< of the file, without extension
    void (*choose)(SceneOptions&);
};

struct SceneInfo {
    std::string_view name;
    std::string_view summary;  ///< one line for help
    /// Throws engine::SceneError or std::invalid_argument with one sentence.
    engine::Scene (*make)(const SceneOptions&);
    /// The files that are bundled with the program; empty for one file of the scene's own name with default options.
    std::span<const SceneVariant> variants = {};
    bool isBundled = true;  ///< false: made on request only
};

/// The one list of computed scenes: a new scene is a row, and the build then makes its file. A scene without computed
/// parts is a file in scenes/.
std::span<const SceneInfo> sceneTable();

/// The bundled files of a row of the table; none if it is made on request only.
std::vector<SceneVariant> bundledVariants(const SceneInfo& scene);

}  // namespace touchstone::app
