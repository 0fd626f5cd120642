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

/// The material of a collider: nothing if it names none.
std::optional<FrictionMaterial> readMaterial(const Scene& scene, Fields& collider) {
    const bool inDocument = scene.extensions->is_object() && scene.extensions->contains(kExtension);
    std::optional<Fields> document;
    if (inDocument)
        document.emplace(scene, "file", std::string("extensions.") + kExtension, scene.extensions->at(kExtension));
    const nlohmann::json* materials = document ? document->find("physicsMaterials") : nullptr;
    if (materials && !materials->is_array()) document->fail("physicsMaterials", "an array");
    if (!collider.find("physicsMaterial")) return {};
    if (!materials || materials->empty())
        collider.fail("physicsMaterial", "absent, since the file has no physicsMaterials");
    const auto index = collider.whole("physicsMaterial", 0, static_cast<int>(materials->size()) - 1);
    Fields fields(scene, "file",
                  std::string("extensions.") + kExtension + ".physicsMaterials[" + std::to_string(*index) + "]",
                  materials->at(static_cast<std::size_t>(*index)));
    return readFriction(fields);
}

}  // namespace

FrictionMaterial readFriction(Fields& fields) {
    // Rubber on rubber reaches 2; more than 10 is a mistake of the unit or of the exporter.
    constexpr double kMostFriction = 10;
    FrictionMaterial material;
    const auto atRest = fields.number("staticFriction", 0, kMostFriction);
    const auto sliding = fields.number("dynamicFriction", 0, kMostFriction);
    const auto combine = fields.choice("frictionCombine", kFrictionCombineNames);
    material.staticFriction = atRest.value_or(material.staticFriction);
    material.dynamicFriction = sliding.value_or(material.dynamicFriction);
    if (combine) material.combine = static_cast<FrictionCombine>(*combine);
    material.complete = atRest && sliding && combine;
    return material;
}

double combined(double a, double b, FrictionCombine combine) {
    switch (combine) {
        case FrictionCombine::Average:
            return (a + b) / 2;
        case FrictionCombine::Minimum:
            return std::min(a, b);
        case FrictionCombine::Maximum:
            return std::max(a, b);
        case FrictionCombine::Multiply:
            break;
    }
    return a * b;
}

std::optional<RigidBodyMark> readRigidBody(const Scene& scene, Entity node, std::vector<std::string>& warnings) {
    const NodeMarking* marking = scene.registry.find<NodeMarking>(node);
    if (!marking || !marking->extensions->is_object() || !marking->extensions->contains(kExtension)) return {};
    Fields fields(scene, nodeLabel(scene, node), std::string("extensions.") + kExtension,
                  marking->extensions->at(kExtension));
    RigidBodyMark mark;
    mark.motion = fields.object("motion").has_value();
    if (auto collider = fields.object("collider")) {
        mark.collider = readGeometry(scene, node, *collider, warnings);
        mark.friction = readMaterial(scene, *collider);
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
