#include "tools/touchstone/step_parts.hpp"

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/scene/cad_clearance.hpp"
#include "engine/scene/cad_scene.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/step_file.hpp"
#include "engine/scene/text.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/math/nearest_name.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/tree_parts.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostObstacles = 100;  // each is a part of its own, with which the tool is compared every tick
constexpr double kBeside = 4;                // times the deviation that was asked for: no tessellation deviates so
constexpr double kLeastDeviation = 1e-9, kMostDeviation = 0.1;  // m

double deviationOf(const std::string& text) {
    const std::size_t end = text.find_last_of("0123456789.") + 1;
    const auto number = readNumber(text.substr(0, end), 0, 1e6);
    const std::string unit = end < text.size() ? text.substr(end) : "mm";
    const double meters = number ? *number * (unit == "um" || unit == "µm" ? 1e-6 : metersPer(unit)) : 0;
    if (!(meters >= kLeastDeviation && meters <= kMostDeviation))
        throw UsageError("--deviation takes a length like 0.001mm or 1um, from 1 nm to 100 mm, not '" + text + "'");
    return meters;
}

}  // namespace

std::string lengthWords(double meters) {
    const double mm = meters * sandbox::kMmPerMeter;
    return mm < 0.0995 ? engine::formatted("%.3g µm", mm * 1000) : engine::formatted("%.3g mm", mm);
}

std::vector<CLI::Option*> addStepChoice(CLI::App& command, StepChoice& choice) {
    return {
        command.add_option(
            "--deviation", choice.deviation,
            "how far triangles of STEP files may deviate from the surfaces, in mm or like 1um (default: a "
            "tenth of the least clearance between the parts, at most 0.05 mm, at least 0.2 µm, and at "
            "most a million triangles for each part, 100,000 of them by Open Cascade)"),
        command
            .add_option("--facets", choice.facets,
                        "number of facets of holes and shafts of STEP files: coprime, so that those of a hole and of a "
                        "shaft are nowhere in phase, or in-step, so that one number divides the other")
            ->capture_default_str()
            ->check(CLI::IsMember({"coprime", "in-step"})),
        command.add_flag(
            "--keep-clearance", choice.keepClearance,
            "place the facets of holes in STEP files outside their surfaces and those of shafts inside, so "
            "that they take nothing from the drawn clearance")};
}

StepParts::StepParts(const fs::path& assembly, const std::string& tool, const std::vector<std::string>& obstacles,
                     const StepChoice& choice) {
    read(std::span(&assembly, 1), choice, false);
    const auto body = [&](std::uint32_t part) { return Body{assembly, 0, {part}, assemblies_[0].parts[part].name}; };
    tool_ = body(find(assembly, tool));
    for (const std::string& name : obstacles) obstacles_.push_back(body(find(assembly, name)));
    std::vector<std::string> without;
    if (obstacles.empty())
        for (std::uint32_t i = 0; i < assemblies_[0].parts.size(); ++i) {
            if (i == tool_.parts[0]) continue;
            // What is no solid cannot be felt; it stops nothing here, as nobody named it.
            if (assemblies_[0].shapes[assemblies_[0].parts[i].shape].problem.empty())
                obstacles_.push_back(body(i));
            else
                without.push_back(assemblies_[0].parts[i].name);
        }
    if (obstacles_.empty())
        engine::failIn(assembly, "",
                       "has no other solid than '" + engine::printable(tool_.name) + "', so there is no obstacle");
    if (obstacles_.size() > kMostObstacles)
        engine::failIn(assembly, "",
                       "has " + std::to_string(obstacles_.size()) + " parts beside the tool, and a scene at most " +
                           std::to_string(kMostObstacles) + " obstacles: name those near the tool with --obstacle");
    std::vector<std::string> only{assemblies_[0].parts[tool_.parts[0]].path};
    for (const Body& obstacle : obstacles_) only.push_back(assemblies_[0].parts[obstacle.parts[0]].path);
    read(std::span(&assembly, 1), choice, true, std::move(only));
    if (!without.empty())
        assemblies_[0].notes.push_back(
            "'" + engine::printable(without.front()) + "'" +
            (without.size() > 1 ? " and " + std::to_string(without.size() - 1) + " more" : "") +
            " left out, since no solid: touchstone validate says why");
}

StepParts::StepParts(const fs::path& tool, const std::vector<fs::path>& obstacles, const StepChoice& choice) {
    std::vector<fs::path> files;
    if (engine::isStepFile(tool)) files.push_back(tool);
    for (const fs::path& file : obstacles)
        if (engine::isStepFile(file)) files.push_back(file);
    if (files.empty() && choice.given())
        throw UsageError(
            "--deviation, --facets and --keep-clearance are for STEP files: meshes have triangles already");
    if (!files.empty()) read(files, choice, true);
    std::size_t next = 0;
    tool_ = engine::isStepFile(tool) ? whole(tool, next++) : Body{tool, 0, {}, ""};
    for (const fs::path& file : obstacles)
        obstacles_.push_back(engine::isStepFile(file) ? whole(file, next++) : Body{file, 0, {}, ""});
}

void StepParts::read(std::span<const fs::path> files, const StepChoice& choice, bool meshes,
                     std::vector<std::string> only) {
    engine::StepOptions options;
    options.meshes = meshes;
    if (!choice.deviation.empty()) options.deviation = deviationOf(choice.deviation);
    options.inStep = choice.facets == "in-step";
    options.keepClearance = choice.keepClearance;
    options.only = std::move(only);
    auto found =
        engine::readStep(files, options, [bar = progressBar("STEP:")](const std::string& what, double fraction) {
            return bar({.part = what, .fraction = fraction});
        });
    if (!found) throw BuildCancelled();
    assemblies_ = std::move(*found);
}

StepParts::Body StepParts::whole(const fs::path& file, std::size_t assembly) const {
    Body body{file, assembly, {}, file.stem().string()};
    const engine::CadAssembly& content = assemblies_[assembly];
    for (std::uint32_t i = 0; i < content.parts.size(); ++i) body.parts.push_back(i);
    return body;
}

std::uint32_t StepParts::find(const fs::path& file, const std::string& name) const {
    std::vector<std::string> names;
    const std::vector<engine::CadPart>& parts = assemblies_[0].parts;
    for (std::uint32_t i = 0; i < parts.size(); ++i) {
        if (parts[i].name == name || parts[i].path == name) return i;
        names.push_back(parts[i].name);
    }
    const std::string nearest = nearestName(name, names);
    engine::failIn(file, "",
                   "has no part '" + engine::printable(name) + "'" +
                       (nearest.empty() ? "" : "; did you mean '" + engine::printable(nearest) + "'?") +
                       " touchstone validate lists its " + std::to_string(parts.size()) + " parts");
}

Part StepParts::part(const Body& body, const PartFrame& frame, const engine::Material& material,
                     const engine::RigidPart& pose) const {
    const engine::CadAssembly& assembly = assemblyOf(body);
    Part out;
    out.name = body.name;
    for (const std::string& note : assembly.notes) out.notes.push_back(body.file.string() + ": " + note);
    for (const std::uint32_t index : body.parts) {
        const engine::CadPart& part = assembly.parts[index];
        const engine::CadShape& shape = assembly.shapes[part.shape];
        const std::string name = "'" + engine::printable(part.name) + "'";
        if (!shape.problem.empty()) engine::failIn(body.file, "", "the part " + name + " " + shape.problem);
        if (shape.limited)
            out.notes.push_back(
                body.file.string() + ": the part " + name +
                " would have more than a million triangles, or 100,000 of those that Open Cascade makes, at " +
                lengthWords(shape.asked) + " from its surfaces: they deviate by up to " + lengthWords(shape.deviation) +
                "; a larger --deviation silences this");
        else if (shape.deviation > kBeside * shape.asked)
            out.notes.push_back(body.file.string() + ": triangles of the part " + name + " deviate by up to " +
                                lengthWords(shape.deviation) +
                                " from its surfaces, as edges lie beside these: heal the part in the CAD program");
        out.triangles += shape.triangles.size();
        out.deviation = std::max(out.deviation.value_or(0), shape.deviation);
    }
    const glm::dmat4 up = frame.zUp ? glm::rotate(glm::dmat4(1), glm::radians(-90.0), {1, 0, 0}) : glm::dmat4(1);
    out.unit = assembly.metersPerUnit;
    if (frame.zUp) out.inScene.rotation = kZUp;
    out.modeled = chained(pose, out.inScene);
    out.content = engine::sceneOf(assembly, body.parts, material, frame.crease, up * engine::rigidMatrix(pose));
    findBox(out, body.file.string(), frame.zUp, {"mm", 1}, pose);
    return out;
}

double StepParts::clearance() const {
    // Tool and obstacles as one part each, since what is between the parts of one is no clearance of the fit.
    engine::CadAssembly fit;
    fit.shapes.resize(2);
    fit.parts = {{.shape = 0}, {.shape = 1}};
    const auto add = [&](const Body& body, engine::CadShape& shape) {
        for (const std::uint32_t index : body.parts) {
            const engine::CadPart& part = assemblyOf(body).parts[index];
            for (engine::CadFace face : assemblyOf(body).shapes[part.shape].faces) {
                face.origin = glm::dvec3(part.placement * glm::dvec4(face.origin, 1));
                face.axis = glm::dvec3(part.placement * glm::dvec4(face.axis, 0));
                shape.faces.push_back(face);
            }
        }
    };
    add(tool_, fit.shapes[0]);
    for (const Body& obstacle : obstacles_) add(obstacle, fit.shapes[1]);
    engine::findClearances({&fit, 1});
    return engine::leastClearance(fit);
}

}  // namespace touchstone::app
