#pragma once
// The scenes that come with the program: parts, roles, demonstration, expected outcome.
#include <filesystem>
#include <span>
#include <string_view>

#include "engine/scene/scene.hpp"
#include "tools/parts/bayonet.hpp"
#include "tools/parts/dental.hpp"
#include "tools/parts/gears.hpp"
#include "tools/parts/hook.hpp"
#include "tools/parts/lock.hpp"
#include "tools/parts/shapes.hpp"

namespace touchstone::app {

struct SceneOptions {
    SplineFit fit;     ///< of `spline`
    PocketFit pocket;  ///< of `dental`
    BayonetFit bayonet;
    GearPair gears;
    HookAndEye hook;
    LockFit lock;
    int leaves = 0;  ///< of each body's sphere tree; 0: the scene's own
    std::filesystem::path bunny = "/usr/share/glmark2/models/bunny.obj";  ///< of `bunnies` and `wedge`
    std::filesystem::path treeCache;                                      ///< folder for sphere trees; empty for none
};

struct SceneInfo {
    std::string_view name;
    std::string_view summary;  ///< one line for help
    /// Throws engine::SceneError or std::invalid_argument with one sentence.
    engine::Scene (*make)(const SceneOptions&);
};

/// bunnies, spline, plate, wedge, pinch, dental, bayonet, gears, hook, lock. Adding one is adding a row; a scene
/// without computed parts is a file in scenes/.
std::span<const SceneInfo> sceneTable();

}  // namespace touchstone::app
