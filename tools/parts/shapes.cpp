#include "tools/parts/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>

#include "tools/parts/angles.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::app {
namespace {

void check(const SplineFit& fit) {
    require(fit.diameter > 0 && fit.length > 0 && fit.depth > 0 && fit.wall > 0 && fit.spacing > 0,
            "diameter, length, depth, wall and spacing of a spline must be positive");
    require(fit.clearance >= 0 && fit.chamfer >= 0, "clearance and chamfer of a spline must not be negative");
    require(fit.chamfer < std::min(fit.length, fit.depth), "the chamfer must be smaller than the length of the spline");
    require(fit.chamfer < fit.wall, "the chamfer must be smaller than the wall around the hole");
    require(fit.chamfer < fit.keyWidth / 2, "the chamfer must be smaller than half the width of the keys");
}

Solid icosahedron(double radius) {
    const double g = std::numbers::phi;
    Solid solid;
    for (const glm::dvec3& p : {glm::dvec3{-1, g, 0},
                                {1, g, 0},
                                {-1, -g, 0},
                                {1, -g, 0},
                                {0, -1, g},
                                {0, 1, g},
                                {0, -1, -g},
                                {0, 1, -g},
                                {g, 0, -1},
                                {g, 0, 1},
                                {-g, 0, -1},
                                {-g, 0, 1}})
        solid.points.push_back(radius * glm::normalize(p));
    solid.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    return solid;
}

/// Divides every triangle into four, with the new points on the sphere.
void divide(Solid& solid, double radius) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
        const auto [entry, isNew] =
            middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(solid.points.size()));
        if (isNew) solid.points.push_back(radius * glm::normalize(solid.points[a] + solid.points[b]));
        return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : solid.triangles) {
        const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        for (const auto& part : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) finer.push_back(part);
    }
    solid.triangles = std::move(finer);
}

/// The largest distance of a triangle's interior from the sphere.
double sagitta(const Solid& solid, double radius) {
    double most = 0;
    for (const auto& [a, b, c] : solid.triangles) {
        const glm::dvec3 &A = solid.points[a], &B = solid.points[b], &C = solid.points[c];
        most = std::max(most, radius - std::abs(glm::dot(A, glm::normalize(glm::cross(B - A, C - A)))));
    }
    return most;
}

/// A box about the origin with faces divided into squares of at most `spacing`.
Solid boxSolid(const glm::dvec3& size, double spacing) {
    Solid solid;
    glm::ivec3 count;
    for (int i = 0; i < 3; ++i) count[i] = std::max(1, static_cast<int>(std::ceil(size[i] / spacing - 1e-9)));
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        for (const int side : {0, 1}) {
            // Cell corners are fractions of the box, so that neighboring faces compute identical numbers.
            const auto at = [&](int i, int j) {
                glm::dvec3 p;
                p[axis] = (side - 0.5) * size[axis];
                p[u] = (double(i) / count[u] - 0.5) * size[u];
                p[v] = (double(j) / count[v] - 0.5) * size[v];
                return p;
            };
            for (int i = 0; i < count[u]; ++i)
                for (int j = 0; j < count[v]; ++j) {
                    const glm::dvec3 a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
                    if (side == 1)
                        solid.add(a, b, c), solid.add(a, c, d);
                    else
                        solid.add(a, c, b), solid.add(a, d, c);
                }
        }
    }
    return solid;
}

}  // namespace

engine::MeshData box(const glm::dvec3& size, double spacing) {
    require(size.x > 0 && size.y > 0 && size.z > 0 && spacing > 0, "the sides of a box must be positive");
    return finished(boxSolid(size, spacing));
}

engine::MeshData sphere(double radius) {
    require(radius > 0, "the radius of a sphere must be positive");
    Solid solid = icosahedron(radius);
    while (sagitta(solid, radius) > kChordError) divide(solid, radius);
    return finished(solid);
}

engine::MeshData pebble(int triangles, unsigned seed) {
    require(triangles >= 48, "a pebble needs at least 48 triangles");
    constexpr double kRadius = 30, kHeight = 0.25;  // mm; the waves add up to 0.7 mm RMS
    struct Wave {
        glm::dvec3 vector;  // rad for each unit of the direction
        double phase;
    };
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::array<Wave, 16> waves;
    for (std::size_t i = 0; i < waves.size(); ++i) {
        for (int k = 0; k < 3; ++k) waves[i].vector[k] = normal(random);
        const double length = 12 + static_cast<double>(i);  // mm
        waves[i] = {kTau * kRadius / length * glm::normalize(waves[i].vector), kTau * normal(random)};
    }
    // A divided cube, whose points a tangent spreads evenly over the sphere.
    Solid solid = boxSolid(glm::dvec3(2), 2 / std::round(std::sqrt(triangles / 12.0)));
    for (glm::dvec3& p : solid.points) {
        p = glm::normalize(glm::tan(p * (kPi / 4)));
        double radius = kRadius;
        for (const Wave& wave : waves) radius += kHeight * std::cos(glm::dot(wave.vector, p) + wave.phase);
        p *= radius;
    }
    return finished(solid);
}

engine::MeshData cylinder(double radius, double length, double spacing) {
    require(radius > 0 && length > 0 && spacing > 0, "radius and length of a cylinder must be positive");
    const Outline outline = circle(radius, kChordError, spacing);
    const PlanarMesh end = triangulate(outline, {}, spacing);
    const Section sections[] = {{-length / 2, outline}, {length / 2, outline}};
    Solid solid;
    addWall(solid, sections, spacing);
    addEnd(solid, length / 2, end, true);
    addEnd(solid, -length / 2, end, false);
    return finished(solid);
}

Outline splineProfile(const SplineFit& fit) {
    check(fit);
    const double tip = fit.diameter / 2, root = tip - fit.keyDepth;
    require(fit.keys >= 2, "a spline needs at least two keys");
    require(fit.keyDepth > 0 && root > 0, "the depth of the keys must lie between 0 and half the diameter");
    require(fit.keyWidth > 0 && fit.keyWidth < 2 * root, "the keys must be narrower than the root circle");
    const double pitch = 2 * std::numbers::pi / fit.keys;
    const double tipHalf = std::asin(fit.keyWidth / 2 / tip), rootHalf = std::asin(fit.keyWidth / 2 / root);
    require(2 * rootHalf < pitch, "the keys overlap; make them fewer or narrower");

    // Arcs become chords of equal length with corners exactly on the flanks; the flanks are divided later.
    Outline outline;
    const auto arc = [&](double radius, double from, double to) {
        addArc(outline, radius, from, to, kChordError, fit.spacing);
    };
    for (int key = 0; key < fit.keys; ++key) {
        const double middle = key * pitch;
        arc(tip, middle - tipHalf, middle + tipHalf);
        arc(root, middle + rootHalf, middle + pitch - rootHalf);
    }
    return subdivided(outline, fit.spacing);
}

engine::MeshData splinedShaft(const SplineFit& fit) {
    const Outline profile = splineProfile(fit), lower = offset(profile, -fit.chamfer);
    const Section sections[] = {{0, lower}, {fit.chamfer, profile}, {fit.length, profile}};
    Solid solid;
    addWall(solid, std::span(sections).subspan(fit.chamfer > 0 ? 0 : 1), fit.spacing);
    addEnd(solid, fit.length, triangulate(profile, {}, fit.spacing), true);
    addEnd(solid, 0, triangulate(withoutRepeats(lower), {}, fit.spacing), false);
    return finished(solid);
}

engine::MeshData splinedHole(const SplineFit& fit) {
    // The points of the profile are spread evenly again: the shift shortens edges in inner corners and lengthens them
    // in outer ones.
    const Outline bore = subdivided(withoutRepeats(offset(splineProfile(fit), fit.clearance)), fit.spacing);
    const Outline mouth = offset(bore, fit.chamfer);
    const Outline outer = circle(fit.diameter / 2 + fit.clearance + fit.wall, kChordError, fit.spacing);
    const double bottom = fit.blind ? -fit.depth - fit.wall : -fit.depth;

    Solid solid;
    const Section outside[] = {{bottom, outer}, {0, outer}};
    addWall(solid, outside, fit.spacing);
    const Section within[] = {{0, mouth}, {-fit.chamfer, bore}, {-fit.depth, bore}};
    addWall(solid, std::span(within).subspan(fit.chamfer > 0 ? 0 : 1), fit.spacing);
    addEnd(solid, 0, triangulate(outer, withoutRepeats(mouth), fit.spacing), true);
    addEnd(solid, bottom, triangulate(outer, fit.blind ? Outline{} : bore, fit.spacing), false);
    if (fit.blind) addEnd(solid, -fit.depth, triangulate(bore, {}, fit.spacing), true);
    return finished(solid);
}

}  // namespace touchstone::app
