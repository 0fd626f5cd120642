// touchstone trials from outside: a study is run, killed, resumed, split and summarized, always with the same result.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_write.hpp"
#include "haptics/sandbox/trials/trial.hpp"
#include "tests/program/program.hpp"

namespace touchstone::trials_program_tests {

using namespace touchstone::test;
using nlohmann::json;

namespace {

/// Five hands put the cube down on the slab.
std::string studyFile(const Program& touchstone, const json& changed = json::object()) {
    engine::writeGltf(downScene(), touchstone.file("down.glb"));
    json study{{"format", "touchstone trials"},
               {"version", 1},
               {"participants", {"ada", 17, 3, 4, 5}},
               {"time_limit_s", 10},
               {"conditions", {{{"name", "slab, hard"}, {"scene", touchstone.file("down.glb")}}}}};
    study.update(changed);
    std::ofstream(touchstone.file("study.json")) << study;
    return touchstone.file("study.json");
}

/// The rows without measured times.
std::vector<nlohmann::ordered_json> whatRepeats(const std::string& folder, int trials) {
    std::vector<nlohmann::ordered_json> rows;
    for (int i = 1; i <= trials; ++i) {
        auto row = nlohmann::ordered_json::parse(textOf(folder + "/trial-000" + std::to_string(i) + "/row.json"));
        nlohmann::ordered_json kept;
        for (const auto& [key, value] : row.items())
            if (!sandbox::isMeasuredTime(key)) kept[key] = value;
        rows.push_back(kept);
    }
    return rows;
}

}  // namespace

TEST_CASE("trials: the figure of a summary has no empty part, and says where a condition has no value", "[program]") {
    const Program touchstone;
    const auto draw = [&](const std::string& hardTime) {
        std::ofstream table(touchstone.file("summary.csv"));
        table << "condition,measure,mean,mean_low,mean_high\n";
        for (const std::string condition : {"soft", "hard"}) {
            const std::string time = condition == "hard" ? hardTime : "";
            table << condition << ",seated_rate,0.5,0.2,0.8\n"
                  << condition << ",time_s of seated," << time << ",,\n"
                  << condition << ",torque_peak_mNm,20,10,30\n";
            for (const char* phase : {"approach", "search", "align", "insert"})
                table << condition << ',' << phase << "_s,1,,\n";
        }
        table.close();
        const std::string folder = touchstone.file("").substr(0, touchstone.file("").size() - 1);
        REQUIRE(std::system(("'" TOUCHSTONE_SOURCE_DIR "/tools/plot' trials '" + folder + "' >/dev/null").c_str()) ==
                0);
        return textOf(touchstone.file("summary.svg"));
    };
    CHECK_THAT(draw("3"), Catch::Contains("time until seated") && Catch::Contains(">none<"));
    CHECK_THAT(draw(""),
               !Catch::Contains("time until seated") && !Catch::Contains(">none<") && Catch::Contains("peak torque"));
}

TEST_CASE("trials: killed and resumed, or split and joined, a study is the same", "[program][long]") {
    const Program touchstone;
    const std::string study = studyFile(touchstone), whole = touchstone.file("whole");
    const Answer answer = touchstone("trials " + study + " --headless --out " + whole);
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    const auto rows = whatRepeats(whole, 5);
    for (const auto& row : rows) {
        INFO(row);
        CHECK(row.at("outcome") == "seated");
        CHECK(row.at("first_contact_s").get<double>() > 0.05);
        CHECK(row.at("force_peak_N").get<double>() > 1);  // it was pressed down
        CHECK(row.at("residual_penetration_mm").get<double>() <= 1e-3);
        CHECK(row.at("ticks").get<double>() == Approx(1000 * row.at("time_s").get<double>()));
    }
    CHECK(rows[0].at("hash") != rows[1].at("hash"));  // another hand
    for (const char* file : {"summary.csv", "summary.svg", "summary.png", "phases.svg", "phases.png"})
        CHECK(textOf(whole + "/" + file).size() > 100);
    CHECK_THAT(textOf(whole + "/summary.svg"),
               Catch::Contains("slab, hard") && Catch::Contains("torque, mN·m (mean, 95 % interval)"));
    CHECK_THAT(textOf(whole + "/phases.svg"), Catch::Contains("mean time in each phase, s"));
    const auto table = textOf(whole + "/trials.csv");
    CHECK(std::count(table.begin(), table.end(), '\n') == 6);
    CHECK_THAT(table, Catch::Contains("\"slab, hard\""));
    // Every recording can be replayed.
    const Answer replayed =
        touchstone("run " + touchstone.file("down.glb") + " --headless --device replay:" + whole + "/trial-0002");
    INFO(replayed.err);
    CHECK(replayed.code == 0);
    CHECK_THAT(replayed.out, Catch::Contains("have the recorded bits"));

    SECTION("killed in the third trial") {
        const std::string broken = touchstone.file("broken");
        std::ofstream(touchstone.file("kill.sh"))
            << "export TOUCHSTONE_CACHE='" << touchstone.file("cache") << "'\n"
            << "'" TOUCHSTONE_BINARY_DIR "/touchstone' trials '" << study << "' --headless --out '" << broken
            << "' >/dev/null 2>&1 &\n"
            << "while kill -0 $! && [ ! -e '" << broken << "/trial-0003/ticks.npy' ]; do sleep 0.005; done\n"
            << "kill -9 $!; wait $!; true\n";
        REQUIRE(std::system(("bash '" + touchstone.file("kill.sh") + "' 2>/dev/null").c_str()) == 0);
        // However far the study got, the third and the fifth trial are made to look interrupted.
        fs::create_directories(broken + "/trial-0003");
        fs::create_directories(broken + "/trial-0005");
        fs::remove(broken + "/trial-0003/row.json");
        fs::remove(broken + "/trial-0005/row.json");
        std::ofstream(broken + "/trial-0005/ticks.npy") << "half";
        const auto first = fs::last_write_time(broken + "/trial-0001/row.json");
        REQUIRE(touchstone("trials " + study + " --headless --out " + broken).code == 0);
        CHECK(fs::last_write_time(broken + "/trial-0001/row.json") == first);  // not repeated
        CHECK(whatRepeats(broken, 5) == rows);
        CHECK(textOf(broken + "/summary.csv") == textOf(whole + "/summary.csv"));
    }
    SECTION("in two shards") {
        const std::string one = touchstone.file("one"), two = touchstone.file("two"), both = touchstone.file("both");
        REQUIRE(touchstone("trials " + study + " --headless --shard 1/2 --out " + one).code == 0);
        REQUIRE(touchstone("trials " + study + " --headless --shard 2/2 --out " + two).code == 0);
        CHECK_FALSE(fs::exists(one + "/summary.csv"));
        CHECK_FALSE(fs::exists(one + "/trial-0002"));
        REQUIRE(touchstone("trials summary " + one + " " + two + " --out " + both).code == 0);
        CHECK(textOf(both + "/summary.csv") == textOf(whole + "/summary.csv"));
        for (const char* figure : {"/summary.svg", "/phases.svg"})  // equal tables give equal figures
            CHECK(textOf(both + figure) == textOf(whole + figure));
        const Answer twice = touchstone("trials summary " + one + " " + whole + " --out " + both);
        CHECK(twice.code == 1);
        CHECK(isOneSentence(twice.err));
        CHECK_THAT(twice.err, Catch::Contains("trial-0001"));
    }
    const std::string again = "trials " + study + " --headless --out " + whole, third = whole + "/trial-0003";
    const auto refused = [&](const std::string& args, const std::string& why) {
        fs::remove_all(whole + "/trial-0005");
        const Answer other = touchstone(args);
        INFO(other.err);
        CHECK(other.code == 1);
        CHECK(isOneSentence(other.err));
        CHECK_THAT(other.err, Catch::Contains("trial-0003/row.json") && Catch::Contains(why));
        CHECK_FALSE(fs::exists(whole + "/trial-0005"));  // before any trial
    };
    const auto changeRow = [&](const std::string& column, const json& value) {
        nlohmann::ordered_json row = nlohmann::ordered_json::parse(textOf(third + "/row.json"));
        row[column] = value;
        std::ofstream(third + "/row.json") << row;
    };
    SECTION("a row that a crash left empty is reported before the first trial") {
        std::ofstream(third + "/row.json") << "";
        refused(again, "does not belong to this trial");
    }
    SECTION("a row of another trial is refused") {
        const json changed = GENERATE(json{"seed", 5}, json{"seed", "none"}, json{"participant", "bob"},
                                      json{"condition", "soft"}, json{"repetition", 2});
        INFO(changed);
        changeRow(changed[0].get<std::string>(), changed[1]);
        refused(again, "does not belong to this trial");
        refused("trials summary " + whole + " --out " + whole, "does not belong to this trial");
    }
    SECTION("trials in another version of the scene are refused") {
        changeRow("scene_hash", "0123456789abcdef");
        refused("trials summary " + whole + " --out " + whole, "the scene '" + touchstone.file("down.glb"));
        for (int i : {1, 2, 4}) fs::remove_all(whole + "/trial-000" + std::to_string(i));
        refused(again, "has changed since this trial");
    }
    SECTION("its folder accepts no other study") {
        const Answer other =
            touchstone("trials " + studyFile(touchstone, {{"seed", 9}}) + " --headless --out " + whole);
        CHECK(other.code == 1);
        CHECK(isOneSentence(other.err));
        CHECK_THAT(other.err, Catch::Contains("another protocol"));
    }
}

TEST_CASE("trials: a study with the mouse needs a window, and continues there", "[program]") {
    const Program touchstone;
    const auto study = [&](const std::string& device) {
        return studyFile(touchstone, {{"participants", 1},
                                      {"device", device},
                                      {"conditions", {{{"name", "down"}, {"scene", touchstone.file("down.glb")}}}}});
    };
    const std::string out = touchstone.file("out");
    REQUIRE(touchstone("trials " + study("insert") + " --headless --out " + out).code == 0);
    std::ofstream(out + "/protocol.json") << textOf(study("mouse"));
    const std::string again = "trials " + study("mouse") + " --out " + out;
    CHECK(touchstone(again + " --headless").code == 1);
    const Answer answer = touchstone(again, "DISPLAY=:none");  // all trials are complete, so no window is opened
    INFO(answer.err);
    CHECK(answer.code == 0);
    CHECK_THAT(answer.out, Catch::Contains("1 of 1 trials"));
}

TEST_CASE("trials: the hand waits as long as the goal requires", "[program]") {
    const Program touchstone;
    const std::string study = studyFile(touchstone, {{"participants", 1}}), out = touchstone.file("out");
    engine::writeGltf(downScene(2.5), touchstone.file("down.glb"));
    REQUIRE(touchstone("trials " + study + " --headless --out " + out).code == 0);
    CHECK(whatRepeats(out, 1)[0].at("outcome") == "seated");
}

TEST_CASE("trials: what cannot be run is one sentence", "[program]") {
    const Program touchstone;
    const std::string study = studyFile(touchstone), out = " --headless --out " + touchstone.file("out");
    engine::writeGltf(pressScene(), touchstone.file("no-goal.glb"));
    const auto with = [&](const json& condition) {
        std::string file = studyFile(touchstone, {{"conditions", {condition}}}) + out;
        return file;
    };
    for (const auto& [condition, why] : std::vector<std::pair<json, std::string>>{
             {{{"scene", touchstone.file("no-goal.glb")}}, "no goal"},
             {{{"scene", "nowhere"}}, "nowhere"},
             {{{"scene", touchstone.file("down.glb")}, {"device", "nothing"}}, "nothing"},
             {{{"scene", touchstone.file("down.glb")}, {"device", "insert:me"}}, "insert:SEED"},
             {{{"scene", touchstone.file("down.glb")}, {"settings", {{"trust", 3}}}}, "trust"}}) {
        const Answer answer = touchstone("trials " + with(condition));
        INFO(answer.err);
        CHECK(answer.code == 1);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Catch::Contains(why));
        CHECK_FALSE(fs::exists(touchstone.file("out")));  // nothing was started
    }
    for (const auto& [args, code, why] : std::vector<std::tuple<std::string, int, std::string>>{
             {"", 2, "PROTOCOL"},
             {study, 2, "--out"},
             {study + " --out " + touchstone.file("out"), 1, "no display"},
             {study + out + " --shard 3/2", 2, "--shard"},
             {touchstone.file("none.json") + out, 1, "none.json"},
             {touchstone.file("down.glb") + out, 1, "JSON"},
             {"summary " + touchstone.file("") + " --out " + touchstone.file("out"), 1, "contains no trials"}}) {
        const Answer answer = touchstone("trials " + args);
        INFO(answer.err);
        CHECK(answer.code == code);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Catch::Contains(why));
    }
}

}  // namespace touchstone::trials_program_tests
