// `touchstone tree` with wrong input, when it is stopped, and with a damaged cache.
#include <fcntl.h>
#include <pty.h>
#include <spawn.h>
#include <unistd.h>

#include <csignal>
#include <map>

#include "engine/scene/mesh_file.hpp"
#include "tests/program/tree_program.hpp"

namespace touchstone::tree_refusals_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;

TEST_CASE("program: wrong usage of tree is one sentence and exit code 2, and writes nothing", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile(), scene = partsScene(touchstone), out = touchstone.file("out");
    for (const std::string& args : std::vector<std::string>{"",
                                                            egg + " --leaves 10 --levels 2",
                                                            egg + " --leaves 10 --max-error 1mm",
                                                            egg + " --levels 2 --max-error 1%",
                                                            egg + " --leaves 0",
                                                            egg + " --leaves 262145",
                                                            egg + " --leaves many",
                                                            egg + " --levels 0",
                                                            egg + " --levels 8",
                                                            egg + " --max-error 0",
                                                            egg + " --max-error -1mm",
                                                            egg + " --max-error nan",
                                                            egg + " --max-error 1cm",
                                                            egg + " --max-error 0.1%%",
                                                            egg + " --max-error ''%",
                                                            egg + " --quality finest",
                                                            egg + " --interior hollow",
                                                            egg + " --seed -1",
                                                            egg + " --threads 0",
                                                            egg + " --unit furlong",
                                                            egg + " --part lid",
                                                            scene + " --unit mm",
                                                            scene + " -o " + out,
                                                            scene + " --export " + out,
                                                            scene + " --import " + out,
                                                            scene + " --picture " + out,
                                                            egg + " --import " + out + " --leaves 8",
                                                            egg + " --import " + out + " --seed 2",
                                                            egg + " --frobnicate",
                                                            "check",
                                                            "check a.sph",
                                                            "check a.sph " + scene,
                                                            "check a.sph " + egg + " --samples 1",
                                                            "check a.sph " + egg + " --poses 0"}) {
        INFO(args);
        const Answer answer = touchstone("tree " + args);
        INFO(answer.err);
        CHECK(answer.code == 2);
        CHECK(isOneSentence(answer.err));
        CHECK(answer.out.empty());
    }
    CHECK_FALSE(fs::exists(out));
    CHECK_THAT(touchstone("tree " + scene + " -o " + out).err,
               Contains("3 parts") && Contains("--part (peg, wall, wall)"));
}

TEST_CASE("program: a missing or unsuitable input of tree is one sentence and exit code 1", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile(), scene = partsScene(touchstone);
    std::vector<Corners> broken = test::egg(4, 4);
    broken[5][1].y = std::nanf("");
    engine::Scene nothing;
    addNode(nothing, "nothing");
    engine::writeGltf(nothing, touchstone.file("nothing.glb"));
    touchstone.tree(egg + " --leaves 16 -o " + touchstone.file("egg.spheres"));
    std::string damaged = textOf(touchstone.file("egg.spheres"));
    damaged[damaged.size() / 2] ^= 1;
    const std::map<std::string, std::string> sentences{
        {"/no/such.obj", "/no/such.obj"},
        {"nosuchscene", "nosuchscene"},
        {touchstone.with("mesh.step", "ISO-10303-21;\n"),
         "neither a mesh (" + engine::meshExtensionWords("or") + ") nor a scene (.glb or .gltf)"},
        {touchstone.with("nan.stl", binaryStlOf(broken)), "non-finite"},
        {touchstone.with("nan.obj", "v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n"), "nan.obj"},
        {touchstone.with("range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), "range.obj"},
        {touchstone.with("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), "line"},
        {touchstone.with("points.obj", "v 0 0 0\n"), "points.obj"},
        {touchstone.file("nothing.glb"), "triangle"},
        {scene + " --part lid", "'lid'"},
        {scene + " --part wall", "several nodes"},
        {scene + " --part empty", "no triangles"},
        {egg + " -o /no/such/folder/egg.spheres", "/no/such/folder"},
        {egg + " --export /no/such/folder/egg.sph", "/no/such/folder"},
        {egg + " --picture /no/such/folder/egg.png", "/no/such/folder"},
        {egg + " --import /no/such.sph", "/no/such.sph"},
        {egg + " --import " + touchstone.with("words.sph", "these are words\n"), "words.sph"},
        {egg + " --max-error 1e-9%", "egg"},
        {"check /no/such.sph " + egg, "/no/such.sph"},
        {"check /no/such.spheres " + egg, "/no/such.spheres"},
        {"check " + touchstone.with("damaged.spheres", damaged) + " " + egg, "damaged"},
        {"check " + touchstone.file("egg.spheres") + " /no/such.obj", "/no/such.obj"},
    };
    for (const auto& [args, words] : sentences) {
        INFO(args);
        const Answer answer = touchstone("tree " + args);
        INFO(answer.err);
        CHECK(answer.code == 1);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Contains(words));
        CHECK(answer.out.empty());
    }
}

TEST_CASE("program: tree reports a damaged tree in the cache, and builds it again", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile();
    touchstone.tree(egg + " --leaves 16");
    for (const auto& entry : fs::directory_iterator(touchstone.file("cache"))) fs::resize_file(entry.path(), 20);
    const Answer answer = touchstone("tree " + egg + " --leaves 16");
    CHECK(answer.code == 0);
    CHECK_THAT(answer.err, Contains("warning") && Contains("built again"));
    CHECK_THAT(answer.out, Contains("built in"));
    CHECK(touchstone.tree(egg + " --leaves 16").at("source") == "cache");
}

TEST_CASE("program: Ctrl-C ends tree with 130 while its bar shows the time left, and leaves no file", "[program]") {
    const TreeProgram touchstone;
    const std::string mesh = touchstone.with("fine.stl", binaryStlOf(egg(200, 400))),
                      out = touchstone.file("fine.spheres"), cache = touchstone.file("cache");
    int terminal = -1, side = -1;
    REQUIRE(openpty(&terminal, &side, nullptr, nullptr, nullptr) == 0);
    std::vector<std::string> words{
        TOUCHSTONE_BINARY_DIR "/touchstone", "tree", mesh, "--leaves", "200000", "--quality", "best", "-o", out};
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    std::string variable = "TOUCHSTONE_CACHE=" + cache;
    char* environment[]{variable.data(), nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, side, STDERR_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawnattr_t attributes;  // Ctrl-C is effective in the child even if it is ignored here
    posix_spawnattr_init(&attributes);
    sigset_t interrupt;
    sigemptyset(&interrupt);
    sigaddset(&interrupt, SIGINT);
    posix_spawnattr_setsigdefault(&attributes, &interrupt);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
    pid_t child = -1;
    REQUIRE(posix_spawn(&child, words[0].c_str(), &actions, &attributes, argv.data(), environment) == 0);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    close(side);

    std::string shown;
    bool asked = false;
    char buffer[512];
    for (ssize_t n; (n = read(terminal, buffer, sizeof buffer)) > 0;) {
        shown.append(buffer, static_cast<std::size_t>(n));
        if (!asked && shown.find(" left") != std::string::npos) {
            kill(child, SIGINT);
            asked = true;
        }
    }
    close(terminal);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    INFO(shown);
    CHECK(asked);
    REQUIRE(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 130);
    CHECK_THAT(shown, Contains("\r\033[K[") && Contains("building the sphere tree of fine") && Contains(" %"));
    CHECK_THAT(shown, Contains("touchstone: cancelled"));
    CHECK(shown.find('\n') > shown.find("cancelled"));  // one line until the end, drawn over
    CHECK_FALSE(fs::exists(out));
    for (const auto& entry : fs::directory_iterator(touchstone.file(""))) CHECK(entry.path().extension() != ".part");
    CHECK((!fs::exists(cache) || fs::is_empty(cache)));
}

}  // namespace touchstone::tree_refusals_tests
