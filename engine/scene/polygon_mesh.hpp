#pragma once
// What a mesh file holds, as it is read: vertices, polygons between them, and notes of what was left out.
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/mesh_file.hpp"

namespace touchstone::engine {

/// Where something stands in the file, as sentences name it: `line 12`, `triangle 7`. None: the file as a whole.
struct FilePlace {
    std::string unit;
    std::uint64_t number = 0;

    std::string words() const { return unit.empty() ? "" : unit + ' ' + std::to_string(number); }
};
inline FilePlace atLine(std::uint64_t number) { return {"line", number}; }

class PolygonMesh {
  public:
    /// `file` is for the sentences alone.
    PolygonMesh(std::filesystem::path file, double metresPerUnit)
        : file_(std::move(file)), metresPerUnit_(metresPerUnit) {}

    /// The places of faces are of this unit ("line" unless set), and the first vertex has this number.
    void countFacesIn(const char* unit) { faceUnit_ = unit; }
    void countVerticesFrom(std::uint64_t number) { firstVertex_ = number; }

    std::uint64_t vertexCount() const { return vertices_.size(); }
    void addVertex(const glm::dvec3& inFileUnits);

    /// Adds a polygon. The vertices may follow it; an index that none has at the end is refused by build().
    void addFace(std::span<const std::uint32_t> corners, std::uint64_t place);

    /// Notes what is not read. Notes of the same words become one, with the first place and their number.
    void note(const FilePlace& place, std::string_view what);

    /// Throws SceneError: the place and the problem, which ends with what to do.
    [[noreturn]] void refuse(const FilePlace& place, const std::string& problem) const;

    /// Merges, triangulates and scales; see readMeshFile(). To be called once.
    MeshFile build();

  private:
    struct Note {
        FilePlace place;
        std::string what;
        std::uint64_t count = 1;
    };

    std::string sentence(const Note& note) const;
    void checkCorner(std::uint32_t corner, std::uint64_t place) const;
    void noteRounding(const MeshData& mesh);

    std::filesystem::path file_;
    double metresPerUnit_;
    const char* faceUnit_ = "line";
    std::uint64_t firstVertex_ = 0;
    double rounding_ = 0;  // largest change of a coordinate by single precision, in file units
    std::vector<glm::vec3> vertices_;
    std::vector<std::uint32_t> corners_;  // of all faces
    std::vector<std::size_t> ends_;       // of each face in corners_
    std::vector<std::uint32_t> places_;   // of each face
    std::vector<Note> notes_;
};

/// A word of the file as a sentence quotes it.
std::string quote(std::string_view word);

}  // namespace touchstone::engine
