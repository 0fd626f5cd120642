#pragma once
// Typed, range-checked reading of glTF accessors.
#include <tiny_gltf.h>

#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace touchstone::engine {

/// Purpose of reading an accessor; determines the allowed element and component types.
enum class AccessorUse { Position, Normal, Texcoord, Color3, Color4, Index, Time, Vector, Rotation, InstanceRotation };

/// Reads the accessors of a model whose references and byte ranges were checked. Interleaved, sparse and normalized
/// accessors are converted to plain arrays. Throws SceneError naming the accessor for wrong types, sparse indices out
/// of range, and numbers that are non-finite or beyond 1e12.
class AccessorReader {
  public:
    /// `quantized`: the types of KHR_mesh_quantization are allowed.
    AccessorReader(const std::filesystem::path& file, const tinygltf::Model& model, bool quantized)
        : file_(file), model_(model), quantized_(quantized) {}

    const std::filesystem::path& file() const { return file_; }
    std::size_t count(int accessor) const { return model_.accessors[static_cast<std::size_t>(accessor)].count; }

    /// Without buffer view and sparse values, all elements are zero.
    bool hasNoData(int accessor) const {
        const tinygltf::Accessor& from = model_.accessors[static_cast<std::size_t>(accessor)];
        return from.bufferView < 0 && !from.sparse.isSparse;
    }

    /// Whether glTF allows the accessor for this use.
    bool fits(int accessor, AccessorUse use) const;

    /// T: float, double, std::uint32_t or a glm vector of the accessor's length. `user`: the object that uses the
    /// accessor, for error messages.
    template <class T>
    std::vector<T> read(int accessor, AccessorUse use, const std::string& user) const;

  private:
    struct Layout {
        const unsigned char* data;  // null: all zeros
        std::size_t stride, elementSize, components;
    };

    [[noreturn]] void fail(int accessor, const std::string& problem) const;
    Layout layout(int accessor) const;
    void checkUse(int accessor, AccessorUse use, const std::string& user) const;
    template <class C>
    void readComponents(int accessor, C* out) const;
    template <class C>
    void readSparse(int accessor, const Layout& layout, C* out) const;
    const unsigned char* viewData(int bufferView, std::size_t offset) const;

    const std::filesystem::path& file_;
    const tinygltf::Model& model_;
    const bool quantized_;
};

}  // namespace touchstone::engine
