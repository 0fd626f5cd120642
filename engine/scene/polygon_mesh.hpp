#pragma once
// Content of a mesh file while it is read: vertices, polygons, and notes on ignored content.
#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/mesh_file.hpp"

namespace touchstone::engine {

/// A place in the file for messages: `line 12`, `triangle 7`. An empty unit means the whole file.
struct FilePlace {
    std::string unit;
    std::uint64_t number = 0;

    std::string words() const { return unit.empty() ? "" : unit + ' ' + std::to_string(number); }
};
inline FilePlace atLine(std::uint64_t number) { return {"line", number}; }

class PolygonMesh {
  public:
    /// `file` is only used in messages.
    PolygonMesh(std::filesystem::path file, double metersPerUnit)
        : file_(std::move(file)), metersPerUnit_(metersPerUnit) {}

    /// Set the unit of face places ("line" by default) and the number of the first vertex (0 by default), for messages.
    void countFacesIn(const char* unit) { faceUnit_ = unit; }
    void countVerticesFrom(std::uint64_t number) { firstVertex_ = number; }

    std::uint64_t vertexCount() const { return vertices_.size(); }
    void addVertex(const glm::dvec3& inFileUnits);
    /// Tell how exact coordinates are: the word of one in a text, or that all are floats.
    void wrote(double coordinate, std::string_view word);
    void storesFloats() { floats_ = true; }

    /// Adds a polygon. Its vertices may be added later; build() refuses indices without a vertex.
    void addFace(std::span<const std::uint32_t> corners, std::uint64_t place);

    /// Notes ignored content. Equal notes are merged into one with the first place and a count.
    void note(const FilePlace& place, std::string_view what);

    /// Throws SceneError with the place and the problem, which must end with a remedy.
    [[noreturn]] void refuse(const FilePlace& place, const std::string& problem) const;

    /// Merges, triangulates and scales; see readMeshFile(). Call only once.
    MeshFile build();

  private:
    struct Note {
        FilePlace place;
        std::string what;
        std::uint64_t count = 1;
    };

    std::string sentence(const Note& note) const;
    void checkCorner(std::uint32_t corner, std::uint64_t place) const;
    void center();
    double stepAt(double farthest) const;
    /// As stored: about origin_, in single precision.
    glm::vec3 stored(std::uint32_t corner) const { return glm::vec3(vertices_[corner] - origin_) + glm::vec3(0); }

    std::filesystem::path file_;
    double metersPerUnit_;
    const char* faceUnit_ = "line";
    std::uint64_t firstVertex_ = 0;
    bool floats_ = false;
    std::array<double, 64> lastDigits_{};  // the least last digit of coordinates in a decade, the first of 1e-32
    glm::dvec3 origin_{0};                 // of the mesh, in file units
    std::vector<glm::dvec3> vertices_;
    std::vector<std::uint32_t> corners_;  // corners of all faces
    std::vector<std::size_t> ends_;       // end of each face in corners_
    std::vector<std::uint32_t> places_;   // place of each face
    std::vector<Note> notes_;
};

/// A word of the file, quoted for messages.
std::string quote(std::string_view word);

}  // namespace touchstone::engine
