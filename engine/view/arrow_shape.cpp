#include "engine/view/arrow_shape.hpp"

#include <array>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <utility>

namespace touchstone::engine {

std::vector<ArrowVertex> arrowShape() {
    constexpr int kSides = 24;
    struct Ring {
        float radius, lengths, heads;
    };
    // Outline from the tail's center to the tip; the last segment is the cone.
    constexpr std::array<Ring, 5> outline{Ring{0, 0, 0}, Ring{1, 0, 0}, Ring{1, 1, 1}, Ring{kArrowHeadRadius, 1, 1},
                                          Ring{0, 1, 0}};
    constexpr std::array<glm::vec2, 4> normals{glm::vec2{0, -1}, {1, 0}, {0, -1}, {0, 0}};  // outwards, along

    std::vector<ArrowVertex> vertices;
    for (std::size_t k = 0; k + 1 < outline.size(); ++k)
        for (int side = 0; side < kSides; ++side) {
            const auto corner = [&](const Ring& ring, int s) {
                const float angle = glm::two_pi<float>() * static_cast<float>(s) / kSides;
                const bool cone = k + 2 == outline.size();
                vertices.push_back({{ring.radius, ring.lengths, ring.heads, cone ? 1.f : 0.f},
                                    {std::cos(angle), std::sin(angle), normals[k].x, normals[k].y}});
            };
            for (const auto& [ring, step] : {std::pair{k, 0}, {k, 1}, {k + 1, 1}, {k, 0}, {k + 1, 1}, {k + 1, 0}})
                corner(outline[ring], side + step);
        }
    return vertices;
}

}  // namespace touchstone::engine
