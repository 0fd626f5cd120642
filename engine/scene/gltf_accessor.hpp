#pragma once
// Typed, range-checked reading of glTF accessors.
#include <tiny_gltf.h>

#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace touchstone::engine {

/// What an accessor is read for; decides the element and component types that are allowed.
enum class AccessorUse { Position, Normal, Texcoord, Index, Time, Vector, Rotation };

/// Reads the accessors of a model whose references and buffer views are in range. Interleaved, sparse and normalised
/// accessors come out as plain arrays. Throws SceneError naming the accessor for ranges outside the buffer view, wrong
/// types, and numbers that are not finite or beyond 1e12.
class AccessorReader {
  public:
    /// Checks the byte ranges of all accessors. `quantized`: the types of KHR_mesh_quantization are allowed.
    AccessorReader(const std::filesystem::path& file, const tinygltf::Model& model, bool quantized);

    std::size_t count(int accessor) const { return model_.accessors[static_cast<std::size_t>(accessor)].count; }

    /// T: float, double, std::uint32_t or a glm vector of the accessor's length. `user`: who reads, for the sentence.
    template <class T>
    std::vector<T> read(int accessor, AccessorUse use, const std::string& user) const;

  private:
    struct Layout {
        const unsigned char* data;  // null: all zeros
        std::size_t stride, elementSize, components;
    };

    [[noreturn]] void fail(int accessor, const std::string& problem) const;
    void checkRange(int accessor, int bufferView, std::size_t offset, std::size_t count, std::size_t stride,
                    std::size_t elementSize) const;
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
