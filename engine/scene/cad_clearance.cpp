#include "engine/scene/cad_clearance.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone::engine {
namespace {

constexpr double kParallel = 1e-4;      // rad between axes that count as one; a shaft of 50 mm leans by 5 µm
constexpr double kTouching = 1e-9;      // m: nearer surfaces are drawn to touch
constexpr double kLoosest = 0.1;        // of the hole's radius: what is farther apart is no fit
constexpr double kApartLoosest = 0.02;  // the same for parts that are modeled apart

/// A round face at its place.
struct RoundFace {
    std::size_t part = 0;
    CadFace* face = nullptr;
    CadShape* shape = nullptr;
    glm::dvec3 origin{0}, axis{0};
    double from = 0, to = 0;  // along the axis
};

bool isRound(const CadFace& face) {
    return face.surface == CadSurface::Cylinder || face.surface == CadSurface::Cone ||
           face.surface == CadSurface::Sphere;
}

void note(const RoundFace& at, double clearance) {
    for (double* least : {&at.face->clearance, &at.shape->clearance})
        *least = *least > 0 ? std::min(*least, clearance) : clearance;
}

/// The clearance of a shaft in a hole where it is placed. Nothing if it is not in it, or touches.
std::optional<double> clearanceInPlace(const RoundFace& hole, const RoundFace& shaft) {
    const CadFace &h = *hole.face, &s = *shaft.face;
    const glm::dvec3 between = shaft.origin - hole.origin;
    if (h.surface == CadSurface::Sphere) {
        const double clearance = h.radius - s.radius;
        return clearance > kTouching && glm::length(between) <= clearance ? std::optional(clearance) : std::nullopt;
    }
    if (glm::length(glm::cross(hole.axis, shaft.axis)) > kParallel) return {};
    const double along = glm::dot(between, hole.axis), sign = glm::dot(hole.axis, shaft.axis) > 0 ? 1 : -1;
    const double beside = glm::length(between - along * hole.axis);
    // The shaft's extent along the axis of the hole.
    const double low = along + std::min(sign * shaft.from, sign * shaft.to);
    const double high = along + std::max(sign * shaft.from, sign * shaft.to);
    if (std::min(hole.to, high) - std::max(hole.from, low) <= kTouching) return {};
    double clearance = h.radius - s.radius;
    if (h.surface == CadSurface::Cone) {
        if (sign < 0 || std::abs(h.halfAngle - s.halfAngle) > kParallel) return {};
        clearance = (h.radius + along * std::tan(h.halfAngle) - s.radius) * std::cos(h.halfAngle);
    }
    if (clearance <= kTouching || beside > clearance || clearance > kLoosest * h.radius) return {};
    return clearance;
}

}  // namespace

void findClearances(std::span<CadAssembly> assemblies) {
    std::vector<RoundFace> holes, shafts;
    std::size_t index = 0;
    for (CadAssembly& assembly : assemblies) {
        for (CadShape& shape : assembly.shapes) {
            shape.clearance = 0;
            for (CadFace& face : shape.faces) face.clearance = 0;
        }
        for (const CadPart& part : assembly.parts) {
            CadShape& shape = assembly.shapes[part.shape];
            for (CadFace& face : shape.faces)
                if (isRound(face))
                    (face.hollow ? holes : shafts)
                        .push_back({.part = index,
                                    .face = &face,
                                    .shape = &shape,
                                    .origin = glm::dvec3(part.placement * glm::dvec4(face.origin, 1)),
                                    .axis = glm::dvec3(part.placement * glm::dvec4(face.axis, 0)),
                                    .from = face.from,
                                    .to = face.to});
            ++index;
        }
    }
    std::ranges::sort(shafts, {}, [](const RoundFace& shaft) { return shaft.face->radius; });
    // Radii of a cone's faces count from points of their own.
    double widest = 0;
    for (const RoundFace& shaft : shafts)
        if (shaft.face->surface == CadSurface::Cone) widest = std::max(widest, shaft.face->radius);
    bool together = false;
    for (const RoundFace& hole : holes) {
        const bool cone = hole.face->surface == CadSurface::Cone;
        const double radius = hole.face->radius, low = cone ? 0 : radius * (1 - kLoosest),
                     high = cone ? widest : radius;
        for (auto shaft = std::ranges::lower_bound(shafts, low, {}, [](const RoundFace& s) { return s.face->radius; });
             shaft != shafts.end() && shaft->face->radius <= high; ++shaft) {
            if (shaft->part == hole.part || shaft->face->surface != hole.face->surface) continue;
            if (const auto clearance = clearanceInPlace(hole, *shaft)) {
                together = true;
                note(hole, *clearance);
                note(*shaft, *clearance);
            }
        }
    }
    if (together) return;
    for (const RoundFace& hole : holes)
        for (const RoundFace& shaft : shafts) {
            const double clearance = hole.face->radius - shaft.face->radius;
            if (shaft.part == hole.part || shaft.face->surface != hole.face->surface ||
                hole.face->surface == CadSurface::Cone || clearance <= kTouching ||
                clearance > kApartLoosest * hole.face->radius)
                continue;
            note(hole, clearance);
            note(shaft, clearance);
        }
}

double leastClearance(const CadAssembly& assembly) {
    double least = 0;
    for (const CadPart& part : assembly.parts)
        if (const double own = assembly.shapes[part.shape].clearance; own > 0)
            least = least > 0 ? std::min(least, own) : own;
    return least;
}

}  // namespace touchstone::engine
