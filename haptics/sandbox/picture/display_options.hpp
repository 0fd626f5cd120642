#pragma once
// What is drawn besides the scene itself, and the names and keys by which it is asked for.
#include <span>
#include <string>
#include <string_view>

namespace touchstone::sandbox {

/// What is drawn besides the meshes whose Visibility is on.
struct DisplayOptions {
    bool contacts = true;    ///< points and normals of the pairs that touch, coloured by multiplier
    bool arrows = true;      ///< force and torque on the hand at C
    bool ghost = true;       ///< the device's pose, where it is apart from the tool, and the line to it
    bool clearance = false;  ///< the nearest pair
    bool goal = true;        ///< where the tool is to come to rest, and the region that counts
    bool trace = false;      ///< the way C has come
    bool values = true;      ///< numbers beside arrows and clearance
    bool section = false;    ///< cut the scene open where it touches, else at C
    bool byGap = false;      ///< spheres show their gap instead of their level
    bool grid = true;
    int toolLevel = -1;          ///< sphere-tree level drawn over the tool: 0 leaves, -1 none
    int obstacleLevel = -1;      ///< likewise over the obstacles
    int sectionAxis = -1;        ///< normal of the section: 0 to 2 for x, y, z; -1 upright, facing the viewer
    double sectionOffset = 0;    ///< mm, towards the viewer
    double contactMargin = 0.2;  ///< mm: pairs this near are shown as contacts

    bool trees() const { return toolLevel >= 0 || obstacleLevel >= 0; }
    void showTrees(int level) { toolLevel = obstacleLevel = level; }
};

/// A switch of DisplayOptions, for menus, keys, help and the command line.
struct DisplaySwitch {
    std::string_view name;  ///< on the command line
    char key;               ///< capital letter
    const char* title;
    bool DisplayOptions::*option;  ///< null: the sphere trees
    const char* help;              ///< one sentence
};
std::span<const DisplaySwitch> displaySwitches();

bool isOn(const DisplayOptions& options, const DisplaySwitch& which);
void turn(DisplayOptions& options, const DisplaySwitch& which, bool on);  ///< trees: down to the leaves

/// Changes options by a list of names with commas between: `contacts,no-grid,trees:2,section:x`. Returns one sentence
/// naming what is wrong with it, or nothing.
std::string applyShowList(DisplayOptions& options, std::string_view list);

}  // namespace touchstone::sandbox
