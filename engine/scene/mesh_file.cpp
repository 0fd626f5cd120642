#include "engine/scene/mesh_file.hpp"

#include <GL/glu.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <memory>
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

/// Triangulates polygons of any shape, concave ones and ones that cross themselves included. (Assimp's triangles of a
/// concave polygon reach out of it where a corner lies on a diagonal.)
class PolygonTessellator {
  public:
    explicit PolygonTessellator(MeshData& mesh) : mesh_(mesh), tess_(gluNewTess(), gluDeleteTess) {
        using Callback = void (*)();
        const auto edgeFlag = +[](GLboolean) {};  // asked for so that only single triangles come, no fans or strips
        const auto vertex = +[](void* data, void* self) {
            static_cast<PolygonTessellator*>(self)->mesh_.indices.push_back(indexOf(data));
        };
        const auto combine = +[](const GLdouble at[3], void* const from[4], const GLfloat*, void** out, void* self) {
            *out = static_cast<PolygonTessellator*>(self)->crossing({at[0], at[1], at[2]}, from);
        };
        gluTessCallback(tess_.get(), GLU_TESS_EDGE_FLAG, reinterpret_cast<Callback>(edgeFlag));
        gluTessCallback(tess_.get(), GLU_TESS_VERTEX_DATA, reinterpret_cast<Callback>(vertex));
        gluTessCallback(tess_.get(), GLU_TESS_COMBINE_DATA, reinterpret_cast<Callback>(combine));
        gluTessProperty(tess_.get(), GLU_TESS_WINDING_RULE, GLU_TESS_WINDING_NONZERO);
    }

    /// Appends the triangles of a polygon, wound as it is, to the mesh's indices.
    void add(const std::vector<std::uint32_t>& corners) {
        glm::dvec3 normal(0);  // Newell's: that of the area which the polygon encloses
        for (std::size_t i = 1; i + 1 < corners.size(); ++i)
            normal += glm::cross(at(corners[i]) - at(corners[0]), at(corners[i + 1]) - at(corners[0]));
        gluTessNormal(tess_.get(), normal.x, normal.y, normal.z);
        gluTessBeginPolygon(tess_.get(), this);
        gluTessBeginContour(tess_.get());
        for (const std::uint32_t corner : corners) {
            glm::dvec3 position = at(corner);
            gluTessVertex(tess_.get(), &position.x, dataOf(corner));
        }
        gluTessEndContour(tess_.get());
        gluTessEndPolygon(tess_.get());
    }

  private:
    // A vertex as the library carries it: its index plus one, since null has a meaning.
    static void* dataOf(std::uint32_t index) { return reinterpret_cast<void*>(std::uintptr_t(index) + 1); }
    static std::uint32_t indexOf(void* data) {
        return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(data) - 1);
    }
    glm::dvec3 at(std::uint32_t index) const { return mesh_.positions[index]; }

    /// The vertex where edges cross or corners coincide.
    void* crossing(const glm::vec3& place, void* const from[4]) {
        for (int i = 0; i < 4; ++i)
            if (from[i] && mesh_.positions[indexOf(from[i])] == place) return from[i];
        mesh_.positions.push_back(place);
        return dataOf(static_cast<std::uint32_t>(mesh_.positions.size() - 1));
    }

    MeshData& mesh_;
    std::unique_ptr<GLUtesselator, void (*)(GLUtesselator*)> tess_;
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
    const aiScene* scene = importer.ReadFile(name, aiProcess_SortByPType);
    if (!scene)
        failIn(file, "", "cannot be read (" + printable(importer.GetErrorString()) + "); export the part again");

    MeshData mesh;
    PolygonTessellator polygons(mesh);
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
            std::vector<std::uint32_t> polygon;  // without the corners that repeat their forerunner
            for (unsigned i = 0; i < face.mNumIndices; ++i) {
                const std::uint32_t corner = corners.at(face.mIndices[i]);
                if (polygon.empty() || polygon.back() != corner) polygon.push_back(corner);
            }
            while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
            if (polygon.size() == 3)
                mesh.indices.insert(mesh.indices.end(), polygon.begin(), polygon.end());
            else if (polygon.size() > 3)
                polygons.add(polygon);
        }
    }
    if (mesh.indices.empty()) failIn(file, "", "holds no triangle; export the part as a surface of triangles");
    mesh.normals = smoothNormals(mesh);
    return mesh;
}

}  // namespace touchstone::engine
