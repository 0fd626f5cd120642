#include "haptics/sandbox/scene/marking.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/rigid_bodies.hpp"
#include "haptics/sandbox/scene/friction.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"

namespace touchstone::sandbox {
namespace {

using engine::Entity;
using engine::Scene;
using engine::SceneEdit;
using nlohmann::json;

json withRole(json extras, std::optional<Role> role) {
    if (role) {
        extras["touchstone"]["role"] = name(*role);
    } else if (extras.contains("touchstone")) {
        extras["touchstone"].erase("role");
        if (extras["touchstone"].empty()) extras.erase("touchstone");
    }
    return extras.empty() ? json() : extras;
}

json withTree(json extras, const TreeOptions& tree) {
    json& mark = extras["touchstone"];
    for (const char* key : {"leaves", "max_error_mm", "quality", "interior"}) mark.erase(key);
    if (tree.maxError > 0)
        mark["max_error_mm"] = tree.maxError;
    else
        mark["leaves"] = tree.leaves;
    if (tree.quality != TreeQuality::Fast) mark["quality"] = name(tree.quality);
    if (tree.interior != Interior::Shell) mark["interior"] = name(tree.interior);
    return extras;
}

json withFriction(json extras, const std::optional<engine::FrictionMaterial>& friction) {
    json& mark = extras["touchstone"];
    if (friction)
        engine::writeFriction(mark, *friction);
    else
        for (const char* key : {"staticFriction", "dynamicFriction", "frictionCombine"}) mark.erase(key);
    return extras;
}

class Marker {
  public:
    Marker(std::vector<SceneEdit>& edits, const Scene& scene) : edits_(edits), scene_(scene) {}

    void operator()(const GiveRole& marking) const {
        if (!isNode(marking.node)) return;
        std::vector<SceneEdit> made;
        checkRoleIsFree(marking.node);
        if (marking.role == Role::Tool) made = otherToolsToVisual(marking.node);
        made.push_back(engine::SetExtras{marking.node, withRole(extrasOf(marking.node), marking.role)});
        append(made);
    }
    void operator()(const ChooseTree& marking) const {
        if (isNode(marking.node))
            append({engine::SetExtras{marking.node, withTree(extrasOf(marking.node), marking.tree)}});
    }
    void operator()(const ChooseFriction& marking) const {
        if (!isNode(marking.node)) return;
        const std::vector<Entity> colliders = collidersOf(scene_, nodeAt(marking.node));
        if (colliders.empty())
            append({engine::SetExtras{marking.node, withFriction(extrasOf(marking.node), marking.friction)}});
        else if (marking.friction)
            setMaterial(colliders, *marking.friction);
        else
            removeMaterial(colliders);
    }
    void operator()(const AddBody& marking) const {
        std::vector<SceneEdit> made;
        if (marking.role == Role::Tool) made = otherToolsToVisual(-1);
        made.push_back(engine::AddPart{marking.file, withRole(json::object(), marking.role)});
        append(made);
    }

  private:
    bool isNode(int index) const {
        return index >= 0 && static_cast<std::size_t>(index) < scene_.nodes.size() &&
               scene_.nodes[static_cast<std::size_t>(index)];
    }
    Entity nodeAt(int index) const { return scene_.nodes[static_cast<std::size_t>(index)]; }

    /// The extras of the node after the newest edit; without one, those in the scene.
    json extrasOf(int index) const {
        json extras;
        if (const auto* marking = scene_.registry.find<engine::NodeMarking>(nodeAt(index))) extras = *marking->extras;
        for (const SceneEdit& edit : edits_)
            if (const auto* set = std::get_if<engine::SetExtras>(&edit); set && set->node == index)
                extras = *set->extras;
            else if (const auto* adjusted = std::get_if<engine::AdjustExtras>(&edit);
                     adjusted && adjusted->node == index)
                extras = *adjusted->to;
        if (extras.is_null()) return json::object();
        if (!extras.is_object())
            engine::failIn(scene_.file, nodeLabel(scene_, nodeAt(index)),
                           "its extras are not a JSON object: make them one to mark the node");
        return extras;
    }
    /// The KHR_physics_rigid_bodies of a node, or of the root as -1, after the newest edit.
    json rigidBodyOf(int index) const {
        const json& extensions =
            index == -1 ? *scene_.extensions : *scene_.registry.get<engine::NodeMarking>(nodeAt(index)).extensions;
        json body = extensions.is_object() ? extensions.value(engine::kRigidBodies, json::object()) : json::object();
        for (const SceneEdit& edit : edits_)
            if (const auto* set = std::get_if<engine::SetRigidBody>(&edit); set && set->node == index)
                body = *set->body;
        return body;
    }
    void setMaterial(const std::vector<Entity>& colliders, const engine::FrictionMaterial& friction) const {
        json file = rigidBodyOf(-1);
        json& materials = file["physicsMaterials"];
        std::vector<SceneEdit> made;
        std::optional<std::size_t> used;
        for (const Entity node : colliders)
            if (const json collider = rigidBodyOf(nodeIndex(scene_, node)).at("collider");
                !used && collider.contains("physicsMaterial"))
                used = collider.at("physicsMaterial").get<std::size_t>();
        if (used) {
            engine::writeFriction(materials.at(*used), friction);
        } else {
            json added = json::object();
            engine::writeFriction(added, friction);
            materials.push_back(added);
            for (const Entity node : colliders) {
                json body = rigidBodyOf(nodeIndex(scene_, node));
                body["collider"]["physicsMaterial"] = materials.size() - 1;
                made.push_back(engine::SetRigidBody{nodeIndex(scene_, node), body});
            }
        }
        made.push_back(engine::SetRigidBody{-1, file});
        append(made);
    }
    /// The material stays in the file: other parts may use it, and indices must not change.
    void removeMaterial(const std::vector<Entity>& colliders) const {
        std::vector<SceneEdit> made;
        for (const Entity node : colliders) {
            json body = rigidBodyOf(nodeIndex(scene_, node));
            body["collider"].erase("physicsMaterial");
            made.push_back(engine::SetRigidBody{nodeIndex(scene_, node), body});
        }
        append(made);
    }
    void checkRoleIsFree(int index) const {
        std::vector<std::string> unused;
        const auto body = engine::readRigidBody(scene_, nodeAt(index), unused);
        if (body && (body->motion || body->collider || body->trigger))
            engine::failIn(scene_.file, nodeLabel(scene_, nodeAt(index)),
                           "its role comes from KHR_physics_rigid_bodies: change it there");
    }
    std::vector<SceneEdit> otherToolsToVisual(int tool) const {
        std::vector<SceneEdit> made;
        for (int index = 0; static_cast<std::size_t>(index) < scene_.nodes.size(); ++index) {
            if (index == tool || !isNode(index)) continue;
            const Role* role = scene_.registry.find<Role>(nodeAt(index));
            if (!(role && *role == Role::Tool) && !isMarkedTool(index)) continue;
            checkRoleIsFree(index);
            made.emplace_back(engine::SetExtras{index, withRole(extrasOf(index), Role::Visual)});
        }
        return made;
    }
    bool isMarkedTool(int index) const {
        const auto* marking = scene_.registry.find<engine::NodeMarking>(nodeAt(index));
        const bool edited = std::any_of(edits_.begin(), edits_.end(), [&](const SceneEdit& edit) {
            const auto* set = std::get_if<engine::SetExtras>(&edit);
            return set && set->node == index;
        });
        if (!edited && (!marking || !marking->extras->is_object())) return false;
        const json extras = extrasOf(index);
        const auto mark = extras.find("touchstone");
        return mark != extras.end() && mark->is_object() && mark->value("role", json()) == name(Role::Tool);
    }
    void append(std::vector<SceneEdit> made) const {
        for (SceneEdit& edit : made) engine::append(edits_, std::move(edit));
    }

    std::vector<SceneEdit>& edits_;
    const Scene& scene_;
};

}  // namespace

void appendMarking(std::vector<SceneEdit>& edits, const Scene& scene, const Marking& marking) {
    std::visit(Marker(edits, scene), marking);
}

void applyMarking(Scene& scene, const Marking& marking) {
    std::vector<SceneEdit> edits;
    appendMarking(edits, scene, marking);
    engine::applyEdits(scene, edits);
}

bool movesRigidly(const engine::Registry& registry, Entity node) {
    const Entity owner = roleOwner(registry, registry.get<engine::Hierarchy>(node).parent);
    const Role* role = owner ? registry.find<Role>(owner) : nullptr;
    const bool own = registry.has<Role>(node);  // it belongs to no body above
    return own || !role || (*role != Role::Tool && *role != Role::Obstacle);
}

}  // namespace touchstone::sandbox
