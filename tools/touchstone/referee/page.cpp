#include "tools/touchstone/referee/page.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <utility>

#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/referee/rigid_engine.hpp"

namespace touchstone::app {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

constexpr std::array<std::pair<const char*, const char*>, 12> kColumns{
    {{"system", "system"},
     {"intersecting_percent", "ticks that intersect, %"},
     {"depth_mm", "depth, mm"},
     {"seated", "seated"},
     {"tunneled", "tunneled"},
     {"force_error_p50_N", "force error p50, N"},
     {"force_error_p99_N", "p99, N"},
     {"rest_noise_N", "noise at rest, N"},
     {"energy_created_mJ", "energy created, mJ"},
     {"tick_p50_us", "tick p50, µs"},
     {"tick_p999_us", "p99.9, µs"},
     {"prepare_ms", "preparation, ms"}}};

/// In how many motions the least value of a column is an engine's, in words. A system that was stopped does not count.
std::string winsOfEngines(const std::vector<ordered_json>& rows, const std::vector<std::string>& motions,
                          const char* column, const char* what) {
    std::map<std::string, int> wins;
    int all = 0;
    for (const std::string& motion : motions) {
        const ordered_json* best = nullptr;
        for (const ordered_json& row : rows)
            if (row["motion"] == motion && row["note"] == "" && row[column].is_number() &&
                (!best || row[column] < (*best)[column]))
                best = &row;
        if (!best || (*best)["system"].get<std::string>().starts_with("Touchstone")) continue;
        ++wins[(*best)["system"]];
        ++all;
    }
    std::string text = std::string("- ") + what + ": an engine's in " + std::to_string(all) + " of " +
                       std::to_string(motions.size()) + " motions";
    const char* between = " (";
    for (const auto& [system, count] : wins)
        text += std::exchange(between, ", ") + system + " " + std::to_string(count);
    return text + (all > 0 ? ")" : "") + ".\n";
}

/// Whether a system is another solver of one that the page shows.
bool isVariant(const std::string& system) { return system.find(" with ") != std::string::npos; }

std::string passivitySection(const std::vector<ordered_json>& rows) {
    std::string text =
        "\n## Stiffness against rate\n\n"
        "A simulated hand (0.1 kg, 0.5 N/mm, 14 N·s/m) presses the ball of the scene plate 4 mm into the plate and "
        "rests. It moves continuously, and the force holds from tick to tick. The device has no damping, resolution "
        "or noise, and the safety stage takes no part.\n\n"
        "- *Passive up to*: with this stiffness of the coupling or less, the hand never gets back more energy than it "
        "gave, and it comes to rest.\n"
        "- *At rest up to*: it does not vibrate at the end; 100 N/mm is the most that was tried. Beside it stands 2 b "
        "/ T "
        "with the hand's damping b (Colgate and Schenkel 1997).\n\n"
        "Choi and Tan (2004) measured on a device where people began to perceive instability: 0.325 N/mm at 250 Hz to "
        "0.904 N/mm at 40 kHz. A device differs from this simulation, so the figures cannot be compared directly.\n\n"
        "| rate, Hz | passive up to, N/mm | at rest up to, N/mm | 2 b / T, N/mm |\n|---|---|---|---|\n";
    for (const ordered_json& row : rows)
        text += "| " + std::to_string(row["rate_Hz"].get<int>()) + " | " + tableCell(row["passive_N_per_mm"]) + " | " +
                tableCell(row["rests_N_per_mm"]) + " | " + tableCell(row["bound_N_per_mm"]) + " |\n";
    return text;
}

}  // namespace

std::string tableCell(const ordered_json& value) {
    if (value.is_null()) return "–";
    if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
    if (value.is_number()) {
        char text[32];
        std::snprintf(text, sizeof text, "%.3g", value.get<double>());
        return text;
    }
    return value.get<std::string>();
}

std::string pictureName(const std::string& motion, const std::string& system) {
    std::string name = motion + "-" + system + ".png";
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

void writeRefereePage(const RefereePage& of) {
    const fs::path folder = of.out.filename().empty() ? of.out.parent_path() : of.out;
    const ordered_json build = sandbox::buildInfo();
    std::string page = "# The referee: other engines on the same motions\n\n";
    page +=
        "Written by `touchstone referee " + of.arguments + " --out " + folder.generic_string() + "`; [referee.csv](" +
        folder.filename().string() +
        "/referee.csv) has all figures.\n\n"
        "- *Motion*: one tick is 1 ms, in one step or in four. The device rests for the last 0.3 s. A system that "
        "needs "
        "more than " +
        shortNumber(of.limit) +
        " s for a motion is stopped, and has no picture if that was before its moment.\n"
        "- *Tool*: of an engine, a body of 50 g that a spring and a damper pull to the device, with the scene's "
        "stiffness and torsion, critical damping, and an inertia with which turning is as fast as moving.\n"
        "- *Depth* and ticks that intersect: one judge tests the meshes themselves after every tick (depth: after "
        "every "
        "third tick, of vertices and edges).\n"
        "- *Force*: that of the springs for all. The reference is Touchstone between meshes with eight ticks for each, "
        "so Touchstone's own error only says what the length of a tick changes.\n"
        "- *Tunneled*: at the end, the straight line of C from the reference's place to the system's crosses a part.\n"
        "- *Energy created*: the most that the hand had got back beyond what it gave.\n"
        "- *Tick*: thread CPU time, of engines with their collision. *Preparation*: the shapes of an engine; surfaces "
        "and "
        "trees, which Touchstone makes when it opens a scene, are not counted.\n\n"
        "The tables show each way to touch and each engine; referee.csv also has Touchstone's other solvers. "
        "Processor: " +
        build["machine"]["processor"].get<std::string>() + ".\n\n| engine | version | choices |\n|---|---|---|\n";
    for (const EngineInfo& info : engineTable())
        page += std::string("| ") + info.name + " | " + info.version + " | " + info.choices + " |\n";
    for (const char* name : {"Bullet", "ODE", "MuJoCo"})
        if (std::none_of(engineTable().begin(), engineTable().end(),
                         [&](const EngineInfo& info) { return std::string_view(info.name) == name; }))
            page += std::string("| ") + name + " | – | not installed when the program was built |\n";
    page +=
        "\n## What the engines do better\n\n"
        "- They move many bodies, with gravity, joints and motors; Touchstone moves one tool among fixed parts.\n"
        "- Their tool has mass, so it can be thrown and can bounce; Touchstone's has none.\n" +
        winsOfEngines(of.rows, of.motions, "tick_p50_us", "Shortest median tick") +
        winsOfEngines(of.rows, of.motions, "tick_p999_us", "Shortest tick at p99.9") +
        winsOfEngines(of.rows, of.motions, "prepare_ms", "Shortest preparation") +
        "\nMuJoCo's times are those of convex hulls, while the judge looks at the meshes.\n";
    for (const Figure& figure : of.figures)
        page += "\n![" + figure.caption + "](" + folder.filename().string() + "/" + figure.name + ".svg)\n";
    for (const std::string& motion : of.motions) {
        page += "\n## " + motion + "\n\n|";
        for (const auto& [key, title] : kColumns) page += std::string(" ") + title + " |";
        page += "\n|";
        for (std::size_t k = 0; k < kColumns.size(); ++k) page += "---|";
        page += "\n";
        std::string notes, pictures;
        for (const ordered_json& row : of.rows) {
            if (row["motion"] != motion || isVariant(row["system"])) continue;
            page += "|";
            for (const auto& [key, title] : kColumns) page += " " + tableCell(row[key]) + " |";
            page += "\n";
            const std::string system = row["system"], note = row["note"];
            if (!note.empty()) notes += "- " + system + ": " + note + "\n";
            const std::string picture = pictureName(motion, system);
            if (fs::exists(of.out / picture))
                pictures +=
                    "| ![" + system + "](" + folder.filename().string() + "/" + picture + ")<br>" + system + " ";
        }
        if (!notes.empty()) page += "\n" + notes;
        if (!pictures.empty()) {
            const auto columns = std::count(pictures.begin(), pictures.end(), '|');
            std::string head;
            for (std::ptrdiff_t k = 0; k < columns; ++k) head += "| ";
            std::string rule;
            for (std::ptrdiff_t k = 0; k < columns; ++k) rule += "|---";
            page += "\n" + head + "|\n" + rule + "|\n" + pictures + "|\n";
        }
    }
    if (!of.passivity.empty()) page += passivitySection(of.passivity);
    writeFile(fs::path(folder).concat(".md"), "the page", page);
}

}  // namespace touchstone::app
