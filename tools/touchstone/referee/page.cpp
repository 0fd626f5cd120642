#include "tools/touchstone/referee/page.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>

#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/referee/rigid_engine.hpp"

namespace touchstone::app {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

/// A column shows the value of a key, or of two.
struct Column {
    const char *title, *key, *second = nullptr;
};
constexpr Column kColumns[] = {{"system", "system"},
                               {"intersects, %", "intersecting_percent"},
                               {"depth, mm", "depth_mm"},
                               {"end", "end"},
                               {"force N: p50 / p99", "force_error_p50_N", "force_error_p99_N"},
                               {"noise, N", "rest_noise_N"},
                               {"energy, mJ", "energy_created_mJ"},
                               {"tick µs: p50 / p99.9", "tick_p50_us", "tick_p999_us"}};

constexpr std::string_view kStopped = "stopped after ", kFriction = "-friction";

/// What became of the tool.
std::string endOf(const ordered_json& row) {
    if (row["note"].get<std::string>().starts_with(kStopped))
        return std::string(kStopped) + std::to_string(row["ticks"].get<int>());
    if (row["tunneled"].is_boolean() && row["tunneled"].get<bool>()) return "tunneled";
    if (!row["seated"].is_boolean()) return tableCell(nullptr);
    return row["seated"].get<bool>() ? "seated" : "not seated";
}

std::string lineOf(const ordered_json& row) {
    std::string line = "|";
    for (const Column& column : kColumns) {
        line += " " + (column.key == std::string_view("end") ? endOf(row) : tableCell(row[column.key]));
        line += (column.second ? " / " + tableCell(row[column.second]) : "") + " |";
    }
    return line + "\n";
}

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
        "rests. The force holds from tick to tick. The device has no damping, resolution or noise.\n\n"
        "- *Passive up to*: with this stiffness of the coupling or less, the hand never gets back more energy than it "
        "gave, and it comes to rest.\n"
        "- *At rest up to*: it does not vibrate at the end; 100 N/mm is the most that was tried. Beside it stands 2 b "
        "/ T with the hand's damping b (Colgate and Schenkel 1997).\n\n"
        "On a device, people began to perceive instability from 0.325 N/mm at 250 Hz to 0.904 N/mm at 40 kHz (Choi "
        "and Tan 2004); a device differs from this simulation.\n\n"
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
        "- *Motion*: one tick is 1 ms, in one step or in four substeps. The device rests for the last 0.3 s.\n"
        "- *Tool* of an engine: a body of 50 g on a spring and a damper to the device, with the scene's stiffness and "
        "torsion, critical damping, and an inertia with which turning is as fast as moving.\n"
        "- *Intersects*, *depth*: one judge tests the meshes after every tick (depth: every third, vertices and "
        "edges).\n"
        "- *End*: seated, if the scene has a goal; *tunneled*: the line of C from the reference's place to the "
        "system's crosses a part; *stopped after* N ticks: the motion needed more than " +
        shortNumber(of.limit) +
        " s.\n"
        "- *Force*: its error. The reference is Touchstone between meshes with eight ticks for each, so Touchstone's "
        "own error shows only the effect of the tick's length.\n"
        "- *Noise* at rest; *energy* that the hand got back beyond what it gave, at most.\n"
        "- *Tick*: thread CPU time, of engines with their collision. *Preparation*, in referee.csv: an engine's "
        "shapes, without the surfaces and trees that Touchstone makes when it opens a scene.\n\n"
        "referee.csv also has Touchstone's other solvers. "
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
        "- Their tool has mass, so it can be thrown and can bounce.\n" +
        winsOfEngines(of.rows, of.motions, "tick_p50_us", "Shortest median tick") +
        winsOfEngines(of.rows, of.motions, "tick_p999_us", "Shortest tick at p99.9") +
        winsOfEngines(of.rows, of.motions, "prepare_ms", "Shortest preparation") +
        "\nMuJoCo's times are those of convex hulls, while the judge looks at the meshes.\n";
    for (const Figure& figure : of.figures)
        page += "\n![" + figure.caption + "](" + folder.filename().string() + "/" + figure.name + ".svg)\n";
    std::string notes, names, pictures;
    const auto endSection = [&] {
        if (!notes.empty()) page += "\n" + notes;
        if (!pictures.empty()) {
            page += "\n" + names + "|\n";
            for (std::ptrdiff_t k = std::count(names.begin(), names.end(), '|'); k > 0; --k) page += "|---";
            page += "|\n" + pictures + "|\n";
        }
        notes = names = pictures = "";
    };
    for (const std::string& motion : of.motions) {
        // The same motion with friction continues the table.
        const std::size_t plain = motion.size() - std::min(motion.size(), kFriction.size());
        const bool rubs =
            motion.ends_with(kFriction) && &motion != &of.motions.front() && *(&motion - 1) == motion.substr(0, plain);
        if (rubs) {
            page += "| **with friction** |\n";
        } else {
            endSection();
            page += "\n## " + motion + "\n\n|";
            for (const Column& column : kColumns) page += std::string(" ") + column.title + " |";
            page += "\n|";
            for (std::size_t k = 0; k < std::size(kColumns); ++k) page += "---|";
            page += "\n";
        }
        for (const ordered_json& row : of.rows) {
            if (row["motion"] != motion || isVariant(row["system"])) continue;
            page += lineOf(row);
            const std::string system = row["system"], note = row["note"];
            if (!note.empty() && !note.starts_with(kStopped))
                notes += "- " + system + (rubs ? ", with friction: " : ": ") + note + "\n";
            const std::string picture = pictureName(motion, system);
            if (!fs::exists(of.out / picture)) continue;
            names += "| " + system + " ";
            pictures += "| ![" + system + "](" + folder.filename().string() + "/" + picture + ") ";
        }
    }
    endSection();
    if (!of.passivity.empty()) page += passivitySection(of.passivity);
    writeFile(fs::path(folder).concat(".md"), "the page", page);
}

}  // namespace touchstone::app
