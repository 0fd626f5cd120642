// make_scenes: writes one of the scenes that come with the program, with its parameters.
#include <CLI/CLI.hpp>
#include <iostream>

#include "engine/scene/gltf_write.hpp"
#include "tools/parts/scenes.hpp"

int main(int argc, char** argv) {
    using namespace touchstone;
    app::SceneOptions options;
    std::filesystem::path output;

    CLI::App program{"Writes a self-contained glTF scene with its parts, roles, demonstration and expected outcome."};
    program.require_subcommand(1);
    for (const app::SceneInfo& scene : app::sceneTable()) {
        CLI::App* command = program.add_subcommand(std::string(scene.name), std::string(scene.summary));
        command->add_option("-o,--output", output, "the file to write, .glb or .gltf")->required();
        command->add_option("--leaves", options.leaves, "leaves of each body's sphere tree")
            ->check(CLI::Range(8, 65536));
        const auto number = [command](const char* name, auto& value, const char* help) {
            command->add_option(name, value, help)->capture_default_str();
        };
        if (scene.name == "bunnies" || scene.name == "wedge")
            command->add_option("--bunny", options.bunny, "the Stanford bunny as OBJ, of any size");
        if (scene.name == "bunnies" || scene.name == "pinch")
            command->add_option("--tree-cache", options.treeCache, "folder in which sphere trees are kept");
        if (scene.name == "spline") {
            app::SplineFit& fit = options.fit;
            number("--diameter", fit.diameter, "over the keys of the shaft, mm");
            number("--keys", fit.keys, "number of keys");
            number("--key-depth", fit.keyDepth, "from root to key top, mm");
            number("--key-width", fit.keyWidth, "between the flanks of a key, mm");
            number("--length", fit.length, "of the shaft, mm");
            number("--depth", fit.depth, "of the hole, mm");
            number("--clearance", fit.clearance, "between the surfaces on each side, mm");
            number("--chamfer", fit.chamfer, "of the shaft's end and the hole's mouth, mm");
        } else if (scene.name == "bayonet") {
            app::BayonetFit& fit = options.bayonet;
            number("--diameter", fit.diameter, "of the cap's body, mm");
            number("--lugs", fit.lugs, "number of lugs");
            number("--depth", fit.depth, "from the rim down to the lugs' way round, mm");
            number("--turn", fit.turn, "from going in to the pockets, rad");
            number("--clearance", fit.clearance, "of lugs and body on each side, mm");
        } else if (scene.name == "gears") {
            app::GearPair& fit = options.gears;
            number("--module", fit.module, "pitch diameter by number of teeth, mm");
            number("--fixed-teeth", fit.fixedTeeth, "of the fixed gear");
            number("--loose-teeth", fit.looseTeeth, "of the gear that is slid on");
            number("--width", fit.width, "of both gears along the axis, mm");
            number("--clearance", fit.clearance, "of a tooth in mesh and of the post, on each side, mm");
        } else if (scene.name == "hook") {
            app::HookAndEye& fit = options.hook;
            number("--wire", fit.wire, "thickness of hook and eye, mm");
            number("--bow", fit.bow, "radius of the hook's bend, mm");
            number("--eye", fit.eye, "radius of the ring, mm");
        } else if (scene.name == "lock") {
            app::LockFit& fit = options.lock;
            number("--bit-reach", fit.bitReach, "of the bit, from the axis, mm");
            number("--ward-reach", fit.wardReach, "of the notch's bottom, from the axis, mm");
            number("--ward-width", fit.wardWidth, "along the axis, mm");
            number("--turn", fit.turn, "of the key to its stop, rad");
            number("--clearance", fit.clearance, "of key and lock on each side, mm");
        }
        if (scene.name == "dental") {
            app::PocketFit& pocket = options.pocket;
            command->add_option("--depth", pocket.depth, "of the pocket, mm")->capture_default_str();
            command->add_option("--sulcus", pocket.sulcus, "depth of the gap elsewhere, mm")->capture_default_str();
            command->add_option("--width", pocket.width, "of the pocket at the gum margin, mm")->capture_default_str();
            command->add_option("--bottom-width", pocket.bottomWidth, "of its bottom, mm")->capture_default_str();
            command->add_option("--stiffness", pocket.stiffness, "of the spring between hand and probe, N/m")
                ->capture_default_str();
        }
    }
    CLI11_PARSE(program, argc, argv);

    try {
        for (const app::SceneInfo& scene : app::sceneTable())
            if (program.got_subcommand(std::string(scene.name))) engine::writeGltf(scene.make(options), output);
    } catch (const std::exception& error) {
        std::cerr << "make_scenes: " << error.what() << '\n';
        return 1;
    }
    return 0;
}
