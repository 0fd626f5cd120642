#pragma once
// A rigid part: how it is touched, and its material. Tool and obstacles are parts.
#include <cstdint>
#include <memory>
#include <optional>

#include "haptics/builder/triangle_mesh.hpp"

namespace touchstone {

struct SphereTree;
struct Surface;

/// Coulomb friction of a pair of parts: a contact that sticks holds a tangential force up to atRest F_n, one that
/// slides resists with sliding F_n. Both 0: no friction.
struct Friction {
    double atRest = 0, sliding = 0;
    bool any() const { return atRest > 0 || sliding > 0; }
    friend bool operator==(const Friction&, const Friction&) = default;
};

/// How the coefficients of two materials make those of the pair. The earlier one of two rules counts.
enum class FrictionRule : std::uint8_t { Average, Minimum, Maximum, Multiply };

/// What a part contributes to the friction of its pairs.
struct Material {
    Friction friction;
    FrictionRule rule = FrictionRule::Average;
    friend bool operator==(const Material&, const Material&) = default;
};

/// Friction between parts of these materials; none unless both parts have one.
Friction frictionBetween(const std::optional<Material>& a, const std::optional<Material>& b);

struct PartOptions {
    /// Maximum leaf count of the part's sphere tree; 0: no tree. A part needs one if its mesh is not closed, or for
    /// Geometry::Spheres and the modes that touch spheres. It takes seconds to build.
    int spheres = 0;
};

/// A rigid part. It has a surface or a tree of spheres or both, in its own frame, mm. Immutable parts of it are shared
/// by its copies, so a copy is cheap.
struct Part {
    std::shared_ptr<const Surface> surface = {};     ///< null: its mesh is not closed, or unknown; spheres touch
    std::shared_ptr<const SphereTree> spheres = {};  ///< null: it is touched by its mesh alone
    bool prefersSpheres = false;                     ///< it is touched by its spheres in either geometry
    std::optional<Material> material = {};           ///< nothing: it is frictionless

    /// Makes a part from triangles, mm in its own frame, counter-clockwise seen from outside: repairs the mesh and
    /// finds the features by which it can touch. Throws std::invalid_argument with one sentence if an index is out of
    /// range, a coordinate is not finite, no triangle has an area, or the mesh is not closed and no spheres are asked
    /// for. Deterministic. Takes about a second for 100,000 triangles.
    static Part fromTriangles(const TriangleMesh& mesh, const PartOptions& options = {});

    /// The point about which its travel is measured, in its own frame, and the greatest distance from there, mm.
    Vec3 center() const;
    double reach() const;
};

}  // namespace touchstone
