#pragma once
// The overlays over the scene, with their names on the command line and their keys.
#include <span>
#include <string>
#include <string_view>

namespace touchstone::sandbox {

/// What is drawn in addition to the visible meshes.
struct DisplayOptions {
    bool contacts = true;    ///< points and normals of pairs in contact, colored by multiplier
    bool arrows = true;      ///< force and torque on the hand at C
    bool ghost = true;       ///< the device pose where it differs from the tool pose, and a line to it
    bool clearance = false;  ///< the nearest points of tool and obstacles
    bool goal = true;        ///< target pose of the tool, and the region that counts as reached
    bool trace = false;      ///< path of C
    bool values = true;      ///< values at arrows, clearance and gauge
    bool section = false;    ///< cut the scene open at the contacts, or at C without contacts
    bool byGap = false;      ///< color by gap: parts that touch by their meshes, and spheres instead of by level
    bool grid = true;
    int toolLevel = -1;          ///< sphere-tree level drawn for the tool: 0 leaves, -1 none
    int obstacleLevel = -1;      ///< likewise for the obstacles
    int sectionAxis = -1;        ///< axis of the section normal: 0 to 2 for x, y, z; -1 faces the viewer
    double sectionOffset = 0;    ///< mm, toward the viewer
    double contactMargin = 0.2;  ///< mm: pairs with at most this gap are shown as contacts

    bool trees() const { return toolLevel >= 0 || obstacleLevel >= 0; }
    void showTrees(int level) { toolLevel = obstacleLevel = level; }
};

/// One switch of DisplayOptions, for menus, keys, help and the command line.
struct DisplaySwitch {
    std::string_view name;  ///< on the command line
    char key;               ///< capital letter
    const char* title;
    bool DisplayOptions::*option;  ///< null: the sphere trees
    const char* help;              ///< one sentence
};
std::span<const DisplaySwitch> displaySwitches();

bool isOn(const DisplayOptions& options, const DisplaySwitch& which);
void turn(DisplayOptions& options, const DisplaySwitch& which, bool on);  ///< sphere trees turn on at the leaves

/// Applies a comma-separated list of names: `contacts,no-grid,trees:2,section:x`. Returns an empty string, or one
/// sentence that names the first invalid item.
std::string applyShowList(DisplayOptions& options, std::string_view list);

}  // namespace touchstone::sandbox
