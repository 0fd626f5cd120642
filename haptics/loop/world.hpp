#pragma once
// The world of the tick: one tool and its obstacles. Immutable once published.
#include <cstddef>
#include <string>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "haptics/surface/part.hpp"

namespace touchstone {

inline constexpr std::size_t kMaxObstacles = 255;  // a contact's identity keeps eight bits for the obstacle

struct Obstacle {
    std::string name;
    Part part;
    Pose X_WO = {};  ///< obstacle's node in the scene frame, at the first tick
};

/// Surface and spheres of the tool are given in the tool node's frame, whose origin is o. Increments and torques of the
/// tick refer to C, the center of the mesh, whichever geometry the tick uses, so that results can be compared.
struct World {
    Part tool;
    std::vector<Obstacle> obstacles;
    Pose X_WT_start = {};  ///< tool node at the first tick

    /// Whether tool and obstacle can touch by their meshes.
    bool hasMeshes(std::size_t obstacle) const { return tool.surface && obstacles[obstacle].part.surface; }
    /// Whether they can touch by their spheres.
    bool hasSpheres(std::size_t obstacle) const { return tool.spheres && obstacles[obstacle].part.spheres; }
    bool hasSpheres() const;  ///< likewise of all obstacles

    /// Whether they touch by their meshes in this geometry of the tick.
    bool byMeshes(std::size_t obstacle, Geometry geometry) const {
        const bool spheres =
            geometry == Geometry::Spheres || tool.prefersSpheres || obstacles[obstacle].part.prefersSpheres;
        return hasMeshes(obstacle) && !(spheres && hasSpheres(obstacle));
    }

    /// Friction between tool and obstacle, by their materials and with these settings.
    Friction friction(std::size_t obstacle) const {
        return frictionBetween(tool.material, obstacles[obstacle].part.material);
    }
    Friction friction(std::size_t obstacle, const Settings& settings) const;

    Vec3 p_TC() const { return tool.center(); }
    double reach() const { return tool.reach(); }  ///< ρ, mm
};

}  // namespace touchstone
