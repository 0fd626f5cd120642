// Scenes from STEP files: those of tests/step/files, and what make_step_parts draws. Both need Open Cascade.
#include <cmath>
#include <nlohmann/json.hpp>

#include "haptics/loop/distances.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tests/program/program.hpp"

namespace touchstone::step_program_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using nlohmann::json;

namespace {

const std::string kFiles = TOUCHSTONE_SOURCE_DIR "/tests/step/files/";

/// Whether Open Cascade was found when this was built.
bool readsStep() { return fs::exists(TOUCHSTONE_BINARY_DIR "/touchstone-step"); }

/// Draws a part into the program's folder.
void draw(const Program& program, const std::string& name, const std::string& file, const std::string& options = {}) {
    const std::string command =
        "'" TOUCHSTONE_BINARY_DIR "/make_step_parts' " + name + " '" + program.file(file) + "' " + options;
    REQUIRE(std::system(command.c_str()) == 0);
}

sandbox::HapticScene open(const std::string& file) {
    sandbox::SceneOptions options;
    options.trees = false;
    return sandbox::openScene(file, options);
}

/// Whether new, fit and the surfaces agree on the clearance of a peg and its hole, drawn with these diameters in mm.
void checkFit(const std::string& options, double taken) {
    const Program touchstone;
    draw(touchstone, "peg", "peg.step", "diameter=9.98");
    draw(touchstone, "block", "block.step", "diameter=10");
    const Answer made =
        touchstone("new --tool peg.step --obstacle block.step --up z --assembled -o fit.glb " + options);
    INFO(made.err);
    REQUIRE(made.code == 0);
    CHECK_THAT(made.out, Contains("clearance 10 µm between the surfaces"));
    const sandbox::HapticScene scene = open(touchstone.file("fit.glb"));
    CHECK(scene.defects == std::vector<std::string>(2));  // both meshes are closed
    CHECK(scene.warnings.empty());
    const json fit = json::parse(touchstone("fit fit.glb --json").out);
    INFO(fit.dump());
    CHECK(fit["drawn"]["clearance_mm"].get<double>() == Approx(0.01).margin(1e-9));
    // Within what single precision leaves of coordinates of 10 mm, and the search for the most room, of 0.01 µm.
    CHECK(fit["drawn"]["tessellation_took_mm"].get<double>() == Approx(taken).margin(2e-5));
    CHECK(fit["drawn"]["deviation_mm"].get<double>() < 0.001);
}

}  // namespace

TEST_CASE("step: without the reader, a sentence says what to install", "[program]") {
    const Program touchstone;
    const Answer answer = touchstone("validate '" + kFiles + "stand-ap242.step'", "TOUCHSTONE_STEP=");
    CHECK(answer.code == 1);
    CHECK(isOneSentence(answer.err));
    CHECK_THAT(answer.err, Contains("libocct-data-exchange-dev"));
}

TEST_CASE("step: validate lists the tree of the parts", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    const Answer stand = touchstone("validate '" + kFiles + "stand-ap242.step'");
    CHECK(stand.code == 0);
    CHECK_THAT(stand.out, Contains("AP242, lengths in mm\n"
                                   "  stand\n"
                                   "    the pair\n"
                                   "      upright pin: 3 faces, 2356 mm³, at (20, 0, 8) mm\n"
                                   "      lying pin: 3 faces, 2356 mm³, at (-20, 0, 38) mm\n"
                                   "    the base: 3 faces, 4.021e+04 mm³, at (0, 0, 0) mm\n"
                                   "3 parts; "));
    // π/4 · 25.4² · 50.8 mm³
    CHECK_THAT(touchstone("validate '" + kFiles + "pin-ap203-inch.step'").out,
               Contains("AP203, lengths in in") && Contains("Länge") && Contains("3 faces, 2.574e+04 mm³"));
    CHECK_THAT(touchstone("validate '" + kFiles + "comment-in-entity.step'").out, Contains("6 faces, 4712 mm³"));
    CHECK_THAT(touchstone("validate '" + kFiles + "mirrored-ap214.step'").out,
               Contains("warning: mirrors 1 part") && Contains("solids of their own"));
}

TEST_CASE("step: files that hold no solid are refused in a sentence", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    const auto problem = [&](const std::string& file) {
        const Answer answer = touchstone("new --tool '" + kFiles + file + ".step' --obstacle '" + kFiles +
                                         "two-solids-ap203.step' -o fit.glb");
        INFO(file << ": " << answer.err);
        CHECK(answer.code == 1);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Contains(file));
        return answer.err;
    };
    CHECK_THAT(problem("not-step"), Contains("is not a STEP file"));
    CHECK_THAT(problem("other-schema"), Contains("AP203, AP214 or AP242"));
    CHECK_THAT(problem("cut-off"), Contains("is truncated"));
    CHECK_THAT(problem("surface-model"), Contains("part 'pin' is a surface model") && Contains("to a solid"));
    CHECK_THAT(problem("open-shell"), Contains("part 'pin'") && Contains("open at"));
    CHECK_THAT(problem("zero-size"), Contains("part 'pin' encloses no volume"));
    CHECK_THAT(problem("no-shape"), Contains("part 'pin' has no solid"));
    CHECK_THAT(problem("missing-entity"), Contains("part 'pin'"));
    CHECK_THAT(problem("malformed-operator"), Contains("makes Open Cascade crash") && Contains("heal the part"));
}

TEST_CASE("step: facets take from a clearance less than a tenth of it", "[program]") {
    if (!readsStep()) return;
    // The hole has its vertices on the surface, so that the middles of facets reach in by r (1 - cos(180° / facets)).
    // At the wider end of its chamfer, of 6 mm, 1 µm asks for 173 facets, of which 192 is the next count for holes.
    const double facets = 192, pi = std::acos(-1.0);
    checkFit("", 5 * (1 - std::cos(pi / facets)));
}

TEST_CASE("step: with --keep-clearance facets take nothing from it", "[program]") {
    if (!readsStep()) return;
    checkFit("--keep-clearance", 0);
}

TEST_CASE("step: a ball keeps its clearance in a socket, and both are closed", "[program]") {
    if (!readsStep()) return;
    const bool kept = GENERATE(false, true);
    CAPTURE(kept);
    const Program touchstone;
    draw(touchstone, "ball", "ball.step", "diameter=19.98");
    draw(touchstone, "socket", "socket.step", "diameter=20");
    const Answer made =
        touchstone("new --tool ball.step --obstacle socket.step --up z --assembled --no-mate -o fit.glb" +
                   std::string(kept ? " --keep-clearance" : ""));
    INFO(made.out << made.err);
    REQUIRE(made.code == 0);
    CHECK_THAT(made.out, Contains("clearance 10 µm between the surfaces"));
    const sandbox::HapticScene scene = open(touchstone.file("fit.glb"));
    CHECK(scene.defects == std::vector<std::string>(2));
    // Triangles deviate by up to a tenth of the clearance, and single precision of coordinates of 20 mm by 1 nm.
    const double clearance = trueClearance(*scene.world, scene.roles.goal->X_WT), drawn = 0.01, rounding = 2e-5;
    CHECK(clearance > drawn - (kept ? 0 : 0.1 * drawn) - rounding);
    CHECK(clearance < drawn + 0.2 * drawn + rounding);

    // A hollow that is as small as the deviation stays in its block.
    draw(touchstone, "socket", "small.step", "diameter=0.1");
    const Answer small =
        touchstone("new --tool ball.step --obstacle small.step --no-mate --deviation 0.05mm -o small.glb" +
                   std::string(kept ? " --keep-clearance" : ""));
    INFO(small.out << small.err);
    CHECK_THAT(small.out, Contains("small, 0.2 x 0.2 x 0.1 mm"));
    CHECK(open(touchstone.file("small.glb")).defects == std::vector<std::string>(2));
}

TEST_CASE("step: spheres and tori have points on lines and rows, in no more triangles than these need", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    draw(touchstone, "ball", "ball.step", "diameter=20 rod=0");
    draw(touchstone, "ring", "ring.step", "diameter=40 wire=8");
    draw(touchstone, "grooved-shaft", "shaft.step", "diameter=40 wire=8");
    const Answer made = touchstone(
        "new --tool ball.step --obstacle ring.step --obstacle shaft.step --deviation 0.01mm --no-mate -o a.glb");
    INFO(made.out << made.err);
    REQUIRE(made.code == 0);
    // Chords of each of both directions deviate by half of what triangles may; counts of shafts are odd, and no
    // multiple of 3.
    const auto chords = [](double radius) { return std::ceil(std::acos(-1.0) / std::acos(1 - 0.005 / radius)); };
    const auto facets = [&](double radius) {
        int count = int(chords(radius));
        while (count % 2 == 0 || count % 3 == 0) ++count;
        return count;
    };
    // Half as many rows as there are chords in a turn, of which those at the poles have one triangle for each line.
    const int ball = 2 * facets(10) * (int(std::ceil(chords(10) / 2)) - 1), ring = 2 * facets(24) * int(chords(4));
    CHECK_THAT(made.out, Contains(", " + std::to_string(ball) + " triangles within ") &&
                             Contains(", " + std::to_string(ring) + " triangles within "));
    CHECK(open(touchstone.file("a.glb")).defects == std::vector<std::string>(3));
}

TEST_CASE("step: a bolt and a nut keep the clearance that was drawn, and are closed", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    draw(touchstone, "bolt", "bolt.step");
    draw(touchstone, "nut", "nut.step");
    const Answer made =
        touchstone("new --tool nut.step --obstacle bolt.step --up z --no-mate --keep-clearance -o fit.glb");
    INFO(made.err);
    REQUIRE(made.code == 0);
    // Crest and root are drawn 0.1 mm apart: the helices have facets of a tenth of that, and no more than these need.
    CHECK_THAT(made.out, Contains("clearance 0.1 mm"));
    const sandbox::HapticScene scene = open(touchstone.file("fit.glb"));
    CHECK(scene.defects == std::vector<std::string>(2));
    std::size_t faces = 0;
    for (const Surface* surface : {scene.world->tool.surface.get(), scene.world->obstacles[0].part.surface.get()})
        faces += surface->features.faces.size();
    CHECK(faces < 12000);
}

TEST_CASE("step: the parts of an assembly are tool and obstacles where they are", "[program]") {
    if (!readsStep()) return;
    const Program touchstone;
    draw(touchstone, "housing-with-screws", "housing.step");
    const Answer made = touchstone("new housing.step --tool 'screw 3' --up z --assembled --demo -o fit.glb");
    INFO(made.err);
    REQUIRE(made.code == 0);
    CHECK_THAT(made.out,
               Contains("tool      screw 3") && Contains("obstacle  housing") && Contains("obstacle  screw 6"));
    const sandbox::HapticScene all = open(touchstone.file("fit.glb"));
    CHECK(all.world->obstacles.size() == 6);
    REQUIRE(all.roles.goal);
    // The file has it at (0, -10, 0) with z up. The origin is the middle of a box around facets, within 1 µm.
    CHECK(std::abs(all.roles.goal->X_WT.p.x()) < 0.001);
    CHECK(std::abs(all.roles.goal->X_WT.p.z() - 10) < 0.001);
    const engine::Registry& registry = all.scene.registry;
    CHECK(registry.get<engine::Name>(all.roles.tool).value == "screw 3");

    REQUIRE(touchstone("new housing.step --tool 'screw 3' --obstacle housing -o two.glb").code == 0);
    CHECK(open(touchstone.file("two.glb")).world->obstacles.size() == 1);
    const Answer wrong = touchstone("new housing.step --tool 'skrew 3' -o three.glb");
    CHECK(wrong.code == 1);
    CHECK_THAT(wrong.err, Contains("has no part 'skrew 3'; did you mean 'screw 3'?"));
}

TEST_CASE("step: options of other files are refused", "[program]") {
    const Program touchstone;
    const std::string meshes =
        "new --tool '" TOUCHSTONE_SOURCE_DIR "/docs/examples/peg.stl' --obstacle '" TOUCHSTONE_SOURCE_DIR
        "/docs/examples/block.stl' -o fit.glb ";
    CHECK_THAT(touchstone(meshes + "--keep-clearance").err, Contains("are for STEP files"));
    CHECK(touchstone(meshes + "--keep-clearance").code == 2);
    CHECK_THAT(touchstone("new fit.glb --tool a -o b.glb").err, Contains("an assembly is a .step or .stp file"));
    if (readsStep())
        CHECK_THAT(touchstone("new '" + kFiles + "stand-ap242.step' --tool 'the base' --deviation 0 -o b.glb").err,
                   Contains("--deviation takes a length"));
}

}  // namespace touchstone::step_program_tests
