#include "engine/scene/mesh_data.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone::engine {
namespace {

constexpr double kRounding = 0x1p-22;  ///< relative; of a decimal number that was scaled in single precision
constexpr double kNormalized[] = {1.0 / 127, 1.0 / 255, 1.0 / 32767, 1.0 / 65535};

}  // namespace

double gridOf(const MeshData& mesh) {
    double largest = 0;
    for (const glm::vec3& p : mesh.positions)
        for (int k = 0; k < 3; ++k) largest = std::max(largest, std::abs(double(p[k])));
    if (!(largest > 0)) return 0;
    const auto decadeOf = [](double x) { return std::pow(10.0, std::floor(std::log10(x))); };
    // Fixed decimals, or a number of digits: then coordinates of the decade below have a grid as much finer.
    const auto isGrid = [&](double grid, double decade) {
        return std::all_of(mesh.positions.begin(), mesh.positions.end(), [&](const glm::vec3& p) {
            for (int k = 0; k < 3; ++k) {
                const double x = std::abs(double(p[k]));
                if (x <= largest / 10) continue;
                const double steps = x / grid * (decade > 0 ? decade / decadeOf(x) : 1);
                if (std::abs(steps - std::round(steps)) > kRounding * steps) return false;
            }
            return true;
        });
    };
    // Below this every coordinate is a multiple, within its own rounding.
    const double finest = 4 * kRounding * largest, decade = decadeOf(largest);
    for (const double of : {0.0, decade})
        for (double grid = decade; grid > finest; grid /= 10)
            if (isGrid(grid, of)) return grid;
    if (largest <= 1)
        for (const double grid : kNormalized)
            if (grid > finest && isGrid(grid, 0)) return grid;
    return 0x1p-23 * largest;
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
