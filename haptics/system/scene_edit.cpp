#include "haptics/system/scene_edit.hpp"

#include <algorithm>
#include <map>

#include "engine/scene/gltf_read.hpp"
#include "engine/scene/transforms.hpp"
#include "haptics/system/units.hpp"

namespace touchstone::system {
namespace {

using engine::Entity;
using engine::Scene;

Entity nodeAt(const Scene& scene, int index) {
    return index >= 0 && static_cast<std::size_t>(index) < scene.nodes.size()
               ? scene.nodes[static_cast<std::size_t>(index)]
               : Entity{};
}

std::vector<SceneEdit> withoutPlaces(const std::vector<SceneEdit>& edits) {
    std::vector<SceneEdit> others;
    std::copy_if(edits.begin(), edits.end(), std::back_inserter(others),
                 [](const SceneEdit& edit) { return !std::holds_alternative<PlaceNode>(edit); });
    return others;
}

struct Applier {
    Scene& scene;

    void operator()(const GiveRole& edit) const {
        if (const Entity node = nodeAt(scene, edit.node)) setRole(scene, node, edit.role);
    }
    void operator()(const ChooseTree& edit) const {
        if (const Entity node = nodeAt(scene, edit.node)) setTree(scene, node, edit.tree);
    }
    void operator()(const PlaceNode& edit) const {
        if (const Entity node = nodeAt(scene, edit.node)) setPlace(scene, node, edit.to);
    }
    void operator()(const AddPart& edit) const {
        const Scene part = engine::readGltf(edit.file);
        const Entity node = engine::appendScene(scene, part, edit.file.stem().string());
        scene.registry.add(node, AddedPart{});
        setRole(scene, node, edit.role);
    }
};

}  // namespace

void append(std::vector<SceneEdit>& edits, SceneEdit edit) {
    if (auto* place = std::get_if<PlaceNode>(&edit))
        if (auto* last = edits.empty() ? nullptr : std::get_if<PlaceNode>(&edits.back());
            last && last->node == place->node) {
            last->to = place->to;
            return;
        }
    edits.push_back(std::move(edit));
}

void applyEdits(Scene& scene, const std::vector<SceneEdit>& edits) {
    for (const SceneEdit& edit : edits) std::visit(Applier{scene}, edit);
    updateWorldTransforms(scene);
}

std::optional<std::vector<PlaceNode>> onlyPlacesDiffer(const std::vector<SceneEdit>& now,
                                                       const std::vector<SceneEdit>& next) {
    if (withoutPlaces(now) != withoutPlaces(next)) return std::nullopt;
    std::map<int, PlaceNode> places;
    // Back to where each node was before, then to where it is to be: the last word counts.
    for (const SceneEdit& edit : now)
        if (const auto* place = std::get_if<PlaceNode>(&edit))
            places.try_emplace(place->node, PlaceNode{place->node, place->to, place->from});
    for (const SceneEdit& edit : next)
        if (const auto* place = std::get_if<PlaceNode>(&edit)) places[place->node] = *place;
    std::vector<PlaceNode> all;
    for (const auto& [node, place] : places) all.push_back(place);
    return all;
}

engine::LocalTransform placedAt(const engine::Registry& registry, Entity node, const Pose& X_WN) {
    const Entity parent = registry.get<engine::Hierarchy>(node).parent;
    const glm::dmat4 X_WP = parent ? worldMatrix(registry, parent) : glm::dmat4(1);
    const glm::dmat4 rest(engine::rigidPart(worldMatrix(registry, node)).rest);
    engine::LocalTransform local = engine::localTransform(glm::inverse(X_WP) * toMatrix(X_WN) * rest);
    // Rounding is no reason to touch what was not meant.
    const auto& old = registry.get<engine::LocalTransform>(node);
    constexpr double kRounding = 1e-9;
    const auto near = [](const auto& a, const auto& b, int count) {
        for (int k = 0; k < count; ++k)
            if (!(glm::length(a[k] - b[k]) <= kRounding * (1 + glm::length(b[k])))) return false;
        return true;
    };
    if (near(local.scale, old.scale, 3)) local.scale = old.scale;
    if (near(local.shear, old.shear, 3)) local.shear = old.shear;
    return local;
}

bool movesRigidly(const engine::Registry& registry, Entity node) {
    const Entity owner = roleOwner(registry, registry.get<engine::Hierarchy>(node).parent);
    const Role* role = owner ? registry.find<Role>(owner) : nullptr;
    const bool body = registry.has<BodyMarking>(node);  // the tool or an obstacle itself
    return body || !role || (*role != Role::Tool && *role != Role::Obstacle);
}

}  // namespace touchstone::system
