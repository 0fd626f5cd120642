#pragma once
// Recognizes cylinders and threads in free-form surfaces, as which CAD programs export them.
#include <glm/glm.hpp>
#include <optional>
#include <span>

namespace touchstone::engine {

/// A point of a surface, and its unit normal.
struct SurfacePoint {
    glm::dvec3 place{0}, normal{0};
};

/// A surface that a screw motion maps to itself.
struct ScrewSurface {
    glm::dvec3 point{0}, axis{0};  ///< on the axis nearest to the surface's middle; unit
    double lead = 0;               ///< travel along the axis per turn, positive if right-handed; 0 if `cylinder`
    bool cylinder = false;         ///< about the axis
    double inner = 0, outer = 0;   ///< between these distances from the axis
};

/// The velocity of a screw motion, v + ω x p, is tangential at every point p of a surface that the motion maps to
/// itself: n · (v + ω x p) = 0 is linear in v and ω (H. Pottmann and T. Randrup, "Rotational and helical surface
/// approximation for reverse engineering", 1998). Points should spread over the surface, 20 or more. Nothing if no such
/// motion fits to a ten-thousandth of its speed, if the surface is a plane, a sphere or one that a translation alone
/// maps to itself, or if it is a surface of revolution.
std::optional<ScrewSurface> screwSurface(std::span<const SurfacePoint> points);

}  // namespace touchstone::engine
