#pragma once
// What the module is made of, and what its parts share.
#include <memory>

#include "haptics/sandbox/scene/scene_world.hpp"
#include "tools/python/bindings/arrays.hpp"

namespace touchstone::python {

/// A scene as Python holds it. Its sphere trees are built when something first needs them.
class SceneHandle {
  public:
    SceneHandle(const std::string& file, int leaves, bool trees);

    const sandbox::HapticScene& scene() const { return *scene_; }
    std::shared_ptr<const sandbox::HapticScene> shared() const { return scene_; }
    /// With the sphere trees of all parts if these settings touch them.
    std::shared_ptr<const World> world(const Settings& settings);
    void buildTrees();

  private:
    std::shared_ptr<sandbox::HapticScene> open(const std::filesystem::path& file, bool trees) const;

    int leaves_;
    std::shared_ptr<sandbox::HapticScene> scene_;
};

/// Throws TypeError with one sentence if it is no scene.
SceneHandle& sceneOf(const py::object& scene);

/// The scene's settings or those given. Throws std::invalid_argument if they contradict each other.
Settings settingsFor(const SceneHandle& scene, const std::optional<Settings>& given);

void bindSettings(py::module_& module);
void bindFlags(py::module_& module);
void bindScenes(py::module_& module);
void bindWorlds(py::module_& module);
void bindRuns(py::module_& module);
void bindSolvers(py::module_& module);
void bindShapes(py::module_& module);

}  // namespace touchstone::python
