// Where a tool of STEP files goes, found by touchstone new, and what overrules it.
#include <cmath>
#include <nlohmann/json.hpp>

#include "haptics/sandbox/scene/scene_world.hpp"
#include "tests/program/program.hpp"

namespace touchstone::mates_program_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

/// Whether Open Cascade was found when this was built; if not, step_program_tests.cpp tests what is said instead.
bool readsStep() { return fs::exists(TOUCHSTONE_BINARY_DIR "/touchstone-step"); }

/// Draws a part into the program's folder; lengths in mm.
void drawPart(const Program& program, const std::string& name, const std::string& options) {
    const std::string command =
        "'" TOUCHSTONE_BINARY_DIR "/make_step_parts' " + name + " '" + program.file(name + ".step") + "' " + options;
    INFO(command);
    REQUIRE(std::system(command.c_str()) == 0);
}

GoalRegion goalOf(const Program& program, const std::string& scene) {
    sandbox::SceneOptions options;
    options.trees = false;
    return *sandbox::openScene(program.file(scene), options).roles.goal;
}

/// Makes a scene of tool and obstacle, whose demonstration must seat the tool, and returns what was printed.
std::string seatedFrom(const Program& touchstone, const std::string& tool, const std::string& obstacle) {
    const Answer made =
        touchstone("new --tool " + tool + ".step --obstacle " + obstacle + ".step --up z --demo -o a.glb");
    INFO(made.out << made.err);
    REQUIRE(made.code == 0);
    const Answer run = touchstone("run a.glb --headless --shadow none --report report.json");
    INFO(run.err);
    CHECK(run.code == 0);
    CHECK(json::parse(textOf(touchstone.file("report.json")))["outcome"]["met"] == true);
    return made.out;
}

}  // namespace

TEST_CASE("mates: parts modeled anywhere, in any unit, go together", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    SECTION("a peg in its hole") {
        drawPart(touchstone, "peg", "diameter=6.35 length=20 unit=inch pose=10,5,3,90,0,0");
        drawPart(touchstone, "block", "diameter=6.3627 length=25 unit=m pose=-5,0,0,0,45,30");
        const std::string said = seatedFrom(touchstone, "peg", "block");
        CHECK_THAT(said, Contains("the shaft of 6.350 mm goes into the hole of 6.3627 mm of \"block\""));
        CHECK_THAT(said, Contains("its shoulder meets a face of \"block\""));
        CHECK(goalOf(touchstone, "a.glb").fold == 0);
        CHECK(goalOf(touchstone, "a.glb").depth == Approx(20).margin(1e-4));  // vertices are floats
    }
    SECTION("keys in their slots") {
        drawPart(touchstone, "spline-shaft", "diameter=30 keys=10 schema=AP242 pose=0,200,0,30,0,77");
        drawPart(touchstone, "spline-hub", "diameter=30 keys=10 clearance=0.03 schema=AP203 pose=9,0,0,0,0,5");
        CHECK_THAT(seatedFrom(touchstone, "spline-shaft", "spline-hub"),
                   Contains("30 faces along the axis meet theirs"));
        CHECK(goalOf(touchstone, "a.glb").fold == 10);
    }
    SECTION("a left-handed nut of three starts on its bolt") {
        drawPart(touchstone, "nut", "left=1 starts=3 pitch=1.5 diameter=10 unit=m pose=30,40,50,70,20,10");
        drawPart(touchstone, "bolt", "left=1 starts=3 pitch=1.5 diameter=10 unit=inch");
        CHECK_THAT(seatedFrom(touchstone, "nut", "bolt"), Contains("a left-handed thread of 4.500 mm per turn"));
        const GoalRegion goal = goalOf(touchstone, "a.glb");
        CHECK(goal.lead == Approx(-4.5).epsilon(1e-4));
        CHECK(goal.fold == 3);
    }
}

TEST_CASE("mates: options overrule what was found", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    drawPart(touchstone, "peg", "pose=100,0,0");
    drawPart(touchstone, "block", "");
    const auto depthWith = [&](const std::string& options) {
        const Answer made = touchstone("new --tool peg.step --obstacle block.step --up z -o a.glb " + options);
        INFO(made.out << made.err);
        REQUIRE(made.code == 0);
        return goalOf(touchstone, "a.glb").depth;
    };
    CHECK(depthWith("") == Approx(40).margin(1e-4));
    CHECK(depthWith("--goal 12mm") == Approx(12).margin(1e-4));
    CHECK(depthWith("--tool-pose -100mm,0,60mm") == Approx(40).margin(1e-4));  // it lies on its axis, and slides in
    CHECK(depthWith("--tool-pose -100mm,0,10mm --assembled") == Approx(30).margin(1e-4));

    // What is printed as found gives the same scene without a search.
    const Answer found = touchstone("new --tool peg.step --obstacle block.step --up z -o a.glb");
    const std::size_t start = found.out.find("--tool-pose"), end = found.out.find(": give other values");
    REQUIRE(start != std::string::npos);
    const std::string options = found.out.substr(start, end - start);
    CHECK(options == "--tool-pose -100mm,0mm,0mm,0,0,0 --axis z --goal 40mm");
    CHECK(touchstone("new --no-mate --tool peg.step --obstacle block.step --up z -o b.glb " + options).code == 0);
    const GoalRegion a = goalOf(touchstone, "a.glb"), b = goalOf(touchstone, "b.glb");
    // Without the surfaces the axis is that of the box around the facets, which are within 1.2 µm of them.
    CHECK((a.X_WT.p - b.X_WT.p).norm() < 0.0024);
    CHECK(a.depth == Approx(b.depth).margin(1e-4));

    drawPart(touchstone, "nut", "");  // its thread fits no hole
    const Answer lost = touchstone("new --tool nut.step --obstacle block.step --up z -o d.glb");
    CHECK(lost.code == 0);
    CHECK_THAT(lost.out, Contains("warning: nothing of the tool fits into or over an obstacle"));

    const Answer none = touchstone("new --no-mate --tool peg.step --obstacle block.step --up z --demo -o c.glb");
    CHECK(none.code != 0);
    CHECK_THAT(none.err, Contains("--demo needs a goal"));
}

TEST_CASE("mates: a report has the tool's last pose as a motion in its file", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    drawPart(touchstone, "peg", "unit=inch pose=100,0,30,0,90,0");
    drawPart(touchstone, "block", "");
    REQUIRE(touchstone("new --tool peg.step --obstacle block.step --up z --demo -o a.glb").code == 0);
    REQUIRE(touchstone("run a.glb --headless --shadow none --report report.json").code == 0);
    const json pose = json::parse(textOf(touchstone.file("report.json")))["tool_pose"];
    INFO(pose.dump());
    CHECK(pose["frame"] == "file");
    CHECK(pose["unit_m"] == Approx(0.0254));
    // The peg lies along x about (100, 0, 30) mm, and stands in the block's hole about z at the end; the hole leaves it
    // 12 µm on each side, and 0.6 mrad over its length.
    const double unit = 25.4, wanted[4][4]{{0, 0, -1, 30 / unit}, {0, 1, 0, 0}, {1, 0, 0, -100 / unit}, {0, 0, 0, 1}};
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j)
            CHECK(pose["matrix"][i][j].get<double>() ==
                  Approx(wanted[i][j]).margin(j == 3 ? (0.012 + 100 * 0.0006) / unit : 0.0006));
}

TEST_CASE("mates: a part of an assembly goes where it is drawn", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    drawPart(touchstone, "housing-with-screws", "");
    const Answer made = touchstone("new housing-with-screws.step --tool 'screw 3' --up z --demo -o a.glb");
    INFO(made.out << made.err);
    REQUIRE(made.code == 0);
    CHECK_THAT(made.out, Contains("the shaft of 4.980 mm goes into the hole of 5.000 mm of \"housing\""));
    CHECK_THAT(made.out, Contains("the tool is modeled there"));
    CHECK(touchstone("run a.glb --headless --shadow none").code == 0);
}

}  // namespace touchstone::mates_program_tests
