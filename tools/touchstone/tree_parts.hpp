#pragma once
// The parts that get sphere trees: of a mesh file the whole, of a scene what has a role.
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "tools/touchstone/commands.hpp"

namespace touchstone::app {

struct TreePart {
    std::string name;
    std::string role;      ///< "tool" or "obstacle"; empty without one
    TriangleMesh mesh;     ///< mm; of a scene's node in the node's frame
    TreeOptions options;   ///< as the scene has them
    double mmPerUnit = 1;  ///< of the lengths in the file

    double diagonal() const;  ///< of the bounding box, mm
};

/// mm, cm, m or in. Throws UsageError for other units.
double metresPer(const std::string& unit);

/// All parts that the choice means: tool and obstacles of a scene, the whole scene if it has neither, or the node that
/// is named with what hangs below it. Throws UsageError where the choice does not fit the file, else
/// engine::SceneError or std::runtime_error with one sentence.
std::vector<TreePart> readParts(const PartChoice& choice);

/// The node of that name: one with a role before others, since helpers often repeat it. Throws std::runtime_error with
/// the names that there are, or where several have it.
engine::Entity nodeNamed(const engine::Scene& scene, const std::string& name);

/// The only part that is meant. `why` completes the UsageError where there are several: "-o writes one tree".
TreePart onlyPart(std::vector<TreePart> parts, const std::string& file, const std::string& why);

}  // namespace touchstone::app
