#include "haptics/sandbox/picture/display_options.hpp"

#include <algorithm>
#include <array>
#include <charconv>

namespace touchstone::sandbox {
namespace {

constexpr std::array<DisplaySwitch, 11> kSwitches{{
    {"contacts", 'C', "Contacts", &DisplayOptions::contacts,
     "Pairs in contact with their normals, colored from yellow to red by the force they carry, or blue without force. "
     "With friction also the cone of possible forces and the force: green if the contact sticks, magenta if it "
     "slides."},
    {"forces", 'V', "Force", &DisplayOptions::arrows,
     "Force (red) and torque (violet) on the hand, drawn at C. Arrow lengths are compressed."},
    {"ghost", 'G', "Ghost", &DisplayOptions::ghost, "The device pose as a ghost of the tool, with a line to it."},
    {"clearance", 'N', "Clearance", &DisplayOptions::clearance,
     "The nearest points of tool and obstacles and their gap in mm."},
    {"goal", 'O', "Goal", &DisplayOptions::goal, "Target pose of the tool, and the region that counts as reached."},
    {"trace", 'T', "Trace", &DisplayOptions::trace, "Path of the tool's center C."},
    {"values", 'U', "Values", &DisplayOptions::values,
     "Values at the arrows (N, mN·m), the clearance (mm) and the gauge depth (mm)."},
    {"section", 'X', "Section", &DisplayOptions::section,
     "Cuts the scene open at the contacts, or at C without contacts. Cut solids are hatched."},
    {"trees", 'L', "Spheres", nullptr, "Spheres of both sphere trees. The sliders below choose the level."},
    {"gaps", 'K', "By gap", &DisplayOptions::byGap,
     "Colors by gap, from red at 0 mm to gray at 1 mm: parts that touch by their meshes, and the spheres shown."},
    {"grid", 'B', "Grid", &DisplayOptions::grid, "Floor grid, spaced in powers of ten."},
}};

std::string applyOne(DisplayOptions& options, std::string_view item) {
    const auto quoted = [&] { return "'" + std::string(item) + "'"; };
    const bool off = item.starts_with("no-");
    const std::string_view word = off ? item.substr(3) : item;
    const std::size_t colon = word.find(':');
    const std::string_view name = word.substr(0, colon);
    const auto found = std::find_if(kSwitches.begin(), kSwitches.end(), [&](auto& s) { return s.name == name; });
    if (found == kSwitches.end()) {
        std::string names;
        for (const DisplaySwitch& s : kSwitches) names += (names.empty() ? "" : ", ") + std::string(s.name);
        return quoted() + " is an unknown overlay; choose from " + names + ", each with an optional prefix no-";
    }
    turn(options, *found, !off);
    if (colon == std::string_view::npos) return {};
    const std::string_view value = word.substr(colon + 1);
    if (name == "trees") {
        int level = -1;
        const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), level);
        if (error != std::errc() || end != value.data() + value.size() || level < 0)
            return quoted() + " needs a tree level after the colon, 0 for the leaves";
        options.showTrees(level);
        return {};
    }
    constexpr std::string_view kAxes = "xyz";
    if (name != "section" || value.size() != 1 || kAxes.find(value) == std::string_view::npos)
        return quoted() + " takes no such value after the colon; write section:x, section:y, section:z or trees:LEVEL";
    options.sectionAxis = static_cast<int>(kAxes.find(value));
    return {};
}

}  // namespace

std::span<const DisplaySwitch> displaySwitches() { return kSwitches; }

bool isOn(const DisplayOptions& options, const DisplaySwitch& which) {
    return which.option ? options.*which.option : options.trees();
}

void turn(DisplayOptions& options, const DisplaySwitch& which, bool on) {
    if (which.option)
        options.*which.option = on;
    else
        options.showTrees(on ? 0 : -1);
}

std::string applyShowList(DisplayOptions& options, std::string_view list) {
    while (!list.empty()) {
        const std::size_t comma = list.find(',');
        if (const std::string wrong = applyOne(options, list.substr(0, comma)); !wrong.empty()) return wrong;
        list = comma == std::string_view::npos ? std::string_view() : list.substr(comma + 1);
    }
    return {};
}

}  // namespace touchstone::sandbox
