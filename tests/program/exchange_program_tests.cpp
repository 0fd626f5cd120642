// export --hdf5, export --mcap and verify from outside.
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
