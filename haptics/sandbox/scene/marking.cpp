#include "haptics/sandbox/scene/marking.hpp"

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/rigid_bodies.hpp"
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

    /// What the newest edit gives the node, else what the scene has.
    json extrasOf(int index) const {
        json extras;
        if (const auto* marking = scene_.registry.find<engine::NodeMarking>(nodeAt(index))) extras = marking->extras;
        for (const SceneEdit& edit : edits_)
            if (const auto* set = std::get_if<engine::SetExtras>(&edit); set && set->node == index)
                extras = set->extras;
        if (extras.is_null()) return json::object();
        if (!extras.is_object())
            engine::failIn(scene_.file, nodeLabel(scene_, nodeAt(index)),
                           "its extras are no object: make them one to mark the node");
        return extras;
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
        if (!edited && (!marking || !marking->extras.is_object())) return false;
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
    const bool body = registry.has<BodyMarking>(node);  // the tool or an obstacle itself
    return body || !role || (*role != Role::Tool && *role != Role::Obstacle);
}

}  // namespace touchstone::sandbox
