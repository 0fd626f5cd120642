#pragma once
// Outlines in the plane and their triangulation: the cross-sections of the parts.
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace touchstone::app {

/// A simple closed polygon, counter-clockwise, without repeating the first point. Lengths in mm.
using Outline = std::vector<glm::dvec2>;

/// Regular polygon inscribed in the circle, the first corner at angle 0.
Outline polygon(double radius, int corners);

/// Regular polygon inscribed in the circle, its chords at most `chordError` inside it and at most `spacing` long.
Outline circle(double radius, double chordError, double spacing);

/// Throws std::invalid_argument with the sentence, for parts that cannot be made.
void require(bool holds, const char* sentence);

/// Adds points of an arc about the origin, both ends included (rad), its chords as those of a circle.
void addArc(Outline& outline, double radius, double from, double to, double chordError, double spacing);

/// The outline moved outward by `distance` (inward if negative): every edge shifts along its normal and neighboring
/// edges meet in mitered corners, so that points on an edge are `distance` away and corners farther. The result has one
/// point for each point given; an edge that the shift consumes has both ends at the same place (see withoutRepeats).
/// Throws std::invalid_argument when the shift consumes the whole outline.
Outline offset(const Outline& outline, double distance);

/// The outline without points that coincide with their predecessor.
Outline withoutRepeats(const Outline& outline);

/// The outline with its edges divided evenly into pieces of at most `spacing`.
Outline subdivided(const Outline& outline, double spacing);

/// Enclosed area, mm²; positive for counter-clockwise outlines.
double signedArea(const Outline& outline);

struct PlanarMesh {
    std::vector<glm::dvec2> points;                       ///< those of the outer outline, of the hole, then inner ones
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise
};

/// Delaunay triangulation of the region inside `outer` and outside `hole` (may be empty), with points on a hexagonal
/// grid of `spacing` inside. The points and edges of the outlines are kept exactly, and no point is added on them.
/// Throws std::invalid_argument when an edge of an outline is too long for the narrowest part of the region beside it.
PlanarMesh triangulate(const Outline& outer, const Outline& hole, double spacing);

}  // namespace touchstone::app
