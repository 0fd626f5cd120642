#include "engine/edit/scene_scale.hpp"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_container.hpp"

namespace touchstone::engine {
namespace {

/// Scales all numbers of a value.
void scaleNumbers(nlohmann::json& value, double scale) {
    if (value.is_number()) value = scale * value.get<double>();
    if (value.is_structured())
        for (nlohmann::json& part : value) scaleNumbers(part, scale);
}

/// Whether the values of this key are lengths that scale with the parts. Precisions in millimeters do not.
bool isLength(const std::string& key) {
    return (key.ends_with("_m") && !key.ends_with("_per_m")) || key == "translation" || key == "clearance_mm" ||
           key == "deviation_mm";
}

/// Scales the lengths in extras.
void scaleLengths(nlohmann::json& extras, double scale) {
    if (!extras.is_structured()) return;
    for (const auto& [key, value] : extras.items())
        if (isLength(key))
            scaleNumbers(value, scale);
        else
            scaleLengths(value, scale);
}

bool scales(const Animation& animation, Entity node) {
    return std::ranges::any_of(animation.channels, [&](const AnimationChannel& channel) {
        return channel.target == node && channel.path == AnimationPath::Scale;
    });
}

}  // namespace

std::vector<SceneEdit> scaled(const Scene& scene, double scale, const char* member) {
    std::vector<SceneEdit> edits;
    const auto scaleExtras = [&](int node, const nlohmann::json& before) {
        if (!before.is_object() || !before.contains(member)) return;
        nlohmann::json extras = before;
        scaleLengths(extras[member], scale);
        if (extras != before) edits.push_back(SetExtras{node, std::move(extras)});
    };
    scaleExtras(-1, *scene.extras);
    for (const Entity node : scene.nodes)
        if (const auto* marking = node ? scene.registry.find<NodeMarking>(node) : nullptr)
            scaleExtras(nodeIndex(scene, node), *marking->extras);
    for (const Entity root : scene.roots) {
        const auto moves = [&](const Animation& animation) { return animates(animation, root); };
        const auto first = std::ranges::find_if(scene.animations, moves);
        if (std::ranges::count_if(scene.animations, moves) > 1 ||
            (first != scene.animations.end() && scales(*first, root)))
            failIn(scene.file, nodeLabel(scene, root),
                   "it has several motions, or one that scales it, which would not be scaled with it: scale the "
                   "scene where it was made");
        if (first != scene.animations.end()) {
            auto motion = std::make_shared<Animation>();
            for (AnimationChannel channel : first->channels) {
                if (channel.target != root) continue;
                if (channel.path == AnimationPath::Translation)
                    for (glm::dvec4& value : channel.values) value *= scale;  // and tangents
                motion->channels.push_back(std::move(channel));
            }
            edits.push_back(SetMotion{nodeIndex(scene, root), {}, std::move(motion)});
        }
        const auto from = scene.registry.get<LocalTransform>(root);
        auto to = from;
        to.translation *= scale;
        to.scale *= scale;
        edits.push_back(PlaceNode{nodeIndex(scene, root), from, to});
    }
    return edits;
}

}  // namespace touchstone::engine
