#include "haptics/sandbox/session/scene_opening.hpp"

#include <utility>

#include "engine/scene/gltf_read.hpp"
#include "haptics/builder/tree_builder.hpp"

namespace touchstone::sandbox {

SceneOpening::SceneOpening(SceneRequest request_, const std::filesystem::path& treeCache,
                           std::function<Settings(const Settings&)> adjust)
    : request(std::move(request_)),
      progress_{.file = request.file.filename().string(), .part = {}},
      thread_([this, treeCache, adjust = std::move(adjust)](const std::stop_token& stop) {
          run(stop, treeCache, adjust);
      }) {}

bool SceneOpening::done() const {
    const std::lock_guard lock(mutex_);
    return done_;
}

OpeningProgress SceneOpening::progress() const {
    const std::lock_guard lock(mutex_);
    return progress_;
}

void SceneOpening::run(const std::stop_token& stop, const std::filesystem::path& treeCache,
                       const std::function<Settings(const Settings&)>& adjust) {
    SceneOptions options{.treeCache = treeCache, .progress = {}, .allTrees = request.allTrees, .adjust = adjust};
    options.progress = [&](const SceneStatus& status) {
        const std::lock_guard lock(mutex_);
        progress_.part = status.part;
        progress_.fraction = status.fraction;
        progress_.secondsLeft = status.secondsLeft;
        return !stop.stop_requested();
    };
    if (request.settings) options.adjust = [this](const Settings&) { return *request.settings; };
    try {
        engine::Scene read = engine::readGltf(request.file);
        engine::applyEdits(read, request.edits);
        scene = std::make_shared<HapticScene>(openScene(std::move(read), options));
    } catch (const BuildCancelled&) {
    } catch (const std::exception& e) {
        error = e.what();
    }
    const std::lock_guard lock(mutex_);
    done_ = true;
}

}  // namespace touchstone::sandbox
