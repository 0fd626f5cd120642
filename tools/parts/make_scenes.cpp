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
        if (scene.name == "bunnies" || scene.name == "wedge")
            command->add_option("--bunny", options.bunny, "the Stanford bunny as OBJ, of any size");
        if (scene.name == "bunnies" || scene.name == "pinch")
            command->add_option("--tree-cache", options.treeCache, "folder in which sphere trees are kept");
        if (scene.name == "spline") {
            app::SplineFit& fit = options.fit;
            command->add_option("--diameter", fit.diameter, "over the keys of the shaft, mm")->capture_default_str();
            command->add_option("--keys", fit.keys, "number of keys")->capture_default_str();
            command->add_option("--key-depth", fit.keyDepth, "from root to key top, mm")->capture_default_str();
            command->add_option("--key-width", fit.keyWidth, "between the flanks of a key, mm")->capture_default_str();
            command->add_option("--length", fit.length, "of the shaft, mm")->capture_default_str();
            command->add_option("--depth", fit.depth, "of the hole, mm")->capture_default_str();
            command->add_option("--clearance", fit.clearance, "between the surfaces on each side, mm")
                ->capture_default_str();
            command->add_option("--chamfer", fit.chamfer, "of the shaft's end and the hole's mouth, mm")
                ->capture_default_str();
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
