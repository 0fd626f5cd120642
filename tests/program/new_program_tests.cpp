// The command new, with the parts of docs/first-parts.md and with boxes.
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/scene/gltf_write.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tests/program/program.hpp"
#include "tools/parts/nut.hpp"

namespace touchstone::new_program_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using nlohmann::json;

namespace {

const std::string kExamples = TOUCHSTONE_SOURCE_DIR "/docs/examples/";
const std::string kParts = "new --tool " + kExamples + "peg.stl --obstacle " + kExamples + "block.stl --up z ";

sandbox::HapticScene open(const std::string& file) {
    sandbox::SceneOptions options;
    options.buildWorld = false;
    return sandbox::openScene(file, options);
}

/// Writes a box as OBJ, two opposite corners in its file's unit, maybe without its last sides: +x, -x, +y, -y, ...
void writeBox(const std::string& file, const glm::dvec3& low, const glm::dvec3& high, int without = 0) {
    std::ofstream out(file);
    for (int i = 0; i < 8; ++i)
        out << "v " << (i & 1 ? high.x : low.x) << ' ' << (i & 2 ? high.y : low.y) << ' ' << (i & 4 ? high.z : low.z)
            << '\n';
    const char* sides[]{"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"};
    for (int i = 0; i + without < 6; ++i) out << "f " << sides[i] << '\n';
}

Vec3 goalOf(const sandbox::HapticScene& scene) {
    REQUIRE(scene.roles.goal);
    return scene.roles.goal->X_WT.p;
}

}  // namespace

TEST_CASE("new: parts in assembled position make a scene whose demonstration seats the tool", "[program]") {
    const Program touchstone;
    const std::string scene = touchstone.file("my fit.glb");
    const Answer made = touchstone(kParts + "--assembled --demo --tool-name 'my peg' -o '" + scene + "'");
    INFO(made.err);
    REQUIRE(made.code == 0);
    CHECK_THAT(made.out, Contains("my peg, 18 x 51 x 18 mm") && Contains("block, 40 x 35 x 40 mm"));

    const sandbox::HapticScene opened = open(scene);
    CHECK(opened.warnings.empty());
    CHECK(opened.scene.registry.get<engine::Name>(opened.roles.tool).value == "my peg");
    // The tip of the peg is its origin; it ends 25 mm deep, and starts a tenth of its size above the block.
    CHECK((goalOf(opened) - Vec3(0, -25, 0)).norm() < 1e-5);
    CHECK(opened.roles.goal->depth == Approx(25));
    const Vec3 start = sandbox::startPose(opened).p;
    CHECK((start - Vec3(0, 0.1 * std::sqrt(18 * 18 * 2 + 51 * 51), 0)).norm() < 1e-3);

    // The printed commands run as they stand.
    std::istringstream lines(made.out.substr(made.out.find("Next:\n") + 6));
    int commands = 0;
    for (std::string line; std::getline(lines, line);) {
        const std::size_t end = line.find("/touchstone ");
        REQUIRE(end != std::string::npos);
        const std::string arguments = line.substr(end + 12);
        const bool window = arguments.find("run") == 0 && arguments.find("--headless") == std::string::npos;
        const Answer answer = touchstone(arguments + (window ? " --headless" : ""));
        INFO(line << '\n' << answer.out << answer.err);
        CHECK(answer.code == 0);
        if (arguments.find("run") == 0) CHECK_THAT(answer.out, Contains("expected outcome: met"));
        if (arguments.find("fit") == 0) CHECK_THAT(answer.out, Contains("goes in with 0.19"));
        ++commands;
    }
    CHECK(commands == 3);

    // A run that stops before the tool is seated does not say that it is.
    const Answer stopped =
        touchstone("run 'my fit.glb' --headless --seconds 2.6 --report " + touchstone.file("stopped.json"));
    CHECK(stopped.code == 0);
    CHECK_THAT(stopped.out, Contains("expected outcome: not judged, since the run stopped before the end"));
    CHECK(json::parse(textOf(touchstone.file("stopped.json"))).at("outcome").at("checks_left") == 3);

    // A study finds a scene beside its protocol.
    fs::create_directory(touchstone.file("sub"));
    fs::copy(scene, touchstone.file("sub/peg.glb"));
    std::ofstream(touchstone.file("sub/study.json"))
        << R"({"format": "touchstone trials", "version": 1, "participants": 1, "scene": "peg.glb",)"
           R"( "conditions": [{"name": "a"}]})";
    const Answer study = touchstone("trials sub/study.json --headless --out study");
    INFO(study.err);
    CHECK(study.code == 0);
    CHECK_THAT(study.out + study.err, Contains("seated after"));
    CHECK(fs::file_size(touchstone.file("my fit.png")) > 1000);
}

TEST_CASE("new: the commands of docs/first-parts.md run as they stand", "[program][slow]") {
    const Program touchstone;
    for (const char* file : {"shaft.step", "housing.step", "peg.stl", "block.stl", "first-parts-study.json"})
        fs::copy(TOUCHSTONE_SOURCE_DIR "/docs/examples/" + std::string(file), touchstone.file(file));
    std::istringstream page(textOf(TOUCHSTONE_SOURCE_DIR "/docs/first-parts.md"));
    const std::string program = "touchstone ";
    const bool step = fs::exists(TOUCHSTONE_BINARY_DIR "/touchstone-step");  // else only meshes can be read
    int commands = 0;
    for (std::string line; std::getline(page, line);) {
        if (!line.starts_with(program) || line.find("--device mouse") != std::string::npos) continue;
        if (!step && line.find(".stl") == std::string::npos) continue;
        const Answer answer = touchstone(line.substr(program.size()));
        INFO(line << '\n' << answer.out << answer.err);
        CHECK(answer.code == 0);
        ++commands;
    }
    CHECK(fs::exists(touchstone.file("peg.glb")));
    CHECK(commands == (step ? 6 : 1));
    if (!step) return;
    CHECK(fs::exists(touchstone.file("fit.png")));
    const std::string trials = textOf(touchstone.file("study/trials.csv"));
    std::size_t seated = 0;
    for (std::size_t at = 0; (at = trials.find(",seated,", at)) != std::string::npos; ++at) ++seated;
    CHECK(seated == 10);
}

TEST_CASE("new: a tool modeled apart is turned and moved to its place, and a study follows at once",
          "[program][slow]") {
    const Program touchstone;
    writeBox(touchstone.file("tool.obj"), {0, 0, 0}, {1, 2, 3});  // inches
    writeBox(touchstone.file("plate.obj"), {0, -2, 0}, {10, -1.5, 10});
    const std::string parts = "new --unit in --tool " + touchstone.file("tool.obj") + " --obstacle " +
                              touchstone.file("plate.obj") + " --goal 0.5,2mm -o " + touchstone.file("a.glb");
    const Answer made = touchstone(parts + " --tool-pose 10,1mm,0,0,0,90");
    INFO(made.err);
    REQUIRE(made.code == 0);
    CHECK_THAT(made.out, Contains("tool, 50.8 x 25.4 x 76.2 mm"));
    // Turned about z it lies from x = -2 to 0, and 10 further; its depth is that of the goal, wherever it was modeled.
    CHECK((goalOf(open(touchstone.file("a.glb"))) - 25.4 * Vec3(9, -2, 1.5)).norm() < 1e-4);
    for (const char* wrong : {"1,2", "1,2,3,4", "1,2,x", "1,2,3,4,5,6mm", "1,2,3furlong"}) {
        CAPTURE(wrong);
        const Answer refused = touchstone(parts + " --tool-pose " + wrong);
        CHECK(refused.code == 2);
        CHECK(isOneSentence(refused.err));
    }

    // Five simulated hands, in the same command.
    const std::string study =
        kParts + "--assembled --study " + touchstone.file("study") + " -o " + touchstone.file("fit.glb");
    const Answer ran = touchstone(study);
    INFO(ran.err << ran.out);
    CHECK(ran.code == 0);
    CHECK_THAT(ran.out, Contains("5 of 5 trials are in"));
    const std::string trials = textOf(touchstone.file("study/trials.csv"));
    std::size_t seated = 0;
    for (std::size_t at = 0; (at = trials.find(",seated,", at)) != std::string::npos; ++at) ++seated;
    CHECK(seated == 5);
    CHECK(touchstone("new --tool " + touchstone.file("tool.obj") + " --obstacle " + touchstone.file("plate.obj") +
                     " --study s -o b.glb")
              .code == 2);
}

TEST_CASE("new: without assembled position the goal lies by its depth below the obstacle", "[program]") {
    const Program touchstone;
    writeBox(touchstone.file("tool.obj"), {4, -1, -1}, {6, 1, 1});  // inches, its axis at x = 5
    writeBox(touchstone.file("plate.obj"), {0, -2, 0}, {10, -1.5, 10});
    const std::string scene = touchstone.file("a.glb");
    const Answer made = touchstone("new --unit in --tool " + touchstone.file("tool.obj") + " --obstacle " +
                                   touchstone.file("plate.obj") + " --goal 0.5,2mm -o " + scene);
    INFO(made.err);
    REQUIRE(made.code == 0);
    const sandbox::HapticScene opened = open(scene);
    CHECK((goalOf(opened) - 25.4 * Vec3(5, -2, 0)).norm() < 1e-4);
    CHECK(opened.roles.goal->depth == Approx(12.7));
    CHECK(opened.roles.goal->tolerance == Approx(2));
    CHECK(opened.motions.empty());
    CHECK_THAT(made.out, !Contains("check --goal"));
    CHECK_THAT(made.out, Contains("warning: at its goal the tool does not fit"));  // the plate has no hole
    // A plate of half an inch that is read as half a millimeter.
    const Answer wrong = touchstone("new --tool " + touchstone.file("tool.obj") + " --obstacle " +
                                    touchstone.file("plate.obj") + " --goal 12.7mm -o " + touchstone.file("b.glb"));
    CHECK_THAT(wrong.out,
               Contains("warning: at the goal the tool is 12.7 mm below the top of obstacles that are 0.5 mm "
                        "high: check --goal, --unit and --axis"));
}

TEST_CASE("new: a goal inside an obstacle or in mid-air is named by all commands, in every unit", "[program]") {
    const Program touchstone;
    const auto study = [&](const std::string& scene) {
        std::ofstream(touchstone.file("study.json"))
            << R"({"format": "touchstone trials", "version": 1, "participants": 1, "time_limit_s": 0.1, "scene": ")"
            << scene << R"(", "conditions": [{"name": "a"}]})";
        fs::remove_all(touchstone.file("study"));
        return touchstone("trials study.json --headless --out study").err;
    };
    for (const auto& [unit, mm] : {std::pair("mm", 1.0), std::pair("m", 1000.0), std::pair("in", 25.4)})
        for (const double inside : {0.01, 0.1, 1.27, -31.0}) {  // mm; the goal's tolerance is 0.245 mm
            INFO(unit << ", " << inside << " mm inside");
            const double aside = inside < 0 ? 15 - inside : 0;
            writeBox(touchstone.file("tool.obj"), glm::dvec3(aside - 5, 0, -5) / mm, glm::dvec3(aside + 5, 20, 5) / mm);
            writeBox(touchstone.file("plate.obj"), glm::dvec3(-10, -10, -10) / mm, glm::dvec3(10, 0, 10) / mm);
            std::ostringstream goal;
            goal << " --goal " << std::abs(inside < 0 ? 1 : inside) / mm;
            const Answer made = touchstone("new --tool tool.obj --obstacle plate.obj --unit " + std::string(unit) +
                                           goal.str() + " -o a.glb");
            INFO(made.out << made.err);
            REQUIRE(made.code == 0);
            const Answer fit = touchstone("fit a.glb --json");
            INFO(fit.out << fit.err);
            const std::string verdict = json::parse(fit.out).at("verdict");
            if (inside < 0) {
                const std::string said =
                    "at its goal the tool is 31 mm from every obstacle: are the parts on one axis?";
                CHECK_THAT(made.out, Contains(said));
                CHECK_THAT(verdict, Contains(said));
                CHECK_THAT(touchstone("validate a.glb").out, Contains(said));
                CHECK_THAT(study("a.glb"), Contains(said));
            } else if (inside > 1) {
                CHECK(fit.code == 3);
                CHECK(json::parse(fit.out).at("fits_when").at("raised_mm") == Approx(inside).margin(1e-3));
                for (const std::string& said : {made.out, verdict, touchstone("validate a.glb").out, study("a.glb")})
                    CHECK_THAT(said, Contains("the goal lies 1.270 mm inside \"plate\""));
            } else {
                CHECK(fit.code == 0);
                CHECK_THAT(made.out, !Contains("warning"));
            }
        }
}

TEST_CASE("new: what is closed or open is named with its place in the file, and each command that is printed answers",
          "[program]") {
    const Program touchstone;
    // A side of a cube may be missing on purpose, one of a plate of 40 x 2 x 40 mm is closed, two of one are not.
    struct {
        bool zUp;
        int ofTool, ofPlate;  ///< sides that are missing
    } const cases[]{{false, 1, 0}, {false, 0, 1}, {false, 0, 2}, {true, 1, 1}, {true, 2, 0}};
    for (const auto& [zUp, ofTool, ofPlate] : cases) {
        INFO((zUp ? "z" : "y") << " up, without " << ofTool << " sides of the tool and " << ofPlate << " of the plate");
        const auto at = [&](double x, double y, double z) { return zUp ? glm::dvec3(x, z, y) : glm::dvec3(x, y, z); };
        writeBox(touchstone.file("tool.obj"), at(0, -1, 0), at(10, 9, 10), ofTool);
        writeBox(touchstone.file("plate.obj"), at(-15, -2, -15), at(25, 0, 25), ofPlate);
        const Answer made =
            touchstone("new --tool tool.obj --obstacle plate.obj --assembled --demo --leaves 64 -o a.glb" +
                       std::string(zUp ? " --up z" : ""));
        INFO(made.out << made.err);
        REQUIRE(made.code == 0);
        const bool open = ofTool > 0 || ofPlate > 1;
        const auto named = [&](const std::string& what) { return made.out.find(what) != std::string::npos; };
        CHECK(named("tool.obj has ") == (ofTool > 0));
        CHECK(named("plate.obj has ") == (ofPlate > 1));
        CHECK(named("plate.obj: was repaired: 1 hole closed") == (ofPlate == 1));
        // The side at +x.
        if (ofTool == 1)
            CHECK(named(zUp ? "1 hole (4 open edges), 14.1 mm across at (10.0, 5.0, 4.0) mm"
                            : "1 hole (4 open edges), 14.1 mm across at (10.0, 4.0, 5.0) mm"));
        if (ofPlate == 1) CHECK(named(zUp ? "at (25.0, 5.0, -1.0) mm" : "at (25.0, -1.0, 5.0) mm"));
        if (ofTool == 1) {  // also in the unit of the file, and where the part is in its file, not where it was put
            const Answer inches = touchstone(
                "new --tool tool.obj --obstacle plate.obj --unit in --tool-pose 0,0,5,0,0,90 --goal 1 --leaves 64 -o "
                "b.glb" +
                std::string(zUp ? " --up z" : ""));
            INFO(inches.out << inches.err);
            CHECK_THAT(inches.out, Contains(zUp ? "at (254.0, 127.0, 101.6) mm, which is (10, 5, 4) in"
                                                : "at (254.0, 101.6, 127.0) mm, which is (10, 4, 5) in"));
        }
        CHECK(named("/touchstone fit ") == !open);
        std::istringstream lines(made.out.substr(made.out.find("Next:\n") + 6));
        for (std::string line; std::getline(lines, line);) {
            const std::string arguments = line.substr(line.find("/touchstone ") + 12);
            const Answer answer = touchstone(arguments + (arguments == "run a.glb" ? " --headless" : ""));
            INFO(line << '\n' << answer.out << answer.err);
            CHECK((answer.code == 0 || answer.code == 3));  // 3: it does not fit, or is not seated
        }
        const Answer valid = touchstone("validate a.glb"), fit = touchstone("fit a.glb");
        INFO(valid.out << fit.err);
        CHECK(valid.code == 0);
        if (!open) {
            CHECK((fit.code == 0 || fit.code == 3));
            continue;
        }
        CHECK_THAT(valid.out, !Contains("touchstone fit"));
        CHECK(fit.code == 1);
        CHECK_THAT(fit.err.substr(fit.err.find("touchstone: ")),
                   Contains(ofTool > 0 ? "\"tool\" has " : "\"plate\" has ") && Contains(" mm across at (") &&
                       Contains("close it in the program that made it"));
    }
}

TEST_CASE("new: sizes that suggest another unit are asked about, with the option that gives it", "[program]") {
    const Program touchstone;
    for (const double size : {0.25, 4.0, 10.0, 600.0, 2000.0}) {  // a cube's edge as it is read, mm
        writeBox(touchstone.file("tool.obj"), {0, 0, 0}, glm::dvec3(size));
        writeBox(touchstone.file("plate.obj"), {-10, -10, -10}, {10, 0, 10});
        const Answer made = touchstone("new --tool tool.obj --obstacle plate.obj -o a.glb");
        INFO(made.out << made.err);
        REQUIRE(made.code == 0);
        const double across = size * std::sqrt(3.0);
        CHECK((made.out.find("is its unit right?") != std::string::npos) == (across < 5 || across > 1000));
        CHECK((made.out.find("--unit mm, cm, m or in") != std::string::npos) == (across < 5 || across > 1000));
    }
    // All parts in inches that were read as millimeters: the scene says what they may be.
    writeBox(touchstone.file("tool.obj"), {0, 0, 0}, {0.5, 1.5, 0.5});
    writeBox(touchstone.file("plate.obj"), {-1, -1, -1}, {1, 0, 1});
    const Answer made = touchstone("new --tool tool.obj --obstacle plate.obj --goal 0.1 -o a.glb");
    CHECK_THAT(made.out, Contains("as if inches had been taken for millimeters?"));
    CHECK_THAT(touchstone("fit a.glb").err, Contains("as if inches had been taken for millimeters?"));
}

namespace {

/// Writes a part as OBJ with +y up, turned about y.
void writePart(const std::string& file, const engine::MeshData& mesh, double turn, double mm) {
    std::ofstream out(file);
    out.precision(9);
    const glm::dquat q = glm::angleAxis(turn, glm::dvec3(0, 1, 0));
    for (const glm::vec3& p : mesh.positions) {
        const glm::dvec3 at = 1000 / mm * (q * glm::dvec3(p));
        out << "v " << at.x << ' ' << at.y << ' ' << at.z << '\n';
    }
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        out << "f " << mesh.indices[i] + 1 << ' ' << mesh.indices[i + 1] + 1 << ' ' << mesh.indices[i + 2] + 1 << '\n';
}

}  // namespace

TEST_CASE("new: a nut modeled out of phase is turned into its thread, and its demonstration screws it on",
          "[program][slow]") {
    const Program touchstone;
    struct {
        bool left;
        int starts;
        double turn, mm;
    } const cases[]{{false, 1, 2.2, 1}, {true, 1, 0.3, 25.4}, {false, 2, 1.1, 1}, {true, 2, -0.8, 1}};
    for (const auto& [left, starts, turn, mm] : cases) {
        INFO((left ? "left" : "right") << "-handed, " << starts << " starts, turned by " << turn);
        app::ThreadFit fit;
        fit.clearance = 0.1;
        fit.segments = 48;
        fit.left = left;
        fit.starts = starts;
        writePart(touchstone.file("nut.obj"), app::nut(fit), turn, mm);
        writePart(touchstone.file("bolt.obj"), app::bolt(fit), 0, mm);
        const std::string lead = std::string(left ? "-" : "") + std::to_string(2 * starts) + "mm",
                          parts = "new --tool nut.obj --obstacle bolt.obj --assembled --demo -o nut.glb --unit " +
                                  std::string(mm == 1 ? "mm" : "in");
        const Answer made = touchstone(parts + " --thread " + lead);
        INFO(made.out << made.err);
        REQUIRE(made.code == 0);
        CHECK_THAT(made.out, Contains(left ? "left-handed, " : "right-handed, ") &&
                                 Contains(std::to_string(2 * starts) + " mm per turn") && !Contains("warning"));
        CHECK((made.out.find(", 2 starts;") != std::string::npos) == (starts == 2));
        const sandbox::HapticScene scene = open(touchstone.file("nut.glb"));
        REQUIRE(scene.roles.goal);
        CHECK(scene.roles.goal->lead == Approx((left ? -2 : 2) * starts));
        CHECK(scene.roles.goal->fold == starts);
        // The play is 0.36 rad to either side for one start; sections of 7.5° make it uneven.
        CHECK(std::abs(foldedTwist(scene.roles.goal->X_WT.q * expRotation({0, turn, 0}), starts)) < 0.05);
        const Answer fits = touchstone("fit nut.glb");
        INFO(fits.out);
        CHECK(fits.code == 0);
        if (left == (starts > 1)) {  // one of each
            const Answer run = touchstone("run nut.glb --headless");
            INFO(run.out);
            CHECK(run.code == 0);
            CHECK_THAT(run.out, Contains("expected outcome: met"));
        }
        // The other hand, and for more starts the pitch in place of the lead.
        const Answer wrong = touchstone(parts + " --thread " + (left ? "" : "-") + std::to_string(2 * starts) + "mm");
        CHECK(wrong.code == 0);
        CHECK_THAT(wrong.out, Contains("warning") && Contains("the lead of a left-handed thread is negative"));
        if (starts > 1)
            CHECK_THAT(touchstone(parts + " --thread " + (left ? "-2mm" : "2mm")).out,
                       Contains("warning") && Contains("check the lead, the travel per turn"));
    }
}

TEST_CASE("new: the way out may be any axis, and z may be up", "[program]") {
    const Program touchstone;
    // A pin with a flag on one side sticks in a wall along the parts' x.
    writeBox(touchstone.file("pin.obj"), {-10, 2, 3}, {20, 4, 5});
    std::ofstream(touchstone.file("pin.obj"), std::ios::app)
        << "v 15 2 3\nv 20 2 3\nv 15 14 3\nv 20 14 3\nv 15 2 5\nv 20 2 5\nv 15 14 5\nv 20 14 5\n"
           "f 9 11 12 10\nf 13 14 16 15\nf 9 10 14 13\nf 11 15 16 12\nf 9 13 15 11\nf 10 12 16 14\n";
    writeBox(touchstone.file("wall.obj"), {-30, -20, -20}, {0, -5, 20});
    const auto make = [&](const std::string& options) {
        const std::string scene = touchstone.file("b.glb");
        const Answer made = touchstone("new --tool " + touchstone.file("pin.obj") + " --obstacle " +
                                       touchstone.file("wall.obj") + " --assembled --demo " + options + " -o " + scene);
        INFO(made.err);
        REQUIRE(made.code == 0);
        return open(scene);
    };
    // The origin is on the axis of the portion that goes in, at its end, and +y of the goal is the way out.
    const sandbox::HapticScene alongX = make("--axis x");
    CHECK((goalOf(alongX) - Vec3(-10, 3, 4)).norm() < 1e-5);
    CHECK((alongX.roles.goal->X_WT.q * Vec3::UnitY() - Vec3::UnitX()).norm() < 1e-6);
    CHECK(alongX.roles.goal->depth == Approx(10));
    // z up: parts' (x, y, z) are the scene's (x, z, -y).
    const sandbox::HapticScene zUp = make("--axis x --up z");
    CHECK((goalOf(zUp) - Vec3(-10, 4, -3)).norm() < 1e-5);
    // The demonstration ends at the goal, and begins outside.
    CHECK((zUp.motions.front().motion->at(zUp.motions.front().motion->duration()).p - goalOf(zUp)).norm() < 1e-4);
    CHECK(zUp.motions.front().motion->at(0).p.x() > 0);
}

TEST_CASE("new: parts may be glTF files, whose nodes, materials and size they keep", "[program]") {
    const Program touchstone;
    engine::Scene part;
    const engine::Entity arm = addNode(part, "arm", {}, {.translation = {0, 0.01, 0}});
    addMesh(part, addNode(part, "hand", arm, {.scale = {2, 1, 1}}), boxMesh(glm::vec3(0.01f)),
            addMaterial(part, {"blue", {0, 0, 1, 1}, 0, 0.5f}));
    engine::updateWorldTransforms(part);
    engine::writeGltf(part, touchstone.file("part.glb"));
    writeBox(touchstone.file("plate.obj"), {-20, -10, -20}, {20, 0, 20});
    const std::string scene = touchstone.file("c.gltf");
    const std::string plate = " --obstacle " + touchstone.file("plate.obj");
    const Answer made = touchstone("new --tool " + touchstone.file("part.glb") + plate + plate +
                                   " --obstacle-name base --obstacle-name lid -o " + scene);
    INFO(made.err);
    REQUIRE(made.code == 0);
    CHECK_THAT(made.out, Contains("part, 20 x 10 x 10 mm") && Contains("base,") && Contains("lid,"));
    const sandbox::HapticScene opened = open(scene);
    CHECK(opened.roles.obstacles.size() == 2);
    CHECK(opened.scene.materials.front().name == "blue");
    // The tool's lowest point is a tenth of its size above the plate.
    const double size = std::sqrt(20.0 * 20 + 10 * 10 * 2);
    CHECK((sandbox::startPose(opened).p - Vec3(0, 0.1 * size - 5, 0)).norm() < 1e-5);
    // A crease of the box is sharp: three vertices at each corner.
    for (const auto& mesh : opened.scene.meshes)
        if (mesh.primitives.front().material != 0) CHECK(mesh.primitives.front().mesh->positions.size() == 24);
}

TEST_CASE("new: options that do not fit are refused in one sentence", "[program]") {
    const Program touchstone;
    const std::string out = " -o " + touchstone.file("x.glb");
    const std::pair<std::string, std::string> cases[] = {
        {"--demo", "give --goal DEPTH, or --assembled"},
        {"--thread 2mm", "--thread needs a goal"},
        {"--assembled --thread 0", "--thread takes the travel per turn like 2mm"},
        {"--assembled --thread fast", "or -2mm for a left-handed thread, not 'fast'"},
        {"--goal 20q", "--unit is mm, cm, m or in, not 'q'"},
        {"--goal deep", "--goal takes lengths above zero like 20mm or 20mm,0.5mm, not 'deep'"},
        {"--goal 0", "above zero"},
        {"--goal 5,", "above zero"},
        {"--assembled --axis w", "--axis is x, y, z, -x, -y or -z, not 'w'"},
        {"--crease 200", "0 to 180"},
        {"--obstacle-name a --obstacle-name b", "more --obstacle-name than --obstacle"},
        {"--scene a.glb", "excludes"},
    };
    for (const auto& [options, sentence] : cases) {
        const Answer answer = touchstone(kParts + options + out);
        INFO(options << ": " << answer.err);
        CHECK(answer.code == 2);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Contains(sentence));
        CHECK(!fs::exists(touchstone.file("x.glb")));
    }
    CHECK_THAT(touchstone("new --tool a.stl --obstacle b.stl --up x" + out).err, Contains("--up is y or z, not 'x'"));
    writeBox(touchstone.file("above.obj"), {-1, 50, -1}, {1, 60, 1});
    writeBox(touchstone.file("plate.obj"), {-20, -10, -20}, {20, 0, 20});
    const Answer answer = touchstone("new --tool " + touchstone.file("above.obj") + " --obstacle " +
                                     touchstone.file("plate.obj") + " --assembled" + out);
    CHECK(answer.code == 2);
    CHECK_THAT(answer.err, Contains("50 mm outside") && Contains("--axis"));
    CHECK(touchstone("new --tool absent.stl --obstacle " + touchstone.file("plate.obj") + out).code == 1);
}

}  // namespace touchstone::new_program_tests
