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

struct Obstacle {
    std::string name;
    std::shared_ptr<const SphereTree> tree;
    Pose X_WO;                                         ///< obstacle's node in the scene frame, at the first tick
    std::shared_ptr<const Surface> surface = nullptr;  ///< null: it is touched by its spheres alone
};

/// The tool's tree is given in the tool node's frame, whose origin is o. Increments and torques of the tick refer to C,
/// the tree's center.
struct World {
    std::shared_ptr<const SphereTree> tool;
    std::vector<Obstacle> obstacles;
    Pose X_WT_start;                                       ///< tool node at the first tick
    std::shared_ptr<const Surface> toolSurface = nullptr;  ///< null: as for an obstacle

    /// Whether tool and obstacle can touch by their meshes.
    bool hasMeshes(std::size_t obstacle) const { return toolSurface && obstacles[obstacle].surface; }

    /// Whether tool and obstacle touch by their meshes in this geometry of the tick.
    bool byMeshes(std::size_t obstacle, Geometry geometry) const {
        return geometry == Geometry::Mesh && hasMeshes(obstacle);
    }

    Vec3 p_TC() const { return tool->center(); }
    double reach() const { return tool->reach(); }  ///< ρ, mm
};

}  // namespace touchstone
