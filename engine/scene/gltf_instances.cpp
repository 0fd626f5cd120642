#include "engine/scene/gltf_instances.hpp"

#include <nlohmann/json.hpp>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/transforms.hpp"

namespace touchstone::engine {
namespace {

constexpr const char* kAttributes[] = {"TRANSLATION", "ROTATION", "SCALE"};

int accessorOf(const nlohmann::json& attributes, const char* name) {
    return attributes.contains(name) ? attributes[name].get<int>() : -1;
}

}  // namespace

std::size_t instanceCount(const nlohmann::json& attributes, const AccessorReader& accessors) {
    for (const char* name : kAttributes)
        if (const int accessor = accessorOf(attributes, name); accessor >= 0) return accessors.count(accessor);
    return 1;
}

std::vector<glm::dmat4> readInstances(const nlohmann::json& attributes, const AccessorReader& accessors,
                                      const std::string& node, Warnings& warnings) {
    std::vector<LocalTransform> locals(instanceCount(attributes, accessors));
    const auto read = [&]<class T>(const char* name, AccessorUse use, std::vector<T> values) {
        if (const int accessor = accessorOf(attributes, name); accessor >= 0)
            values = accessors.read<T>(accessor, use, node + ", instances, " + name);
        if (!values.empty() && values.size() != locals.size())
            failIn(accessors.file(), node,
                   std::string("instance attribute ") + name + " has " + std::to_string(values.size()) +
                       " elements, others have " + std::to_string(locals.size()) + "; export the file again");
        return values;
    };
    const auto translations = read("TRANSLATION", AccessorUse::Vector, std::vector<glm::dvec3>());
    const auto rotations = read("ROTATION", AccessorUse::InstanceRotation, std::vector<glm::dvec4>());
    const auto scales = read("SCALE", AccessorUse::Vector, std::vector<glm::dvec3>());
    bool areUnit = true;
    std::vector<glm::dmat4> transforms;
    for (std::size_t i = 0; i < locals.size(); ++i) {
        LocalTransform& local = locals[i];
        if (!translations.empty()) local.translation = translations[i];
        if (!scales.empty()) local.scale = scales[i];
        if (!rotations.empty()) {
            const glm::dvec4& q = rotations[i];
            if (!(glm::length(q) > 1e-6))
                failIn(accessors.file(), node,
                       "instance " + std::to_string(i) + " has a rotation of length zero; give it a unit quaternion");
            areUnit &= isUnit(q);
            local.rotation = glm::normalize(glm::dquat(q.w, q.x, q.y, q.z));
        }
        transforms.push_back(localMatrix(local));
    }
    if (!areUnit) warnings.add(node, "has instances whose rotations are not of unit length; they were normalized");
    return transforms;
}

MeshInstance instancedMesh(const MeshInstance& mesh, const std::vector<glm::dmat4>& transforms) {
    MeshInstance all;
    for (const Primitive& primitive : mesh.primitives) {
        MeshData data;
        data.flat = primitive.mesh->flat;
        for (const glm::dmat4& transform : transforms) {
            const MeshData copy = bakedMesh(*primitive.mesh, transform);
            const auto base = static_cast<std::uint32_t>(data.positions.size());
            data.positions.insert(data.positions.end(), copy.positions.begin(), copy.positions.end());
            data.normals.insert(data.normals.end(), copy.normals.begin(), copy.normals.end());
            data.texcoords.insert(data.texcoords.end(), copy.texcoords.begin(), copy.texcoords.end());
            data.colors.insert(data.colors.end(), copy.colors.begin(), copy.colors.end());
            for (const std::uint32_t index : copy.indices) data.indices.push_back(base + index);
        }
        all.primitives.push_back({std::make_shared<const MeshData>(std::move(data)), primitive.material});
    }
    return all;
}

}  // namespace touchstone::engine
