// touchstone compare, paper and referee from outside. The measured values are never asserted: only that the inputs
// were the same and that every output is present.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/scene/gltf_write.hpp"
#include "haptics/hands/motion.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/qp/friction_table.hpp"
#include "tests/program/csv_table.hpp"
#include "tests/program/program.hpp"

namespace touchstone::compare_program_tests {

using namespace touchstone::test;
using nlohmann::json;

namespace {

std::string pressFile(const Program& touchstone) {
    engine::writeGltf(pressScene(), touchstone.file("press.glb"));
    return touchstone.file("press.glb");
}

/// The table of `compare ARGS`.
Table compared(const Program& touchstone, const std::string& args, const std::string& folder) {
    const Answer answer = touchstone("compare " + args + " --runs 1 --out " + touchstone.file(folder));
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    return tableOf(touchstone.file(folder + "/compare.csv"));
}

}  // namespace

TEST_CASE("compare: every solver is given the same motion, and is in the table, the ticks and the figures",
          "[program]") {
    const Program touchstone;
    const auto table = compared(touchstone, pressFile(touchstone) + " --mode paper,default,god-object,penalty", "all");
    std::set<std::string> cases, devices;
    for (const auto& row : table) {
        INFO(row.at("case"));
        cases.insert(row.at("case"));
        devices.insert(row.at("device_hash"));
        CHECK(row.at("ticks") == table.front().at("ticks"));
        for (const char* column : {"step_p50_us", "step_p99_us", "step_p999_us", "collision_mean_us", "solve_mean_us",
                                   "iterations_mean", "iterations_max", "rows_max", "penetration_max_mm",
                                   "hover_p99_mm", "ticks_elastic", "ticks_iteration_limit", "ticks_invalid"})
            CHECK_FALSE(row.at(column).empty());
        CHECK(row.at("force_error_max_N").empty() == row.at("solver").empty());  // penalty has no rows to solve
        if (row.at("solver") == kExactName) CHECK(std::stod(row.at("force_error_max_N")) < 1e-9);
        if (row.at("solver") == kExactName) CHECK(std::stod(row.at("force_difference_max_N")) == 0);
        if (row.at("mode") == "default" || row.at("mode") == "god-object")
            CHECK(std::stod(row.at("penetration_max_mm")) <= 1e-3);
        std::string ticks = "all/ticks-" + row.at("case") + ".csv";
        std::replace(ticks.begin(), ticks.end(), ' ', '-');
        CHECK(tableOf(touchstone.file(ticks)).size() == std::stoul(row.at("ticks")));
    }
    std::set<std::string> expected{"penalty"};
    for (const SolverInfo& solver : solverTable())
        for (const char* mode : {"paper ", "default ", "god-object "}) expected.insert(mode + std::string(solver.name));
    CHECK(cases == expected);
    CHECK(table.size() == cases.size());
    CHECK(devices.size() == 1);
    // Penalty mode penetrates, the constrained modes do not.
    const auto& penalty = table.back();
    REQUIRE(penalty.at("mode") == "penalty");
    CHECK(std::stod(penalty.at("penetration_max_mm")) > 1e-3);
    for (const char* plot : {"time", "rows", "force", "penetration", "stages"})
        for (const char* extension : {".svg", ".png"})
            CHECK(textOf(touchstone.file(std::string("all/") + plot + extension)).size() > 1000);
    // A curve for every case, and axes with names and units.
    const std::string force = textOf(touchstone.file("all/force.svg"));
    for (const std::string& name : expected) CHECK_THAT(force, Catch::Contains(">" + name + "<"));
    CHECK_THAT(force, Catch::Contains(">force, N<") && Catch::Contains(">simulated time, ms<"));
}

TEST_CASE("compare: every friction solver is given the same motion, and its errors are those of its law", "[program]") {
    const Program touchstone;
    const std::string file = touchstone.file("rub.glb");
    engine::writeGltf(rubScene(), file);
    std::string names;
    for (const FrictionSolverInfo& info : frictionSolverTable())
        names += (names.empty() ? "" : ",") + std::string(info.name);
    const auto table = compared(touchstone, file + " --friction-solvers " + names, "friction");
    REQUIRE(table.size() == frictionSolverTable().size());
    std::set<std::string> devices;
    for (std::size_t i = 0; i < table.size(); ++i) {
        const auto& row = table[i];
        const std::string name = row.at("friction_solver");
        INFO(name);
        const auto number = [&](const char* column) { return std::stod(row.at(column)); };
        CHECK(name == frictionSolverTable()[i].name);
        CHECK(row.at("case") == "default " + name);
        devices.insert(row.at("device_hash"));
        CHECK(number("step_p999_us") >= number("step_p50_us"));
        CHECK(number("solve_mean_us") > 0);
        CHECK(number("penetration_max_mm") <= 1e-3);
        CHECK(number("cone_max_N") < 1e-4);
        const FrictionLaw& law = findFrictionSolver(name)->law;
        const double most = std::max(1e-3, 100 * law.accuracy);
        if (law.facets > 0)
            CHECK(number("force_error_max_N") > 1e-3);
        else
            CHECK(number("force_error_max_N") < most);
        if (law.hovers)
            CHECK(number("complementarity_max_mJ") > 1e-3);
        else
            CHECK(number("complementarity_max_mJ") < most);
        if (name == "cone-newton") {
            CHECK(number("force_error_max_N") < 1e-9);
            CHECK(number("force_difference_max_N") == 0);
            CHECK(number("direction_max_mJ") < 1e-6);
            CHECK(number("ticks_iteration_limit") == 0);
        }
        CHECK(tableOf(touchstone.file("friction/ticks-default-" + name + ".csv")).size() ==
              std::stoul(row.at("ticks")));
    }
    CHECK(devices.size() == 1);
    CHECK_THAT(textOf(touchstone.file("friction/force.svg")), Catch::Contains(">default lemke-8<"));
    const Answer printed = touchstone("compare " + file + " --friction-solvers convex,cone-newton --runs 1");
    CHECK_THAT(printed.out, Catch::Contains("hover mm") && Catch::Contains("\nconvex ") &&
                                Catch::Contains("\ncone-newton ") && Catch::Contains("same device poses"));
}

TEST_CASE("compare: without matplotlib one sentence says so, and the tables are complete", "[program]") {
    const Program touchstone;
    const std::string out = touchstone.file("out"), compare = "compare " + pressFile(touchstone) + " --solvers " +
                                                              kExactName + " --runs 1 --out " + out;
    // A folder without programs, and one whose python3 lacks matplotlib.
    fs::create_directory(touchstone.file("bin"));
    for (const bool python : {false, true}) {
        INFO(python);
        if (python) {
            std::ofstream(touchstone.file("bin/python3")) << "#!/bin/sh\nexit 3\n";
            fs::permissions(touchstone.file("bin/python3"), fs::perms::owner_all);
        }
        fs::remove_all(out);
        const Answer answer = touchstone(compare, "PATH='" + touchstone.file("bin") + "'");
        INFO(answer.err);
        CHECK(answer.code == 0);
        CHECK_THAT(answer.err,
                   Catch::Contains("apt-get install python3-matplotlib") && Catch::Contains("plot compare " + out));
        const std::string last = answer.err.substr(std::min(answer.err.find("warning: "), answer.err.size()));
        CHECK(std::count(last.begin(), last.end(), '\n') == 1);
        CHECK_THAT(answer.err, !Catch::Contains("not found"));  // the shell's own message is not repeated
        CHECK(tableOf(out + "/compare.csv").size() == 1);
        CHECK_FALSE(tableOf(out + "/ticks-default-" + kExactName + ".csv").empty());
        CHECK_FALSE(fs::exists(out + "/time.svg"));
    }
    // A script that fails for another reason is a failure, and the tables are still complete.
    std::ofstream(touchstone.file("bin/python3")) << "#!/bin/sh\nexit 1\n";
    const Answer answer = touchstone(compare, "PATH='" + touchstone.file("bin") + "'");
    CHECK(answer.code == 1);
    CHECK_THAT(answer.err, Catch::Contains("could not be drawn"));
    CHECK(tableOf(out + "/compare.csv").size() == 1);
}

TEST_CASE("compare: a recording and a motion from a file are used unchanged", "[program]") {
    const Program touchstone;
    const std::string press = pressFile(touchstone);
    REQUIRE(touchstone("run " + press + " --headless --record " + touchstone.file("push")).code == 0);
    const std::string approximate = solverNames(false).front(), two = kExactName + "," + approximate;
    const auto demo = compared(touchstone, press + " --solvers " + two, "demo");
    const auto recorded = compared(touchstone, touchstone.file("push") + " --solvers " + two, "recorded");
    REQUIRE(demo.size() == 2);
    REQUIRE(recorded.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) {
        CHECK(recorded[i].at("device_hash") == demo[i].at("device_hash"));
        CHECK(recorded[i].at("hash") == demo[i].at("hash"));
    }

    writeMotion(touchstone.file("down.csv"), std::vector<MotionKey>{{0, {Vec3(0, 15, 0), Quat::Identity()}},
                                                                    {300, {Vec3(0, 9, 0), Quat::Identity()}}});
    const auto moved = compared(
        touchstone, press + " --solvers " + approximate + " --device replay:" + touchstone.file("down.csv"), "moved");
    REQUIRE(moved.size() == 1);
    CHECK(moved[0].at("device_hash") != demo[0].at("device_hash"));
    CHECK(std::stod(moved[0].at("force_max_N")) > 0.99);   // 1 mm into the slab, and the protrusion of the leaves
    CHECK(moved[0].at("force_difference_max_N").empty());  // the exact solver was not selected
}

TEST_CASE("compare: what cannot be compared is one sentence", "[program]") {
    const Program touchstone;
    const std::string press = pressFile(touchstone);
    REQUIRE(touchstone("run " + press + " --headless --record " + touchstone.file("push")).code == 0);
    for (const auto& [args, code, why] : std::vector<std::tuple<std::string, int, std::string>>{
             {"", 2, ""},
             {press + " --solvers simplex", 2, "simplex"},
             {press + " --mode papery", 2, "papery"},
             {press + " --friction-solvers pqp", 2, "friction_solver must be one of cone-newton"},
             {press + " --friction-solvers convex --mode paper", 2, "--mode"},
             {press + " --friction-solvers convex --solvers pqp", 2, "--solvers"},
             {press + " --friction-solvers convex", 1, "nothing has friction"},
             {press + " --mode paper --tolerance none", 2, "tolerance"},
             {press + " --set trust=3", 2, "trust"},
             {press + " --out /proc/no", 1, "/proc/no"},
             {"nowhere", 1, "nowhere"},
             {touchstone.file("push") + " --device demo", 2, "--device"},
             {press + " --mode default,penalty --solvers " + kExactName + " --device hand:0.1,200,1,0", 1,
              "record its"},
             {press + " --device demo:none", 1, "none"}}) {
        INFO(args);
        const Answer answer = touchstone("compare " + args);
        INFO(answer.err);
        CHECK(answer.code == code);
        const auto last = answer.err.find("touchstone: ");  // after the lines that name the running cases
        REQUIRE(last != std::string::npos);
        CHECK(isOneSentence(answer.err.substr(last)));
        CHECK_THAT(answer.err, Catch::Contains(why));
    }
}

TEST_CASE("paper: the quick experiments draw every figure and judge every claim", "[program][gl][long]") {
    const Program touchstone;
    const Answer answer = touchstone("paper --quick --out " + touchstone.file("paper"));
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    const json results = json::parse(textOf(touchstone.file("paper/paper.json")));
    CHECK(results.at("quick") == true);
    CHECK_FALSE(results.at("machine").at("processor").get<std::string>().empty());
    REQUIRE(results.at("motions").size() == 4);
    for (const json& motion : results.at("motions")) {
        INFO(motion.at("name"));
        std::set<std::string> devices;
        for (const json& row : motion.at("rows")) devices.insert(row.at("device_hash").get<std::string>());
        CHECK(motion.at("rows").size() ==
              (motion.at("name") == "figure-7-1024" ? solverTable().size() : 2 * solverTable().size() + 1));
        CHECK(devices.size() == 1);
    }
    std::set<std::string> claims;
    for (const json& claim : results.at("claims")) {
        claims.insert(claim.at("key").get<std::string>());
        CHECK(claim.contains("agrees"));
        CHECK_THAT(answer.out, Catch::Contains(claim.at("measured").get<std::string>()));
    }
    CHECK(claims == std::set<std::string>{"speed", "iterations", "budget", "active-set", "penetration", "axial"});
    for (const char* figure : {"figure-5", "figure-5-deeper", "figure-6", "figure-7", "figure-7-default"})
        CHECK(textOf(touchstone.file(std::string("paper/") + figure + ".svg")).size() > 1000);
    for (const char* steps : {"figure-5", "figure-7"})
        for (int k = 1; k <= 4; ++k)
            CHECK(fs::exists(touchstone.file("paper/" + std::string(steps) + "-step-" + std::to_string(k) + ".png")));
}

TEST_CASE("referee: a recording of the user goes through every geometry, mode and solver", "[program][gl]") {
    const Program touchstone;
    REQUIRE(
        touchstone("run " + pressFile(touchstone) + " --headless --seconds 0.15 --record " + touchstone.file("push"))
            .code == 0);
    const std::string out = " --limit 1 --out " + touchstone.file("judged");
    const auto systemsOf = [&](const std::string& args) {
        const Answer answer = touchstone("referee " + args + out);
        INFO(answer.err);
        REQUIRE(answer.code == 0);
        std::set<std::string> systems;
        for (const auto& row : tableOf(touchstone.file("judged/referee.csv"))) {
            if (row.at("system").starts_with("Touchstone")) systems.insert(row.at("system"));
            CHECK(row.at("motion") == (args.starts_with(touchstone.file("push")) ? "push" : "press"));
        }
        return systems;
    };
    std::set<std::string> expected{"Touchstone penalty mode"}, withFriction;
    for (const char* way : {"meshes", "spheres", "paper mode", "god-object mode"})
        for (const std::string& solver : settingChoices("solver")) {
            const bool usual = solver == (std::string(way) == "paper mode" ? "pqp" : kExactName);
            expected.insert(std::string("Touchstone ") + way + (usual ? "" : " with " + solver));
        }
    for (const char* way : {"meshes", "spheres"})
        for (const FrictionSolverInfo& info : frictionSolverTable())
            withFriction.insert(std::string("Touchstone ") + way +
                                (&info == &frictionSolverTable()[0] ? "" : " with " + std::string(info.name)));
    CHECK(systemsOf(touchstone.file("push")) == expected);
    const std::string page = textOf(touchstone.file("judged.md"));
    CHECK_THAT(page, Catch::Matchers::Contains("touchstone referee " + touchstone.file("push")));
    CHECK_THAT(page, !Catch::Matchers::Contains("Stiffness against rate"));  // that is of a bundled scene
    CHECK(systemsOf(touchstone.file("press.glb") + " --friction 0.3 --seconds 0.1") == withFriction);

    CHECK_THAT(touchstone("referee " + touchstone.file("press.glb") + " --device demo:moon" + out).err,
               Catch::Matchers::Contains("has no motion 'moon'"));
    CHECK(touchstone("referee " + touchstone.file("push") + " --device demo:moon" + out).code == 2);
    CHECK(touchstone("referee " + touchstone.file("press.glb") + " --device mouse" + out).code == 2);
    CHECK(touchstone("referee --friction 1" + out).code == 2);
}

TEST_CASE("referee: systems are judged on one motion, and the page has each but its other solvers", "[program][gl]") {
    const Program touchstone;
    const Answer answer =
        touchstone("referee --motions plate-10,wedge-friction --seconds 0.1 --limit 2 --rates 250,1000,5000 --out " +
                       touchstone.file("judged"),
                   "TOUCHSTONE_CACHE=" TOUCHSTONE_BINARY_DIR "/cache");  // the trees of bundled scenes are built once
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    const auto table = tableOf(touchstone.file("judged/referee.csv"));
    const std::string page = textOf(touchstone.file("judged.md"));
    std::set<std::string> systems;
    std::map<std::string, std::string> ticks;
    for (const auto& row : table) {
        INFO(row.at("motion") << ", " << row.at("system"));
        systems.insert(row.at("system"));
        // The page leaves out other solvers of the same system.
        const bool shown = page.find("| " + row.at("system") + " |") != std::string::npos;
        CHECK(shown == (row.at("system").find(" with ") == std::string::npos));
        if (!row.at("note").empty()) continue;
        CHECK(row.at("ticks") == ticks.emplace(row.at("motion"), row.at("ticks")).first->second);
        for (const char* column : {"intersecting_percent", "depth_mm", "tunneled", "force_error_p50_N", "rest_noise_N",
                                   "energy_created_mJ", "tick_p50_us", "tick_p999_us", "prepare_ms"})
            CHECK_FALSE(row.at(column).empty());
        if (row.at("system") == "Touchstone meshes") {
            CHECK(row.at("intersecting_percent") == "0.0");
            CHECK(row.at("tunneled") == "false");
        }
        // A tool that falls through the plate is off by far more.
        const bool engine = row.at("system").find("Touchstone") == std::string::npos;
        if (engine && row.at("motion") == "plate-10") CHECK(std::stod(row.at("force_error_p50_N")) < 10);
    }
    CHECK(systems.count("Touchstone meshes") == 1);
    CHECK(systems.count("Touchstone paper mode") == 1);
    for (const char* engine : {"Bullet", "ODE", "MuJoCo"}) {
        const bool built = page.find(std::string("| ") + engine + " | – | not installed") == std::string::npos;
        CHECK(systems.count(engine) == (built ? 1 : 0));
        CHECK(systems.count(std::string(engine) + " 4 substeps") == (built ? 1 : 0));
    }

    // Without sensors and noise, the hand rests up to what theory says.
    const auto passivity = tableOf(touchstone.file("judged/passivity.csv"));
    REQUIRE(passivity.size() == 3);
    for (const auto& row : passivity) {
        INFO(row.at("rate_Hz"));
        const double bound = std::min(100.0, std::stod(row.at("bound_N_per_mm")));
        CHECK(std::stod(row.at("rests_N_per_mm")) <= 1.1 * bound);
        CHECK(std::stod(row.at("rests_N_per_mm")) >= 0.7 * bound);
        CHECK(std::stod(row.at("passive_N_per_mm")) <= std::stod(row.at("rests_N_per_mm")));
        CHECK(std::stod(row.at("passive_N_per_mm")) > 0.1);
    }
    CHECK_THAT(touchstone("referee --motions moon --out " + touchstone.file("judged")).err,
               Catch::Matchers::Contains("moon"));
}

}  // namespace touchstone::compare_program_tests
