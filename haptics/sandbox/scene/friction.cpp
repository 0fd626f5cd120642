#include "haptics/sandbox/scene/friction.hpp"

#include <algorithm>

#include "engine/scene/rigid_bodies.hpp"
#include "engine/scene/text.hpp"

namespace touchstone::sandbox {
namespace {

using engine::Entity;
using engine::FrictionCombine;
using engine::FrictionMaterial;
using engine::Scene;

std::optional<engine::RigidBodyMark> rigidBodyOf(const Scene& scene, Entity node) {
    std::vector<std::string> known;  // these warnings were given when the roles were assigned
    return engine::readRigidBody(scene, node, known);
}

/// Says which keys are absent and what is used instead; empty if none is.
std::string defaultsOf(const FrictionMaterial& friction, const std::string& source) {
    const std::string number = engine::formatted("%g", engine::kDefaultFriction);
    std::vector<const char*> absent;
    std::string values;
    const auto add = [&](bool given, const char* key, const std::string& value) {
        if (given) return;
        values += (absent.empty() ? "" : ", ") + value;
        absent.push_back(key);
    };
    add(friction.staticFriction.has_value(), "staticFriction", number);
    add(friction.dynamicFriction.has_value(), "dynamicFriction", number);
    add(friction.frictionCombine.has_value(), "frictionCombine", name(friction.combineOr()));
    if (absent.empty()) return "";
    return source + " sets no " + engine::anyOf(absent) + ", so the defaults are used: " + values;
}

/// Adds a sentence unless it is there: parts may share a material.
void addOnce(std::vector<std::string>& sentences, const std::string& sentence) {
    if (std::find(sentences.begin(), sentences.end(), sentence) == sentences.end()) sentences.push_back(sentence);
}

/// The coefficients of a material. Friction at rest is never below that of sliding, or a contact that begins to slide
/// would be held back harder.
Friction coefficients(const FrictionMaterial& material) {
    return {std::max(material.staticOr(), material.dynamicOr()), material.dynamicOr()};
}

}  // namespace

std::vector<Entity> collidersOf(const Scene& scene, Entity part) {
    std::vector<Entity> colliders;
    for (const Entity node : scene.nodes) {
        if (!node || roleOwner(scene.registry, node) != part) continue;
        if (const auto body = rigidBodyOf(scene, node); body && body->collider) colliders.push_back(node);
    }
    return colliders;
}

void assignFriction(Scene& scene, const std::vector<Entity>& parts, std::vector<std::string>& notes,
                    std::vector<std::string>& warnings) {
    const std::vector<FrictionMaterial> materials = engine::readPhysicsMaterials(scene);
    for (const Entity part : parts) {
        std::optional<PartFriction>& friction = scene.registry.get<BodyMarking>(part).friction;
        const std::string label = nodeLabel(scene, part);
        const std::vector<Entity> colliders = collidersOf(scene, part);
        if (!colliders.empty()) {
            if (friction)
                warnings.push_back(label +
                                   ": extras.touchstone sets friction, but the part has a collider, whose physics "
                                   "material decides: set it there");
            friction.reset();
            bool differ = false;
            const std::optional<int> first = rigidBodyOf(scene, colliders.front())->material;
            for (const Entity collider : colliders) {
                const std::optional<int> material = rigidBodyOf(scene, collider)->material;
                differ |= material != first;
                if (material && !friction) friction = {materials[static_cast<std::size_t>(*material)], *material};
            }
            if (differ)
                warnings.push_back(label + ": its colliders differ in their physics material; " +
                                   physicsMaterialLabel(scene, friction->material) + " is used for all of them");
        }
        if (!friction) continue;
        const std::string source = sourceOf(scene, part, *friction);
        const FrictionMaterial& values = friction->values;
        if (const std::string defaults = defaultsOf(values, source); !defaults.empty()) addOnce(notes, defaults);
        if (values.staticOr() < values.dynamicOr())
            addOnce(warnings, source + engine::formatted(": staticFriction %g is below dynamicFriction %g, so that %g "
                                                         "is used for both",
                                                         values.staticOr(), values.dynamicOr(), values.dynamicOr()));
    }
}

std::optional<Material> materialOf(const BodyMarking& part) {
    if (!part.friction) return {};
    // The rules of both have one order.
    return Material{coefficients(part.friction->values), static_cast<FrictionRule>(part.friction->values.combineOr())};
}

std::string frictionWords(const BodyMarking& tool, const BodyMarking& obstacle) {
    if (!tool.friction || !obstacle.friction)
        return std::string("no friction, since ") + (tool.friction       ? "the obstacle sets none"
                                                     : obstacle.friction ? "the tool sets none"
                                                                         : "neither part sets any");
    constexpr std::array kRules{"average", "minimum", "maximum", "product"};
    const std::optional<Material> a = materialOf(tool), b = materialOf(obstacle);
    const Friction pair = frictionBetween(a, b);
    return engine::formatted("friction %g at rest, %g sliding, the %s of both materials", pair.atRest, pair.sliding,
                             kRules[static_cast<std::size_t>(std::min(a->rule, b->rule))]);
}

std::string sourceOf(const Scene& scene, Entity part, const PartFriction& friction) {
    return friction.material >= 0 ? physicsMaterialLabel(scene, friction.material)
                                  : nodeLabel(scene, part) + ": extras.touchstone";
}

}  // namespace touchstone::sandbox
