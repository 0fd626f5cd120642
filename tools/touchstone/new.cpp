// touchstone new: makes a scene from parts, or from a scene of another unit.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <vector>

#include "engine/edit/scene_scale.hpp"
#include "engine/scene/gltf_read.hpp"
#include "engine/scene/gltf_write.hpp"
#include "engine/scene/mesh_file.hpp"
#include "engine/scene/step_file.hpp"
#include "engine/scene/text.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/measure/goal_check.hpp"
#include "haptics/sandbox/scene/flat_keys.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/new_mate.hpp"
#include "tools/touchstone/new_scene.hpp"
#include "tools/touchstone/step_parts.hpp"
#include "tools/touchstone/tree_parts.hpp"
#include "tools/touchstone/trials.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;

constexpr double kOfClearance = 0.1, kCoarsest = 0.05;  // of the clearance, and mm: how far triangles may deviate

struct NewOptions {
    fs::path assembly, scene, output, study;
    std::string tool;                    ///< a file; with an assembly, the name of a part
    std::vector<std::string> obstacles;  ///< likewise
    std::string toolName;
    std::vector<std::string> obstacleNames;
    std::string unit = "mm", up = "y";
    double crease = 30;    ///< degrees
    std::string axis;      ///< in coordinates with `up`; empty: up
    std::string goal;      ///< DEPTH[,TOLERANCE]
    std::string thread;    ///< LEAD
    std::string toolPose;  ///< X,Y,Z[,RX,RY,RZ]
    bool assembled = false, demonstration = false, noMate = false;
    double scale = 1;  ///< of the scene
    TreeChoice tree;   ///< of all parts
    StepChoice step;
};

int scaleScene(const NewOptions& options) {
    if (!(options.scale > 0)) throw UsageError("--scale is a positive number");
    engine::Scene scene = engine::readGltf(options.scene);
    sandbox::nestFlatKeys(scene);
    engine::applyEdits(scene, engine::scaled(scene, options.scale, "touchstone"));
    engine::saveScene(scene, options.output);
    std::printf("%s: scaled by %g\n", options.output.string().c_str(), options.scale);
    return kOk;
}

/// A length such as 20mm or 0.5in as meters; without a unit, in that of the parts. Nothing if it is zero or not a
/// length.
std::optional<double> lengthInMeters(const std::string& text, const std::string& unit) {
    const std::size_t end = text.find_last_of("0123456789.") + 1;
    const auto number = readNumber(text.substr(0, end), -1e6, 1e6);
    if (!number || *number == 0) return {};
    return *number * metersPer(end < text.size() ? text.substr(end) : unit);
}

double goalLength(const std::string& text, const std::string& unit) {
    const auto length = lengthInMeters(text, unit);
    if (!length || *length < 0)
        throw UsageError("--goal takes lengths above zero like 20mm or 20mm,0.5mm, not '" + text + "'");
    return *length;
}

double leadOf(const NewOptions& options) {
    const auto lead = lengthInMeters(options.thread, options.unit);
    if (!lead || std::abs(*lead) > 1)
        throw UsageError(
            "--thread takes the travel per turn like 2mm, up to 1 m, or -2mm for a left-handed thread, not '" +
            options.thread + "'");
    return *lead;
}

NewGoal goalOf(const NewOptions& options) {
    const std::size_t comma = options.goal.find(',');
    NewGoal goal{.depth = goalLength(options.goal.substr(0, comma), options.unit), .tolerance = {}};
    if (comma != std::string::npos) goal.tolerance = goalLength(options.goal.substr(comma + 1), options.unit);
    return goal;
}

/// Where the tool is put instead of where it is modeled.
engine::RigidPart toolPoseOf(const NewOptions& options) {
    engine::RigidPart pose;
    if (options.toolPose.empty()) return pose;
    const auto refuse = [&] {
        throw UsageError("--tool-pose takes X,Y,Z or X,Y,Z,RX,RY,RZ: lengths like 100mm and angles in degrees, not '" +
                         options.toolPose + "'");
    };
    std::vector<std::string> words(1);
    for (const char c : options.toolPose) c == ',' ? words.emplace_back() : words.back() += c;
    if (words.size() != 3 && words.size() != 6) refuse();
    for (int k = 0; k < int(words.size()); ++k) {
        const std::string& word = words[std::size_t(k)];
        const std::size_t end = word.find_last_of("0123456789.") + 1;
        const auto number = readNumber(word.substr(0, end), -1e6, 1e6);
        if (!number || (k >= 3 && end < word.size())) {
            refuse();
            return pose;
        }
        if (k < 3)
            pose.translation[k] = *number * metersPer(end < word.size() ? word.substr(end) : options.unit);
        else
            pose.rotation = glm::angleAxis(glm::radians(*number), glm::dvec3(k == 3, k == 4, k == 5)) * pose.rotation;
    }
    return pose;
}

int study(const NewOptions& options) {
    makeFolder(options.study, "the study");
    const fs::path protocol = options.study / sandbox::kStudyFile;
    const auto file = sandbox::firstStudy(fs::absolute(options.output).string(), options.output.stem().string());
    writeFile(protocol, "the protocol", file.dump(1) + "\n");
    return runStudy(protocol, options.study);
}

/// The direction in the scene, whose +y is up.
glm::dvec3 axisOf(const NewOptions& options) {
    std::string name = options.axis.empty() ? options.up : options.axis;
    const bool minus = name.starts_with('-');
    if (minus) name.erase(0, 1);
    if (name != "x" && name != "y" && name != "z")
        throw UsageError("--axis is x, y, z, -x, -y or -z, not '" + options.axis + "'");
    glm::dvec3 axis(name == "x", name == "y", name == "z");
    if (options.up == "z") axis = {axis.x, axis.z, 0 - axis.y};
    return minus ? -axis : axis;
}

void print(const char* role, const Part& part) {
    const glm::dvec3 mm = (part.high - part.low) * sandbox::kMmPerMeter;
    std::printf("  %-9s %s, %.4g x %.4g x %.4g mm", role, engine::escaped(part.name).c_str(), mm.x, mm.y, mm.z);
    if (part.deviation)
        std::printf(", %zu triangles within %s of its surfaces", part.triangles, lengthWords(*part.deviation).c_str());
    std::printf("\n");
}

/// Vectors of STEP files in the scene, and back.
glm::dvec3 inScene(const glm::dvec3& v, const NewOptions& options) {
    return options.up == "z" ? glm::dvec3(v.x, v.z, 0 - v.y) : v;
}
glm::dvec3 inFile(const glm::dvec3& v, const NewOptions& options) {
    return options.up == "z" ? glm::dvec3(v.x, 0 - v.z, v.y) : v;
}

/// Takes what the options leave open from the surfaces of STEP parts: the goal, its axis, fold and lead, and where the
/// tool goes.
std::optional<sandbox::MateProposal> findMate(const NewOptions& options, const StepParts& step, engine::RigidPart& pose,
                                              NewScene& parts) {
    if (options.noMate || step.tool().parts.empty()) return {};
    using Tool = sandbox::MateConstraints::Tool;
    sandbox::MateConstraints given;
    given.tool = options.assembled ? Tool::AtGoal : options.toolPose.empty() ? Tool::Anywhere : Tool::OnAxis;
    if (!options.axis.empty()) given.out = inFile(axisOf(options), options);
    if (!options.thread.empty()) given.lead = leadOf(options);
    const std::optional<sandbox::MateProposal> mate = mateOf(step, pose, given);
    if (!mate) return {};
    pose = chained(pose, mate->pose);
    parts.axis = inScene(mate->out, options);
    parts.onAxis = inScene(mate->point, options);
    if (!parts.goal) {
        parts.goal.emplace();
        parts.assembled = true;
    }
    parts.goal->lead = mate->lead;
    parts.goal->fold = mate->fold;
    return mate;
}

void printMate(const sandbox::MateProposal& mate, std::vector<std::string>& warnings) {
    const char* title = "mate";
    for (const std::string& reason : mate.reasons) {
        std::printf("  %-9s %s\n", title, engine::escaped(reason).c_str());
        title = "";
    }
    warnings.insert(warnings.end(), mate.doubts.begin(), mate.doubts.end());
}

/// The options that would give what was found.
void printProposed(const NewOptions& options, const sandbox::MateProposal& mate, const engine::RigidPart& pose,
                   const GoalRegion& goal) {
    std::string words;
    const auto add = [&](const std::string& option) { words += (words.empty() ? "" : " ") + option; };
    if (!mate.modeled) add("--tool-pose " + toolPoseText(pose));
    for (int k = 0; k < 3 && options.axis.empty(); ++k)
        for (const double sign : {1.0, -1.0})
            if (sign * mate.out[k] > 1 - 1e-9) add(std::string("--axis ") + (sign < 0 ? "-" : "") + "xyz"[k]);
    if (options.goal.empty()) add(engine::formatted("--goal %.7gmm", goal.depth));
    if (mate.lead != 0 && options.thread.empty())
        add(engine::formatted("--thread %.5gmm", mate.lead * sandbox::kMmPerMeter));
    if (!words.empty()) std::printf("  found     %s: give other values to overrule it\n", words.c_str());
}

/// Turns the goal until the threads are in phase there.
void findPhase(NewScene& parts, std::vector<std::string>& warnings) {
    std::vector<std::string> ignored;
    sandbox::SceneOptions meshes;
    meshes.trees = false;
    const sandbox::HapticScene scene = sandbox::openScene(makeScene(parts, ignored), meshes);
    for (const std::string& defects : scene.defects)
        if (!defects.empty()) {
            warnings.push_back("the phase of the thread is found between closed meshes, and one has " + defects +
                               ": the goal keeps the phase of the tool as it is modeled");
            return;
        }
    const sandbox::ThreadPhase phase = sandbox::threadPhase(*scene.world, *scene.roles.goal);
    if (!phase.doubt.empty()) warnings.push_back(phase.doubt);
    parts.goal->turn = phase.turn.turn;
    parts.goal->play = phase.turn.play;
    parts.goal->fold = phase.starts;
    const std::string starts = phase.starts > 1 ? ", " + std::to_string(phase.starts) + " starts" : "";
    std::printf(
        "  thread    %s-handed, %.4g mm per turn%s; the tool is turned by %.1f° to be in phase, with a play of "
        "±%.1f°\n",
        parts.goal->lead < 0 ? "left" : "right", std::abs(parts.goal->lead) * sandbox::kMmPerMeter, starts.c_str(),
        phase.turn.turn * 180 / std::numbers::pi, phase.turn.play * 180 / std::numbers::pi);
}

void printNext(const NewOptions& options, bool measurable) {
    const std::string program = programAsTyped(), scene = sandbox::shellQuoted(options.output.string());
    std::printf("Next:\n  %s run %s\n", program.c_str(), scene.c_str());
    if (measurable) std::printf("  %s fit %s\n", program.c_str(), scene.c_str());
    const std::string picture = sandbox::shellQuoted(fs::path(options.output).replace_extension(".png").string());
    std::printf("  %s run %s --headless --screenshot %s\n", program.c_str(), scene.c_str(), picture.c_str());
}

/// The parts of STEP files, if there are any.
StepParts stepParts(const NewOptions& options, const StepChoice& choice) {
    if (!options.assembly.empty()) return {options.assembly, options.tool, options.obstacles, choice};
    return {options.tool, {options.obstacles.begin(), options.obstacles.end()}, choice};
}

/// Parts of one file share its notes.
void removeRepeated(std::vector<std::string>& sentences) {
    std::set<std::string> told;
    std::erase_if(sentences, [&](const std::string& sentence) { return !told.insert(sentence).second; });
}

int makeNew(const NewOptions& options) {
    if (options.output.extension() != ".glb" && options.output.extension() != ".gltf")
        throw UsageError("-o names a .glb or .gltf file, not '" + options.output.string() + "'");
    if (!options.scene.empty()) return scaleScene(options);
    if (options.tool.empty() || (options.assembly.empty() && options.obstacles.empty()))
        throw UsageError("new needs --tool and --obstacle, an assembly and --tool, or --scene and --scale");
    if (!options.assembly.empty() && !engine::isStepFile(options.assembly))
        throw UsageError("an assembly is a .step or .stp file, not '" + options.assembly.string() +
                         "': give the other parts with --tool and --obstacle");
    if (options.obstacleNames.size() > options.obstacles.size())
        throw UsageError("there are more --obstacle-name than --obstacle: give one for each obstacle, in order");
    if (options.up != "y" && options.up != "z") throw UsageError("--up is y or z, not '" + options.up + "'");
    checkChoice(options.tree);
    if (options.tree.leaves.value_or(sandbox::kMinLeaves) < sandbox::kMinLeaves)
        throw UsageError("--leaves is at least " + std::to_string(sandbox::kMinLeaves) + " in a scene");

    const PartFrame frame{options.unit.c_str(), metersPer(options.unit), options.up == "z",
                          options.crease * std::numbers::pi / 180};
    NewScene parts;
    parts.name = options.output.stem().string();
    parts.tree = options.tree;
    parts.axis = axisOf(options);
    parts.assembled = options.assembled;
    if (options.assembled) parts.goal.emplace();
    if (!options.goal.empty()) parts.goal = goalOf(options);
    parts.demonstration = options.demonstration;
    std::vector<std::string> warnings;
    StepParts step = stepParts(options, options.step);
    engine::RigidPart toolPose = toolPoseOf(options);
    const std::optional<sandbox::MateProposal> mate = findMate(options, step, toolPose, parts);
    if (mate && !mate->modeled && options.step.deviation.empty() && step.clearance() == 0 && mate->clearance > 0) {
        // Where the parts lie in their files, nothing says how close they fit.
        StepChoice finer = options.step;
        finer.deviation = engine::formatted("%.9fmm", std::min(kCoarsest, kOfClearance * mate->clearance * 1000));
        step = stepParts(options, finer);
    }
    if (!mate && !parts.goal && !step.tool().parts.empty() && !options.noMate)
        warnings.emplace_back(
            "nothing of the tool fits into or over an obstacle by its surfaces, so it has no goal: put it in place in "
            "the "
            "window and choose *Set goal here*, or give --goal or --assembled");
    if (!options.thread.empty()) {
        if (!parts.goal) throw UsageError("--thread needs a goal: give --goal DEPTH, or --assembled");
        parts.goal->lead = leadOf(options);
    }
    if (!options.study.empty() && !parts.goal)
        throw UsageError("--study needs a goal: give --goal DEPTH, or --assembled");
    const auto read = [&](const StepParts::Body& body, const std::string& name, const engine::Material& material,
                          const engine::RigidPart& pose = {}) {
        Part part =
            body.parts.empty() ? readPart(body.file, frame, material, pose) : step.part(body, frame, material, pose);
        if (!name.empty()) part.name = name;
        warnings.insert(warnings.end(), part.notes.begin(), part.notes.end());
        return part;
    };
    parts.tool = read(step.tool(), options.toolName, {"gold", {1.0f, 0.77f, 0.34f, 1}, 1, 0.35f}, toolPose);
    for (std::size_t i = 0; i < step.obstacles().size(); ++i)
        parts.obstacles.push_back(read(step.obstacles()[i],
                                       i < options.obstacleNames.size() ? options.obstacleNames[i] : "",
                                       {"silver", {0.95f, 0.95f, 0.97f, 1}, 1, 0.4f}));
    parts.clearance = mate && !mate->modeled ? std::max(0.0, mate->clearance) : step.clearance();
    removeRepeated(warnings);
    const glm::dvec3 moved = moveToOrigin(parts) * sandbox::kMmPerMeter;
    makeScene(parts, warnings);  // refuses what does not go together before anything is printed

    std::printf("%s\n", options.output.string().c_str());
    if (moved != glm::dvec3(0))
        std::printf("  moved     all parts by (%.0f, %.0f, %.0f) mm to the origin, far from which they lie\n", moved.x,
                    moved.y, moved.z);
    print("tool", parts.tool);
    for (const Part& obstacle : parts.obstacles) print("obstacle", obstacle);
    if (parts.clearance > 0)
        std::printf("  clearance %s between the surfaces of tool and obstacles\n",
                    lengthWords(parts.clearance).c_str());
    if (mate) printMate(*mate, warnings);
    if (parts.goal && parts.goal->lead != 0) findPhase(parts, warnings);
    std::vector<std::string> told;
    engine::writeGltf(makeScene(parts, told), options.output);
    sandbox::SceneOptions meshes;
    meshes.buildWorld = parts.goal.has_value();
    meshes.trees = false;
    const sandbox::HapticScene written = sandbox::openScene(options.output, meshes);
    warnings.insert(warnings.end(), written.warnings.begin(), written.warnings.end());
    if (written.world)
        if (std::string doubt = sandbox::goalDoubt(*written.world, *written.roles.goal); !doubt.empty())
            warnings.push_back(std::move(doubt));
    if (mate) printProposed(options, *mate, toolPose, *written.roles.goal);
    for (const std::string& warning : warnings) std::printf("  warning: %s\n", engine::escaped(warning).c_str());
    const auto isOpen = [](const Part& part) { return part.open; };
    printNext(options, parts.goal.has_value() && !parts.tool.open && std::ranges::none_of(parts.obstacles, isOpen));
    return options.study.empty() ? kOk : study(options);
}

constexpr const char* kNewFooter =
    "The lengths of --goal, --thread and --tool-pose may have a unit (20mm, 0.5in); without one they are in that of "
    "--unit.\n\n"
    "Examples:\n"
    "  touchstone new --tool shaft.stl --obstacle hole.stl -o fit.glb   place the tool in the window, then *Set goal "
    "here*\n"
    "  touchstone new --tool peg.stl --obstacle block.stl --up z --assembled --demo -o peg.glb\n"
    "  touchstone new --tool peg.stl --obstacle block.obj --goal 20mm,0.5mm --demo -o peg.glb\n"
    "  touchstone new --tool shaft.stl --obstacle hub.stl --unit in --up z --tool-pose 0,-100mm,0,0,0,90 --goal 0.6 "
    "-o d.glb --study d\n"
    "  touchstone new --tool nut.stl --obstacle bolt.stl --up z --assembled --thread 2mm --demo -o nut.glb\n"
    "  touchstone new --tool shaft.step --obstacle housing.step --up z --assembled --demo -o fit.glb   with the "
    "clearance "
    "that was drawn\n"
    "  touchstone new gearbox.step --tool 'output shaft' --up z --assembled --demo -o gearbox.glb   touchstone "
    "validate "
    "gearbox.step lists its parts\n"
    "  touchstone new --scene nut.glb --scale 0.001 -o small.glb   millimeters that were taken for meters\n";

}  // namespace

void addNew(CLI::App& program, Action& action) {
    const auto options = std::make_shared<NewOptions>();
    static const std::string about = "Make a scene from parts (" + engine::meshExtensionWords("or") +
                                     ", STEP or glTF), or from a scene of another unit";
    CLI::App* command = addCommand(program, "new", about.c_str(), kNewFooter);
    CLI::Option* assembly = command->add_option(
        "ASSEMBLY", options->assembly,
        "a STEP file with tool and obstacles at their places: --tool and --obstacle then name parts "
        "in it, and without --obstacle all others are obstacles");
    CLI::Option* tool = command->add_option("--tool", options->tool, "the part that moves with the hand");
    CLI::Option* obstacle =
        command->add_option("--obstacle", options->obstacles, "a part that is fixed; may be repeated")
            ->expected(1)
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    obstacle->needs(tool);
    assembly->needs(tool);
    std::vector<CLI::Option*> ofParts{assembly, tool, obstacle};
    const auto ofPart = [&](CLI::Option* option) {
        option->needs(tool);
        ofParts.push_back(option);
        return option;
    };
    ofPart(command->add_option("--tool-name", options->toolName, "its name (default: that of the file)"));
    ofPart(command->add_option("--obstacle-name", options->obstacleNames, "the same, in the order of --obstacle"))
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    ofPart(command->add_option("--unit", options->unit,
                               "unit of coordinates in " + engine::meshExtensionWords("and") +
                                   " files: mm, cm, m or in; glTF has meters, and STEP names its own"))
        ->capture_default_str();
    ofPart(command->add_option("--up", options->up, "axis of these coordinates that is up: y or z; that of glTF is y"))
        ->capture_default_str();
    ofPart(command->add_option("--crease", options->crease,
                               "edges that turn by more, in degrees, are drawn sharp, in " +
                                   engine::meshExtensionWords("and") + " files"))
        ->capture_default_str()
        ->check(within(0, 180, "degrees"));
    ofPart(command->add_flag(
        "--assembled", options->assembled,
        "the parts are modeled in assembled position: that is the goal, and the tool starts outside"));
    ofPart(
        command->add_flag("--no-mate", options->noMate,
                          "do not search the surfaces of STEP files for where the tool fits: it stays where its file "
                          "has it, and has no goal without --goal or --assembled"));
    ofPart(command->add_option(
        "--goal", options->goal,
        "DEPTH[,TOLERANCE]: the tool should end with its lowest point DEPTH below the highest of the "
        "obstacles, within TOLERANCE (default: a hundredth of the tool, at most 1 mm)"));
    ofPart(command->add_option(
        "--tool-pose", options->toolPose,
        "X,Y,Z[,RX,RY,RZ]: the tool is turned about the x, y and z axes of its file by these degrees, one after the "
        "other, and then moved by X,Y,Z, before anything else is measured: for parts that are modeled apart"));
    ofPart(
        command->add_option("--axis", options->axis,
                            "the way out: x, y, z, -x, -y or -z in the coordinates that --up describes (default: up)"));
    ofPart(command->add_option(
        "--thread", options->thread,
        "LEAD: the tool is screwed in along --axis, by LEAD per turn (the pitch times the "
        "starts), negative for a left-handed thread; at the goal it is turned until the threads are in phase"));
    ofPart(command->add_flag("--demo", options->demonstration,
                             "add a demonstration: straight in along --axis, or on the thread, from outside to the "
                             "goal"));
    ofPart(
        command->add_option("--study", options->study,
                            "run a study of five simulated hands, and write its protocol and results to this folder"));
    for (CLI::Option* option : addStepChoice(*command, options->step)) ofPart(option);
    CLI::Option* scene = command->add_option("--scene", options->scene, "instead of parts: a scene to copy and scale");
    for (CLI::Option* option : ofParts) scene->excludes(option);
    command->add_option("--scale", options->scale, "factor by which the scene is scaled")->needs(scene);
    addTreeChoice(*command, options->tree);
    command->add_option("-o,--output", options->output, "the scene to write, .glb or .gltf")->required();
    command->callback([options, &action] { action = [options] { return makeNew(*options); }; });
}

}  // namespace touchstone::app
