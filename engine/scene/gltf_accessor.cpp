#include "engine/scene/gltf_accessor.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "engine/scene/gltf_container.hpp"

namespace touchstone::engine {
namespace {

constexpr double kLargestNumber = 1e12;

template <class C>
C component(const unsigned char* bytes, int type, bool normalized) {
    const auto convert = [&](auto value, double scale) {
        std::memcpy(&value, bytes, sizeof value);
        if (!normalized) return static_cast<C>(value);
        return static_cast<C>(std::max(static_cast<double>(value) / scale, -1.0));
    };
    switch (type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return convert(std::int8_t{}, 127);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return convert(std::uint8_t{}, 255);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return convert(std::int16_t{}, 32767);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return convert(std::uint16_t{}, 65535);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return convert(std::uint32_t{}, 4294967295.0);
        default:
            break;
    }
    float value;
    std::memcpy(&value, bytes, sizeof value);
    return static_cast<C>(value);
}

std::size_t sizeOf(int componentType) {
    return static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(componentType));
}

/// The types glTF allows for a use (tables of sections 3.7.2.1 and 3.11, and KHR_mesh_quantization).
struct Allowed {
    int type;
    bool floats;
    std::vector<int> normalized, plain;                    // integer component types without extension
    std::vector<int> quantizedNormalized, quantizedPlain;  // added by KHR_mesh_quantization
    const char* words;
};

const Allowed& allowedFor(AccessorUse use) {
    constexpr int b = TINYGLTF_COMPONENT_TYPE_BYTE, ub = TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
    constexpr int s = TINYGLTF_COMPONENT_TYPE_SHORT, us = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
    constexpr int ui = TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    static const Allowed position{TINYGLTF_TYPE_VEC3, true, {}, {}, {b, ub, s, us}, {b, ub, s, us}, "VEC3 of floats"};
    static const Allowed normal{TINYGLTF_TYPE_VEC3, true, {}, {}, {b, s}, {}, "VEC3 of floats"};
    static const Allowed texcoord{
        TINYGLTF_TYPE_VEC2, true, {ub, us}, {}, {b, s}, {b, ub, s, us}, "VEC2 of floats or normalized integers"};
    static const Allowed color3{
        TINYGLTF_TYPE_VEC3, true, {ub, us}, {}, {}, {}, "VEC3 of floats or normalized integers"};
    static const Allowed color4{
        TINYGLTF_TYPE_VEC4, true, {ub, us}, {}, {}, {}, "VEC4 of floats or normalized integers"};
    static const Allowed index{TINYGLTF_TYPE_SCALAR, false, {}, {ub, us, ui}, {}, {}, "SCALAR of unsigned integers"};
    static const Allowed time{TINYGLTF_TYPE_SCALAR, true, {}, {}, {}, {}, "SCALAR of floats"};
    static const Allowed vector{TINYGLTF_TYPE_VEC3, true, {}, {}, {}, {}, "VEC3 of floats"};
    static const Allowed rotation{
        TINYGLTF_TYPE_VEC4, true, {b, ub, s, us}, {}, {}, {}, "VEC4 of floats or normalized integers"};
    static const Allowed instanceRotation{
        TINYGLTF_TYPE_VEC4, true, {b, s}, {}, {}, {}, "VEC4 of floats or signed normalized integers"};
    switch (use) {
        case AccessorUse::InstanceRotation:
            return instanceRotation;
        case AccessorUse::Position:
            return position;
        case AccessorUse::Normal:
            return normal;
        case AccessorUse::Texcoord:
            return texcoord;
        case AccessorUse::Color3:
            return color3;
        case AccessorUse::Color4:
            return color4;
        case AccessorUse::Index:
            return index;
        case AccessorUse::Time:
            return time;
        case AccessorUse::Vector:
            return vector;
        case AccessorUse::Rotation:
            break;
    }
    return rotation;
}

}  // namespace

void AccessorReader::fail(int accessor, const std::string& problem) const {
    const auto index = static_cast<std::size_t>(accessor);
    failIn(file_, objectLabel("accessor", index, model_.accessors[index].name), problem);
}

const unsigned char* AccessorReader::viewData(int bufferView, std::size_t offset) const {
    const auto& view = model_.bufferViews[static_cast<std::size_t>(bufferView)];
    return model_.buffers[static_cast<std::size_t>(view.buffer)].data.data() + view.byteOffset + offset;
}

AccessorReader::Layout AccessorReader::layout(int index) const {
    const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
    Layout layout{};
    layout.components =
        static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)));
    layout.elementSize = layout.components * sizeOf(accessor.componentType);
    layout.stride = layout.elementSize;
    if (accessor.bufferView < 0) return layout;
    if (const auto stride = model_.bufferViews[static_cast<std::size_t>(accessor.bufferView)].byteStride; stride > 0)
        layout.stride = stride;
    layout.data = viewData(accessor.bufferView, accessor.byteOffset);
    return layout;
}

bool AccessorReader::fits(int index, AccessorUse use) const {
    const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
    const Allowed& allowed = allowedFor(use);
    const auto in = [&](const std::vector<int>& types) {
        return std::find(types.begin(), types.end(), accessor.componentType) != types.end();
    };
    const bool isFloat = accessor.componentType == TINYGLTF_COMPONENT_TYPE_FLOAT;
    const bool plain = in(allowed.plain) || (quantized_ && in(allowed.quantizedPlain));
    const bool normalized = in(allowed.normalized) || (quantized_ && in(allowed.quantizedNormalized));
    const bool fits = isFloat ? allowed.floats : accessor.normalized ? normalized : plain;
    return accessor.type == allowed.type && fits;
}

void AccessorReader::checkUse(int index, AccessorUse use, const std::string& user) const {
    const Allowed& allowed = allowedFor(use);
    if (!fits(index, use))
        fail(index, "has the wrong type for " + user + "; it must be " + allowed.words + ", so export the file again");
}

template <class C>
void AccessorReader::readSparse(int index, const Layout& layout, C* out) const {
    const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
    const auto& sparse = accessor.sparse;
    const unsigned char* indices =
        viewData(sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset));
    const unsigned char* values =
        viewData(sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset));
    const std::size_t indexSize = sizeOf(sparse.indices.componentType), componentSize = sizeOf(accessor.componentType);
    for (std::size_t i = 0; i < static_cast<std::size_t>(sparse.count); ++i) {
        const auto place = component<std::uint32_t>(indices + i * indexSize, sparse.indices.componentType, false);
        if (place >= accessor.count)
            fail(index, "replaces element " + std::to_string(place) + " of " + std::to_string(accessor.count) +
                            "; export the file again");
        for (std::size_t k = 0; k < layout.components; ++k)
            out[place * layout.components + k] = component<C>(values + i * layout.elementSize + k * componentSize,
                                                              accessor.componentType, accessor.normalized);
    }
}

template <class C>
void AccessorReader::readComponents(int index, C* out) const {
    const tinygltf::Accessor& accessor = model_.accessors[static_cast<std::size_t>(index)];
    const Layout from = layout(index);
    const std::size_t componentSize = sizeOf(accessor.componentType);
    for (std::size_t i = 0; from.data && i < accessor.count; ++i)
        for (std::size_t k = 0; k < from.components; ++k)
            out[i * from.components + k] = component<C>(from.data + i * from.stride + k * componentSize,
                                                        accessor.componentType, accessor.normalized);
    if (accessor.sparse.isSparse) readSparse(index, from, out);
    if constexpr (std::is_floating_point_v<C>) {
        for (std::size_t i = 0; i < accessor.count * from.components; ++i)
            if (!(std::abs(static_cast<double>(out[i])) <= kLargestNumber))
                fail(index, "holds a non-finite number or one beyond 1e12 in element " +
                                std::to_string(i / from.components) +
                                "; repair the mesh or animation and export it again");
    }
}

template <class T>
std::vector<T> AccessorReader::read(int accessor, AccessorUse use, const std::string& user) const {
    checkUse(accessor, use, user);
    std::vector<T> values(count(accessor), T(0));
    if constexpr (std::is_arithmetic_v<T>)
        readComponents(accessor, values.data());
    else
        readComponents(accessor, &values[0][0]);
    return values;
}

template std::vector<std::uint32_t> AccessorReader::read(int, AccessorUse, const std::string&) const;
template std::vector<double> AccessorReader::read(int, AccessorUse, const std::string&) const;
template std::vector<glm::vec2> AccessorReader::read(int, AccessorUse, const std::string&) const;
template std::vector<glm::vec4> AccessorReader::read(int, AccessorUse, const std::string&) const;
template std::vector<glm::vec3> AccessorReader::read(int, AccessorUse, const std::string&) const;
template std::vector<glm::dvec3> AccessorReader::read(int, AccessorUse, const std::string&) const;
template std::vector<glm::dvec4> AccessorReader::read(int, AccessorUse, const std::string&) const;

}  // namespace touchstone::engine
