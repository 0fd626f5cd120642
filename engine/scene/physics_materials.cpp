#include "engine/scene/physics_materials.hpp"

#include <nlohmann/json.hpp>

#include "engine/scene/rigid_bodies.hpp"

namespace touchstone::engine {
namespace {

using nlohmann::json;

std::string labelOf(const json& material, std::size_t index) {
    const auto name = material.is_object() ? material.find("name") : material.end();
    return objectLabel("physics material", index,
                       name != material.end() && name->is_string() ? name->get<std::string>() : "");
}

/// The list in the file's extension; null if the file has none.
const json* listOf(const Scene& scene) {
    if (!scene.extensions->is_object() || !scene.extensions->contains(kRigidBodies)) return nullptr;
    const std::string path = std::string("extensions.") + kRigidBodies;
    Fields extension(scene, "", path, scene.extensions->at(kRigidBodies));
    const json* list = extension.find("physicsMaterials");
    if (list && !list->is_array()) extension.fail("physicsMaterials", "a list of materials");
    return list;
}

}  // namespace

FrictionMaterial readFriction(Fields& fields) {
    FrictionMaterial friction;
    friction.staticFriction = fields.number("staticFriction", 0, kMaxFriction);
    friction.dynamicFriction = fields.number("dynamicFriction", 0, kMaxFriction);
    if (const auto known = fields.choice("frictionCombine", kFrictionCombineNames))
        friction.frictionCombine = static_cast<FrictionCombine>(*known);
    return friction;
}

void writeFriction(json& object, const FrictionMaterial& friction) {
    if (friction.staticFriction) object["staticFriction"] = *friction.staticFriction;
    if (friction.dynamicFriction) object["dynamicFriction"] = *friction.dynamicFriction;
    if (friction.frictionCombine) object["frictionCombine"] = name(*friction.frictionCombine);
}

std::vector<FrictionMaterial> readPhysicsMaterials(const Scene& scene) {
    std::vector<FrictionMaterial> materials;
    const json* list = listOf(scene);
    if (!list) return materials;
    for (const json& item : *list) {
        const std::size_t index = materials.size();
        Fields fields(scene, labelOf(item, index),
                      std::string("extensions.") + kRigidBodies + ".physicsMaterials[" + std::to_string(index) + "]",
                      item);
        materials.push_back(readFriction(fields));
    }
    return materials;
}

std::size_t physicsMaterialCount(const Scene& scene) {
    const json* list = listOf(scene);
    return list ? list->size() : 0;
}

std::string physicsMaterialLabel(const Scene& scene, int index) {
    const auto at = static_cast<std::size_t>(index);
    return labelOf(listOf(scene)->at(at), at);
}

}  // namespace touchstone::engine
