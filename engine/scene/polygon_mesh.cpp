#include "engine/scene/polygon_mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <unordered_map>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/polygon_tessellator.hpp"
#include "engine/scene/text_cursor.hpp"

namespace touchstone::engine {
namespace {

constexpr double kMaxDistance = 1e12;    // m: keeps squares of lengths finite in single precision
constexpr double kNotedRounding = 3e-5;  // of the diagonal: 1.5 µm on a part of 50 mm, less than contacts are apart
// Distance from the origin, in diagonals, up to which single precision holds a part: 2^-24 of twice its size.
constexpr double kFar = 2;
constexpr std::uint32_t kUnused = ~0u;

/// Index of the decade of |x|: 32 for 1 to 10.
std::size_t decadeOf(double x) { return std::size_t(std::clamp(std::floor(std::log10(std::abs(x))) + 32, 0.0, 63.0)); }

struct PositionHash {
    std::size_t operator()(const glm::vec3& p) const {
        std::size_t hash = 0;
        for (int k = 0; k < 3; ++k) hash = (hash ^ std::bit_cast<std::uint32_t>(p[k])) * 0x9E3779B97F4A7C15u;
        return hash ^ hash >> 32;
    }
};

}  // namespace

std::string quote(std::string_view word) { return '\'' + printable(std::string(word.substr(0, 100))) + '\''; }

void PolygonMesh::addVertex(const glm::dvec3& inFileUnits) { vertices_.push_back(inFileUnits); }

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
    if (!(glm::length(vertices_[corner] * metersPerUnit_) <= kMaxDistance))
        refuse({faceUnit_, place}, "its " + number() + " is non-finite or beyond 1e12 m; repair the part");
}

void PolygonMesh::wrote(double coordinate, std::string_view word) {
    if (!(std::abs(coordinate) > 0) || !std::isfinite(coordinate)) return;
    const double digit = lastDigitOf(word);
    double& least = lastDigits_[decadeOf(coordinate)];
    least = least > 0 ? std::min(least, digit) : digit;
}

/// The distance of numbers that the file can hold so far from the origin.
double PolygonMesh::stepAt(double farthest) const {
    const double digit = lastDigits_[decadeOf(farthest)];
    const auto spacing = [](double x) { return double(std::nextafter(float(x), HUGE_VALF)) - double(float(x)); };
    if (floats_) return spacing(farthest);
    // A text may have been written from floats: all its coordinates are, and not since they are round.
    const double step = spacing(farthest), round = std::pow(10.0, std::floor(std::log10(step)));
    if (!(digit > 0 && digit < step)) return digit;
    bool fractions = false;
    for (const std::uint32_t corner : corners_)
        for (int k = 0; k < 3; ++k) {
            const double x = vertices_[corner][k];
            if (std::abs(x - double(float(x))) > 0.51 * digit) return digit;
            fractions = fractions || std::abs(x / round - std::round(x / round)) * round > 0.51 * digit;
        }
    return fractions ? step : digit;
}

// Takes a round point near the middle as origin, so that decimal coordinates stay decimal, and notes if the file is too
// coarse for the part where it lies.
void PolygonMesh::center() {
    glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
    for (std::size_t face = 0, i = 0; face < ends_.size(); ++face)
        for (; i < ends_[face]; ++i) {
            checkCorner(corners_[i], places_[face]);
            low = glm::min(low, vertices_[corners_[i]]);
            high = glm::max(high, vertices_[corners_[i]]);
        }
    const double size = glm::length(high - low);
    const glm::dvec3 reach = glm::max(glm::abs(low), glm::abs(high));
    const double farthest = std::max({reach.x, reach.y, reach.z});
    if (!(size > 0 && farthest > kFar * size)) return;
    const double round = std::pow(10.0, std::floor(std::log10(size)));
    origin_ = round * glm::round((low + high) / 2.0 / round);

    const double step = stepAt(farthest);
    if (step / 2 <= kNotedRounding * size) return;
    char text[240];
    std::snprintf(text, sizeof text,
                  "the part lies up to %.6g file units from the origin, where the coordinates of the file are exact to "
                  "%.2g only; move it to the origin before it is exported, or export it with more digits",
                  farthest, step / 2);
    note({}, text);
}

MeshFile PolygonMesh::build() {
    MeshFile out;
    MeshData& mesh = out.mesh;
    center();
    out.origin = origin_ * metersPerUnit_;
    PolygonTessellator polygons(mesh);
    // Vertices are merged before they are scaled, since scaling may round neighbors to the same point.
    std::unordered_map<glm::vec3, std::uint32_t, PositionHash> indexAt;
    std::vector<std::uint32_t> indexOf(vertices_.size(), kUnused);
    std::vector<std::uint32_t> polygon;  // without consecutive duplicates
    for (std::size_t face = 0, i = 0; face < ends_.size(); ++face) {
        polygon.clear();
        for (; i < ends_[face]; ++i) {
            const std::uint32_t corner = corners_[i];
            if (corner >= indexOf.size() || indexOf[corner] == kUnused) {
                const glm::vec3 vertex = stored(corner);
                const auto [place, isNew] = indexAt.emplace(vertex, static_cast<std::uint32_t>(mesh.positions.size()));
                if (isNew) mesh.positions.emplace_back(glm::dvec3(vertex) * metersPerUnit_);
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
    mesh.normals = smoothNormals(mesh);
    for (const Note& note : notes_) out.notes.push_back(file_.string() + ": " + sentence(note));
    return out;
}

}  // namespace touchstone::engine
