#include "engine/scene/polygon_mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <unordered_map>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/polygon_tessellator.hpp"

namespace touchstone::engine {
namespace {

constexpr double kMaxDistance = 1e12;    // m: keeps squares of lengths finite in single precision
constexpr double kNotedRounding = 1e-5;  // of the diagonal: 0.5 µm on a part of 50 mm
constexpr std::uint32_t kUnused = ~0u;

struct PositionHash {
    std::size_t operator()(const glm::vec3& p) const {
        std::size_t hash = 0;
        for (int k = 0; k < 3; ++k) hash = (hash ^ std::bit_cast<std::uint32_t>(p[k])) * 0x9E3779B97F4A7C15u;
        return hash ^ hash >> 32;
    }
};

}  // namespace

std::string quote(std::string_view word) { return '\'' + printable(std::string(word.substr(0, 100))) + '\''; }

void PolygonMesh::addVertex(const glm::dvec3& inFileUnits) {
    // Adding zero turns -0 into +0, so that both are merged.
    const glm::vec3 vertex = glm::vec3(inFileUnits) + glm::vec3(0);
    for (int k = 0; k < 3; ++k)
        if (std::isfinite(vertex[k])) rounding_ = std::max(rounding_, std::abs(vertex[k] - inFileUnits[k]));
    vertices_.push_back(vertex);
}

void PolygonMesh::addFace(std::span<const std::uint32_t> corners, std::uint64_t place) {
    corners_.insert(corners_.end(), corners.begin(), corners.end());
    ends_.push_back(corners_.size());
    places_.push_back(static_cast<std::uint32_t>(place));
}

void PolygonMesh::note(const FilePlace& place, std::string_view what) {
    const auto same = std::find_if(notes_.begin(), notes_.end(), [&](const Note& n) { return n.what == what; });
    if (same == notes_.end())
        notes_.push_back({place, std::string(what)});
    else
        ++same->count;
}

void PolygonMesh::refuse(const FilePlace& place, const std::string& problem) const {
    failIn(file_, place.words(), problem);
}

std::string PolygonMesh::sentence(const Note& note) const {
    const std::string place = note.place.words();
    std::string text = place.empty() ? note.what : place + ": " + note.what;
    if (note.count > 1) text += " (" + std::to_string(note.count) + " times, here first)";
    return text;
}

void PolygonMesh::checkCorner(std::uint32_t corner, std::uint64_t place) const {
    const auto number = [&] { return "vertex " + std::to_string(corner + firstVertex_); };
    if (corner >= vertices_.size())
        refuse({faceUnit_, place}, "refers to " + number() + ", but the file has " + std::to_string(vertices_.size()) +
                                       " vertices; export the part again");
    if (!(glm::length(glm::dvec3(vertices_[corner]) * metresPerUnit_) <= kMaxDistance))
        refuse({faceUnit_, place}, "its " + number() + " is non-finite or beyond 1e12 m; repair the part");
}

void PolygonMesh::noteRounding(const MeshData& mesh) {
    glm::dvec3 low(mesh.positions.front()), high = low;
    for (const glm::dvec3 p : mesh.positions) low = glm::min(low, p), high = glm::max(high, p);
    if (rounding_ * metresPerUnit_ <= kNotedRounding * glm::length(high - low)) return;
    char text[160];
    std::snprintf(text, sizeof text,
                  "coordinates are rounded to single precision by up to %.2g file units, since the part is far from "
                  "the origin; move the part to the origin",
                  rounding_);
    note({}, text);
}

MeshFile PolygonMesh::build() {
    MeshFile out;
    MeshData& mesh = out.mesh;
    PolygonTessellator polygons(mesh);
    // Vertices are merged by their coordinates in the file, since scaling may round neighbors to the same point.
    std::unordered_map<glm::vec3, std::uint32_t, PositionHash> indexAt;
    std::vector<std::uint32_t> indexOf(vertices_.size(), kUnused);
    std::vector<std::uint32_t> polygon;  // without consecutive duplicates
    for (std::size_t face = 0, i = 0; face < ends_.size(); ++face) {
        polygon.clear();
        for (; i < ends_[face]; ++i) {
            const std::uint32_t corner = corners_[i];
            if (corner >= indexOf.size() || indexOf[corner] == kUnused) {
                checkCorner(corner, places_[face]);
                const auto [place, isNew] =
                    indexAt.emplace(vertices_[corner], static_cast<std::uint32_t>(mesh.positions.size()));
                if (isNew) mesh.positions.emplace_back(glm::dvec3(vertices_[corner]) * metresPerUnit_);
                indexOf[corner] = place->second;
            }
            if (polygon.empty() || polygon.back() != indexOf[corner]) polygon.push_back(indexOf[corner]);
        }
        while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();

        const std::size_t before = mesh.indices.size();
        if (polygon.size() == 3)
            mesh.indices.insert(mesh.indices.end(), polygon.begin(), polygon.end());
        else if (polygon.size() > 3 && !polygons.add(polygon))
            refuse({faceUnit_, places_[face]}, "the edges of this face cross each other too often; split the face");
        if (mesh.indices.size() == before)
            note({faceUnit_, places_[face]}, polygon.size() > 3
                                                 ? "a polygon without area is dropped"
                                                 : "a face with fewer than three distinct corners is dropped");
    }
    if (mesh.indices.empty())
        refuse({}, "has no triangles" + (notes_.empty() ? "" : ": " + sentence(notes_.front())) +
                       "; export the part as a surface of triangles");
    noteRounding(mesh);
    mesh.normals = smoothNormals(mesh);
    for (const Note& note : notes_) out.notes.push_back(file_.string() + ": " + sentence(note));
    return out;
}

}  // namespace touchstone::engine
