#include "engine/scene/mesh_data.hpp"

#include <algorithm>
#include <cmath>
#include <set>

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
    // In doubles, so that the cross product of tiny or huge triangles keeps its direction.
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0));
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        const auto a = mesh.indices[i], b = mesh.indices[i + 1], c = mesh.indices[i + 2];
        const glm::dvec3 p = mesh.positions[a];
        const glm::dvec3 doubleArea = glm::cross(glm::dvec3(mesh.positions[b]) - p, glm::dvec3(mesh.positions[c]) - p);
        sums[a] += doubleArea;
        sums[b] += doubleArea;
        sums[c] += doubleArea;
    }
    std::vector<glm::vec3> normals(sums.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const double length = glm::length(sums[i]);
        normals[i] = length > 0 ? glm::vec3(sums[i] / length) : glm::vec3(0, 0, 1);
    }
    return normals;
}

}  // namespace touchstone::engine
