#pragma once
// A scene made of parts: where the tool starts, its goal, and the motion that leads there.
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"
#include "engine/scene/transforms.hpp"
#include "haptics/builder/mesh_words.hpp"
#include "haptics/sandbox/scene/role.hpp"
#include "tools/touchstone/tree_choice.hpp"

namespace touchstone::app {

/// How coordinates of parts in STL, OBJ and PLY files are read. Those of glTF files are meters with +y up.
struct PartFrame {
    const char* unit = "mm";             ///< of the coordinates
    double meters = 0.001;               ///< of that unit
    bool zUp = false;                    ///< +z is up; else +y
    double crease = 0.5235987755982988;  ///< edges that turn by more are drawn sharp, rad
};

/// Turns +z up to +y up.
inline const glm::dquat kZUp = glm::angleAxis(glm::radians(-90.0), glm::dvec3(1, 0, 0));

/// A part as read: its nodes, and the box around what is visible, in meters with +y up.
struct Part {
    std::string name;
    engine::Scene content;
    glm::dvec3 low{0}, high{0};
    glm::dvec3 origin{0};             ///< of its node: not 0 if its file has it far from the origin
    bool open = false;                ///< it bounds no volume, so that its fit cannot be measured
    std::optional<double> deviation;  ///< of its triangles from CAD surfaces, m
    std::size_t triangles = 0;
    double unit = 1;                 ///< m, of the coordinates of its file
    engine::RigidPart inScene;       ///< the frame of its file
    engine::RigidPart modeled;       ///< the same, with the part put to its pose
    std::vector<std::string> notes;  ///< what was ignored in the file
};

/// Reads an STL, OBJ, PLY, glTF or GLB file. `material` is that of a file without materials; `pose` turns the part
/// about the origin of its file, and then moves it, both in the axes of the file, meters. Throws engine::SceneError
/// with one sentence.
Part readPart(const std::filesystem::path& file, const PartFrame& frame, const engine::Material& material,
              const engine::RigidPart& pose = {});

/// Sets the box of the part, without stray triangles that enclose nothing. Adds a note on what was left out, closed, or
/// stays open, with its place in the coordinates of the file: in `unit`, with +z up if `zUp`, before the part was moved
/// to `pose`.
void findBox(Part& part, const std::string& file, bool zUp, const PlaceUnit& unit, const engine::RigidPart& pose);

/// Where the tool should end, relative to the scene's parts.
struct NewGoal {
    std::optional<double> depth;      ///< m below the highest point of the obstacles along the axis; by default as
                                      ///< deep as the tool is modeled
    std::optional<double> tolerance;  ///< m; by default a hundredth of the tool, at most 1 mm
    double lead = 0;                  ///< m along the axis per turn, positive for a right-handed thread; 0: no thread
    double turn = 0;                  ///< rad about the axis, from the tool as it is modeled
    double play = 0;                  ///< rad about the axis that the tool may turn there, on either side
    int fold = 1;                     ///< number of equivalent orientations about the axis; 0: all
};

struct NewScene {
    std::string name;
    Part tool;
    std::vector<Part> obstacles;
    TreeChoice tree;                   ///< of all parts
    double clearance = 0;              ///< between the CAD surfaces of tool and obstacles, m; 0: unknown
    glm::dvec3 axis{0, 1, 0};          ///< the way out: a unit vector
    std::optional<glm::dvec3> onAxis;  ///< a point on the axis of the tool at its goal; by default it is measured
    bool assembled = false;            ///< the parts are modeled where the tool ends; needs a goal
    std::optional<NewGoal> goal;
    bool demonstration = false;  ///< the tool comes in from outside along the axis, on a thread turning; needs a goal
};

/// First one motion, then the other.
engine::RigidPart chained(const engine::RigidPart& first, const engine::RigidPart& then);

/// Moves all parts by the same whole millimeters to the origin if they lie more than 10 m from it, where drawing loses
/// digits, and later contacts. Returns by how much, m.
glm::dvec3 moveToOrigin(NewScene& parts);

/// Adds to `warnings` what is allowed but rarely intended.
///
/// Parts keep their coordinates, apart from the tool, which starts outside along the axis by a tenth of its size. With
/// a goal, the origin of the tool's node is put on the axis of the portion that goes in. Throws UsageError if there is
/// no goal where one is needed, or if tool and obstacles do not overlap along the axis at the goal.
engine::Scene makeScene(const NewScene& parts, std::vector<std::string>& warnings);

}  // namespace touchstone::app
