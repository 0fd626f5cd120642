// export --hdf5, export --mcap and verify from outside.
#include <functional>

#include "engine/scene/gltf_write.hpp"
#include "tests/program/program.hpp"

namespace touchstone::exchange_program_tests {

using namespace touchstone::test;
using Catch::Contains;

TEST_CASE("verify: confirms what was exported, and every file is checked", "[program][exchange]") {
    const Program touchstone;
    REQUIRE(touchstone("run hello --headless --seconds 1.5 --record push").code == 0);
    REQUIRE(touchstone("export push push --hdf5 push.hdf5 --mcap push.mcap").code == 0);
    const Answer good = touchstone("verify push.hdf5 push push.mcap");
    CHECK(good.code == 0);
    CHECK(good.err.empty());
    CHECK_THAT(good.out, Contains("demo_1: hello, 1500 ticks") && Contains("push.hdf5: confirmed\n") &&
                             Contains("push: confirmed\n") && Contains("push.mcap: confirmed\n"));

    fs::resize_file(touchstone.file("push.hdf5"), 100'000);
    const Answer bad = touchstone("verify push.hdf5 push.mcap");
    CHECK(bad.code == 1);
    CHECK_THAT(bad.err, Contains("push.hdf5: it is cut off: it has 100000 of"));
    CHECK_THAT(bad.out, Contains("push.mcap: confirmed\n"));
    const Answer last = touchstone("verify push.mcap push.hdf5");
    CHECK(last.code == 1);
    CHECK(isOneSentence(last.err));
}

TEST_CASE("export: what does not fit together is one sentence", "[program][exchange]") {
    const Program touchstone;
    REQUIRE(touchstone("run hello --headless --seconds 0.1 --record push").code == 0);
    for (const auto& [args, code, why] :
         std::vector<std::tuple<std::string, int, std::string>>{{"export --hdf5 a.hdf5", 2, "DIR"},
                                                                {"export push push", 2, "--hdf5"},
                                                                {"export push --by-hash", 2, "--by-hash"},
                                                                {"export push --hdf5 a --out b", 2, "--out"},
                                                                {"export push --hdf5 a --mcap a", 2, "different files"},
                                                                {"export none --hdf5 a", 1, "none"},
                                                                {"export push --hdf5 /nowhere/a", 1, "/nowhere/a"},
                                                                {"verify", 2, "FILE"},
                                                                {"verify none", 1, "none"}}) {
        const Answer answer = touchstone(args);
        INFO(args << ": " << answer.err);
        CHECK(answer.code == code);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Contains(why));
        CHECK_FALSE(fs::exists(touchstone.file("a")));
    }
}

TEST_CASE("recordings: the scene is found wherever it is now", "[program][exchange]") {
    const Program touchstone;
    const fs::path home = fs::path(touchstone.file("x")).parent_path();
    const auto make = [&] {
        for (const char* folder : {"was", "now", "far"}) fs::remove_all(home / folder);
        fs::create_directories(home / "was/parts");
        fs::create_directories(home / "far");
        engine::writeGltf(pressScene(), home / "was/parts/press.glb");
        REQUIRE(touchstone("run was/parts/press.glb --headless --seconds 0.3 --record was/runs/push").code == 0);
    };
    const auto other = [&](const fs::path& file) {  // another scene of the same name
        engine::writeGltf(downScene(), file);
    };
    struct Case {
        std::string name;
        std::function<void()> move;
        std::string option = {};  ///< names the scene
    };
    const fs::path scene = home / "was/parts/press.glb", push = home / "now/runs/push";
    const auto all = [&] { fs::rename(home / "was", home / "now"); };
    const std::vector<Case> cases{
        {"where it was", [&] { fs::create_directories(push.parent_path()), fs::rename(home / "was/runs/push", push); }},
        {"in the recording", [&] { all(), fs::rename(home / "now/parts/press.glb", push / "press.glb"); }},
        {"beside the recording",
         [&] { all(), fs::rename(home / "now/parts/press.glb", push.parent_path() / "press.glb"); }},
        {"moved together", all},
        {"beside it under another name",
         [&] { all(), fs::rename(home / "now/parts/press.glb", push.parent_path() / "renamed.glb"); }},
        {"beside another of its name", [&] { all(), other(push.parent_path() / "press.glb"); }},
        {"replaced where it was", [&] { all(), fs::create_directories(scene.parent_path()), other(scene); }},
        {"named", [&] { all(), fs::rename(home / "now/parts/press.glb", home / "far/p.glb"); }, "far/p.glb"},
        {"in a folder that is named", [&] { all(), fs::rename(home / "now/parts/press.glb", home / "far/p.glb"); },
         "far"}};
    for (const Case& one : cases) {
        INFO(one.name);
        make();
        one.move();
        const std::string option = one.option.empty() ? "" : " --scene " + one.option;
        const auto works = [&](const std::string& args, const std::string& says) {
            const Answer answer = touchstone(args);
            INFO(args << ": " << answer.out << answer.err);
            CHECK(answer.code == 0);
            CHECK_THAT(answer.out + answer.err, Contains(says) && !Contains("is not the recorded"));
        };
        works("verify now/runs/push" + option, ", 300 ticks, all with the recorded bits");
        works("export now/runs/push --hdf5 now/push.hdf5" + option, "300 ticks, all with the recorded bits");
        works("compare now/runs/push --solvers dual-active-set --runs 1" + option, "300 ticks each");
        if (one.option != "far")
            works("run " + one.option + " --headless --device replay:now/runs/push",
                  "all of 300 ticks have the recorded");
    }
    SECTION("a scene that is gone is named, with what to do") {
        make();
        all();
        fs::remove(home / "now/parts/press.glb");
        for (const std::string command :
             {"verify now/runs/push", "export now/runs/push --hdf5 now/push.hdf5", "compare now/runs/push",
              "referee now/runs/push --out now/judged", "run --headless --device replay:now/runs/push"}) {
            const Answer answer = touchstone(command);
            INFO(command << ": " << answer.err);
            CHECK(answer.code == 1);
            CHECK(isOneSentence(answer.err));
            CHECK_THAT(answer.err, Contains("press.glb (content hash ") && Contains("is missing") &&
                                       Contains("put it beside the recording") &&
                                       (Contains("--scene") || Contains("SCENE")));
        }
    }
    SECTION("a scene that was changed is said to be another one") {
        make();
        other(scene);
        const Answer answer = touchstone("run --headless --device replay:was/runs/push");
        CHECK_THAT(answer.err, Contains("was/parts/press.glb' is not the recorded press.glb: its content hash is"));
    }
}

TEST_CASE("export: a program that is killed leaves a complete file or none", "[program][exchange]") {
    const Program touchstone;
    REQUIRE(touchstone("run hello --headless --record push").code == 0);
    std::string many;
    for (int i = 0; i < 20; ++i) many += " push";
    int absent = 0;
    for (const char* seconds : {"0.05", "0.2", "0.4", "0.7", "1", "1.5"}) {
        // Its own process, so that the shell does not end with it.
        const std::string run = " '" TOUCHSTONE_BINARY_DIR "/touchstone' export" + many;
        const std::string kill = "timeout -s KILL " + std::string(seconds);
        const std::string place = fs::path(touchstone.file("x")).parent_path().string();
        [[maybe_unused]] const int status =
            std::system(("cd '" + place + "' && " + kill + run + " --hdf5 a.hdf5 --mcap a.mcap >out 2>&1").c_str());
        for (const char* file : {"a.hdf5", "a.mcap"}) {
            if (!fs::exists(touchstone.file(file))) {
                ++absent;
                continue;
            }
            CHECK(touchstone(std::string("verify ") + file).code == 0);
            fs::remove(touchstone.file(file));
        }
    }
    CHECK(absent > 0);
}

}  // namespace touchstone::exchange_program_tests
