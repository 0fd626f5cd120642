#include "engine/scene/mesh_data.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <span>
#include <utility>

namespace touchstone::engine {
namespace {

constexpr double kRounding = 0x1p-22;  ///< relative; of a decimal number that was scaled in single precision
constexpr double kNormalized[] = {1.0 / 127, 1.0 / 255, 1.0 / 32767, 1.0 / 65535};
/// Number of different coordinates that use the last digit of a grid, from which on they count as rounded to it. With
/// fewer a part with round dimensions would seem coarse; with more small parts would seem exact.
constexpr std::size_t kRounded = 8;

/// Calls visit(|x|) for all coordinates until it returns false. Returns whether none did.
template <class Visit>
bool forEachCoordinate(const MeshData& mesh, Visit&& visit) {
    for (const glm::vec3& p : mesh.positions)
        for (int k = 0; k < 3; ++k)
            if (!visit(std::abs(double(p[k])))) return false;
    return true;
}

bool isMultiple(double steps) { return std::abs(steps - std::round(steps)) <= kRounding * steps; }

/// Whether enough coordinates need a grid: those that are no multiples of ten times its step.
bool isNeeded(const MeshData& mesh, double grid) {
    std::set<double> found;
    return !forEachCoordinate(mesh, [&](double x) {
        if (!isMultiple(x / (10 * grid))) found.insert(x);
        return found.size() < kRounded;
    });
}

/// Twice the area of a triangle along its normal. In doubles, so that tiny and huge triangles keep their direction.
glm::dvec3 doubleArea(const MeshData& mesh, std::size_t triangle) {
    const auto corner = [&](std::size_t k) { return glm::dvec3(mesh.positions[mesh.indices[3 * triangle + k]]); };
    return glm::cross(corner(1) - corner(0), corner(2) - corner(0));
}

/// Groups corners of one vertex that lie on the same side of all creases.
class CornerGroups {
  public:
    CornerGroups(const MeshData& mesh, double angle) : mesh_(mesh), cosine_(std::cos(angle)) {
        for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
            const glm::dvec3 area = doubleArea(mesh, t);
            const double length = glm::length(area);
            faceNormals_.push_back(length > 0 ? area / length : glm::dvec3(0));
        }
    }

    /// A group's number for each of the corners, which are indices into mesh.indices.
    const std::vector<std::size_t>& of(std::span<const std::size_t> corners) {
        edges_.clear();
        groups_.resize(corners.size());
        std::iota(groups_.begin(), groups_.end(), std::size_t{0});
        for (std::size_t i = 0; i < corners.size(); ++i)
            for (const std::size_t turn : {1, 2}) {
                const std::size_t first = corners[i] / 3 * 3;
                edges_.push_back({mesh_.indices[first + (corners[i] - first + turn) % 3], i});
            }
        std::sort(edges_.begin(), edges_.end());
        for (std::size_t k = 1; k < edges_.size(); ++k) {
            const auto [end, i] = edges_[k - 1];
            const auto [otherEnd, j] = edges_[k];
            const glm::dvec3 &one = faceNormals_[corners[i] / 3], &other = faceNormals_[corners[j] / 3];
            // A face without area, whose normal is 0, joins nothing: it would connect both sides of a crease.
            const bool haveArea = one != glm::dvec3(0) && other != glm::dvec3(0);
            if (end == otherEnd && haveArea && glm::dot(one, other) >= cosine_ - kRounding) groups_[root(j)] = root(i);
        }
        for (std::size_t i = 0; i < groups_.size(); ++i) groups_[i] = root(i);
        return groups_;
    }

  private:
    std::size_t root(std::size_t i) {
        while (groups_[i] != i) i = groups_[i] = groups_[groups_[i]];
        return i;
    }

    const MeshData& mesh_;
    double cosine_;
    std::vector<glm::dvec3> faceNormals_;
    std::vector<std::pair<std::uint32_t, std::size_t>> edges_;  // vertex at the other end, and number of the corner
    std::vector<std::size_t> groups_;
};

}  // namespace

double gridOf(const MeshData& mesh) {
    double largest = 0;
    forEachCoordinate(mesh, [&](double x) {
        largest = std::max(largest, x);
        return true;
    });
    if (!(largest > 0)) return 0;
    const auto decadeOf = [](double x) { return std::pow(10.0, std::floor(std::log10(x))); };
    const double floats = 0x1p-23 * largest, decade = decadeOf(largest);
    // Below the finest every coordinate is a multiple, within its own rounding.
    const auto find = [&](double coarsest, double finest, auto&& stepsOf) {
        for (double grid = coarsest; grid > finest; grid /= 10)
            if (forEachCoordinate(mesh, [&](double x) { return isMultiple(stepsOf(x) / grid); }))
                return isNeeded(mesh, grid) ? grid : floats;
        return 0.0;
    };
    const double finest = 4 * kRounding * largest;
    if (const double grid = find(decade, finest, [](double x) { return x; }); grid > 0) return grid;
    // A number of digits: coordinates of the decade below have a grid as much finer.
    const auto sameDigits = [&](double x) { return x > largest / 10 ? x * decade / decadeOf(x) : 0; };
    if (const double grid = find(decade, finest, sameDigits); grid > 0) return grid;
    for (const double grid : kNormalized)
        if (largest <= 1 && grid > finest && forEachCoordinate(mesh, [&](double x) { return isMultiple(x / grid); }) &&
            isNeeded(mesh, grid))
            return grid;
    return floats;
}

std::vector<glm::vec3> smoothNormals(const MeshData& mesh) {
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0));
    for (std::size_t t = 0; t < mesh.indices.size() / 3; ++t) {
        const glm::dvec3 area = doubleArea(mesh, t);
        for (std::size_t k = 0; k < 3; ++k) sums[mesh.indices[3 * t + k]] += area;
    }
    std::vector<glm::vec3> normals(sums.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const double length = glm::length(sums[i]);
        normals[i] = length > 0 ? glm::vec3(sums[i] / length) : glm::vec3(0, 0, 1);
    }
    return normals;
}

MeshData splitAtCreases(const MeshData& mesh, double angle) {
    std::vector<std::size_t> ends(mesh.positions.size() + 1);  // of the corners of each vertex, in `corners`
    for (const std::uint32_t v : mesh.indices) ++ends[v + 1];
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    std::vector<std::size_t> corners(mesh.indices.size()), next(ends);
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) corners[next[mesh.indices[i]]++] = i;

    MeshData out;
    out.indices.resize(mesh.indices.size());
    CornerGroups groups(mesh, angle);
    std::vector<std::uint32_t> vertexOf;  // by group
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const std::span<const std::size_t> own(corners.data() + ends[v], corners.data() + ends[v + 1]);
        const std::vector<std::size_t>& group = groups.of(own);
        vertexOf.assign(own.size(), 0);
        for (std::size_t i = 0; i < own.size(); ++i)
            if (group[i] == i) {
                vertexOf[i] = static_cast<std::uint32_t>(out.positions.size());
                out.positions.push_back(mesh.positions[v]);
                if (!mesh.texcoords.empty()) out.texcoords.push_back(mesh.texcoords[v]);
                if (!mesh.colors.empty()) out.colors.push_back(mesh.colors[v]);
            }
        for (std::size_t i = 0; i < own.size(); ++i) out.indices[own[i]] = vertexOf[group[i]];
    }
    out.normals = smoothNormals(out);
    return out;
}

}  // namespace touchstone::engine
