#include "engine/scene/mesh_file.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "engine/scene/gltf_container.hpp"

namespace touchstone::engine {
namespace fs = std::filesystem;
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Bytes in memory as assimp reads them.
class MemoryStream final : public Assimp::IOStream {
  public:
    explicit MemoryStream(const Bytes& bytes) : bytes_(bytes) {}

    std::size_t Read(void* out, std::size_t size, std::size_t count) override {
        if (size == 0) return 0;
        const std::size_t items = std::min(count, (bytes_.size() - at_) / size);
        if (items > 0) std::memcpy(out, bytes_.data() + at_, items * size);
        at_ += items * size;
        return items;
    }
    aiReturn Seek(std::size_t offset, aiOrigin origin) override {
        const std::size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
        if (offset > bytes_.size() - base) return aiReturn_FAILURE;
        at_ = base + offset;
        return aiReturn_SUCCESS;
    }
    std::size_t Tell() const override { return at_; }
    std::size_t FileSize() const override { return bytes_.size(); }
    std::size_t Write(const void*, std::size_t, std::size_t) override { return 0; }
    void Flush() override {}

  private:
    const Bytes& bytes_;
    std::size_t at_ = 0;
};

/// Shows assimp this one file, so that no material library or texture named in it is opened.
class SingleFile final : public Assimp::IOSystem {
  public:
    SingleFile(std::string name, const Bytes& bytes) : name_(std::move(name)), bytes_(bytes) {}

    bool Exists(const char* name) const override { return name_ == name; }
    char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* name, const char*) override {
        return Exists(name) ? new MemoryStream(bytes_) : nullptr;
    }
    void Close(Assimp::IOStream* stream) override { delete stream; }

  private:
    std::string name_;
    const Bytes& bytes_;
};

struct PositionHash {
    std::size_t operator()(const glm::vec3& p) const {
        std::size_t hash = 0;
        for (int k = 0; k < 3; ++k) hash = (hash ^ std::bit_cast<std::uint32_t>(p[k])) * 0x9E3779B97F4A7C15u;
        return hash ^ hash >> 32;
    }
};

}  // namespace

MeshData readMeshFile(const fs::path& file, double metresPerUnit) {
    assert(metresPerUnit > 0);
    std::string extension = file.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension != ".stl" && extension != ".obj")
        failIn(file, "", "is no .stl or .obj file; export the part as one of the two");

    const Bytes bytes = readBytes(file);
    const std::string name = "part" + extension;
    Assimp::Importer importer;
    importer.SetIOHandler(new SingleFile(name, bytes));  // owned by the importer
    importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
    const aiScene* scene = importer.ReadFile(name, aiProcess_Triangulate | aiProcess_SortByPType);
    if (!scene)
        failIn(file, "", "cannot be read (" + printable(importer.GetErrorString()) + "); export the part again");

    MeshData mesh;
    std::unordered_map<glm::vec3, std::uint32_t, PositionHash> places;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const aiMesh& part = *scene->mMeshes[m];
        std::vector<std::uint32_t> corners(part.mNumVertices);
        for (unsigned v = 0; v < part.mNumVertices; ++v) {
            const aiVector3D& from = part.mVertices[v];
            const glm::dvec3 metres = glm::dvec3(from.x, from.y, from.z) * metresPerUnit;
            if (!(glm::length(metres) <= 1e12))
                failIn(file, "", "vertex " + std::to_string(v) + " is not finite or beyond 1e12; repair the part");
            // Merged by the coordinates in the file, since scaling may round neighbours together. Adding zero turns -0
            // into +0, which are one place.
            const glm::vec3 inFile = glm::vec3(from.x, from.y, from.z) + glm::vec3(0);
            const auto [place, isNew] = places.emplace(inFile, static_cast<std::uint32_t>(mesh.positions.size()));
            if (isNew) mesh.positions.emplace_back(metres);
            corners[v] = place->second;
        }
        for (unsigned f = 0; f < part.mNumFaces; ++f) {
            const aiFace& face = part.mFaces[f];
            if (face.mNumIndices != 3) continue;
            const std::uint32_t a = corners.at(face.mIndices[0]), b = corners.at(face.mIndices[1]),
                                c = corners.at(face.mIndices[2]);
            if (a != b && b != c && c != a) mesh.indices.insert(mesh.indices.end(), {a, b, c});
        }
    }
    if (mesh.indices.empty()) failIn(file, "", "holds no triangle; export the part as a surface of triangles");
    mesh.normals = smoothNormals(mesh);
    return mesh;
}

}  // namespace touchstone::engine
