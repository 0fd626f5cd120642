// make_scenes: writes one computed scene with its parameters, or all scenes that are bundled with the program.
#include <CLI/CLI.hpp>
#include <cctype>
#include <iostream>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_write.hpp"
#include "engine/scene/text.hpp"
#include "tools/parts/export_faults.hpp"
#include "tools/parts/scenes.hpp"

namespace {

using namespace touchstone;

/// The options of one scene, by its name.
void addOptions(CLI::App& command, std::string_view scene, app::SceneOptions& options) {
    const auto number = [&command](const char* name, auto& value, const char* help) {
        command.add_option(name, value, help)->capture_default_str();
    };
    command.add_option("--leaves", options.leaves, "maximum leaf count of each body's sphere tree")
        ->check(CLI::Range(8, 65536));
    if (scene == "spline") {
        app::SplineFit& fit = options.fit;
        number("--diameter", fit.diameter, "diameter over the keys of the shaft, mm");
        number("--keys", fit.keys, "number of keys");
        number("--key-depth", fit.keyDepth, "height of a key from root to top, mm");
        number("--key-width", fit.keyWidth, "distance between the flanks of a key, mm");
        number("--length", fit.length, "length of the shaft, mm");
        number("--depth", fit.depth, "depth of the hole, mm");
        number("--clearance", fit.clearance, "distance between the surfaces on each side, mm");
        number("--chamfer", fit.chamfer, "chamfer of the shaft's end and the hole's mouth, mm");
    } else if (scene == "bayonet") {
        app::BayonetFit& fit = options.bayonet;
        number("--diameter", fit.diameter, "diameter of the cap's body, mm");
        number("--lugs", fit.lugs, "number of lugs");
        number("--depth", fit.depth, "distance from the rim down to the groove of the lugs, mm");
        number("--turn", fit.turn, "angle from the entry slots to the pockets, rad");
        number("--clearance", fit.clearance, "clearance of lugs and body on each side, mm");
    } else if (scene == "gears") {
        app::GearPair& fit = options.gears;
        number("--module", fit.module, "pitch diameter divided by the number of teeth, mm");
        number("--fixed-teeth", fit.fixedTeeth, "number of teeth of the fixed gear");
        number("--loose-teeth", fit.looseTeeth, "number of teeth of the gear that slides on");
        number("--width", fit.width, "width of both gears along the axis, mm");
        number("--clearance", fit.clearance, "clearance of a tooth in mesh and of the post, on each side, mm");
    } else if (scene == "hook") {
        app::HookAndEye& fit = options.hook;
        number("--wire", fit.wire, "thickness of hook and eye, mm");
        number("--bow", fit.bow, "radius of the hook's bend, mm");
        number("--eye", fit.eye, "radius of the ring, mm");
    } else if (scene == "lock") {
        app::LockFit& fit = options.lock;
        number("--bit-reach", fit.bitReach, "distance of the bit's edge from the axis, mm");
        number("--ward-reach", fit.wardReach, "distance of the notch's bottom from the axis, mm");
        number("--ward-width", fit.wardWidth, "width of the ward along the axis, mm");
        number("--turn", fit.turn, "angle of the key to its stop, rad");
        number("--clearance", fit.clearance, "clearance of key and lock on each side, mm");
    } else if (scene == "peg") {
        app::PegFit& fit = options.peg;
        number("--diameter", fit.diameter, "diameter of the peg, mm");
        number("--breadth", fit.breadth, "other side of a rectangular peg, mm; 0: a round peg");
        number("--clearance", fit.clearance, "least distance of the walls on each side, mm");
        number("--depth", fit.depth, "depth of the hole, mm");
        command.add_flag("--through", fit.through, "a hole without a bottom");
        number("--chamfer", fit.chamfer, "chamfer of the peg's end and the hole's mouth, mm");
        number("--segments", fit.segments, "sides of the peg's polygon");
        number("--hole-segments", fit.holeSegments, "sides of the hole's polygon; 0: twelve more than the peg's");
    } else if (scene == "nut") {
        app::ThreadFit& fit = options.nut;
        number("--diameter", fit.diameter, "major diameter of the thread, mm");
        number("--pitch", fit.pitch, "pitch of the thread, mm");
        number("--clearance", fit.clearance, "clearance of flanks, crests and roots, mm");
        number("--height", fit.height, "height of the nut, mm");
        number("--flank", fit.flank, "angle from the flanks to the radial planes, degrees; 1: about a square thread");
        number("--depth", fit.depth, "depth of the thread, mm; 0: that of the basic profile");
        number("--starts", fit.starts, "threads side by side");
        command.add_flag("--left", fit.left, "a left-handed thread");
        number("--segments", fit.segments, "sections of the bolt around its axis");
        number("--nut-segments", fit.nutSegments,
               "sections of the nut around its axis; 0: twelve more than the bolt's");
    } else if (scene == "incline") {
        command.add_option("--slope", options.slope, "angle of the plane, rad")
            ->check(CLI::Range(0.0, 1.0))
            ->capture_default_str();
    } else if (scene == "drawer") {
        app::DrawerFit& fit = options.drawer;
        number("--length", fit.length, "length of the drawer along the rails, mm");
        number("--width", fit.width, "width of the drawer, mm");
        number("--clearance", fit.clearance, "clearance of drawer and rail on each side, mm");
        number("--bar", fit.bar, "length of the bar, mm");
    } else if (scene == "pebbles") {
        number("--triangles", options.triangles, "number of triangles of each pebble, about");
    } else if (scene == "dental") {
        app::PocketFit& pocket = options.pocket;
        number("--depth", pocket.depth, "depth of the pocket, mm");
        number("--sulcus", pocket.sulcus, "depth of the gap elsewhere, mm");
        number("--width", pocket.width, "width of the pocket at the gum margin, mm");
        number("--bottom-width", pocket.bottomWidth, "width of the pocket at its bottom, mm");
        number("--stiffness", pocket.stiffness, "stiffness of the spring between hand and probe, N/m");
    }
}

/// Where the bunny and sphere trees come from, for scenes that use them.
void addSources(CLI::App& command, bool bunny, bool trees, app::SceneOptions& options) {
    if (bunny) command.add_option("--bunny", options.bunny, "the Stanford bunny as OBJ, of any size");
    if (trees) command.add_option("--tree-cache", options.treeCache, "folder in which sphere trees are kept");
}

/// The scene with its summary as description, and the clearance of its fit.
engine::Scene described(const app::SceneInfo& info, const app::SceneOptions& options) {
    engine::Scene scene = info.make(options);
    nlohmann::json& mark = (*scene.extras)["touchstone"];
    std::string text(info.summary);
    text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
    if (info.variants.size() > 1 && mark.is_object() && mark.contains("clearance_mm"))
        text += engine::formatted(", with %g mm of clearance on each side", mark["clearance_mm"].get<double>());
    mark["description"] = text + ".";
    return scene;
}

void writeBundled(const std::filesystem::path& folder, const app::SceneOptions& sources) {
    std::filesystem::create_directories(folder);
    for (const app::SceneInfo& scene : app::sceneTable())
        for (const app::SceneVariant& variant : app::bundledVariants(scene)) {
            app::SceneOptions options = sources;
            variant.choose(options);
            engine::writeGltf(described(scene, options), folder / (std::string(variant.name) + ".glb"));
        }
}

}  // namespace

int main(int argc, char** argv) {
    app::SceneOptions options;
    std::filesystem::path output;
    bool exported = false;

    CLI::App program{"Writes self-contained glTF scenes with parts, roles, demonstration and expected outcome."};
    program.require_subcommand(1);
    CLI::App* bundled = program.add_subcommand("bundled", "all scenes that are bundled with the program");
    bundled->add_option("-o,--output", output, "the folder to write to")->required();
    addSources(*bundled, true, true, options);
    for (const app::SceneInfo& scene : app::sceneTable()) {
        CLI::App* command = program.add_subcommand(std::string(scene.name), std::string(scene.summary));
        command->add_option("-o,--output", output, "the file to write, .glb or .gltf")->required();
        command->add_flag("--exported", exported,
                          "with the faults that exports of other programs have: coordinates of six decimals, vertices "
                          "that lie off their edge, slivers, doubles, inner walls");
        addOptions(*command, scene.name, options);
        addSources(*command, scene.name == "bunnies" || scene.name == "wedge",
                   scene.name == "bunnies" || scene.name == "pinch", options);
    }
    CLI11_PARSE(program, argc, argv);

    try {
        if (bundled->parsed()) writeBundled(output, options);
        for (const app::SceneInfo& scene : app::sceneTable())
            if (program.got_subcommand(std::string(scene.name))) {
                engine::Scene made = described(scene, options);
                if (exported) app::addFaults(made, app::kUsualFaults);
                engine::writeGltf(made, output);
            }
    } catch (const std::exception& error) {
        std::cerr << "make_scenes: " << error.what() << '\n';
        return 1;
    }
    return 0;
}
