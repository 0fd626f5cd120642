#include "tools/parts/wire.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "tools/parts/shapes.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::app {

std::vector<glm::dvec3> arc(const glm::dvec3& center, const glm::dvec3& u, const glm::dvec3& v, double radius,
                            double from, double to, double spacing) {
    const int n = std::max(1, static_cast<int>(std::ceil(radius * std::abs(to - from) / spacing)));
    std::vector<glm::dvec3> points;
    for (int i = 0; i <= n; ++i) {
        const double angle = from + (to - from) * i / n;
        points.push_back(center + radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
    return points;
}

engine::MeshData wire(std::span<const glm::dvec3> line, double radius, bool closed, double spacing) {
    const std::size_t n = line.size();
    if (n < (closed ? 3 : 2)) throw std::invalid_argument("a wire needs two points, a ring three");
    const Outline round = circle(radius, kChordError, spacing);

    // Frames carried along the line with minimal rotation. Along a closed plane line they return unchanged.
    struct Ring {
        glm::dvec3 center, side, up, along;
        double radius;
    };
    std::vector<Ring> rings;
    glm::dvec3 side(0);
    for (std::size_t i = 0; i < n; ++i) {
        const glm::dvec3 before = line[i > 0 ? i - 1 : closed ? n - 1 : 0];
        const glm::dvec3 after = line[i + 1 < n ? i + 1 : closed ? 0 : n - 1];
        const glm::dvec3 along = glm::normalize(after - before);
        if (i == 0) side = std::abs(along.y) < 0.9 ? glm::dvec3(0, 1, 0) : glm::dvec3(0, 0, 1);
        side = glm::normalize(side - glm::dot(side, along) * along);
        rings.push_back({line[i], side, glm::cross(along, side), along, radius});
    }
    for (std::size_t i = 0; i + 1 < n; ++i) {
        const glm::dvec3 step = rings[i + 1].center - rings[i].center;
        if (glm::length(rings[i + 1].along - rings[i].along) * radius >= glm::length(step))
            throw std::invalid_argument("the wire bends more sharply than it is thick");
    }
    if (!closed) {  // round ends: rings that shrink to a point
        const int caps = std::max(3, static_cast<int>(std::ceil(std::numbers::pi / 2 * radius / spacing)));
        std::vector<Ring> start, end;
        for (int k = 1; k <= caps; ++k) {
            const double angle = std::numbers::pi / 2 * k / caps, out = radius * std::sin(angle);
            Ring a = rings.front(), b = rings.back();
            a.center -= out * a.along, b.center += out * b.along;
            a.radius = b.radius = k == caps ? 0 : radius * std::cos(angle);
            start.insert(start.begin(), a), end.push_back(b);
        }
        rings.insert(rings.begin(), start.begin(), start.end());
        rings.insert(rings.end(), end.begin(), end.end());
    }

    Solid solid;
    const std::size_t m = round.size(), spans = rings.size() - (closed ? 0 : 1);
    const auto at = [&](std::size_t ring, std::size_t i) {
        const Ring& r = rings[ring % rings.size()];
        const glm::dvec2 p = round[i % m] / radius * r.radius;
        return r.center + p.x * r.side + p.y * r.up;
    };
    for (std::size_t ring = 0; ring < spans; ++ring)
        for (std::size_t i = 0; i < m; ++i) {
            solid.add(at(ring, i), at(ring, i + 1), at(ring + 1, i + 1));
            solid.add(at(ring, i), at(ring + 1, i + 1), at(ring + 1, i));
        }
    return finished(solid);
}

}  // namespace touchstone::app
