// The clearance of CAD parts, by hand.
#include "engine/scene/cad_clearance.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

namespace touchstone::cad_clearance_tests {

using namespace touchstone::engine;

namespace {

CadFace round(CadSurface surface, bool hollow, double radius) {
    CadFace face;
    face.surface = surface;
    face.hollow = hollow;
    face.axis = {0, 0, 1};
    face.radius = radius;
    face.to = 0.02;
    return face;
}

/// A part for each face.
CadAssembly partsOf(const std::vector<CadFace>& faces) {
    CadAssembly assembly;
    for (const CadFace& face : faces) {
        assembly.parts.push_back({.name = "part", .shape = std::uint32_t(assembly.shapes.size())});
        assembly.shapes.emplace_back().faces = {face};
    }
    return assembly;
}

double clearanceOf(CadAssembly assembly) {
    findClearances({&assembly, 1});
    CHECK(assembly.shapes.front().clearance == assembly.shapes.front().faces[0].clearance);
    return leastClearance(assembly);
}

constexpr CadSurface kCylinder = CadSurface::Cylinder, kCone = CadSurface::Cone, kSphere = CadSurface::Sphere;

}  // namespace

TEST_CASE("cad clearance: that of a shaft in a hole is the difference of their radii", "[cad]") {
    const CadAssembly fit = partsOf({round(kCylinder, true, 0.005), round(kCylinder, false, 0.00499)});
    CHECK(clearanceOf(fit) == Approx(0.00001));

    CadAssembly moved = fit;  // along the axis, turned about it, and upside down
    moved.parts[1].placement = glm::translate(glm::dmat4(1), {0, 0, 0.03});
    moved.parts[1].placement = glm::rotate(moved.parts[1].placement, std::acos(-1.0), {1, 0, 0});
    CHECK(clearanceOf(moved) == Approx(0.00001));

    CadAssembly loose = partsOf({round(kCylinder, true, 0.005), round(kCylinder, false, 0.00495)});
    loose.parts.push_back(loose.parts[1]);
    loose.parts[2].shape = 2;
    loose.shapes.push_back(loose.shapes[1]);
    loose.shapes[2].faces[0].radius = 0.00498;  // of two shafts, the one with less room
    CHECK(clearanceOf(loose) == Approx(0.00002));
}

TEST_CASE("cad clearance: parts that touch, or are not in each other, have none", "[cad]") {
    CHECK(clearanceOf(partsOf({round(kCylinder, true, 0.005), round(kCylinder, false, 0.005)})) == 0);
    CHECK(clearanceOf(partsOf({round(kCylinder, true, 0.005), round(kCylinder, false, 0.00501)})) == 0);
    CHECK(clearanceOf(partsOf({round(kCylinder, true, 0.005), round(kCylinder, true, 0.00499)})) == 0);
    CHECK(clearanceOf(partsOf({round(kSphere, true, 0.005), round(kCylinder, false, 0.00499)})) == 0);
    // Beside a pair that is together, another hole does not count: the shaft is not in it.
    CadAssembly fit =
        partsOf({round(kCylinder, true, 0.005), round(kCylinder, false, 0.00497), round(kCylinder, true, 0.00498)});
    fit.parts[2].placement = glm::translate(glm::dmat4(1), {0.05, 0, 0});
    CHECK(clearanceOf(fit) == Approx(0.00003));
    // Modeled apart, all count.
    fit.parts[0].placement = glm::translate(glm::dmat4(1), {0, 0.05, 0});
    CHECK(clearanceOf(fit) == Approx(0.00001));
}

TEST_CASE("cad clearance: that of cones counts at a right angle to them, that of spheres along the radius", "[cad]") {
    CadFace hole = round(kCone, true, 0.005), shaft = round(kCone, false, 0.005);
    hole.halfAngle = shaft.halfAngle = std::acos(0.8);  // tan: 0.75
    CadAssembly fit = partsOf({hole, shaft});
    fit.parts[1].placement = glm::translate(glm::dmat4(1), {0, 0, 0.0001});
    // Raised by 0.1 mm, the shaft has 0.075 mm of room across the axis, and 0.06 mm across the surface.
    CHECK(clearanceOf(fit) == Approx(0.00006));
    CHECK(clearanceOf(partsOf({round(kSphere, true, 0.005), round(kSphere, false, 0.00498)})) == Approx(0.00002));
}

}  // namespace touchstone::cad_clearance_tests
