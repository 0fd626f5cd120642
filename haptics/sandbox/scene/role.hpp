#pragma once
// Components that the haptic marking of a scene adds to its nodes.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "engine/scene/physics_materials.hpp"
#include "engine/scene/scene.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/math/rigid.hpp"

namespace touchstone::sandbox {

/// Component of nodes with a role. Everything below such a node belongs to it, except nodes that have a role themselves
/// and what is below those.
enum class Role : std::uint8_t {
    Tool,      ///< moves with the hand; exactly one
    Obstacle,  ///< fixed
    Goal,      ///< where the tool should come to rest
    Visual,    ///< drawn only
    Gauge,     ///< reads how deep the tool reaches
};
inline constexpr std::array kRoleNames{"tool", "obstacle", "goal", "visual", "gauge"};
inline const char* name(Role role) { return kRoleNames[static_cast<std::size_t>(role)]; }

/// What a scene may request of a sphere tree: the least number of leaves, and the range of its protrusion in mm.
inline constexpr int kMinLeaves = 8;
inline constexpr double kMinError = 1e-6, kMaxError = 1e3;

/// The material of a part that has friction, and where it comes from.
struct PartFriction {
    engine::FrictionMaterial values;
    int material = -1;  ///< physics material of the file; -1: the extras of the node
};

/// What a part's triangles took from the exact surfaces of a CAD file, mm.
struct CadFit {
    double deviation = 0;             ///< the greatest distance of triangles from surfaces
    std::optional<double> clearance;  ///< of the tool: the least between the surfaces of tool and obstacles
};

/// Where the file of a part has its coordinates.
struct FileFrame {
    double unit = 1;  ///< m, of its coordinates
    Pose X_WF;        ///< its frame in the scene, for parts that stay where they are modeled, mm
    Pose X_TF;        ///< its frame in the part's node, mm
};

/// The motion that takes a part from its place in its file to where it is in the scene, in the unit and on the axes of
/// the file; rows of a 4 x 4 matrix.
std::array<std::array<double, 4>, 4> matrixInFile(const FileFrame& file, const Pose& X_WT);

/// Component of the tool and of obstacles.
struct BodyMarking {
    TreeOptions tree;
    bool spheres = false;                                ///< touched by its spheres in either geometry
    std::optional<double> stiffness = {}, torsion = {};  ///< of the tool: N/mm, mN·m/rad
    std::optional<PartFriction> friction = {};           ///< nothing: the part is frictionless
    std::optional<CadFit> cad = {};                      ///< nothing: the part is not from a CAD file
    std::optional<FileFrame> file = {};                  ///< of the tool; nothing: its file is the scene
};

/// The node itself or its nearest ancestor that has a role; null if there is none.
engine::Entity roleOwner(const engine::Registry& registry, engine::Entity node);

}  // namespace touchstone::sandbox
