#pragma once
// Outlines in the plane and their triangulation: the cross-sections of the parts.
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace touchstone::app {

/// A simple closed polygon, counter-clockwise, without repeating the first point. Lengths in mm.
using Outline = std::vector<glm::dvec2>;

/// Regular polygon inscribed in the circle, its chords at most `chordError` inside it and at most `spacing` long.
Outline circle(double radius, double chordError, double spacing);

/// Throws std::invalid_argument with the sentence where a part cannot be made.
void require(bool holds, const char* sentence);

/// Adds points of an arc about the origin, both ends included (rad), its chords as those of a circle.
void addArc(Outline& outline, double radius, double from, double to, double chordError, double spacing);

/// The outline moved outward by `distance` (inward when negative): every edge shifts along its normal and neighboring
/// edges meet in mitred corners, so that points on an edge are `distance` away and corners further. The result has one
/// point for each point given; an edge that the shift consumes has both ends at one place (see withoutRepeats).
/// Throws std::invalid_argument when nothing of the outline is left.
Outline offset(const Outline& outline, double distance);

/// The outline without points that coincide with the one before.
Outline withoutRepeats(const Outline& outline);

/// The outline with its edges divided evenly into pieces of at most `spacing`.
Outline subdivided(const Outline& outline, double spacing);

/// Area enclosed, mm²; positive for counter-clockwise.
double signedArea(const Outline& outline);

struct PlanarMesh {
    std::vector<glm::dvec2> points;                       ///< those of the outer outline, of the hole, then inner ones
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise
};

/// Delaunay triangulation of the region inside `outer` and outside `hole` (may be empty), with points on a hexagonal
/// grid of `spacing` inside. The outlines' points and edges are kept exactly: none is added on them.
/// Throws std::invalid_argument when an outline's edges are too long for the narrowest place beside them.
PlanarMesh triangulate(const Outline& outer, const Outline& hole, double spacing);

}  // namespace touchstone::app
