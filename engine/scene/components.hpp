#pragma once
// Components are tiny structs. Systems are free functions over the registry.
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <string>
#include <vector>

#include "engine/scene/json_value.hpp"
#include "engine/scene/mesh_data.hpp"
#include "engine/scene/registry.hpp"

namespace touchstone::engine {

struct Name {
    std::string value;
};

/// Pose and scale in the parent's frame, meters. If the matrix of a node is not a product T · R · S, `shear` keeps the
/// remainder: local = T · R · S · shear.
struct LocalTransform {
    glm::dvec3 translation{0};
    glm::dquat rotation{1, 0, 0, 0};
    glm::dvec3 scale{1};
    glm::dmat3 shear{1};

    friend bool operator==(const LocalTransform&, const LocalTransform&) = default;
};

struct Hierarchy {
    Entity parent;  ///< null for a root
    std::vector<Entity> children;
};

/// Written by updateWorldTransforms().
struct WorldTransform {
    glm::dmat4 matrix{1};
};

struct Primitive {
    std::shared_ptr<const MeshData> mesh;
    int material = -1;  ///< index into Scene::materials; -1 for the default
};

struct MeshInstance {
    std::vector<Primitive> primitives;
};

struct Visibility {
    bool visible = true;
};

/// `extras` and `extensions` of the glTF node, as in the file; null if it has none.
struct NodeMarking {
    JsonValue extras, extensions;
};

}  // namespace touchstone::engine
