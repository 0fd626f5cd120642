#pragma once
// The world of the tick: one tool and its obstacles. Immutable once published.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "haptics/collision/sphere_tree.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/surface/surface.hpp"

namespace touchstone {

inline constexpr std::size_t kMaxObstacles = 255;  // a contact's identity keeps eight bits for the obstacle

/// Coulomb friction of a pair of parts: a contact that sticks holds a tangential force up to atRest F_n, one that
/// slides resists with sliding F_n. Both 0: no friction.
struct Friction {
    double atRest = 0, sliding = 0;
    bool any() const { return atRest > 0 || sliding > 0; }
    friend bool operator==(const Friction&, const Friction&) = default;
};

struct Obstacle {
    std::string name;
    std::shared_ptr<const SphereTree> tree;            ///< null: it is touched by its mesh alone
    Pose X_WO;                                         ///< obstacle's node in the scene frame, at the first tick
    std::shared_ptr<const Surface> surface = nullptr;  ///< null: it is touched by its spheres alone
    bool asksForSpheres = false;                       ///< it is touched by its spheres in either geometry
    Friction friction = {};                            ///< between it and the tool, by their materials

    /// The point about which its travel is measured, in its own frame, and the greatest distance from there, mm.
    Vec3 center() const { return surface ? surface->extent.center : tree->center(); }
    double reach() const { return surface ? surface->extent.reach : tree->reach(); }

    /// Friction between it and the tool with these settings.
    Friction frictionIn(const Settings& settings) const {
        if (!settings.friction) return {};
        const double every = settings.frictionCoefficient;
        const Friction pair = every > 0 ? Friction{every, every} : friction;
        return {settings.frictionScale * pair.atRest, settings.frictionScale * pair.sliding};
    }
};

/// Tree and surface of the tool are given in the tool node's frame, whose origin is o. Increments and torques of the
/// tick refer to C, the center of the mesh, whichever geometry the tick uses, so that results can be compared. A part
/// has a tree or a surface or both.
struct World {
    std::shared_ptr<const SphereTree> tool;
    std::vector<Obstacle> obstacles;
    Pose X_WT_start;                                       ///< tool node at the first tick
    std::shared_ptr<const Surface> toolSurface = nullptr;  ///< null: as for an obstacle
    bool toolAsksForSpheres = false;                       ///< likewise

    /// Whether tool and obstacle can touch by their meshes.
    bool hasMeshes(std::size_t obstacle) const { return toolSurface && obstacles[obstacle].surface; }
    /// Whether they can touch by their spheres.
    bool hasSpheres(std::size_t obstacle) const { return tool && obstacles[obstacle].tree; }
    bool hasSpheres() const;  ///< likewise of all obstacles

    /// Whether they touch by their meshes in this geometry of the tick.
    bool byMeshes(std::size_t obstacle, Geometry geometry) const {
        const bool spheres = geometry == Geometry::Spheres || toolAsksForSpheres || obstacles[obstacle].asksForSpheres;
        return hasMeshes(obstacle) && !(spheres && hasSpheres(obstacle));
    }

    Vec3 p_TC() const { return toolSurface ? toolSurface->extent.center : tool->center(); }
    double reach() const { return toolSurface ? toolSurface->extent.reach : tool->reach(); }  ///< ρ, mm
};

inline bool World::hasSpheres() const {
    for (std::size_t k = 0; k < obstacles.size(); ++k)
        if (!hasSpheres(k)) return false;
    return true;
}

}  // namespace touchstone
