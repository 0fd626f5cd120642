#include "engine/scene/rigid_bodies.hpp"

#include <nlohmann/json.hpp>

#include "engine/scene/fields.hpp"
#include "engine/scene/physics_materials.hpp"

namespace touchstone::engine {
namespace {

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

std::optional<int> readMaterial(const Scene& scene, Fields& collider) {
    if (!collider.find("physicsMaterial")) return {};
    const auto count = static_cast<int>(physicsMaterialCount(scene));
    if (count == 0) collider.fail("physicsMaterial", "left out, since the file has no physics materials");
    return collider.whole("physicsMaterial", 0, count - 1);
}

}  // namespace

std::optional<RigidBodyMark> readRigidBody(const Scene& scene, Entity node, std::vector<std::string>& warnings) {
    const NodeMarking* marking = scene.registry.find<NodeMarking>(node);
    if (!marking || !marking->extensions->is_object() || !marking->extensions->contains(kRigidBodies)) return {};
    Fields fields(scene, nodeLabel(scene, node), std::string("extensions.") + kRigidBodies,
                  marking->extensions->at(kRigidBodies));
    RigidBodyMark mark;
    mark.motion = fields.object("motion").has_value();
    if (auto collider = fields.object("collider")) {
        mark.collider = readGeometry(scene, node, *collider, warnings);
        mark.material = readMaterial(scene, *collider);
    }
    if (const auto trigger = fields.object("trigger")) {
        mark.trigger = true;
        mark.triggerGeometry = readGeometry(scene, node, *trigger, warnings);
    }
    if (fields.find("joint"))
        warnings.push_back(nodeLabel(scene, node) + ": joints are not supported: the body is free");
    return mark;
}

}  // namespace touchstone::engine
