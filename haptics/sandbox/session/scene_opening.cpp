#include "haptics/sandbox/session/scene_opening.hpp"

#include <glm/gtc/matrix_transform.hpp>
#include <utility>

#include "engine/scene/cad_scene.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_read.hpp"
#include "engine/scene/gltf_write.hpp"
#include "engine/scene/step_file.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/math/hash.hpp"

namespace touchstone::sandbox {

namespace fs = std::filesystem;

namespace {

constexpr double kCrease = 0.52;  // rad: edges of CAD parts that turn by more are drawn sharp

/// Where the scene of a STEP file is kept, since only glTF can be edited and saved.
fs::path keptScene(const fs::path& step, const fs::path& cache) {
    const std::string path = fs::absolute(step).string();
    const fs::path folder = (cache.empty() ? fs::temp_directory_path() : cache) / "step" /
                            hexadecimal(Hash().add(path.data(), path.size()).value());
    fs::create_directories(folder);
    return folder / (step.stem().string() + ".glb");
}

/// A scene of all solids of a STEP file, whose +z is up as in most CAD programs.
engine::Scene solidsOf(const engine::CadAssembly& assembly, const fs::path& file) {
    std::vector<std::uint32_t> solids;
    std::vector<std::string> warnings;
    for (const std::string& note : assembly.notes) warnings.push_back(file.string() + ": " + note);
    for (std::uint32_t i = 0; i < assembly.parts.size(); ++i) {
        const engine::CadPart& part = assembly.parts[i];
        if (const std::string& problem = assembly.shapes[part.shape].problem; problem.empty())
            solids.push_back(i);
        else
            warnings.push_back(file.string() + ": the part '" + engine::printable(part.name) + "' " + problem);
    }
    if (solids.empty()) throw engine::SceneError(warnings.front());
    const glm::dmat4 up = glm::rotate(glm::dmat4(1), glm::radians(-90.0), {1, 0, 0});
    engine::Scene scene = sceneOf(assembly, solids, {.name = "silver", .metallic = 0.5f}, kCrease, up);
    scene.warnings = std::move(warnings);
    return scene;
}

}  // namespace

SceneOpening::SceneOpening(SceneRequest request_, const std::filesystem::path& treeCache,
                           std::function<Settings(const Settings&)> adjust)
    : request(std::move(request_)),
      file(request.file),
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

engine::Scene SceneOpening::read(const std::stop_token& stop, const fs::path& cache) {
    if (!engine::isStepFile(request.file)) return engine::readGltf(request.file);
    const auto found = engine::readStep(std::span(&request.file, 1), {}, [&](const std::string& what, double fraction) {
        const std::lock_guard lock(mutex_);
        progress_.reading = what;
        progress_.fraction = fraction;
        return !stop.stop_requested();
    });
    if (!found) throw BuildCancelled();
    const engine::Scene made = solidsOf(found->front(), request.file);
    file = keptScene(request.file, cache);
    engine::writeGltf(made, file);
    engine::Scene content = engine::readGltf(file);
    content.warnings.insert(content.warnings.end(), made.warnings.begin(), made.warnings.end());
    const std::lock_guard lock(mutex_);
    progress_.reading.clear();
    return content;
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
        engine::Scene content = read(stop, treeCache);
        engine::applyEdits(content, request.edits);
        scene = std::make_shared<HapticScene>(openScene(std::move(content), options));
    } catch (const BuildCancelled&) {
    } catch (const std::exception& e) {
        error = e.what();
    }
    const std::lock_guard lock(mutex_);
    done_ = true;
}

}  // namespace touchstone::sandbox
