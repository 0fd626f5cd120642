// The command qp, and run --dump-qp.
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/scene/gltf_write.hpp"
#include "tests/program/program.hpp"

namespace touchstone::qp_program_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

const std::string kContactG = R"("G":[1,1,1,1000,1000,1000])";

/// The answers, one per line.
std::vector<json> answersOf(const std::string& out) {
    std::vector<json> answers;
    std::istringstream lines(out);
    for (std::string line; std::getline(lines, line);) answers.push_back(json::parse(line));
    return answers;
}

struct Solved {
    Answer program;
    std::vector<json> answers;
};
Solved solve(const Program& touchstone, const std::string& lines, const std::string& options = "") {
    std::ofstream(touchstone.file("problems.jsonl")) << lines;
    const Answer answer = touchstone("qp " + touchstone.file("problems.jsonl") + " " + options);
    return {answer, answersOf(answer.out)};
}

/// A floor with h one below it, and a wall that is not reached: x = (0.3, 0, 0), y = (1, 0).
std::string floorLine(double floorScale = 1, double wallScale = 1) {
    const json floor = {0, 0, floorScale, 0, 0, 0}, wall = {wallScale, 0, 0, 0, 0, 0};
    return "{" + kContactG + R"(,"J":)" + json({floor, wall}).dump() + R"(,"g":)" + json({0, wallScale}).dump() +
           R"(,"h":[0.3,0,-1,0,0,0]})" + "\n";
}

void checkFloor(const json& answer, double floorScale) {
    INFO(answer.dump());
    CHECK(answer.at("status") == "solved");
    REQUIRE(answer.at("x").size() == 6);
    CHECK(answer["x"][0].get<double>() == Approx(0.3).epsilon(1e-12));
    CHECK(answer["x"][2].get<double>() == Approx(0).margin(1e-12));
    REQUIRE(answer.at("y").size() == 2);
    CHECK(answer["y"][0].get<double>() == Approx(1 / floorScale).epsilon(1e-9));  // of the row as given
    CHECK(answer["y"][1] == 0);
    CHECK(answer.at("iterations") == 1);
    CHECK(answer.at("us") > 0);
    for (const char* key : {"primal_mm", "dual_N", "stationarity_N", "complementarity_mJ"})
        CHECK(answer.at("kkt").at(key) <= 1e-12);
}

}  // namespace

TEST_CASE("qp: rows of any scale and any positive G are answered in the given rows' multipliers", "[program]") {
    const Program touchstone;
    std::string lines;
    const std::vector<double> scales{1, 1e-6, 1e6, 1e-150, 1e150, 1e-300};
    for (const double scale : scales) lines += floorLine(scale, 1 / scale);
    Solved solved = solve(touchstone, lines);
    CHECK(solved.program.code == 0);
    REQUIRE(solved.answers.size() == scales.size());
    for (std::size_t i = 0; i < scales.size(); ++i) checkFloor(solved.answers[i], scales[i]);

    // One newton per meter and a depth of a nanometer, in meters: the force is accurate to its last digits.
    solved =
        solve(touchstone, R"({"G":[1e-9,1e-9,1e-9,1e-9,1e-9,1e-9],"J":[[0,0,1,0,0,0]],"g":[0],"h":[0,0,-1e-9,0,0,0]})"
                          "\n"
                          R"({"G":[1e9,1e9,1e9,1e12,1e12,1e12],"J":[[0,0,5,0,0,0]],"g":[0],"h":[0,0,-1e6,0,0,0]})");
    REQUIRE(solved.answers.size() == 2);
    CHECK(solved.answers[0]["y"][0].get<double>() == Approx(1e-18).epsilon(1e-9));
    CHECK(std::abs(solved.answers[0]["x"][2].get<double>()) <= 1e-20);
    CHECK(solved.answers[1]["y"][0].get<double>() == Approx(2e14).epsilon(1e-9));

    // Overlaps far below the resolution of doubles near one, and numbers that span the range of doubles.
    for (const char* problem : {R"({"G":[1,1,1,1,1,1],"J":[[1,0,0,0,0,0]],"g":[-1e-15],"h":[0,0,0,0,0,0]})",
                                R"({"G":[1,1,1,1,1,1],"J":[[1e15,0,0,0,0,0]],"g":[-1],"h":[0,0,0,0,0,0]})",
                                R"({"G":[1,1,1,1,1,1],"J":[[1,0,0,0,0,0]],"g":[-1e-17],"h":[0,0,0,0,0,0]})",
                                R"({"G":[1,1,1,1,1,1],"J":[[1e160,1e160,0,0,0,0]],"g":[-1],"h":[0,0,0,0,0,0]})",
                                R"({"G":[1e160,1,1,1,1,1e-160],"J":[[1,1,0,0,0,0]],"g":[-1],"h":[0,0,0,0,0,0]})"}) {
        INFO(problem);
        solved = solve(touchstone, problem);
        REQUIRE(solved.answers.size() == 1);
        CHECK(solved.answers[0]["status"] == "solved");
        CHECK(solved.answers[0]["kkt"]["primal_mm"] <= 1e-30);
    }
}

TEST_CASE("qp: residuals are those of rows of unit normal", "[program]") {
    const Program touchstone;
    // Two rows of length 1000 that contradict each other by 0.2 mm: the elastic answer violates each by 0.1 mm.
    const Solved solved =
        solve(touchstone,
              "{" + kContactG + R"(,"J":[[0,0,1000,0,0,0],[0,0,-1000,0,0,0]],"g":[-100,-100],"h":[1,0,0,0,0,0]})");
    REQUIRE(solved.answers.size() == 1);
    CHECK(solved.answers[0].at("status") == "infeasible-elastic");
    CHECK(solved.answers[0].at("kkt").at("primal_mm").get<double>() == Approx(0.1));
    CHECK(solved.answers[0].at("x")[0].get<double>() == Approx(1));
}

TEST_CASE("qp: a zero row is dropped, and makes the problem infeasible if its gap is negative", "[program]") {
    const Program touchstone;
    const auto with = [&](const char* gap) {
        return "{" + kContactG + R"(,"J":[[0,0,0,0,0,0],[0,0,1,0,0,0]],"g":[)" + gap + R"(,0],"h":[0,0,-1,0,0,0]})" +
               "\n";
    };
    for (const SolverInfo& info : solverTable()) {
        const std::string solver(info.name);
        INFO(solver);
        const Solved solved =
            solve(touchstone, with("0") + with("2") + with("-1e-9"), "--tolerance 1e-6 --solver " + solver);
        REQUIRE(solved.answers.size() == 3);
        CHECK(solved.answers[0].at("status") == "solved");
        CHECK(solved.answers[1].at("status") == "solved");
        CHECK(solved.answers[2].at("status") == "infeasible-elastic");
        for (const json& answer : solved.answers) {
            CHECK(answer["y"][0] == 0);
            CHECK(answer["y"][1].get<double>() == Approx(1).epsilon(1e-5));
        }
    }
}

TEST_CASE("qp: NaN, infinity and broken lines are answered invalid, and the run continues", "[program]") {
    const Program touchstone;
    const std::string rest = R"(,"J":[[0,0,1,0,0,0]],"g":[0],"h":[0,0,)";
    const std::string nan = "{" + kContactG + rest + "NaN,0,0,0]}\n",
                      minus = "{" + kContactG + rest + "-Infinity,0,0,0]}\n",
                      large = "{" + kContactG + rest + "1e999,0,0,0]}\n",
                      stiffness = R"({"G":[1,1,1,1,0,1])" + rest + "-1,0,0,0]}\n";
    Solved solved = solve(touchstone, nan + "\n" + minus + large + stiffness + floorLine());
    CHECK(solved.program.code == 0);
    CHECK(solved.program.err.empty());
    REQUIRE(solved.answers.size() == 5);
    CHECK_THAT(solved.answers[0].at("why").get<std::string>(), Contains("h[2] is NaN"));
    CHECK_THAT(solved.answers[1].at("why").get<std::string>(), Contains("h[2] is -Infinity"));
    CHECK_THAT(solved.answers[2].at("why").get<std::string>(), Contains("too large"));
    CHECK_THAT(solved.answers[3].at("why").get<std::string>(), Contains("G[4]"));
    for (int i = 0; i < 4; ++i) CHECK(solved.answers[static_cast<std::size_t>(i)].at("status") == "invalid");
    checkFloor(solved.answers[4], 1);

    const std::vector<std::pair<std::string, std::string>> broken{
        {"{", "not JSON"},
        {"[1,2]", "JSON object"},
        {R"({"G":[1,1,1,1,1,1],"J":[],"g":[]})", "'h' is missing"},
        {R"({"G":[1,1,1],"J":[],"g":[],"h":[0,0,0,0,0,0]})", "G must be a list of six numbers, not 3"},
        {"{" + kContactG + R"(,"J":[[0,0,1]],"g":[0],"h":[0,0,0,0,0,0]})", "J[0] must be a list of six"},
        {"{" + kContactG + R"(,"J":[],"g":[1],"h":[0,0,0,0,0,0]})", "g has 1 entries, but J has 0 rows"},
        {"{" + kContactG + R"(,"J":[[0,0,1,0,0,"x"]],"g":[1],"h":[0,0,0,0,0,0]})", "J[0][5] must be a number"},
        {"{" + kContactG + R"(,"J":[[0,0,1,0,0,0]],"g":[1],"h":[0,0,0,0,0,0],"ids":[1.5]})", "ids[0]"}};
    for (const auto& [line, why] : broken) {
        INFO(line);
        solved = solve(touchstone, line + "\n" + floorLine());
        CHECK(solved.program.code == 1);
        REQUIRE(solved.answers.size() == 2);
        CHECK(solved.answers[0].at("status") == "invalid");
        CHECK_THAT(solved.answers[0].at("why").get<std::string>(), Contains(why));
        CHECK(std::count(solved.program.err.begin(), solved.program.err.end(), '\n') == 1);
        CHECK_THAT(solved.program.err, Contains("problems.jsonl, line 1") && Contains(why));
        checkFloor(solved.answers[1], 1);
    }
}

TEST_CASE("qp: ids of 64 bits start the next line only with --warm, in any order", "[program]") {
    const Program touchstone;
    // A corner of three walls, each a pivot; the second line has the rows in reverse order.
    const std::string start = "{" + kContactG, h = R"(,"g":[0,0,0],"h":[-1,-1,-1,0,0,0])";
    const std::string lines = start + R"(,"J":[[1,0,0,0,0,0],[0,1,0,0,0,0],[0,0,1,0,0,0]])" + h +
                              R"(,"ids":[18446744073709551615,-2,7]})" + "\n" + start +
                              R"(,"J":[[0,0,1,0,0,0],[0,1,0,0,0,0],[1,0,0,0,0,0]])" + h +
                              R"(,"ids":[7,-2,18446744073709551615]})" + "\n";
    for (const auto& [options, again] : {std::pair{"", 3}, std::pair{"--warm", 0}}) {
        const Solved solved = solve(touchstone, lines, options);
        REQUIRE(solved.answers.size() == 2);
        CHECK(solved.answers[0].at("iterations") == 3);
        CHECK(solved.answers[1].at("iterations") == again);
        for (const json& answer : solved.answers)
            for (const json& y : answer.at("y")) CHECK(y.get<double>() == Approx(1).epsilon(1e-12));
    }
}

TEST_CASE("qp: paper mode takes the rows unscaled", "[program]") {
    const Program touchstone;
    const std::string zero =
        "{" + kContactG + R"(,"J":[[0,0,0,0,0,0],[0,0,1,0,0,0]],"g":[0,0],"h":[0,0,-1,0,0,0]})" + "\n";
    const Solved solved = solve(touchstone, floorLine() + zero,
                                "--mode paper --solver " + solverNames(false).front() + " --tolerance 1e-9");
    REQUIRE(solved.answers.size() == 2);
    CHECK(solved.answers[0].at("status") == "solved");
    CHECK(solved.answers[0]["y"][0].get<double>() == Approx(1).epsilon(1e-4));
    CHECK(solved.answers[1].at("status") == "invalid");
    CHECK_THAT(solved.answers[1].at("why").get<std::string>(), Contains("zero row"));
}

TEST_CASE("qp: gives the same answers as the run that wrote the problems", "[program]") {
    const Program touchstone;
    engine::writeGltf(pressScene(), touchstone.file("press.glb"));
    const std::string dump = touchstone.file("dump.jsonl");
    for (const std::string& mode : {std::string("default"), "paper --solver " + kExactName}) {
        INFO(mode);
        Answer answer =
            touchstone("run " + touchstone.file("press.glb") + " --headless --mode " + mode + " --dump-qp " + dump);
        INFO(answer.err);
        REQUIRE(answer.code != 1);
        const std::vector<json> problems = answersOf(textOf(dump));
        REQUIRE(problems.size() > 300);
        for (const char* warm : {"", " --warm"}) {
            answer = touchstone("qp " + dump + warm);
            CHECK(answer.code == 0);
            const std::vector<json> answers = answersOf(answer.out);
            REQUIRE(answers.size() == problems.size());
            int rows = 0;
            for (std::size_t i = 0; i < answers.size(); ++i) {
                REQUIRE(problems[i].at("ids").size() == problems[i].at("J").size());
                rows += static_cast<int>(problems[i].at("J").size());
                for (std::size_t k = 0; k < 6; ++k)
                    REQUIRE(answers[i]["x"][k].get<double>() == Approx(problems[i]["x"][k].get<double>()).margin(1e-9));
            }
            CHECK(rows > 1000);
        }
    }
}

TEST_CASE("qp: wrong usage is one sentence", "[program]") {
    const Program touchstone;
    engine::writeGltf(pressScene(), touchstone.file("press.glb"));
    std::ofstream(touchstone.file("p.jsonl")) << floorLine();
    for (const auto& [args, code] : std::vector<std::pair<std::string, int>>{
             {"qp", 2},
             {"qp /no/such.jsonl", 1},
             {"qp " + touchstone.file("."), 1},
             {"qp " + touchstone.file("p.jsonl") + " --mode penalty", 2},
             {"qp " + touchstone.file("p.jsonl") + " --solver magic", 2},
             {"qp " + touchstone.file("p.jsonl") + " --mode papery", 2},
             {"qp " + touchstone.file("p.jsonl") + " --tolerance -1", 2},
             {"run " + touchstone.file("press.glb") + " --dump-qp " + touchstone.file("d.jsonl"), 2},
             {"run " + touchstone.file("press.glb") + " --headless --dump-qp /no/such/folder/d.jsonl", 1}}) {
        INFO(args);
        const Answer answer = touchstone(args);
        INFO(answer.err);
        CHECK(answer.code == code);
        CHECK(isOneSentence(answer.err));
    }
}

TEST_CASE("bench qp: a table of every solver against rows, and the exact ones without error", "[program]") {
    const Program touchstone;
    const Answer answer = touchstone("bench qp --quick --csv " + touchstone.file("qp.csv"));
    INFO(answer.err);
    REQUIRE(answer.code == 0);
    std::istringstream lines(textOf(touchstone.file("qp.csv")));
    std::string line;
    std::getline(lines, line);
    CHECK(line == "rows,solver,form,tolerance,start,median_us,p99_us,iterations,median_error_N,worst_error_N,unsolved");
    std::size_t count = 0;
    while (std::getline(lines, line)) {
        ++count;
        std::vector<std::string> fields;
        std::istringstream parts(line);
        for (std::string field; std::getline(parts, field, ',');) fields.push_back(field);
        REQUIRE(fields.size() == 11);
        if (fields[1] == kExactName) CHECK(std::stod(fields[9]) <= 1e-9);
    }
    // Every exact solver once and the program's own also warm; every approximate one in four ways, and up to 1,024
    // rows, which are six of the eight counts, in two more of the paper's form.
    const std::size_t exact = solverNames(true).size() + 1, approximate = solverNames(false).size();
    CHECK(count == 8 * (exact + 4 * approximate) + 6 * 2 * approximate);
}

TEST_CASE("qp: on the graphics card a batch has the answers of the processor's pqp, line by line", "[gl]") {
    const Program touchstone;
    const std::string lines = floorLine() + "{broken\n" + floorLine(2, 3) + floorLine(1e-3);
    const Solved card = solve(touchstone, lines, "--solver pqp-gpu --tolerance 1e-3"),
                 processor = solve(touchstone, lines, "--solver pqp --tolerance 1e-3");
    INFO(card.program.err);
    CHECK(card.program.code == 1);  // a line is broken
    CHECK_THAT(card.program.err, Contains("3 problems") && Contains("a second") && Contains("upload") &&
                                     Contains("dispatch") && Contains("solve") && Contains("download"));
    REQUIRE(card.answers.size() == 4);
    for (std::size_t i = 0; i < 4; ++i) {
        CAPTURE(i, card.answers[i].dump(), processor.answers[i].dump());
        CHECK(card.answers[i].at("status") == processor.answers[i].at("status"));
        for (std::size_t k = 0; k < 6; ++k)
            CHECK(card.answers[i]["x"][k].get<double>() ==
                  Approx(processor.answers[i]["x"][k].get<double>()).margin(2e-3));
    }
    CHECK_THAT(solve(touchstone, lines, "--solver pqp-gpu --warm").program.err, Contains("--warm"));
}

TEST_CASE("pqp-gpu: where it cannot be used, a run says so and goes on, and measurements refuse", "[gl]") {
    const Program touchstone;
    const char* old = "MESA_GL_VERSION_OVERRIDE=3.3";
    const Answer run = touchstone("run plate --headless --seconds 0.1 --solver pqp-gpu --shadow pqp-gpu", old);
    INFO(run.err);
    CHECK(run.code == 0);
    CHECK_THAT(run.err,
               Contains("pqp-gpu is not used here, and pqp solves on the processor: ") && Contains("OpenGL 4.3"));
    CHECK_THAT(run.out, Contains("solver pqp, shadow pqp"));
    for (const char* command :
         {"compare plate --seconds 0.1 --solvers pqp-gpu", "bench qp --gpu", "bench --quick --gpu --out never"}) {
        const Answer answer = touchstone(command, old);
        CAPTURE(command, answer.err);
        CHECK(answer.code == 1);
        CHECK(answer.out.empty());
        CHECK_THAT(answer.err, Contains("pqp-gpu cannot be") && Contains("OpenGL 4.3"));
    }
}

TEST_CASE("qp: without a card that can, one sentence says why, and the processor solves", "[gl]") {
    const Program touchstone;
    std::ofstream(touchstone.file("problems.jsonl")) << floorLine();
    const std::string command = "qp " + touchstone.file("problems.jsonl") + " --solver pqp-gpu";
    for (const char* environment : {"MESA_GL_VERSION_OVERRIDE=3.3", "TOUCHSTONE_SHADERS=/nowhere"}) {
        const Answer answer = touchstone(command, environment);
        CAPTURE(environment, answer.err);
        CHECK(answer.code == 0);
        CHECK_THAT(answer.err, Contains("pqp-gpu cannot be used, and pqp solves on the processor: "));
        REQUIRE(answersOf(answer.out).size() == 1);
        CHECK(answersOf(answer.out)[0].at("status") == "solved");
    }
}

}  // namespace touchstone::qp_program_tests
