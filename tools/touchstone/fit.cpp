// touchstone fit: whether the tool fits where it should go, and which settings it needs.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "haptics/device/emergency_stop.hpp"
#include "haptics/sandbox/measure/fit_check.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/scene_path.hpp"
#include "tools/touchstone/settings_choice.hpp"

namespace touchstone::app {
namespace {

using nlohmann::ordered_json;

struct FitCommand {
    std::string scene, geometry;
    bool json = false;
};

ordered_json roomJson(const sandbox::HapticScene& scene, const sandbox::FitRoom& room) {
    return {{"clearance_mm", room.clearance},
            {"as_placed_mm", room.asPlaced},
            {"before_goal_mm", room.depth},
            {"obstacle", scene.world->obstacles[room.obstacle].name},
            {"at_mm", {room.p_W.x(), room.p_W.y(), room.p_W.z()}}};
}

/// How much of the drawn clearance the meshes of CAD parts keep, mm.
struct DrawnFit {
    double clearance = 0;  ///< between the surfaces
    double taken = 0;      ///< of it, by the meshes at the goal; below 0 if they leave more
    double deviation = 0;  ///< the greatest of triangles from surfaces, of any part
};

/// Nothing if the tool is not from a CAD file, or has no goal to be measured at.
std::optional<DrawnFit> drawnFit(const sandbox::HapticScene& scene, const sandbox::FitCheck& fit) {
    const auto cadOf = [&](engine::Entity node) -> const std::optional<sandbox::CadFit>& {
        return scene.scene.registry.get<sandbox::BodyMarking>(node).cad;
    };
    const auto& tool = cadOf(scene.roles.tool);
    if (!tool || !tool->clearance || !fit.goal) return {};
    DrawnFit drawn{*tool->clearance, *tool->clearance - fit.goal->clearance, tool->deviation};
    for (const engine::Entity obstacle : scene.roles.obstacles)
        if (const auto& cad = cadOf(obstacle)) drawn.deviation = std::max(drawn.deviation, cad->deviation);
    return drawn;
}

void printJson(const sandbox::HapticScene& scene, const sandbox::FitCheck& fit) {
    ordered_json json{{"scene", sandbox::sceneName(scene)}, {"fits", fit.fits()}, {"verdict", fit.verdict}};
    json["goal"] = fit.goal ? roomJson(scene, *fit.goal) : ordered_json();
    json["least"] = fit.least ? roomJson(scene, *fit.least) : ordered_json();
    if (const auto drawn = drawnFit(scene, fit))
        json["drawn"] = {{"clearance_mm", drawn->clearance},
                         {"tessellation_took_mm", drawn->taken},
                         {"deviation_mm", drawn->deviation}};
    const auto& [raised, turned] = fit.free;
    if (raised) json["fits_when"]["raised_mm"] = *raised;
    if (turned) json["fits_when"]["turned_rad"] = turned->turn;
    if (fit.thread) json["thread_rise"] = {{"least", fit.thread->least}, {"most", fit.thread->most}};
    json["error_mm"] = fit.error;
    json["geometry"] = fit.spheres ? "spheres" : "mesh";
    json["settings"] = ordered_json::object();
    for (const auto& [key, value] : fit.advice) json["settings"][key] = value;
    std::printf("%s\n", json.dump(-1, ' ', false, ordered_json::error_handler_t::replace).c_str());
}

void print(const sandbox::HapticScene& scene, const sandbox::FitCheck& fit) {
    const auto room = [&](const char* where, const sandbox::FitRoom& at) {
        std::printf("  %-18s %9.4f mm to \"%s\" at (%.1f, %.1f, %.1f) mm; as placed %.4f mm\n", where, at.clearance,
                    engine::escaped(scene.world->obstacles[at.obstacle].name).c_str(), at.p_W.x(), at.p_W.y(),
                    at.p_W.z(), at.asPlaced);
    };
    std::printf("%s: %s\n", engine::escaped(sandbox::sceneName(scene)).c_str(), fit.verdict.c_str());
    if (fit.goal) room("room at the goal", *fit.goal);
    if (fit.least) {
        room("least room", *fit.least);
        if (fit.goal) std::printf("  %-18s %9.1f mm before the goal\n", "there", fit.least->depth);
    }
    if (const auto drawn = drawnFit(scene, fit))
        std::printf(
            "  %-18s %9.4f mm between the CAD surfaces; tessellation took %.4f mm of it at the goal, with "
            "triangles within %.4f mm\n",
            "as drawn", drawn->clearance, drawn->taken, drawn->deviation);
    std::printf("  %-18s %9.4f mm, %s\n", "taken from it", fit.error,
                fit.spheres ? "by which the sphere trees protrude" : "the contact distance between meshes");
    if (fit.thread) std::printf("  thread: %s\n", sandbox::facetClause(*fit.thread).c_str());
    for (const auto& [key, value] : fit.advice) std::printf("  take --set %s=%s\n", key.c_str(), value.c_str());
}

int fit(const FitCommand& command) {
    SettingsChoice choice;
    if (!command.geometry.empty()) choice.geometry = command.geometry;
    withCommandLine({}, choice);  // reports wrong names before a scene is read
    const auto adjust = [&](const Settings& settings) { return checkedWithCommandLine(settings, choice); };
    const sandbox::HapticScene scene =
        sandbox::openScene(findScene(command.scene),
                           {.treeCache = sandbox::treeCacheFolder(), .progress = progressBar(), .adjust = adjust});
    if (scene.unit) spdlog::warn("{}", scene.unit->text);
    const sandbox::SceneProgress bar = progressBar("measuring the fit of");
    const auto found = sandbox::checkFit(sandbox::fitQuestion(scene), adjust(scene.settings), [&](double fraction) {
        return bar({.part = sandbox::sceneName(scene), .fraction = fraction});
    });
    if (!found) return kSignalled + StopRequest::signal();
    if (command.json)
        printJson(scene, *found);
    else
        print(scene, *found);
    return found->fits() ? kOk : kOutcomeUnmet;
}

constexpr const char* kFitFooter =
    "Measures the clearance between the meshes at the goal and on the way in, or along the demonstration where there\n"
    "is no goal: the largest that the tool finds by moving up to 1 mm (4 % of the reach of a smaller tool), and at\n"
    "the goal within its tolerance. A goal inside an obstacle is reported, with the turn or the height at which the\n"
    "tool would fit. For parts from STEP files also the clearance between their surfaces as drawn, and how much of it\n"
    "the triangles take. For a thread, how steeply its facets rise: if that is less than the lead, friction holds it\n"
    "sooner.\n\n"
    "Examples:\n"
    "  touchstone fit peg-h7                      0.01 mm, and what the contact distance leaves of it\n"
    "  touchstone fit spline-01 --geometry spheres  whether sphere trees are fine enough\n\n"
    "Exit code 3: the tool does not fit.\n";

}  // namespace

void addFit(CLI::App& program, Action& action) {
    const auto options = std::make_shared<FitCommand>();
    CLI::App* command = addCommand(
        program, "fit", "Measure whether the tool fits where it should go, and with which settings", kFitFooter);
    command->add_option("SCENE", options->scene, kSceneHelp)->required();
    command->add_option("--geometry", options->geometry, "mesh or spheres, in place of the scene's");
    command->add_flag("--json", options->json, "one JSON object");
    command->callback([options, &action] { action = [options] { return fit(*options); }; });
}

}  // namespace touchstone::app
