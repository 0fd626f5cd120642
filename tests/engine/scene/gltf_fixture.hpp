#pragma once
// A small valid glTF file, and a folder for variants of it.
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_read.hpp"

namespace touchstone::engine::test {

/// A temporary folder for one test, removed at the end.
class TemporaryFolder {
  public:
    TemporaryFolder() {
        static int count = 0;
        // The tests write thousands of small files: use a folder in memory if the system has one.
        const std::filesystem::path memory = "/dev/shm";
        path_ = (std::filesystem::exists(memory) ? memory : std::filesystem::temp_directory_path()) /
                ("touchstone-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
        std::filesystem::create_directories(path_);
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

using Bytes = std::vector<std::uint8_t>;

inline void writeFile(const std::filesystem::path& file, const Bytes& bytes) {
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
}
inline void writeFile(const std::filesystem::path& file, const std::string& text) {
    writeFile(file, Bytes(text.begin(), text.end()));
}

/// A 2 x 1 PNG: a red and a half transparent green pixel (stored deflate block, written by hand).
inline Bytes smallPng() {
    return {137, 80,  78,  71,  13, 10, 26,  10,  0, 0,   0,  13,  73,  72,  68,  82, 0,   0,  0,   2,
            0,   0,   0,   1,   8,  6,  0,   0,   0, 244, 34, 127, 138, 0,   0,   0,  20,  73, 68,  65,
            84,  120, 1,   1,   9,  0,  246, 255, 0, 255, 0,  0,   255, 0,   255, 0,  128, 16, 121, 3,
            126, 54,  160, 104, 96, 0,  0,   0,   0, 73,  69, 78,  68,  174, 66,  96, 130};
}

/// A glTF document under construction: JSON and the contents of its one buffer.
struct GltfDraft {
    nlohmann::json json = {{"asset", {{"version", "2.0"}}}};
    Bytes bin;

    /// Appends a plain accessor with its own buffer view and returns its index.
    template <class T>
    int add(const std::vector<T>& values, int componentType, const std::string& type, int count,
            bool normalized = false) {
        bin.resize((bin.size() + 3) / 4 * 4);
        json["bufferViews"].push_back(
            {{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", values.size() * sizeof(T)}});
        json["accessors"].push_back({{"bufferView", json["bufferViews"].size() - 1},
                                     {"componentType", componentType},
                                     {"count", count},
                                     {"type", type}});
        if (normalized) json["accessors"].back()["normalized"] = true;
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
        bin.insert(bin.end(), bytes, bytes + values.size() * sizeof(T));
        json["buffers"] = {{{"byteLength", bin.size()}}};
        return static_cast<int>(json["accessors"].size()) - 1;
    }

    Bytes glb() const { return glbBytes(json.dump(), binChunk(bin)); }

    Scene read(const TemporaryFolder& folder, int scene = -1) const {
        writeFile(folder / "draft.glb", glb());
        return readGltf(folder / "draft.glb", scene);
    }
};

/// A unit square of two triangles in the plane z = 0, below two nodes, the lower one animated.
/// Accessors: 0 positions, 1 normals, 2 texture coordinates, 3 indices, 4 times, 5 translations, 6 rotations.
inline GltfDraft squareDraft() {
    GltfDraft draft;
    draft.add<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, 5126, "VEC3", 4);
    draft.add<float>({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, 5126, "VEC3", 4);
    draft.add<float>({0, 1, 1, 1, 1, 0, 0, 0}, 5126, "VEC2", 4);
    draft.add<std::uint16_t>({0, 1, 2, 0, 2, 3}, 5123, "SCALAR", 6);
    draft.add<float>({0.5f, 1.5f}, 5126, "SCALAR", 2);
    draft.add<float>({0, 0, 0, 2, 0, 0}, 5126, "VEC3", 2);
    draft.add<float>({0, 0, 0, 1, 0, 0, 1, 0}, 5126, "VEC4", 2);
    auto& json = draft.json;
    json["accessors"][0]["min"] = {0, 0, 0};
    json["accessors"][0]["max"] = {1, 1, 0};
    json["accessors"][4]["min"] = {0.5};
    json["accessors"][4]["max"] = {1.5};
    json["materials"] = {{{"name", "gold"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0.25, 1}}}}}};
    json["meshes"] = {
        {{"name", "square"},
         {"primitives",
          {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}}}, {"indices", 3}, {"material", 0}}}}}};
    json["nodes"] = {{{"name", "base"}, {"children", {1}}, {"translation", {0, 0, 1}}},
                     {{"name", "tool"}, {"mesh", 0}}};
    json["scenes"] = {{{"name", "main"}, {"nodes", {0}}}};
    json["scene"] = 0;
    json["animations"] = {{{"name", "demo"},
                           {"samplers", {{{"input", 4}, {"output", 5}}, {{"input", 4}, {"output", 6}}}},
                           {"channels",
                            {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "translation"}}}},
                             {{"sampler", 1}, {"target", {{"node", 1}, {"path", "rotation"}}}}}}}};
    return draft;
}

}  // namespace touchstone::engine::test
