#include "haptics/sandbox/scene/flat_keys.hpp"

#include <nlohmann/json.hpp>
#include <string_view>

#include "engine/scene/gltf_container.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::json;

constexpr std::string_view kPrefix = "touchstone_";
constexpr std::string_view kObjects[] = {"goal", "gauge", "outcome", "settings"};

void nest(const engine::Scene& scene, const std::string& object, json& extras) {
    if (!extras.is_object()) return;
    std::vector<std::string> flat;
    for (const auto& [key, value] : extras.items())
        if (key.starts_with(kPrefix) && key.size() > kPrefix.size()) flat.push_back(key);
    for (const std::string& key : flat) {
        json* into = &extras.emplace("touchstone", json::object()).first.value();
        std::string name = key.substr(kPrefix.size());
        for (const std::string_view nested : kObjects)
            if (into->is_object() && name.starts_with(std::string(nested) + '_')) {
                into = &into->emplace(nested, json::object()).first.value();
                name.erase(0, nested.size() + 1);
                break;
            }
        if (!into->is_object() || into->contains(name))
            engine::failIn(
                scene.file, object,
                "extras." + engine::printable(key) + " says again what extras.touchstone says: remove one of them");
        (*into)[name] = std::move(extras[key]);
        extras.erase(key);
    }
}

}  // namespace

void nestFlatKeys(engine::Scene& scene) {
    nest(scene, engine::objectLabel("scene", static_cast<std::size_t>(scene.index)), *scene.extras);
    for (const engine::Entity node : scene.nodes)
        if (auto* marking = node ? scene.registry.find<engine::NodeMarking>(node) : nullptr)
            nest(scene, nodeLabel(scene, node), *marking->extras);
    for (std::size_t i = 0; i < scene.animations.size(); ++i)
        nest(scene, engine::objectLabel("animation", i, scene.animations[i].name), *scene.animations[i].extras);
}

}  // namespace touchstone::sandbox
