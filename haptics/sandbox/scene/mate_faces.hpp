#pragma once
// Faces of CAD parts as mates see them: cylinders and threads grouped by axis, and the planes across and beside an
// axis. Lengths in meters.
#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/cad_parts.hpp"

namespace touchstone::sandbox {

/// A part of a CAD file at a place, which may mirror it. The shape must outlive it.
struct MatePart {
    std::string name;
    const engine::CadShape* shape = nullptr;
    glm::dmat4 placement{1};
};

/// A face at its place, with its triangles.
struct MateFace {
    engine::CadFace face;            ///< in the frame of the placement, but for its box
    std::size_t part = 0;            ///< index of its part
    std::vector<glm::dvec3> points;  ///< three for each triangle
};

std::vector<MateFace> mateFaces(std::span<const MatePart> parts);

/// A cylinder or a thread that faces about one axis make up.
struct MateBand {
    bool hollow = false;      ///< a hole, not a shaft
    double radius = 0;        ///< of a thread, the larger one
    double inner = 0;         ///< of a thread, the smaller one; else the same
    double from = 0, to = 0;  ///< along the axis, from its point
    double lead = 0;          ///< of a thread
    double area = 0;          ///< of the faces
    std::size_t part = 0;
    bool flat = false;  ///< a prism: `radius` is half the distance of its closest parallel sides
};

/// A line, and what lies around it.
struct MateAxis {
    glm::dvec3 point{0}, direction{0};  ///< unit
    std::vector<MateBand> bands;
};

/// The axes of all cylinders and threads that go around by more than 0.3 of a turn, so that a rounded edge has none.
std::vector<MateAxis> mateAxes(std::span<const MateFace> faces);

/// The axes of prisms: where the middles between two pairs of parallel planes cross. Planes that look at each other are
/// sides of a hole.
std::vector<MateAxis> prismAxes(std::span<const MateFace> faces);

/// An axis with a direction from which angles about it count.
struct MateFrame {
    glm::dvec3 point{0}, up{0}, first{0};          ///< unit and at right angles
    glm::dvec2 across(const glm::dvec3& p) const;  ///< the place beside the axis
    double height(const glm::dvec3& p) const { return glm::dot(p - point, up); }
};

/// A plane across the axis.
struct MateLevel {
    double height = 0;
    double outer = 0;  ///< distance of its farthest corner from the axis
    std::size_t part = 0;
    std::vector<glm::dvec2> corners;  ///< three for each triangle
};

/// The planes across the axis that look up, or down, the highest first.
std::vector<MateLevel> mateLevels(std::span<const MateFace> faces, const MateFrame& frame, bool lookUp);

/// Whether planes cover a common area above a hundredth of the smaller one, the first turned by that angle about the
/// axis. What lies between `inner` and `outer` from the axis, where a thread ends raggedly, does not count.
bool overlap(const MateLevel& a, const MateLevel& b, double turn, double inner = 0, double outer = 0);

/// A plane along the axis, or a cylinder beside and parallel to it.
struct MateSide {
    double angle = 0;     ///< of the plane's outward normal; of the cylinder's axis
    double distance = 0;  ///< from the axis along that direction; of a plane, below 0 if it looks at the axis
    double radius = 0;    ///< of a cylinder; 0: a plane
    bool hollow = false;
    double from = 0, to = 0;  ///< along the axis
    double area = 0;
};

/// The largest 64.
std::vector<MateSide> mateSides(std::span<const MateFace> faces, const MateFrame& frame);

/// The number of orientations about the axis in which the faces that reach below `top` look the same; 0 if all of them
/// are round.
int symmetry(std::span<const MateFace> faces, const MateFrame& frame, double top);

}  // namespace touchstone::sandbox
