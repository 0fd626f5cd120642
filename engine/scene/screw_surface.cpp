#include "engine/scene/screw_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace touchstone::engine {
namespace {

using glm::dvec3;
using Matrix6 = std::array<std::array<double, 6>, 6>;

constexpr double kScrewFit = 1e-4;   // of the speed: splines of CAD programs are closer, other surfaces are not
constexpr double kLeastRise = 1e-3;  // of the surface's reach: less is a surface of revolution
constexpr std::size_t kLeastScrewPoints = 20;

/// Eigenvalues and, in the columns of `vectors`, eigenvectors of a symmetric matrix, by Jacobi's rotations.
std::array<double, 6> eigenvalues(Matrix6 m, Matrix6& vectors) {
    vectors = {};
    for (std::size_t i = 0; i < 6; ++i) vectors[i][i] = 1;
    for (int sweep = 0; sweep < 30; ++sweep)
        for (std::size_t p = 0; p < 6; ++p)
            for (std::size_t q = p + 1; q < 6; ++q) {
                if (m[p][q] == 0) continue;
                const double angle = std::atan2(2 * m[p][q], m[q][q] - m[p][p]) / 2;
                const double c = std::cos(angle), s = std::sin(angle);
                for (std::size_t k = 0; k < 6; ++k) {
                    const double a = m[k][p], b = m[k][q];
                    m[k][p] = c * a - s * b;
                    m[k][q] = s * a + c * b;
                }
                for (std::size_t k = 0; k < 6; ++k) {
                    const double a = m[p][k], b = m[q][k];
                    m[p][k] = c * a - s * b;
                    m[q][k] = s * a + c * b;
                }
                for (std::size_t k = 0; k < 6; ++k) {
                    const double a = vectors[k][p], b = vectors[k][q];
                    vectors[k][p] = c * a - s * b;
                    vectors[k][q] = s * a + c * b;
                }
            }
    std::array<double, 6> values{};
    for (std::size_t i = 0; i < 6; ++i) values[i] = m[i][i];
    return values;
}

/// Unit motions that leave the surface in place, as (v / reach, ω).
struct SelfMotion {
    dvec3 v, w;
};

}  // namespace

std::optional<ScrewSurface> screwSurface(std::span<const SurfacePoint> points) {
    if (points.size() < kLeastScrewPoints) return {};
    dvec3 middle(0);
    for (const SurfacePoint& p : points) middle += p.place / double(points.size());
    double reach = 0;
    for (const SurfacePoint& p : points) reach = std::max(reach, glm::length(p.place - middle));
    if (!(reach > 0)) return {};

    Matrix6 sum{};
    for (const SurfacePoint& p : points) {
        const dvec3 moment = glm::cross((p.place - middle) / reach, p.normal);
        const std::array<double, 6> row{p.normal.x, p.normal.y, p.normal.z, moment.x, moment.y, moment.z};
        for (std::size_t i = 0; i < 6; ++i)
            for (std::size_t j = 0; j < 6; ++j) sum[i][j] += row[i] * row[j] / double(points.size());
    }
    Matrix6 vectors;
    const std::array<double, 6> values = eigenvalues(sum, vectors);
    std::array<SelfMotion, 6> motions;
    std::size_t count = 0;
    for (std::size_t i = 0; i < 6; ++i)
        if (values[i] < kScrewFit * kScrewFit)
            motions[count++] = {{vectors[0][i], vectors[1][i], vectors[2][i]},
                                {vectors[3][i], vectors[4][i], vectors[5][i]}};
    if (count == 0 || count > 2) return {};

    SelfMotion turning = motions[0];
    if (count == 2) {
        // A cylinder turns about its axis and slides along it: both turn about the same direction, if at all.
        if (glm::length(motions[1].w) > glm::length(turning.w)) std::swap(turning, motions[1]);
        if (glm::length(glm::cross(turning.w, motions[1].w)) > 1e-3) return {};
    }
    const double speed = glm::length(turning.w);
    if (speed < 1e-3) return {};
    ScrewSurface surface;
    surface.axis = turning.w / speed;
    surface.point = middle + reach * glm::cross(turning.w, turning.v) / (speed * speed);
    const double rise = glm::dot(turning.v, surface.axis) / speed;
    surface.cylinder = count == 2;
    if (!surface.cylinder) {
        if (std::abs(rise) < kLeastRise) return {};
        surface.lead = 2 * std::numbers::pi * rise * reach;
    }
    surface.inner = 1e30;
    for (const SurfacePoint& p : points) {
        const double r = glm::length(glm::cross(p.place - surface.point, surface.axis));
        surface.inner = std::min(surface.inner, r);
        surface.outer = std::max(surface.outer, r);
    }
    return surface;
}

}  // namespace touchstone::engine
