// The commands run, validate, new and doctor; `tree` has its own file.
#include <sys/stat.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/scene/gltf_write.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "tests/program/program.hpp"

namespace touchstone::program_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

/// The press scene, with another outcome if one is given.
std::string pressFile(const Program& program, const json& outcome = nullptr) {
    engine::Scene made = pressScene();
    if (!outcome.is_null()) {
        json extras = *made.registry.get<engine::NodeMarking>(made.nodes[0]).extras;
        extras["touchstone"]["outcome"] = outcome;
        setExtras(made, made.nodes[0], extras);
    }
    engine::writeGltf(made, program.file("press.glb"));
    return program.file("press.glb");
}

}  // namespace

TEST_CASE("program: a headless run writes a complete report, and reproduces its hash", "[program]") {
    const Program touchstone;
    const std::string scene = pressFile(touchstone);
    const std::string run = "run " + scene + " --headless --report " + touchstone.file("report.json");
    // Late ticks are counted in runs that are paced by the clock.
    CHECK(touchstone(run + " --seconds 0.05 --paced").out.find("ticks ended late") != std::string::npos);
    CHECK(touchstone(run + " --seconds 0.05").out.find("ticks ended late") == std::string::npos);
    Answer answer = touchstone(run + " --ticks " + touchstone.file("ticks.csv"));
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    // Three lines for people, and all with --verbose.
    CHECK_THAT(answer.out, Contains("expected outcome: met") && Contains("force up to ") && !Contains("p99.9"));
    CHECK(std::count(answer.out.begin(), answer.out.end(), '\n') == 3);
    const json report = json::parse(textOf(touchstone.file("report.json")));
    CHECK(report.at("scene") == "press");
    CHECK(report.at("mode") == "default");
    CHECK(report.at("solver") == kExactName);
    CHECK(report.at("ticks") == 801);
    CHECK(report.at("overruns").is_null());
    CHECK(report.at("outcome").at("met") == true);
    CHECK(report.at("penetration_mm").at("max") <= 0.001);

    std::ifstream ticks(touchstone.file("ticks.csv"));
    std::string header, line;
    std::getline(ticks, header);
    CHECK_THAT(header, Contains("t_ms") && Contains("tool_x_mm") && Contains("force_x_N") && Contains("step_us"));
    int lines = 0;
    while (std::getline(ticks, line)) {
        ++lines;
        if (std::count(line.begin(), line.end(), ',') != std::count(header.begin(), header.end(), ',')) FAIL(line);
    }
    CHECK(lines == 801);

    answer = touchstone(run + " --shadow none --verbose");
    CHECK(answer.code == 0);
    CHECK_THAT(answer.out, Contains("p99.9") && Contains("hash " + report.at("hash").get<std::string>()) &&
                               Contains("ok    max_penetration_mm"));
    const json again = json::parse(textOf(touchstone.file("report.json")));
    CHECK(again.at("hash") == report.at("hash"));
    CHECK(again.at("shadow") == "none");
}

TEST_CASE("program: a sweep of the last tick is a table of every solver", "[program]") {
    const Program touchstone;
    const std::string run = "run " + pressFile(touchstone) + " --sweep " + touchstone.file("sweep.csv");
    const Answer answer = touchstone(run + " --headless --seconds 0.4 --set adaptive_margin=off");
    INFO(answer.err);
    REQUIRE((answer.code == 0 || answer.code == 3));
    const std::string table = textOf(touchstone.file("sweep.csv"));
    CHECK_THAT(table, Contains("tick,rows,mode,solver,tolerance,time_us,force_error_N"));
    for (const std::string& exact : solverNames(true)) CHECK_THAT(table, Contains("," + exact + ","));
    for (const std::string& approximate : solverNames(false)) CHECK_THAT(table, Contains("," + approximate + ",0.01,"));

    CHECK(touchstone(run + " --headless --seconds 0.001").code == 1);  // the only tick has no predecessor
    CHECK(touchstone(run).code == 2);
    CHECK(touchstone("run --plots everything").code == 2);
}

TEST_CASE("program: an outcome that is not met ends with 3 and says which", "[program]") {
    const Program touchstone;
    const Answer answer = touchstone("run " + pressFile(touchstone, {{"min_peak_force_N", 100}}) + " --headless");
    CHECK(answer.code == 3);
    CHECK_THAT(answer.out, Contains("NOT MET") && Contains("min_peak_force_N") && !Contains("  ok "));
}

TEST_CASE("program: the command line overrides the scene, --set overrides all, and paper mode sets its solver",
          "[program]") {
    const Program touchstone;
    engine::Scene made = pressScene();
    *made.extras = {{"touchstone", {{"settings", {{"margin", 0.4}, {"trust", 0.3}, {"rate", 500}}}}}};
    engine::writeGltf(made, touchstone.file("set.glb"));
    const auto settingsOf = [&](const std::string& args) {
        const Answer answer = touchstone("run " + touchstone.file("set.glb") + " --headless --seconds 0.02 --report " +
                                         touchstone.file("r.json") + " " + args);
        INFO(answer.err);
        REQUIRE(answer.code == 0);
        return json::parse(textOf(touchstone.file("r.json"))).at("settings");
    };
    json settings = settingsOf("");
    CHECK(settings.at("margin") == "0.4");
    CHECK(settings.at("rate") == "500");
    settings = settingsOf("--rate 250 --set margin=0.6 --set rate=1000");
    CHECK(settings.at("margin") == "0.6");
    CHECK(settings.at("trust") == "0.3");
    CHECK(settings.at("rate") == "1000");
    // Every setting is an option of its own.
    settings = settingsOf("--margin 0.6 --stiffness 2 --adaptive_margin off --iteration-cap 7");
    CHECK(settings.at("iteration_cap") == "7");
    CHECK(settings.at("margin") == "0.6");
    CHECK(settings.at("stiffness") == "2");
    CHECK(settings.at("adaptive_margin") == "off");
    CHECK(settingsOf("--stiffness 2 --set stiffness=0.5").at("stiffness") == "0.5");
    for (const SettingInfo& info : settingTable()) {
        INFO(info.key);
        const Answer wrong = touchstone("run press --headless --" + std::string(info.key) + " ?");
        CHECK(wrong.code == 2);
        CHECK_THAT(wrong.err, Contains(std::string(info.key)) && !Contains("not expected"));
    }
    settings = settingsOf("--mode paper");
    CHECK(settings.at("solver") == "pqp");
    CHECK(settings.at("shadow") == "none");
    CHECK(settings.at("tolerance") == "0.01");
    settings =
        settingsOf("--mode paper --solver " + kExactName + " --tolerance 0.5 --shadow " + solverNames(false).front());
    CHECK(settings.at("mode") == "paper");
    CHECK(settings.at("solver") == kExactName);
    CHECK(settings.at("shadow") == solverNames(false).front());
    CHECK(settings.at("tolerance") == "0.5");
}

TEST_CASE("program: validate reports how nodes were interpreted, and warns", "[program]") {
    const Program touchstone;
    Answer answer = touchstone("validate " + pressFile(touchstone));
    INFO(answer.err);
    CHECK(answer.code == 0);
    CHECK_THAT(answer.out, Contains("node 0 \"cube\" is the tool") && Contains("node 1 \"slab\" is an obstacle") &&
                               Contains("demonstration: 0.80 s") && Contains("valid"));
    CHECK_THAT(answer.out, Contains("slab: 85.4 mm across, a closed mesh of 12 triangles"));
    engine::Scene round = pressScene();
    *round.extras = {{"touchstone", {{"settings", {{"geometry", "spheres"}}}}}};
    engine::writeGltf(round, touchstone.file("round.glb"));
    answer = touchstone("validate " + touchstone.file("round.glb"));
    CHECK_THAT(answer.out, Contains("slab: 85.4 mm across") && Contains(" leaves (") &&
                               Contains("protrusion at most") && Contains("surface proven covered, closed"));
    engine::Scene lone;
    addBox(lone, "box", glm::vec3(0.01f), {{"role", "tool"}, {"colour", "red"}});
    engine::writeGltf(lone, touchstone.file("lone.glb"));
    answer = touchstone("validate " + touchstone.file("lone.glb"));
    CHECK(answer.code == 1);
    CHECK_THAT(answer.out, Contains("warning") && Contains("colour"));
    CHECK_THAT(answer.err, Contains("no node is an obstacle"));
    CHECK(isOneSentence(answer.err));
}

TEST_CASE("program: validate says valid alone only without a warning that matters", "[program]") {
    const Program touchstone;
    const auto lastOf = [&](const engine::Scene& scene) {
        engine::writeGltf(scene, touchstone.file("scene.glb"));
        const Answer answer = touchstone("validate " + touchstone.file("scene.glb"));
        INFO(answer.err);
        CHECK(answer.code == 0);
        const std::size_t at = answer.out.rfind("\nvalid");
        REQUIRE(at != std::string::npos);
        return answer.out.substr(at + 1);
    };
    CHECK(lastOf(pressScene()) == "valid\n");
    engine::Scene still = pressScene();
    still.animations.clear();
    drawTwice(still, still.nodes[1]);
    CHECK(lastOf(still) == "valid\n");  // no demonstration, and a repaired mesh

    still.registry.get<engine::LocalTransform>(still.nodes[0]).translation.y = 0.008;
    CHECK_THAT(lastOf(still), Catch::StartsWith("valid, with 1 warning:\n  warning: tool and obstacles overlap by "
                                                "2.000 mm at the start"));
    engine::Scene buried = downScene();
    CHECK(lastOf(buried) == "valid\n");  // at the goal the parts touch
    buried.registry.get<engine::LocalTransform>(buried.nodes[2]).translation.y =
        0.0099;  // 0.1 mm deep, less than is tolerated
    CHECK_THAT(lastOf(buried), Contains("valid, with 1 warning:") && Contains("overlap by 0.100 mm at the goal"));
    (*buried.extras)["touchstone"]["descripton"] = "misspelled";
    auto& primitive = buried.registry.get<engine::MeshInstance>(buried.nodes[1]).primitives[0];
    auto mesh = std::make_shared<engine::MeshData>(*primitive.mesh);
    mesh->indices.resize(mesh->indices.size() - 12);  // two faces, more than one cap closes
    primitive.mesh = mesh;
    const std::string all = lastOf(buried);
    CHECK_THAT(all, Contains("descripton") && Contains("touched by its spheres") && Contains("mm at the goal"));
    const auto count = static_cast<int>(std::count(all.begin(), all.end(), '\n')) - 1;
    CHECK_THAT(all, Catch::StartsWith("valid, with " + std::to_string(count) + " warnings:\n"));
}

TEST_CASE("program: validate lists the friction of each obstacle and the tool, and what was assumed", "[program]") {
    const Program touchstone;
    engine::Scene made = pressScene();
    addBox(made, "wall", glm::vec3(0.01f), {{"role", "obstacle"}}, {.translation = {0.1, 0, 0}});
    for (int node : {0, 1})
        addPhysics(made, made.nodes[std::size_t(node)],
                   {{"collider", {{"geometry", {{"node", node}}}, {"physicsMaterial", node}}}});
    (*made.registry.get<engine::NodeMarking>(made.nodes[0]).extensions)["KHR_physics_rigid_bodies"]["motion"] =
        json::object();
    json& materials = (*made.extensions)["KHR_physics_rigid_bodies"]["physicsMaterials"];
    materials = json::array({{{"name", "steel"}, {"staticFriction", 0.2}, {"dynamicFriction", 0.1}},
                             {{"staticFriction", 0.8}, {"dynamicFriction", 0.9}, {"frictionCombine", "maximum"}}});
    updateWorldTransforms(made);
    engine::writeGltf(made, touchstone.file("rough.glb"));
    const Answer answer = touchstone("validate " + touchstone.file("rough.glb"));
    INFO(answer.err);
    CHECK(answer.code == 0);
    CHECK_THAT(answer.out,
               Contains("\n  tool and slab: friction 0.55 at rest, 0.5 sliding, the average of both materials\n") &&
                   Contains("\n  tool and wall: no friction, since the obstacle sets none\n") &&
                   Contains("\n  physics material 0 \"steel\" sets no frictionCombine, so the defaults are used: "
                            "average\n") &&
                   Contains("warning: physics material 1: staticFriction 0.8 is below dynamicFriction 0.9, so that 0.9 "
                            "is used for both\n"));
    materials[1]["staticFriction"] = -1;
    engine::writeGltf(made, touchstone.file("wrong.glb"));
    const Answer wrong = touchstone("validate " + touchstone.file("wrong.glb"));
    CHECK(wrong.code == 1);
    CHECK(isOneSentence(wrong.err));
    CHECK_THAT(wrong.err, Contains("wrong.glb: physics material 1: ") &&
                              Contains("physicsMaterials[1].staticFriction must be a number from 0 to 1000"));
}

TEST_CASE("program: what was repaired in a mesh is said by validate, run, its report and tree", "[program]") {
    const Program touchstone;
    engine::Scene made = pressScene();
    drawTwice(made, made.nodes[1]);
    const std::string file = touchstone.file("twice.glb"), report = touchstone.file("report.json");
    engine::writeGltf(made, file);
    const auto said = Contains("node 1 \"slab\" was repaired: 12 duplicates dropped");
    CHECK_THAT(touchstone("validate " + file).out, said && !Contains("cube\" was repaired"));
    CHECK_THAT(touchstone("run " + file + " --headless --verbose --report " + report).out, said);
    const json repairs = json::parse(textOf(report)).at("repairs");
    REQUIRE(repairs.size() == 1);
    CHECK_THAT(repairs[0].get<std::string>(), said);
    const std::string tree = "tree " + file + " --part slab --leaves 64";
    CHECK_THAT(touchstone(tree).out, Contains("repaired: 12 duplicates dropped"));
    CHECK(json::parse(touchstone(tree + " --json").out).at("repairs").at("duplicates") == 12);
}

TEST_CASE("program: wrong usage is one sentence and exit code 2", "[program]") {
    const Program touchstone;
    const std::string scene = pressFile(touchstone);
    for (const std::string& args :
         std::vector<std::string>{"",
                                  "dance",
                                  "run " + scene + " --headless --frobnicate",
                                  "run " + scene + " --headless --seconds -1",
                                  "run " + scene + " --headless --mode papery",
                                  "run " + scene + " --headless --solver magic",
                                  "run " + scene + " --headless --shadow magic",
                                  "run " + scene + " --headless --set margin",
                                  "run " + scene + " --headless --set magin=1",
                                  "run " + scene + " --headless --set margin=wide",
                                  "run " + scene + " --headless --set trust=5",
                                  "run " + scene + " --headless --rate fast",
                                  "run " + scene + " --headless --mode paper --set friction=on",
                                  "run " + scene + " --headless --set friction=on --set mode=penalty",
                                  "run " + scene + " --headless --mode god-object --set friction_coefficient=0.2",
                                  "run " + scene + " --headless --set friction_scale=-1",
                                  "validate",
                                  "new --tool a.stl",
                                  "new --tool a.stl --obstacle b.stl --unit furlong -o c.glb",
                                  "new --tool a.stl --obstacle b.stl -o c.txt",
                                  "new --tool a.stl --obstacle b.stl -o c.glb --leaves 7",
                                  "new --tool a.stl --obstacle b.stl -o c.glb --leaves 64 --max-error 1mm",
                                  "new --tool a.stl --obstacle b.stl -o c.glb --max-error wide",
                                  "new --tool a.stl --obstacle b.stl -o c.glb --quality finest",
                                  "new --tool a.stl --obstacle b.stl -o c.glb --interior hollow"}) {
        INFO(args);
        const Answer answer = touchstone(args);
        INFO(answer.err);
        CHECK(answer.code == 2);
        CHECK(isOneSentence(answer.err));
    }
}

TEST_CASE("program: a misspelled name is answered with the nearest", "[program]") {
    const Program touchstone;
    const std::string protocol = touchstone.file("p.json");
    std::ofstream(protocol) << R"({"format": "touchstone trials", "version": 1, "participants": 1, "time_limit": 3,
                                   "conditions": [{"scene": "spline"}]})";
    const std::vector<std::pair<std::string, std::string>> cases{
        {"rnu bunnies", "no command 'rnu': did you mean 'run'?"},
        {"run bunies --headless", "no scene 'bunies': did you mean 'bunnies'?"},
        {"run bunnies --headless --set stifness=2", "no setting 'stifness': did you mean 'stiffness'?"},
        {"trials " + protocol + " --headless --out " + touchstone.file("out"), "did you mean 'time_limit_s'?"}};
    for (const auto& [args, expected] : cases) {
        const Answer answer = touchstone(args);
        INFO(args << "\n" << answer.err);
        CHECK(answer.code != 0);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Contains(expected));
    }
    CHECK_THAT(touchstone("dance").err, Contains("no command 'dance'") && !Contains("did you mean"));
}

TEST_CASE("program: a missing or unsuitable input is one sentence and exit code 1", "[program]") {
    const Program touchstone;
    const std::string scene = pressFile(touchstone);
    std::ofstream(touchstone.file("broken.glb")) << "glTF, they said";
    for (const std::string& args : std::vector<std::string>{
             "run /no/such/scene.glb --headless", "run nosuchscene --headless",
             "run " + touchstone.file("broken.glb") + " --headless", "run " + scene + " --headless --device joystick",
             "run " + scene + " --headless --device mouse", "run " + scene + " --headless --device replay:/no/such.csv",
             "run " + scene + " --headless --report /no/such/folder/r.json",
             "run " + scene + " --headless --ticks /no/such/folder/t.csv", "run " + scene,
             "new --tool /no/such.stl --obstacle /no/such.obj -o " + touchstone.file("n.glb")}) {
        INFO(args);
        const Answer answer = touchstone(args);
        INFO(answer.err);
        CHECK(answer.code == 1);
        CHECK(isOneSentence(answer.err));
    }
    CHECK_THAT(touchstone("run " + scene).err, Contains("no display") && Contains("--headless"));
}

TEST_CASE("program: a run that waits for no user ends with a sentence if the file has no roles", "[program]") {
    const Program touchstone;
    engine::Scene bare;
    addBox(bare, "cube", glm::vec3(0.01f));
    engine::updateWorldTransforms(bare);
    engine::writeGltf(bare, touchstone.file("bare.glb"));
    std::ofstream(touchstone.file("parts.step")) << "ISO-10303-21;";
    const auto [file, advice] = GENERATE(table<std::string, std::string>(
        {{"bare.glb", "no node is the tool: set extras.touchstone.role"}, {"parts.step", "touchstone new"}}));
    for (const std::string options : {" --headless", " --headless --seconds 1", " --seconds 1"}) {
        INFO(file + options);
        const Answer answer = touchstone("run " + file + options, "DISPLAY=:none");
        INFO(answer.err);
        CHECK(answer.code == 1);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Contains(file + ": ") && Contains(advice));
    }
}

TEST_CASE("program: help and version need no scene, and every command has its own examples", "[program]") {
    const Program touchstone;
    CHECK_THAT(touchstone("--version").out, Contains("touchstone 0."));
    const Answer help = touchstone("--help");
    CHECK(help.code == 0);
    for (const char* word : {"run", "validate", "doctor", "new", "Examples"}) CHECK_THAT(help.out, Contains(word));
    const Answer settings = touchstone("run --help-settings");
    CHECK(settings.code == 0);
    for (const char* key : {"margin", "travel_budget", "shadow_rows"}) CHECK_THAT(settings.out, Contains(key));
    for (const SolverInfo& solver : solverTable()) CHECK_THAT(settings.out, Contains(std::string(solver.name)));
    CHECK_THAT(touchstone("run --help").out, Contains("--screenshot") && Contains("replay:hand.csv"));
    // Every command has its own examples, not those of the program.
    std::size_t commands = 0;
    for (const std::string& command : std::vector<std::string>{
             "run",    "validate",       "fit",    "doctor",   "new",       "tree",        "tree check",
             "qp",     "export",         "verify", "recover",  "soak",      "compare",     "paper",
             "trials", "trials summary", "bench",  "bench qp", "bench gpu", "bench merge", "referee"}) {
        INFO(command);
        const Answer answer = touchstone(command + " --help");
        CHECK(answer.code == 0);
        CHECK_THAT(answer.out, Contains("Example") && Contains("\n  touchstone " + command));
        CHECK_THAT(answer.out, !Contains("Exit codes:"));
        if (command.find(' ') == std::string::npos) {
            ++commands;
            CHECK_THAT(help.out, Contains("\n  " + command + " "));
        }
    }
    const std::string listed =
        help.out.substr(help.out.find("Subcommands:"),
                        help.out.find("\n\n", help.out.find("Subcommands:")) - help.out.find("Subcommands:"));
    std::size_t rows = 0;
    for (std::size_t at = 0; (at = listed.find("\n  ", at)) != std::string::npos; ++at) rows += listed[at + 3] != ' ';
    CHECK(rows == commands);
}

TEST_CASE("program: doctor examines every part", "[program]") {
    const Program touchstone;
    const Answer answer = touchstone("doctor");
    // 1.1 k T (0.5 + d), in N·s/m.
    CHECK_THAT(touchstone("doctor --stiffness 2 --rate 500").out, Contains("2.2 N·s/m without delay, 6.6 with d = 1"));
    for (const char* what : {"processor", "cores", "SIMD", "scheduling", "pictures", "window", "device", "passivity",
                             "bunny", "scenes", "cache"})
        CHECK_THAT(answer.out, Contains(what));
    CHECK(answer.err.empty());
    double runtime = -1, period = 1;  // µs in which real-time threads may use a processor, of how many
    std::ifstream("/proc/sys/kernel/sched_rt_runtime_us") >> runtime;
    std::ifstream("/proc/sys/kernel/sched_rt_period_us") >> period;
    const bool throttled = answer.out.find("SCHED_FIFO and locked memory are allowed") != std::string::npos &&
                           runtime >= 0 && runtime < period;
    CHECK((answer.out.find("kernel.sched_rt_runtime_us=-1") != std::string::npos) == throttled);

    // Wrapped to the terminal, without a word lost.
    const Answer narrow = touchstone("doctor", "COLUMNS=80");
    std::istringstream lines(narrow.out), words(narrow.out), same(answer.out);
    int continued = 0;
    for (std::string line; std::getline(lines, line);) {
        INFO(line);
        const auto width = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
        CHECK((width <= 80 || line.find(' ', 18) == std::string::npos));  // a path is not broken
        continued += line.rfind(std::string(18, ' '), 0) == 0;
    }
    CHECK(continued > 5);
    CHECK(std::equal(std::istream_iterator<std::string>(words), {}, std::istream_iterator<std::string>(same), {}));
}

TEST_CASE("program: a scene in millimeters is asked about, and new scales it", "[program]") {
    const Program touchstone;
    engine::Scene scene;
    addBox(scene, "peg", glm::vec3(10), {{"role", "tool"}}, {.translation = {0, 20, 0}});
    addBox(scene, "plate", {40, 10, 40}, {{"role", "obstacle"}});
    engine::updateWorldTransforms(scene);
    engine::writeGltf(scene, touchstone.file("mm.glb"));
    Answer answer = touchstone("validate " + touchstone.file("mm.glb"));
    CHECK_THAT(answer.out, Contains("\"plate\" is 57.4 m across: should it be 57.4 mm, as if millimeters") &&
                               Contains("touchstone new --scene " + touchstone.file("mm.glb") + " --scale 0.001"));
    answer = touchstone(commandIn(answer.out));
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    answer = touchstone("validate mm-scaled.glb");
    CHECK_THAT(answer.out, !Contains("should it be"));
    answer = touchstone("tree mm-scaled.glb --leaves 64 --json");
    CHECK(json::parse(answer.out.substr(0, answer.out.find('\n'))).at("diagonal_mm") == Approx(10 * std::sqrt(3)));
    CHECK(touchstone("new --scene " + touchstone.file("mm.glb") + " --scale 0 -o " + touchstone.file("0.glb")).code ==
          2);
    CHECK(touchstone("new -o " + touchstone.file("0.glb")).code == 2);

    // Two motions of one node: one cannot be scaled, so that no command is offered.
    for (int i = 0; i < 2; ++i)
        scene.animations.push_back(translation(scene.nodes[0], {0, 1}, {{0, 20, 0, 0}, {0, 5, 0, 0}}));
    engine::writeGltf(scene, touchstone.file("moved.glb"));
    CHECK_THAT(touchstone("validate moved.glb").out,
               Contains("should it be") && Contains("scale it where it was made") && !Contains("--scene"));
    answer = touchstone("new --scene moved.glb --scale 0.001 -o 0.glb");
    CHECK(answer.code == 1);
    CHECK(isOneSentence(answer.err));
    CHECK_THAT(answer.err, Contains("several motions"));
}

TEST_CASE("program: new scales clearances with the parts, also those under flat keys", "[program]") {
    const Program touchstone;
    engine::Scene scene;
    addBox(scene, "peg", glm::vec3(1), {{"role", "tool"}, {"cad", {{"deviation_mm", 2}, {"clearance_mm", 20}}}});
    addBox(scene, "plate", {4, 1, 4}, {{"role", "obstacle"}}, {.translation = {0, -2, 0}});
    *scene.extras = {{"touchstone_clearance_mm", 50}};
    engine::updateWorldTransforms(scene);
    engine::writeGltf(scene, touchstone.file("large.glb"));
    const Answer answer = touchstone("new --scene large.glb --scale 0.01 -o small.glb");
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    sandbox::SceneOptions options;
    options.buildWorld = false;
    const sandbox::HapticScene small = sandbox::openScene(touchstone.file("small.glb"), options);
    REQUIRE(small.roles.clearance);
    CHECK(*small.roles.clearance == Approx(0.5));
    const auto& cad = small.scene.registry.get<sandbox::BodyMarking>(small.roles.tool).cad;
    REQUIRE(cad);
    CHECK(cad->deviation == Approx(0.02));
    CHECK(cad->clearance.value() == Approx(0.2));
}

TEST_CASE("program: a scaled scene is the scene that was made in the right unit", "[program]") {
    const Program touchstone;
    // The scene of inches that were taken for millimeters, scaled as it says, and the same made with inches.
    const auto box = [&](const std::string& name, const glm::dvec3& low, const glm::dvec3& high) {
        std::ofstream out(touchstone.file(name));
        for (int i = 0; i < 8; ++i)
            out << "v " << (i & 1 ? high.x : low.x) << ' ' << (i & 2 ? high.y : low.y) << ' '
                << (i & 4 ? high.z : low.z) << '\n';
        out << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    };
    box("tool.obj", {-0.25, 0, -0.25}, {0.25, 1.5, 0.25});
    box("plate.obj", {-1, -1, -1}, {1, 0, 1});
    const std::string options[]{"", " --goal 0.01,0.02", " --goal 0.01,0.02 --demo"};
    for (const std::string& each : options) {
        INFO(each);
        const std::string parts = "new --tool tool.obj --obstacle plate.obj" + each;
        const Answer wrong = touchstone(parts + " -o wrong.glb");
        REQUIRE(wrong.code == 0);
        REQUIRE(touchstone(parts + " --unit in -o right.glb").code == 0);
        const Answer scaled = touchstone(commandIn(wrong.out));
        INFO(wrong.out << scaled.err);
        REQUIRE(scaled.code == 0);
        // Without the name, which comes first; of a fit the verdict, since corners are equally near.
        const auto saidBy = [&](const std::string& command, const std::string& name) {
            const std::string text = touchstone(command + " " + name + ".glb").out;
            if (text.empty()) return text;  // a scene without a goal has no fit
            const std::size_t end = text.find('\n');
            return command == "validate" ? text.substr(end) : text.substr(name.size(), end - name.size());
        };
        for (const char* command : {"validate", "fit"})
            CHECK(saidBy(command, "wrong-scaled") == saidBy(command, "right"));
        const sandbox::HapticScene one = sandbox::openScene(touchstone.file("wrong-scaled.glb")),
                                   other = sandbox::openScene(touchstone.file("right.glb"));
        CHECK((sandbox::startPose(one).p - sandbox::startPose(other).p).norm() < 1e-4);
        REQUIRE(one.roles.goal.has_value() == !each.empty());
        if (each.empty()) continue;
        CHECK((one.roles.goal->X_WT.p - other.roles.goal->X_WT.p).norm() < 1e-4);
        CHECK(one.roles.goal->tolerance == Approx(other.roles.goal->tolerance));
        CHECK(one.roles.goal->depth == Approx(other.roles.goal->depth));
        REQUIRE(bool(one.demonstration) == bool(other.demonstration));
        for (double t = 0; one.demonstration && t < 5000; t += 250)
            CHECK((one.demonstration->at(t).p - other.demonstration->at(t).p).norm() < 1e-4);
    }
}

TEST_CASE("program: new makes a scene from two parts in millimeters", "[program]") {
    const Program touchstone;
    // A tetrahedron with edges of 20 mm along the axes, the obstacle twice as large.
    const auto write = [&](const std::string& name, int edge) {
        std::ofstream out(touchstone.file(name));
        out << "v 0 0 0\nv " << edge << " 0 0\nv 0 " << edge << " 0\nv 0 0 " << edge
            << "\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    };
    write("a.obj", 20);
    write("b.obj", 40);
    Answer answer = touchstone("new --tool " + touchstone.file("a.obj") + " --obstacle " + touchstone.file("b.obj") +
                               " --unit mm --leaves 64 -o " + touchstone.file("ab.glb"));
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    CHECK_THAT(answer.out, Contains("20 x 20 x 20 mm") && Contains("40 x 40 x 40 mm"));
    answer = touchstone("validate " + touchstone.file("ab.glb"));
    INFO(answer.err);
    CHECK(answer.code == 0);
    CHECK_THAT(answer.out, Contains("\"a\" is the tool (64 leaves, fast, shell)") && Contains("\"b\" is an obstacle") &&
                               !Contains("overlap by") && Contains("demonstration: none"));
    // 1 % of the diagonals of 20 and 40 mm cubes.
    const std::string asked = "new --tool " + touchstone.file("a.obj") + " --obstacle " + touchstone.file("b.obj") +
                              " --quality best --interior solid -o " + touchstone.file("ab.gltf");
    answer = touchstone(asked + " --max-error 1%");
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    const json nodes = json::parse(textOf(touchstone.file("ab.gltf"))).at("nodes");
    for (const auto& [node, edge] : {std::pair{0, 20}, std::pair{2, 40}}) {
        const json mark = nodes[node].at("extras").at("touchstone");
        CHECK(mark.at("max_error_mm").get<double>() == Approx(0.01 * edge * std::sqrt(3.)));
        CHECK(mark.at("quality") == "best");
        CHECK(mark.at("interior") == "solid");
        CHECK_FALSE(mark.contains("leaves"));
    }
    answer = touchstone(asked + " --max-error 0.5mm");
    CHECK(answer.code == 0);
    answer = touchstone("validate " + touchstone.file("ab.gltf"));
    INFO(answer.err);
    CHECK(answer.code == 0);
    CHECK_THAT(answer.out,
               Contains("is the tool (protrusion at most 0.5 mm, best, solid)") && Contains("a closed mesh of"));
    // Parts of 20 m are the usual sign of a wrong unit.
    answer = touchstone("new --tool " + touchstone.file("a.obj") + " --obstacle " + touchstone.file("b.obj") +
                        " --unit m --leaves 64 -o " + touchstone.file("ab.glb"));
    CHECK_THAT(answer.out, Contains("warning") && Contains("is its unit right?") && Contains("--unit mm"));
}

TEST_CASE("program: a picture needs no display, and shows the largest force unless a time is given", "[program][gl]") {
    const Program touchstone;
    const std::string press = pressFile(touchstone);
    const auto pictureOf = [&](const std::string& run) {
        fs::remove(touchstone.file("p.png"));
        const Answer answer = touchstone("run " + run + " --headless --screenshot " + touchstone.file("p.png"));
        INFO(answer.err);
        CHECK(answer.code == 0);
        const std::string picture = textOf(touchstone.file("p.png"));
        CHECK(picture.rfind("\x89PNG", 0) == 0);
        return std::pair(answer.out, picture);
    };
    const auto [timed, atTime] = pictureOf(press + " --seconds 0.4");
    CHECK_THAT(timed, Contains("picture at 0.399 s, the last tick: "));
    const auto [out, strongest] = pictureOf(press);
    CHECK_THAT(out, Contains("s, where the force is largest: " + touchstone.file("p.png")));
    double seconds = 0;
    REQUIRE(std::sscanf(out.substr(out.find("picture at")).c_str(), "picture at %lf", &seconds) == 1);
    CHECK(seconds >= 0.2);  // from 0.2 s to 0.6 s it is pressed 2 mm deep
    CHECK(seconds <= 0.6);
    const auto [again, same] = pictureOf(press + " --seconds " + std::to_string(seconds + 0.001));
    CHECK(same == strongest);
    CHECK(pictureOf(press + " --seconds 0.801").second != strongest);

    // Three pictures: before, at the largest force, as above, and at the end.
    CHECK_THAT(touchstone("run " + press + " --headless --pictures " + touchstone.file("three")).out,
               Contains("pictures of the start, the largest force and the end: "));
    CHECK(textOf(touchstone.file("three/2-contact.png")) == strongest);
    CHECK(textOf(touchstone.file("three/3-end.png")) == pictureOf(press + " --seconds 0.801").second);
    CHECK(textOf(touchstone.file("three/1-before.png")) == pictureOf(press + " --seconds 0.001").second);
    CHECK(touchstone("run " + press + " --pictures x").code == 2);

    engine::Scene clear = pressScene();
    for (glm::dvec4& p : clear.animations[0].channels[0].values) p.y += 0.02;
    (*clear.registry.get<engine::NodeMarking>(clear.nodes[0]).extras)["touchstone"].erase("outcome");
    engine::writeGltf(clear, touchstone.file("clear.glb"));
    CHECK_THAT(pictureOf(touchstone.file("clear.glb")).first,
               Contains("  the tool touched nothing;") && !Contains("force up to") &&
                   Contains("picture at 0.800 s, the last tick, since the tool touched nothing: "));
}

TEST_CASE("program: without a demonstration the tool rests at its start, and each refusal names a device that works",
          "[program][gl]") {
    const Program touchstone;
    engine::Scene still = pressScene();
    still.animations.clear();
    engine::writeGltf(still, touchstone.file("still.glb"));
    const std::string run = "run " + touchstone.file("still.glb") + " --headless";
    Answer answer = touchstone(run + " --screenshot " + touchstone.file("p.png") + " --report " +
                               touchstone.file("report.json") + " --ticks " + touchstone.file("ticks.csv"));
    INFO(answer.err);
    CHECK(answer.code == 0);
    CHECK(textOf(touchstone.file("p.png")).rfind("\x89PNG", 0) == 0);
    const json report = json::parse(textOf(touchstone.file("report.json")));
    CHECK(report.at("device") == "rest");
    CHECK(report.at("ended") == "motion");
    CHECK(report.at("ticks") == 1);
    CHECK(touchstone(run + " --seconds 0.1").out.find("100 ticks") != std::string::npos);

    for (const std::string device : {"demo", "mouse", "hand"}) {
        INFO(device);
        answer = touchstone(run + " --device " + device);
        CHECK(answer.code == 1);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Contains("the device rest"));
    }
    CHECK(touchstone(run + " --device rest").code == 0);
    answer = touchstone("run " + pressFile(touchstone) + " --headless --device mouse");
    CHECK_THAT(answer.err, Contains("the device demo"));
    CHECK_THAT(touchstone("validate " + touchstone.file("still.glb")).out, Contains("rests at its start"));
}

TEST_CASE("program: what a picture shows and from where is checked before anything runs", "[program]") {
    const Program touchstone;
    const std::string run = "run " + pressFile(touchstone) + " --headless --seconds 0.1 ";
    Answer answer = touchstone(run + "--show contacts,halo");
    CHECK(answer.code == 2);
    CHECK_THAT(answer.err, Contains("'halo'") && Contains("clearance"));
    answer = touchstone(run + "--view behind");
    CHECK(answer.code == 2);
    CHECK_THAT(answer.err, Contains("'behind'") && Contains("front"));
}

TEST_CASE("program: numbers that are not finite, or out of range, are refused by every option", "[program]") {
    const Program touchstone;
    const std::string scene = pressFile(touchstone);
    for (const char* value : {"nan", "-nan", "inf", "1e308", "1e999", "-1", "0", "1x", "''"})
        for (const std::string& command :
             {"run " + scene + " --headless --seconds", "compare " + scene + " --seconds",
              std::string("soak --seconds"), std::string("doctor --rate"), std::string("doctor --stiffness"),
              "run " + scene + " --headless --rate", "run " + scene + " --headless --set stiffness=1 --tolerance",
              "run " + scene + " --ui-scale", "tree " + scene + " --max-error"}) {
            INFO(command << ' ' << value);
            if (*value == '\'' && command.ends_with("max-error")) continue;  // an empty --max-error means none
            const Answer answer = touchstone(command + " " + value);
            CHECK(answer.code == 2);
            CHECK(isOneSentence(answer.err));
            CHECK(answer.out.empty());
        }
    CHECK_THAT(touchstone("run " + scene + " --ui-scale 9").err, Contains("--ui-scale") && Contains("from 0.5 to 4"));
    CHECK_THAT(touchstone("run " + scene + " --ui-scale 2 --headless").err, Contains("leave out --headless"));
    for (const char* hand : {"nan,500,14,0", "0.1,inf,14,0", "0.1,500,1e308,0", "0.1,500,14,nan"}) {
        INFO(hand);
        const Answer answer = touchstone("run " + scene + " --headless --device hand:" + hand);
        CHECK(answer.code == 1);
        CHECK(isOneSentence(answer.err));
    }
}

TEST_CASE("program: an empty box in an outcome is refused", "[program]") {
    const Program touchstone;
    const Answer answer = touchstone(
        "run " + pressFile(touchstone, {{"tool_within_m", {{"min", {0, 0, 1}}, {"max", {1, 1, 0}}}}}) + " --headless");
    CHECK(answer.code == 1);
    CHECK_THAT(answer.err, Contains("tool_within_m.min must be at most max"));
    CHECK(isOneSentence(answer.err));
}

TEST_CASE("program: an output that cannot be written ends with 1 and the reason, and no file is incomplete",
          "[program]") {
    const Program touchstone;
    const std::string scene = pressFile(touchstone);
    const std::string run = "run " + scene + " --headless --seconds 0.3";
    REQUIRE(touchstone(run).code == 0);  // the trees are now in the cache
    for (const char* option : {"--report", "--ticks", "--screenshot", "--dump-qp", "--sweep"}) {
        INFO(option);
        const Answer answer = touchstone(run + " " + option + " /dev/full");
        CHECK(answer.code == 1);
        CHECK_THAT(answer.err, Contains("'/dev/full'") || Contains("/dev/full:"));
        CHECK_THAT(answer.err, Contains("No space left on device"));
        // Files cannot grow beyond 2 blocks, as on a full disk.
        const std::string file = touchstone.file("output");
        std::ofstream(file) << "earlier";
        const Answer limited =
            touchstone(run + " " + option + " " + file, "sh -c 'trap \"\" XFSZ; ulimit -f 2; exec \"$@\"' -");
        CHECK(limited.code == 1);
        CHECK_THAT(limited.err, Contains(file) && Contains("File too large"));
        CHECK(textOf(file) == "earlier");
    }
    CHECK(touchstone(run + " >/dev/full").code == 1);
    CHECK(touchstone("doctor >/dev/full").code == 1);
    CHECK(touchstone("--help >/dev/full").code == 1);
    CHECK_THAT(touchstone("validate " + scene + " >/dev/full").err, Contains("cannot write to the output stream"));
    for (const fs::directory_entry& entry : fs::directory_iterator(fs::path(scene).parent_path()))
        CHECK(entry.path().extension() != ".part");
}

TEST_CASE("program: a motion through the hole is told as such, and a hand lets no tool fall", "[program]") {
    const Program touchstone;
    engine::Scene scene;
    const engine::Entity peg =
        addBox(scene, "peg", glm::vec3(0.01f), {{"role", "tool"}, {"leaves", 64}}, {.translation = {0, 0.02, 0}});
    scene.animations.push_back(translation(peg, {0, 0.4}, {{0, 0.02, 0, 0}, {0, -0.02, 0, 0}}));
    // A square hole of 14 mm through a plate of 10 mm: nothing stops the peg at the goal.
    const engine::Entity plate = addNode(scene, "plate", {}, {});
    setExtras(scene, plate, {{"touchstone", {{"role", "obstacle"}, {"leaves", 512}}}});
    for (const double side : {-1.0, 1.0}) {
        addBox(scene, "x", {0.02f, 0.01f, 0.054f}, nullptr, {.translation = {side * 0.017, 0, 0}}, plate);
        addBox(scene, "z", {0.014f, 0.01f, 0.02f}, nullptr, {.translation = {0, 0, side * 0.017}}, plate);
    }
    const engine::Entity goal = addNode(scene, "seat", {}, {});
    setExtras(scene, goal, {{"touchstone", {{"role", "goal"}, {"goal", {{"tolerance_m", 0.001}, {"depth_m", 0.01}}}}}});
    engine::updateWorldTransforms(scene);
    engine::writeGltf(scene, touchstone.file("through.glb"));
    for (const char* device : {"demo", "insert:1", "insert:3", "insert:5"}) {
        INFO(device);
        const std::string run = "run " + touchstone.file("through.glb") + " --headless --device " + device;
        const Answer answer = touchstone(run + " --report " + touchstone.file("report.json"));
        CHECK(answer.code == 0);
        const json report = json::parse(textOf(touchstone.file("report.json")));
        CHECK(report.at("ended") == "motion");
        CHECK(report.at("ticks") < 60'000);
        const bool fell = std::string(device) == "demo";
        CHECK((answer.out.find("the tool fell through: it was") != std::string::npos) == fell);
        CHECK(report.contains("fell_past_goal_mm") == fell);
        if (fell) CHECK(report.at("fell_past_goal_mm") > 10);
    }
}

TEST_CASE("program: a headless run always ends, and reports the reason", "[program]") {
    const Program touchstone;
    const std::string run = "run " + pressFile(touchstone) + " --headless --report " + touchstone.file("report.json");
    const auto ended = [&](const std::string& options, int ticks) {
        const Answer answer = touchstone(run + options);
        INFO(answer.out << answer.err);
        CHECK(answer.code == 0);
        const json report = json::parse(textOf(touchstone.file("report.json")));
        CHECK(report.at("ticks") == ticks);
        return report.at("ended").get<std::string>();
    };
    CHECK(ended("", 801) == "motion");
    CHECK(ended(" --seconds 0.2", 200) == "seconds");
    CHECK(ended(" --seconds 2", 2000) == "seconds");  // the last pose holds
    // A motion of more than a day counts as one without an end, as what a person moves, which is paced by the clock.
    std::ofstream(touchstone.file("days.csv"))
        << "t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,0,15,0,1,0,0,0\n1e8,0,16,0,1,0,0,0\n";
    CHECK(ended(" --device replay:days.csv", 60'000) == "limit");
}

TEST_CASE("program: a failing output does not affect others, and no output replaces another", "[program]") {
    const Program touchstone;
    const std::string scene = pressFile(touchstone), report = touchstone.file("report.json"),
                      picture = touchstone.file("picture.png");
    const Answer answer =
        touchstone("run " + scene + " --headless --seconds 0.02 --ticks /dev/full --dump-qp /dev/full " + "--sweep " +
                   touchstone.file("sweep.csv") + " --report " + report + " --screenshot " + picture);
    CHECK(answer.code == 1);
    CHECK_THAT(answer.out, Contains("20 ticks at 1000 Hz"));
    CHECK_THAT(answer.err, Contains("cannot write the ticks to '/dev/full'") && Contains("there is nothing to sweep"));
    CHECK(json::parse(textOf(report)).at("ticks") == 20);
    CHECK(fs::file_size(picture) > 1000);
    for (const std::string& two : std::vector<std::string>{" --report same --ticks same",
                                                           " --screenshot same --sweep ./same", " --report " + scene}) {
        INFO(two);
        const Answer refused = touchstone("run " + scene + " --headless --seconds 0.02" + two);
        CHECK(refused.code == 2);
        CHECK(isOneSentence(refused.err));
    }
    CHECK(touchstone("run " + scene + " --headless --seconds 0.02 --ticks /dev/null --report /dev/null").code == 0);
}

TEST_CASE("program: a tool that is held because of invalid poses meets no outcome", "[program]") {
    const Program touchstone;
    std::ofstream(touchstone.file("far.csv"))
        << "t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,0,15,0,1,0,0,0\n100,1e30,15,0,1,0,0,0\n";
    const std::string run = "run " + pressFile(touchstone, {{"max_penetration_mm", 1}}) + " --headless --report " +
                            touchstone.file("report.json");
    const Answer answer = touchstone(run + " --device replay:" + touchstone.file("far.csv"));
    CHECK(answer.code == 3);
    CHECK_THAT(answer.out, Contains("ticks with an invalid pose") && Contains("NOT MET"));
    CHECK(json::parse(textOf(touchstone.file("report.json"))).at("invalid_poses") == 100);
    CHECK(touchstone(run).code == 0);
}

TEST_CASE("program: folders and pipes instead of files are reported as such", "[program]") {
    const Program touchstone;
    const std::string folder = touchstone.file("folder.gltf"), pipe = touchstone.file("pipe.csv");
    fs::create_directory(folder);
    REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
    CHECK_THAT(touchstone("validate " + folder).err, Contains("is a folder"));
    CHECK_THAT(touchstone("validate " + pipe).err, Contains("is a pipe"));
    for (const std::string& motion : {pipe, std::string("/dev/zero")})
        CHECK_THAT(touchstone("run " + pressFile(touchstone) + " --headless --device replay:" + motion).err,
                   Contains("is not a regular file"));
}

}  // namespace touchstone::program_tests
