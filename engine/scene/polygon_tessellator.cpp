#include "engine/scene/polygon_tessellator.hpp"

#include <GL/glu.h>

#include <random>

namespace touchstone::engine {
namespace {

// The library passes vertices as pointers: index plus one, since null has a special meaning.
void* dataOf(std::uint32_t index) { return reinterpret_cast<void*>(std::uintptr_t(index) + 1); }
std::uint32_t indexOf(void* data) { return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(data) - 1); }

}  // namespace

PolygonTessellator::PolygonTessellator(MeshData& mesh) : mesh_(mesh), tess_(gluNewTess(), gluDeleteTess) {
    using Callback = void (*)();
    const auto edgeFlag =
        +[](GLboolean) {};  // an edge-flag callback makes GLU emit single triangles instead of fans and strips
    const auto vertex =
        +[](void* data, void* self) { static_cast<PolygonTessellator*>(self)->mesh_.indices.push_back(indexOf(data)); };
    const auto combine = +[](const GLdouble at[3], void* const from[4], const GLfloat*, void** out, void* self) {
        *out = static_cast<PolygonTessellator*>(self)->crossing({at[0], at[1], at[2]}, from);
    };
    gluTessCallback(tess_.get(), GLU_TESS_EDGE_FLAG, reinterpret_cast<Callback>(edgeFlag));
    gluTessCallback(tess_.get(), GLU_TESS_VERTEX_DATA, reinterpret_cast<Callback>(vertex));
    gluTessCallback(tess_.get(), GLU_TESS_COMBINE_DATA, reinterpret_cast<Callback>(combine));
    gluTessProperty(tess_.get(), GLU_TESS_WINDING_RULE, GLU_TESS_WINDING_NONZERO);
}

bool PolygonTessellator::add(const std::vector<std::uint32_t>& corners) {
    glm::dvec3 normal(0);  // Newell's normal: twice the vector area of the polygon
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        normal += glm::cross(at(corners[i]) - at(corners[0]), at(corners[i + 1]) - at(corners[0]));
    if (crossesOften(corners, normal)) return false;
    gluTessNormal(tess_.get(), normal.x, normal.y, normal.z);
    gluTessBeginPolygon(tess_.get(), this);
    gluTessBeginContour(tess_.get());
    for (const std::uint32_t corner : corners) {
        glm::dvec3 position = at(corner);
        gluTessVertex(tess_.get(), &position.x, dataOf(corner));
    }
    gluTessEndContour(tess_.get());
    gluTessEndPolygon(tess_.get());
    return true;
}

/// Estimates the number of crossings from random pairs of edges, in proportion to the number of corners.
bool PolygonTessellator::crossesOften(const std::vector<std::uint32_t>& corners, const glm::dvec3& normal) const {
    constexpr std::size_t kFew = 128, kDrawsEach = 16, kCrossingsEach = 16;
    const std::size_t n = corners.size();
    if (n <= kFew) return false;  // at most 8,128 crossings
    const glm::dvec3 size = glm::abs(normal);
    const int dropped = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    const auto flat = [&](std::size_t i) {
        const glm::dvec3 p = at(corners[i % n]);
        return glm::dvec2(p[(dropped + 1) % 3], p[(dropped + 2) % 3]);
    };
    const auto parts = [](const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& p, const glm::dvec2& q) {
        const auto side = [&](const glm::dvec2& r) { return (b.x - a.x) * (r.y - a.y) - (b.y - a.y) * (r.x - a.x); };
        return (side(p) > 0 && side(q) < 0) || (side(p) < 0 && side(q) > 0);
    };
    std::mt19937_64 random(n);
    std::size_t hits = 0;
    for (std::size_t draw = 0; draw < kDrawsEach * n; ++draw) {
        const std::size_t i = random() % n, j = random() % n;
        const glm::dvec2 a = flat(i), b = flat(i + 1), p = flat(j), q = flat(j + 1);
        hits += parts(a, b, p, q) && parts(p, q, a, b);
    }
    // The share hits / draws of the n^2 / 2 pairs crosses.
    return hits > 2 * kCrossingsEach * kDrawsEach;
}

/// Returns the vertex where edges cross or corners coincide, and adds it if it is new.
void* PolygonTessellator::crossing(const glm::vec3& place, void* const from[4]) {
    for (int i = 0; i < 4; ++i)
        if (from[i] && mesh_.positions[indexOf(from[i])] == place) return from[i];
    mesh_.positions.push_back(place);
    return dataOf(static_cast<std::uint32_t>(mesh_.positions.size() - 1));
}

}  // namespace touchstone::engine
