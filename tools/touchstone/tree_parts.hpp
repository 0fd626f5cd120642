#pragma once
// The parts that get sphere trees: a whole mesh file, or the nodes of a scene that have a role.
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

/// The triangles that the command line names.
struct PartChoice {
    std::string file;                 ///< .obj, .ply, .stl, .glb or .gltf, or the name of a scene
    std::optional<std::string> unit;  ///< of .obj, .ply and .stl: mm, cm, m or in
    std::string part;                 ///< name of a node; empty: all parts
};

/// Adds --unit and --part.
void addPartChoice(CLI::App& command, PartChoice& choice);

struct TreePart {
    std::string name;
    std::string role;      ///< "tool" or "obstacle"; empty without one
    TriangleMesh mesh;     ///< mm; of a scene's node, in the node's frame
    TreeOptions options;   ///< those of the scene
    double mmPerUnit = 1;  ///< of the lengths in the file

    double diagonal() const;  ///< of the bounding box, mm
};

/// mm, cm, m or in. Throws UsageError for other units.
double metersPer(const std::string& unit);

/// All parts of the choice: tool and obstacles of a scene, the whole scene if it has neither, or the named node with
/// its descendants. Throws UsageError where the choice does not fit the file, otherwise engine::SceneError or
/// std::runtime_error with one sentence.
std::vector<TreePart> readParts(const PartChoice& choice);

/// The node of that name; a node with a role is preferred, since helper nodes often repeat its name. Throws
/// std::runtime_error that lists the names if there is no such node, or if several have the name.
engine::Entity nodeNamed(const engine::Scene& scene, const std::string& name);

/// The only part of the list. `why` begins the UsageError if there are several: "-o writes one tree".
TreePart onlyPart(std::vector<TreePart> parts, const std::string& file, const std::string& why);

}  // namespace touchstone::app
