#include "engine/scene/rigid_bodies.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/scene/fields.hpp"

namespace touchstone::engine {
namespace {

constexpr const char* kExtension = "KHR_physics_rigid_bodies";

ColliderGeometry readGeometry(const Scene& scene, Entity node, Fields body, std::vector<std::string>& warnings) {
    ColliderGeometry geometry;
    std::optional<Fields> fields = body.object("geometry");
    // Drafts of the extension before `geometry` had the indices directly in the collider.
    Fields& from = fields ? *fields : body;
    const auto index = [&](const char* key, std::size_t count) {
        return from.whole(key, 0, static_cast<int>(count) - 1).value_or(-1);
    };
    geometry.node = index("node", scene.nodes.size());
    geometry.mesh = index("mesh", scene.meshes.size());
    if (geometry.node >= 0 && !scene.nodes[geometry.node]) from.fail("node", "a node of the loaded scene");
    if (from.flag("convexHull").value_or(false))
        warnings.push_back(nodeLabel(scene, node) + ": convexHull is not supported: the surface itself is used");
    if (from.find("shape"))
        warnings.push_back(nodeLabel(scene, node) +
                           ": implicit shapes are not supported: the meshes of the node are used instead");
    return geometry;
}

}  // namespace

std::optional<RigidBodyMark> readRigidBody(const Scene& scene, Entity node, std::vector<std::string>& warnings) {
    const NodeMarking* marking = scene.registry.find<NodeMarking>(node);
    if (!marking || !marking->extensions->is_object() || !marking->extensions->contains(kExtension)) return {};
    Fields fields(scene, nodeLabel(scene, node), std::string("extensions.") + kExtension,
                  marking->extensions->at(kExtension));
    RigidBodyMark mark;
    mark.motion = fields.object("motion").has_value();
    if (const auto collider = fields.object("collider")) mark.collider = readGeometry(scene, node, *collider, warnings);
    if (const auto trigger = fields.object("trigger")) {
        mark.trigger = true;
        mark.triggerGeometry = readGeometry(scene, node, *trigger, warnings);
    }
    if (fields.find("joint"))
        warnings.push_back(nodeLabel(scene, node) + ": joints are not supported: the body is free");
    return mark;
}

std::string frictionWarning(const Scene& scene) {
    if (!scene.extensions->is_object() || !scene.extensions->contains(kExtension)) return {};
    const nlohmann::json& extension = scene.extensions->at(kExtension);
    if (!extension.is_object() || !extension.contains("physicsMaterials")) return {};
    const nlohmann::json& materials = extension.at("physicsMaterials");
    const bool rough = std::any_of(materials.begin(), materials.end(), [](const nlohmann::json& material) {
        const auto above = [&](const char* key) {
            return material.is_object() && material.contains(key) && material.at(key).is_number() &&
                   material.at(key) > 0;
        };
        return above("staticFriction") || above("dynamicFriction");
    });
    return rough ? "the file defines friction, which is not simulated: contact is frictionless" : "";
}

}  // namespace touchstone::engine
