// touchstone bench from outside. The measured values are never asserted, only whether they are present.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/scene/gltf_write.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/qp/friction_table.hpp"
#include "tests/program/csv_table.hpp"
#include "tests/program/program.hpp"

namespace touchstone::bench_program_tests {

using namespace touchstone::test;
using nlohmann::json;

namespace {

/// Numbers of linearizations that a sweep tries between meshes: among them the default.
const std::set<int> kLinearizations{1, 2, 4, 16, linearizationsOf({}, Geometry::Mesh)};

std::set<std::string> keysOf(const json& results) {
    std::set<std::string> keys;
    for (const json& row : results.at("rows")) keys.insert(row.at("key").get<std::string>());
    for (const json& cost : results.at("qp")) keys.insert(json{cost["rows"], cost["solver"], cost["form"]}.dump());
    return keys;
}

/// The press scene, with these settings in it unless they are null.
std::string pressFile(const Program& touchstone, const json& settings = nullptr) {
    engine::Scene scene = pressScene();
    if (!settings.is_null()) (*scene.extras)["touchstone"]["settings"] = settings;
    engine::writeGltf(scene, touchstone.file("press.glb"));
    return touchstone.file("press.glb");
}

json measured(const Program& touchstone, const std::string& args, const std::string& folder) {
    const Answer answer = touchstone("bench " + args + " --quick --out " + touchstone.file(folder));
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    return json::parse(textOf(touchstone.file(folder + "/bench.json")));
}

}  // namespace

TEST_CASE("bench: a quick sweep writes a table, JSON, figures and a self-contained page", "[program][long]") {
    const Program touchstone;
    const std::string press = pressFile(touchstone);
    const json results = measured(touchstone, press, "all");

    const json& part = results.at("parts").at(0);
    CHECK_FALSE(part.at("machine").at("processor").get<std::string>().empty());
    for (const char* key : {"commit", "compiler", "flags"}) CHECK_FALSE(part.at(key).get<std::string>().empty());
    std::set<std::string> modes, geometries, solvers, screenings;
    std::set<double> tolerances, leaves;
    std::set<int> linearizations;
    for (const json& row : results.at("rows")) {
        INFO(row.at("key") << ": " << row.at("why"));
        modes.insert(row.at("mode").get<std::string>());
        geometries.insert(row.at("geometry").get<std::string>());
        const bool mesh = row.at("key").get<std::string>().find("/mesh/") != std::string::npos;
        CHECK(row.at("geometry") == (mesh ? "mesh" : "spheres"));
        solvers.insert(row.at("solver").get<std::string>());
        screenings.insert(row.at("screening").get<std::string>());
        leaves.insert(row.at("tool_leaves").get<double>());
        if (row.at("mode") == "default") linearizations.insert(row.at("linearizations").get<int>());
        if (!row.at("tolerance").is_null()) tolerances.insert(row.at("tolerance").get<double>());
        CHECK(row.at("samples").get<int>() + row.at("samples_lost").get<int>() == 3);
        CHECK(row.at("valid").get<bool>() == row.at("why").get<std::string>().empty());
        CHECK(row.at("valid").get<bool>() == row.at("step_p50_us").is_number());
        const SolverInfo* solver = findSolver(row.at("solver").get<std::string>());
        REQUIRE(solver);
        if (!solver->exact || row.at("mode") == "paper") continue;
        CHECK(row.at("valid") == true);
        CHECK(row.at("runs") >= 1);  // of at most 3: a slow machine times slow cases less often
        CHECK(row.at("runs") <= 3);
        CHECK(row.at("run_ticks") >= row.at("ticks"));
        CHECK(row.at("solver_max_N") <= 1e-9);
    }
    CHECK(modes == std::set<std::string>{"default", "paper"});
    CHECK(geometries == std::set<std::string>{"mesh", "spheres"});
    CHECK(solvers.size() == solverTable().size());
    CHECK(screenings == std::set<std::string>{"none", "screen", "cluster"});
    CHECK(tolerances.size() == 3);
    CHECK(leaves.size() >= 3);
    CHECK(linearizations == kLinearizations);

    const Table rows = tableOf(touchstone.file("all/rows.csv"));
    REQUIRE(rows.size() == results.at("rows").size());
    for (std::size_t i = 0; i < rows.size(); ++i) CHECK(rows[i].at("key") == results["rows"][i].at("key"));
    CHECK(tableOf(touchstone.file("all/qp.csv")).size() == results.at("qp").size());

    const std::string page = textOf(touchstone.file("all/index.html"));
    for (const char* plot : {"pareto", "stages", "errors", "cost_leaves", "geometry", "cost_rows"}) {
        INFO(plot);
        for (const char* extension : {".svg", ".png"})
            CHECK(textOf(touchstone.file(std::string("all/") + plot + extension)).size() > 1000);
    }
    std::size_t drawn = 0;
    for (std::size_t at = 0; (at = page.find("<svg", at)) != std::string::npos; ++at) ++drawn;
    CHECK(drawn >= 5);
    // Axes have names and units, and every solver of the table has a curve.
    CHECK_THAT(textOf(touchstone.file("all/pareto.svg")),
               Catch::Contains("step, median, µs") && Catch::Contains("force error against the meshes, median, N"));
    CHECK_THAT(textOf(touchstone.file("all/geometry.svg")),
               Catch::Contains("mesh: linearizations") && Catch::Contains("spheres: leaves"));
    const std::string costs = textOf(touchstone.file("all/cost_rows.svg"));
    CHECK_THAT(costs, Catch::Contains("solve, median, µs"));
    for (const SolverInfo& solver : solverTable()) CHECK_THAT(costs, Catch::Contains(std::string(solver.name)));
    for (const char* outside : {"src=", "href=\"http", "<link", "@import"})
        CHECK(page.find(outside) == std::string::npos);

    SECTION("its shards, merged, hold the same rows") {
        const json one = measured(touchstone, press + " --shard 1/2", "one");
        measured(touchstone, press + " --shard 2/2", "two");
        const std::string folders = touchstone.file("one") + " " + touchstone.file("two"),
                          out = " --out " + touchstone.file("merged");
        CHECK_FALSE(fs::exists(touchstone.file("one/index.html")));
        Answer answer = touchstone("bench merge " + folders + out);
        INFO(answer.err);
        REQUIRE(answer.code == 0);
        const json merged = json::parse(textOf(touchstone.file("merged/bench.json")));
        CHECK(keysOf(one).size() < keysOf(results).size());
        CHECK(keysOf(merged) == keysOf(results));
        CHECK(merged.at("rows").size() == results.at("rows").size());
        CHECK(merged.at("parts").size() == 2);
        CHECK(fs::exists(touchstone.file("merged/index.html")));
        // Equal results give equal figures.
        answer = touchstone("bench merge " + folders + " --out " + touchstone.file("again"));
        REQUIRE(answer.code == 0);
        for (const char* plot : {"pareto", "stages", "errors", "cost_leaves", "cost_rows"}) {
            INFO(plot);
            CHECK(textOf(touchstone.file(std::string("again/") + plot + ".svg")) ==
                  textOf(touchstone.file(std::string("merged/") + plot + ".svg")));
        }
        CHECK(textOf(touchstone.file("all/cost_rows.svg")) != textOf(touchstone.file("merged/cost_rows.svg")));

        for (const auto& [given, why] : std::vector<std::pair<std::string, std::string>>{
                 {touchstone.file("one"), "only 1 of 2"},
                 {touchstone.file("one") + " " + touchstone.file("one"), "twice"},
                 {folders + " " + touchstone.file("all"), "another sweep"},
                 {touchstone.file("merged"), "merged already"},
                 {"/no/such/folder", "not a file of"}}) {
            answer = touchstone("bench merge " + given + out);
            CHECK(answer.code == 1);
            CHECK(isOneSentence(answer.err));
            CHECK_THAT(answer.err, Catch::Contains(why));
        }
    }

    // With the other suites, the page of the docs tells the geometries apart.
    measured(touchstone, press + " --suite hard", "hard");
    measured(touchstone, press + " --suite mesh", "mesh");
    fs::create_directory(touchstone.file("docs"));
    const std::string docs = touchstone.file("docs/benchmarks.md");
    std::ofstream(docs) << "before <!-- measured: made by tools/document_bench --><!-- end of measured --> after";
    const std::string make =
        "cd '" + touchstone.file("") + "' && python3 '" TOUCHSTONE_SOURCE_DIR "/tools/bench_page.py' all hard mesh";
    REQUIRE(std::system(make.c_str()) == 0);
    const std::string text = textOf(docs);
    CHECK_THAT(text, Catch::StartsWith("before ") && Catch::EndsWith(" after"));
    const auto count = [&](const std::string& cells) {
        std::size_t found = 0;
        for (std::size_t at = 0; (at = text.find(cells, at)) != std::string::npos; ++at) ++found;
        return found;
    };
    CHECK(count("| spheres, 512 leaves | 2 | ") == 1);
    for (const int number : kLinearizations) CHECK(count("| mesh | " + std::to_string(number) + " | ") == 1);
    for (const std::string geometry : {"spheres", "mesh"}) {
        INFO(geometry);
        CHECK(count("` motion | " + geometry + " | ") == 1);
        CHECK(count("| default | " + geometry + " | `" + kExactName + "` | 1 | 0 | ") == 1);
        CHECK_THAT(textOf(touchstone.file("docs/benchmarks/hard.csv")),
                   Catch::Contains(",motion,default," + geometry + "," + kExactName + ","));
    }
    // Meshes are kept 2 µm apart, which spheres are not: each row takes the largest value of its own geometry.
    CHECK(count("| hover, all other cases | ≤ 0.5 mm | spheres ") == 1);
    CHECK(count(" (`motion`), mesh 0.002 mm (`motion`) | reached |") == 1);
    CHECK(fs::exists(touchstone.file("docs/pictures/bench-geometry.svg")));
}

TEST_CASE("bench: a row with wrong answers is listed without a time", "[program]") {
    const Program touchstone;
    const std::string press = pressFile(touchstone, {{"iteration_cap", 1}});
    const json results = measured(touchstone, press + " --suite hard", "hard");
    CHECK(results.at("rows").size() == 2 * solverTable().size() + 1);  // two modes, and the exact solver between meshes
    std::size_t failed = 0;
    for (const json& row : results.at("rows")) {
        if (row.at("mode") != "default") continue;
        INFO(row.at("key") << ": " << row.at("why"));
        const bool capped = row.at("solver") != kExactName;  // its work is bounded without the cap
        CHECK(row.at("valid") == !capped);
        CHECK(row.at("step_p50_us").is_null() == capped);
        CHECK(row.at("step_worst_us").is_null() == capped);
        CHECK(row.at("runs") == (capped ? 0 : 3));
        if (capped) CHECK_THAT(row.at("why").get<std::string>(), Catch::Contains("iteration-limit"));
        failed += capped;
    }
    CHECK(failed == solverTable().size() - 1);
    CHECK_THAT(textOf(touchstone.file("hard/index.html")), Catch::Contains("iteration-limit"));
}

TEST_CASE("bench: the mesh suite measures meshes alone, with and without the list worker", "[program]") {
    const Program touchstone;
    engine::Scene scene = pressScene();
    for (const char* name : {"hard-01-slide", "hard-05-teleport"}) {
        scene.animations.push_back(scene.animations.front());
        scene.animations.back().name = name;
    }
    for (engine::Animation& animation : scene.animations)  // runs with the thread take as long as the motion
        for (double& seconds : animation.channels[0].times) seconds /= 4;
    const bool fits = GENERATE(false, true);
    INFO("the parts " << (fits ? "fit" : "do not fit"));
    if (fits) (*scene.extras)["touchstone"]["clearance_mm"] = 0.5;
    engine::writeGltf(scene, touchstone.file("press.glb"));
    const json results = measured(touchstone, touchstone.file("press.glb") + " --suite mesh", "mesh");

    std::map<std::pair<std::string, bool>, int> ticks;  // by the motion, and whether a thread of their own finds lists
    for (const json& row : results.at("rows")) {
        const std::string key = row.at("key").get<std::string>();
        INFO(key << ": " << row.at("why"));
        const bool listWorker = key.find("/list-worker") != std::string::npos;
        ticks[{row.at("motion").get<std::string>(), listWorker}] = row.at("ticks").get<int>();
        CHECK(row.at("valid") == true);
        CHECK(row.at("geometry") == "mesh");
        CHECK(row.at("tool_leaves").is_null());
        CHECK(row.at("tool_triangles") == 12);
        CHECK(row.at("obstacle_triangles") == 12);
        CHECK(row.at("surface_bytes_per_triangle") > 100);  // a face and its normal take that much with their tree
        CHECK(row.at("open_cpu_s") > 0);
        CHECK(row.at("samples") == 0);
        CHECK(row.at("clearance_mm") == (fits ? json(0.5) : json()));
        CHECK((row.at("list_worker_p999_us") > 0) == listWorker);
        CHECK(row.at("run_ticks") >= row.at("ticks"));
    }
    CHECK(results.at("qp").empty());
    CHECK_FALSE(fs::exists(touchstone.file("cache")));  // no sphere tree was built
    const int one = ticks[{"hard-05-teleport", false}];
    REQUIRE(one > 0);
    using Ticks = decltype(ticks);
    const std::string rest = fits ? "motion" : "together";
    const int all = fits ? one : 3 * one;
    CHECK(ticks == Ticks{{{"hard-05-teleport", false}, one},
                         {{"hard-05-teleport", true}, one},
                         {{rest, false}, all},
                         {{rest, true}, all}});
}

TEST_CASE("bench: the friction solvers are measured on the same contacts, with the errors of their laws", "[program]") {
    const Program touchstone;
    const std::string csv = touchstone.file("friction.csv");
    const Answer answer = touchstone("bench friction --quick --csv " + csv);
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    const Table table = tableOf(csv);
    const std::size_t pads = 3, perPad = 1 + frictionSolverTable().size();
    REQUIRE(table.size() == pads * perPad);
    for (std::size_t i = 0; i < table.size(); ++i) {
        const auto& row = table[i];
        const std::string name = row.at("solver");
        const auto number = [&](const char* column) { return std::stod(row.at(column)); };
        const bool flat = i >= 2 * perPad;
        INFO(name << " on " << row.at("feet") << (flat ? ", flat" : ""));
        CHECK(number("feet") == (i < perPad ? 3 : 18));
        CHECK(row.at("flat") == (flat ? "true" : "false"));
        CHECK(number("p999_us") >= number("median_us"));
        CHECK(number("p999_us") >= number("shortest_p999_us"));
        CHECK(number("ticks") >= 500);
        CHECK_THAT(answer.out, Catch::Contains(" " + name + " "));
        if (row.at("friction") == "false") {
            CHECK(name == kExactName);
            CHECK(row.at("error_max_N").empty());
            continue;
        }
        CHECK(number("contacts_p50") == Approx(number("feet")).margin(2));
        if (name == "cone-newton") {
            CHECK(number("loaded_p50") >= (flat ? 16 : 3));
            CHECK(row.at("error_max_N").empty());
            CHECK(number("residual_max_N") < 1e-9);
            CHECK(number("hover_max_mm") < 1e-9);
            CHECK(number("missing_share") < 0.02);
        }
        if (flat) continue;  // nothing slides there, so all laws agree
        const FrictionLaw& law = findFrictionSolver(name)->law;
        if (!row.at("error_max_N").empty() && number("missing_share") < 0.5)
            CHECK((number("error_max_N") > 0.01) == (law.facets > 0));
        if (law.hovers) CHECK(number("hover_max_mm") > 1e-3);
    }
    // The part of the docs that shows it.
    fs::create_directory(touchstone.file("docs"));
    const std::string docs = touchstone.file("docs/benchmarks.md");
    std::ofstream(docs) << "before <!-- friction: made by tools/document_bench --><!-- end of friction --> after";
    const std::string make = "cd '" + touchstone.file("") +
                             "' && python3 '" TOUCHSTONE_SOURCE_DIR "/tools/friction_page.py' friction.csv 2>/dev/null";
    REQUIRE(std::system(make.c_str()) == 0);
    const std::string text = textOf(docs);
    CHECK_THAT(text, Catch::StartsWith("before ") && Catch::EndsWith(" after"));
    for (const FrictionSolverInfo& info : frictionSolverTable())
        for (const char* feet : {"| 3 | `", "| 18 | `", "| 18, flat | `"})
            CHECK_THAT(text, Catch::Contains(feet + std::string(info.name)));
}

TEST_CASE("bench: wrong usage is one sentence", "[program]") {
    const Program touchstone;
    const std::string press = pressFile(touchstone), out = " --out " + touchstone.file("out");
    for (const auto& [args, code] :
         std::vector<std::pair<std::string, int>>{{press, 2},
                                                  {press + out + " --suite soft", 2},
                                                  {press + out + " --shard 3", 2},
                                                  {press + out + " --shard 0/2", 2},
                                                  {press + out + " --shard 3/2", 2},
                                                  {press + out + " --shard 1/2x", 2},
                                                  {"nowhere" + out, 1},
                                                  {"hello" + out + "/" + std::string(300, 'x'), 1},
                                                  {press + " --out /proc/no", 1},
                                                  {"merge " + press, 2}}) {
        INFO(args);
        const Answer answer = touchstone("bench " + args);
        INFO(answer.err);
        CHECK(answer.code == code);
        CHECK(isOneSentence(answer.err));
    }
}

}  // namespace touchstone::bench_program_tests
