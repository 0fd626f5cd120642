#pragma once
// Shapes of CAD files from surfaces that a test writes down, in mm; the contract has meters.
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <vector>

#include "engine/scene/cad_parts.hpp"

namespace touchstone {

/// A shape that grows face by face.
class CadSolid {
  public:
    engine::CadShape shape;

    /// About the z axis through (x, y).
    CadSolid& cylinder(double radius, double from, double to, bool hollow, double x = 0, double y = 0) {
        engine::CadFace face = start(engine::CadSurface::Cylinder);
        face.hollow = hollow;
        face.origin = glm::dvec3(x, y, 0) * kMm;
        face.axis = {0, 0, 1};
        face.radius = radius * kMm;
        face.from = from * kMm;
        face.to = to * kMm;
        face.turn = 2 * std::numbers::pi;
        face.area = face.turn * face.radius * (face.to - face.from);
        wall({x, y}, radius, from, radius, to);
        return add(face);
    }
    CadSolid& thread(double outer, double inner, double lead, double from, double to, bool hollow) {
        engine::CadFace face = start(engine::CadSurface::Helicoid);
        face.hollow = hollow;
        face.axis = {0, 0, 1};
        face.lead = lead * kMm;
        face.from = from * kMm;
        face.to = to * kMm;
        wall({0, 0}, inner, from, outer, to);
        return add(face);
    }
    CadSolid& cone(double low, double from, double high, double to, bool hollow) {
        engine::CadFace face = start(engine::CadSurface::Cone);
        face.hollow = hollow;
        face.origin = glm::dvec3(0, 0, from) * kMm;
        face.axis = {0, 0, 1};
        face.radius = low * kMm;
        face.halfAngle = std::atan2(high - low, to - from);
        face.to = (to - from) * kMm;
        wall({0, 0}, low, from, high, to);
        return add(face);
    }
    /// A ring across the z axis; from radius 0, a disk.
    CadSolid& ring(double inner, double outer, double z, bool up) {
        engine::CadFace face = start(engine::CadSurface::Plane);
        face.origin = glm::dvec3(0, 0, z) * kMm;
        face.axis = {0, 0, up ? 1 : -1};
        wall({0, 0}, up ? inner : outer, z, up ? outer : inner, z);
        return add(face);
    }
    /// A rectangle along the z axis whose normal has this angle, at `distance` from the axis along it.
    CadSolid& flat(double degrees, double distance, double width, double from, double to) {
        engine::CadFace face = start(engine::CadSurface::Plane);
        const double angle = degrees * std::numbers::pi / 180;
        face.axis = {std::cos(angle), std::sin(angle), 0};
        const glm::dvec3 along(-face.axis.y, face.axis.x, 0), up(0, 0, 1);
        face.origin = face.axis * distance * kMm;
        face.area = width * (to - from) * kMm * kMm;
        const auto at = [&](double s, double z) { return distance * face.axis + s * width / 2 * along + z * up; };
        quad(at(-1, from), at(1, from), at(1, to), at(-1, to));
        return add(face);
    }

    /// A rectangle across the z axis.
    CadSolid& rectangle(double x, double y, double z, bool up) {
        engine::CadFace face = start(engine::CadSurface::Plane);
        face.origin = glm::dvec3(0, 0, z) * kMm;
        face.axis = {0, 0, up ? 1 : -1};
        quad({-x / 2, -y / 2, z}, {x / 2, -y / 2, z}, {x / 2, y / 2, z}, {-x / 2, y / 2, z});
        return add(face);
    }

  private:
    static constexpr double kMm = 1e-3;
    static constexpr int kSegments = 48;

    engine::CadFace start(engine::CadSurface surface) {
        first_ = shape.triangles.size();
        engine::CadFace face;
        face.surface = surface;
        return face;
    }
    CadSolid& add(engine::CadFace face) {
        face.triangles = std::uint32_t(shape.triangles.size() - first_);
        shape.faces.push_back(face);
        return *this;
    }
    void quad(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c, const glm::dvec3& d) {
        const auto base = std::uint32_t(shape.vertices.size());
        for (const glm::dvec3& p : {a, b, c, d}) shape.vertices.push_back(p * kMm);
        shape.triangles.push_back({base, base + 1, base + 2});
        shape.triangles.push_back({base, base + 2, base + 3});
    }
    /// Quads around the axis, from one circle to another.
    void wall(const glm::dvec2& center, double r0, double z0, double r1, double z1) {
        const auto at = [&](int i, double r, double z) {
            const double angle = 2 * std::numbers::pi * i / kSegments;
            return glm::dvec3(center.x + r * std::cos(angle), center.y + r * std::sin(angle), z);
        };
        for (int i = 0; i < kSegments; ++i) quad(at(i, r0, z0), at(i, r1, z1), at(i + 1, r1, z1), at(i + 1, r0, z0));
    }

    std::size_t first_ = 0;
};

/// A motion, of which the angles are in degrees about x, y and z, one after the other, and the place in mm.
inline glm::dmat4 placement(const glm::dvec3& mm, const glm::dvec3& degrees = glm::dvec3(0)) {
    glm::dmat4 m = glm::translate(glm::dmat4(1), mm * 1e-3);
    m = glm::rotate(m, glm::radians(degrees.z), glm::dvec3(0, 0, 1));
    m = glm::rotate(m, glm::radians(degrees.y), glm::dvec3(0, 1, 0));
    return glm::rotate(m, glm::radians(degrees.x), glm::dvec3(1, 0, 0));
}

}  // namespace touchstone
