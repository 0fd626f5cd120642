#include "engine/edit/scene_edit.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_read.hpp"
#include "engine/scene/gltf_write.hpp"
#include "engine/scene/rigid_bodies.hpp"
#include "engine/scene/transforms.hpp"

namespace touchstone::engine {
namespace {

/// Components that saveScene() collects: what was edited.
struct ExtrasEdited {};
struct RigidBodyEdited {};
struct PlaceEdited {};
struct NameEdited {};
struct NodeAdded {
    int parent;
};
struct MotionEdited {  // on an entity of its own
    Entity node;
    std::size_t animation;
    std::optional<Animation> original;  // as in the file; nothing: the animation was added
};
struct LooksEdited {  // on an entity of its own
    int material;
};
struct PartAdded {};  // of nodes that came from another file

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
int thingOf(const AdjustExtras& edit) { return edit.node; }
int thingOf(const PlaceNode& edit) { return edit.node; }
int thingOf(const PaintMaterial& edit) { return edit.material; }
int thingOf(const RenameNode& edit) { return edit.node; }
int thingOf(const SetMotion& edit) { return edit.node; }

bool isMotionOf(const AnimationChannel& channel, Entity node) {
    return channel.target == node && channel.path != AnimationPath::Scale;
}

/// The changed motion of the node; made by the first change.
Entity motionEdited(Scene& scene, Entity node) {
    Entity found;
    scene.registry.each<MotionEdited>([&](Entity entity, const MotionEdited& edited) {
        if (edited.node == node) found = entity;
    });
    if (found) return found;
    MotionEdited edited{node, 0, {}};
    const auto moves = [&](const Animation& animation) {
        return std::any_of(animation.channels.begin(), animation.channels.end(),
                           [&](const AnimationChannel& channel) { return isMotionOf(channel, node); });
    };
    std::vector<Animation>& all = scene.animations;
    while (edited.animation < all.size() && !moves(all[edited.animation])) ++edited.animation;
    if (edited.animation < all.size())
        edited.original = all[edited.animation];
    else
        all.push_back({.name = "demonstration", .channels = {}});
    found = scene.registry.create();
    scene.registry.add(found, std::move(edited));
    return found;
}

std::vector<SceneEdit> irreversible(const std::vector<SceneEdit>& edits) {
    std::vector<SceneEdit> others;
    const auto isOne = []<class Edit>(const Edit&) { return !Reversible<Edit>; };
    std::copy_if(edits.begin(), edits.end(), std::back_inserter(others),
                 [&](const SceneEdit& edit) { return std::visit(isOne, edit); });
    return others;
}

struct Applier {
    Scene& scene;

    void operator()(const SetExtras& edit) const {
        if (edit.node == -1) scene.extras = edit.extras;
        const Entity node = nodeAt(scene, edit.node);
        if (!node) return;
        setExtras(scene, node, *edit.extras);
        scene.registry.add(node, ExtrasEdited{});
    }
    void operator()(const AdjustExtras& edit) const { (*this)(SetExtras{edit.node, edit.to}); }
    void operator()(const SetRigidBody& edit) const {
        if (edit.node == -1) {
            (*scene.extensions)[kRigidBodies] = *edit.body;
            return;
        }
        const Entity node = nodeAt(scene, edit.node);
        NodeMarking* marking = node ? scene.registry.find<NodeMarking>(node) : nullptr;
        if (!marking) return;
        (*marking->extensions)[kRigidBodies] = *edit.body;
        scene.registry.add(node, RigidBodyEdited{});
    }
    void operator()(const PlaceNode& edit) const {
        const Entity node = nodeAt(scene, edit.node);
        if (!node) return;
        scene.registry.add(node, edit.to);
        scene.registry.add(node, PlaceEdited{});
    }
    void operator()(const PaintMaterial& edit) const {
        if (edit.material < 0 || static_cast<std::size_t>(edit.material) >= scene.materials.size()) return;
        Material& changed = scene.materials[static_cast<std::size_t>(edit.material)];
        changed.baseColor = edit.to.baseColor;
        changed.metallic = edit.to.metallic;
        changed.roughness = edit.to.roughness;
        bool known = false;
        scene.registry.each<LooksEdited>(
            [&](Entity, const LooksEdited& edited) { known |= edited.material == edit.material; });
        if (!known) scene.registry.add(scene.registry.create(), LooksEdited{edit.material});
    }
    void operator()(const RenameNode& edit) const {
        const Entity node = nodeAt(scene, edit.node);
        if (!node) return;
        scene.registry.get<Name>(node).value = edit.to;
        scene.registry.add(node, NameEdited{});
    }
    void operator()(const AddPart& edit) const {
        const Scene part = readGltf(edit.file);
        const Entity node = appendScene(scene, part, edit.file.stem().string());
        setExtras(scene, node, *edit.extras);
        scene.registry.add(node, PartAdded{});
    }
    void operator()(const AddNode& edit) const {
        const Entity node = addNode(scene, edit.name, nodeAt(scene, edit.parent), edit.local);
        setExtras(scene, node, *edit.extras);
        scene.registry.add(node, NodeAdded{edit.parent});
        scene.registry.add(node, ExtrasEdited{});
        scene.registry.add(node, PlaceEdited{});
        scene.registry.add(node, NameEdited{});
    }
    void operator()(const SetMotion& edit) const {
        const Entity node = nodeAt(scene, edit.node);
        if (!node) return;
        const Entity entity = motionEdited(scene, node);
        const MotionEdited& edited = scene.registry.get<MotionEdited>(entity);
        Animation& animation = scene.animations[edited.animation];
        if (edit.to) {
            std::erase_if(animation.channels,
                          [&](const AnimationChannel& channel) { return isMotionOf(channel, node); });
            for (AnimationChannel channel : edit.to->channels) {
                channel.target = node;
                animation.channels.push_back(std::move(channel));
            }
            return;
        }
        if (edited.original)
            animation = *edited.original;
        else
            scene.animations.erase(scene.animations.begin() + static_cast<std::ptrdiff_t>(edited.animation));
        scene.registry.destroy(entity);
    }
};

bool addsNode(const SceneEdit& edit) { return std::holds_alternative<AddNode>(edit); }

}  // namespace

Looks looksOf(const Material& material) { return {material.baseColor, material.metallic, material.roughness}; }

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
    const std::vector<SceneEdit> before = irreversible(now), after = irreversible(next);
    if (after.size() < before.size() || !std::equal(before.begin(), before.end(), after.begin()) ||
        !std::all_of(after.begin() + static_cast<std::ptrdiff_t>(before.size()), after.end(), addsNode))
        return std::nullopt;
    std::map<std::pair<std::size_t, int>, SceneEdit> changes;  // by kind and object
    // First undo the edits of `now`, then apply those of `next`; the last edit of each object counts.
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
    std::vector<SceneEdit> all(after.begin() + static_cast<std::ptrdiff_t>(before.size()), after.end());
    for (const auto& [which, edit] : changes) all.push_back(edit);
    return all;
}

LocalTransform placedAt(const Registry& registry, Entity node, const RigidPart& wanted) {
    const Entity parent = registry.get<Hierarchy>(node).parent;
    const glm::dmat4 X_WP = parent ? worldMatrix(registry, parent) : glm::dmat4(1);
    const glm::dmat4 rest(rigidPart(worldMatrix(registry, node)).rest);
    LocalTransform local = localTransform(glm::inverse(X_WP) * rigidMatrix(wanted) * rest);
    // Keep components that differ only by rounding.
    const auto& old = registry.get<LocalTransform>(node);
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

void saveScene(const Scene& scene, const std::filesystem::path& out) {
    if (scene.file.empty()) throw SceneError("the scene was not read from a file: write it with writeGltf() first");
    bool hasParts = false;
    scene.registry.each<PartAdded>([&](Entity, const PartAdded&) { hasParts = true; });
    if (hasParts) {
        writeGltf(scene, out);
        return;
    }
    GltfUpdate update;
    scene.registry.each<NodeAdded>(
        [&](Entity node, const NodeAdded& added) { update.addedNodes[nodeIndex(scene, node)] = added.parent; });
    scene.registry.each<MotionEdited>([&](Entity, const MotionEdited& edited) {
        const int node = nodeIndex(scene, edited.node);
        Animation motion = scene.animations[edited.animation];
        std::erase_if(motion.channels,
                      [&](const AnimationChannel& channel) { return !isMotionOf(channel, edited.node); });
        update.motions[static_cast<int>(edited.animation)] = {node, std::move(motion)};
        update.places[node] = scene.registry.get<LocalTransform>(edited.node);  // an animated node has no matrix
    });
    scene.registry.each<ExtrasEdited, NodeMarking>([&](Entity node, const ExtrasEdited&, const NodeMarking& marking) {
        update.nodes[nodeIndex(scene, node)] = *marking.extras;
    });
    scene.registry.each<RigidBodyEdited, NodeMarking>(
        [&](Entity node, const RigidBodyEdited&, const NodeMarking& marking) {
            update.rigidBodies[nodeIndex(scene, node)] = marking.extensions->at(kRigidBodies);
        });
    if (scene.extensions->contains(kRigidBodies)) update.rigidBodies[-1] = scene.extensions->at(kRigidBodies);
    scene.registry.each<PlaceEdited, LocalTransform>([&](Entity node, const PlaceEdited&, const LocalTransform& local) {
        update.places[nodeIndex(scene, node)] = local;
    });
    scene.registry.each<NameEdited, Name>(
        [&](Entity node, const NameEdited&, const Name& name) { update.names[nodeIndex(scene, node)] = name.value; });
    scene.registry.each<LooksEdited>([&](Entity, const LooksEdited& edited) {
        update.materials[edited.material] = scene.materials[static_cast<std::size_t>(edited.material)];
    });
    update.scene = scene.index;
    update.scenes[scene.index] = *scene.extras;
    updateGltf(scene.file, out, update);
}

}  // namespace touchstone::engine
