#include "haptics/sandbox/edit/scene_edit.hpp"

#include <algorithm>
#include <map>

#include "engine/scene/gltf_read.hpp"
#include "engine/scene/transforms.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

using engine::Entity;
using engine::Scene;

Entity nodeAt(const Scene& scene, int index) {
    return index >= 0 && static_cast<std::size_t>(index) < scene.nodes.size()
               ? scene.nodes[static_cast<std::size_t>(index)]
               : Entity{};
}

template <class Edit>
concept Reversible = requires(const Edit& edit) {
    edit.from;
    edit.to;
};
int thingOf(const PlaceNode& edit) { return edit.node; }
int thingOf(const PaintMaterial& edit) { return edit.material; }
int thingOf(const RenameNode& edit) { return edit.node; }

std::vector<SceneEdit> irreversible(const std::vector<SceneEdit>& edits) {
    std::vector<SceneEdit> others;
    const auto isOne = []<class Edit>(const Edit&) { return !Reversible<Edit>; };
    std::copy_if(edits.begin(), edits.end(), std::back_inserter(others),
                 [&](const SceneEdit& edit) { return std::visit(isOne, edit); });
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
    void operator()(const PaintMaterial& edit) const {
        if (edit.material >= 0 && static_cast<std::size_t>(edit.material) < scene.materials.size())
            setLooks(scene, edit.material, edit.to);
    }
    void operator()(const RenameNode& edit) const {
        if (const Entity node = nodeAt(scene, edit.node)) setName(scene, node, edit.to);
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
    const auto joins = [&]<class Edit>(const Edit& next) {
        if constexpr (Reversible<Edit>)
            if (auto* last = edits.empty() ? nullptr : std::get_if<Edit>(&edits.back());
                last && thingOf(*last) == thingOf(next)) {
                last->to = next.to;
                return true;
            }
        return false;
    };
    if (!std::visit(joins, edit)) edits.push_back(std::move(edit));
}

void applyEdits(Scene& scene, const std::vector<SceneEdit>& edits) {
    for (const SceneEdit& edit : edits) std::visit(Applier{scene}, edit);
    updateWorldTransforms(scene);
}

std::optional<std::vector<SceneEdit>> reversibleChange(const std::vector<SceneEdit>& now,
                                                       const std::vector<SceneEdit>& next) {
    if (irreversible(now) != irreversible(next)) return std::nullopt;
    std::map<std::pair<std::size_t, int>, SceneEdit> changes;  // by kind and thing
    // Back to where each thing was before, then to where it is to be: the last word counts.
    for (const SceneEdit& edit : now)
        std::visit(
            [&]<class Edit>(Edit undone) {
                if constexpr (Reversible<Edit>) {
                    std::swap(undone.from, undone.to);
                    changes.try_emplace({edit.index(), thingOf(undone)}, undone);
                }
            },
            edit);
    for (const SceneEdit& edit : next)
        std::visit(
            [&]<class Edit>(const Edit& done) {
                if constexpr (Reversible<Edit>) changes.insert_or_assign({edit.index(), thingOf(done)}, done);
            },
            edit);
    std::vector<SceneEdit> all;
    for (const auto& [which, edit] : changes) all.push_back(edit);
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

}  // namespace touchstone::sandbox
