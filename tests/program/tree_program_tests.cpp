// `touchstone tree` and `touchstone tree check`: meshes and scenes in; trees, .sph files and figures out.
#include <map>
#include <nlohmann/json.hpp>

#include "engine/view/image_file.hpp"
#include "haptics/builder/tree_file.hpp"
#include "tests/program/tree_program.hpp"

namespace touchstone::tree_program_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using nlohmann::json;

TEST_CASE("program: tree reports the quality of a mesh's tree, and caches it", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile();
    const json built = touchstone.tree(egg + " --leaves 100");
    CHECK(built.at("part") == "egg");
    CHECK(built.at("role").is_null());
    CHECK(built.at("triangles") == 24 * 22);
    CHECK(built.at("leaves") <= 100);
    CHECK(built.at("leaves") > 10);
    CHECK(built.at("nodes") > built.at("leaves"));
    CHECK(built.at("levels") == 4);  // 100 leaves need 8^3 slots, and the root is a level
    // The box of the mesh is 20 x 30 x 40, because its stacks and slices are even.
    const double diagonal = std::sqrt(400. + 900 + 1600);
    CHECK(built.at("diagonal_mm").get<double>() == Approx(diagonal).epsilon(1e-6));
    const double protrusion = built.at("protrusion_mm");
    CHECK(protrusion > 0);
    CHECK(protrusion < 10);
    CHECK(built.at("protrusion_percent").get<double>() == Approx(100 * protrusion / diagonal).epsilon(1e-6));
    CHECK(built.at("covered") == true);
    CHECK(built.at("closed") == true);
    CHECK(built.at("note") == "");
    CHECK(built.at("source") == "built");
    CHECK(built.at("quality") == "fast");
    CHECK(built.at("interior") == "shell");
    CHECK(built.at("seed") == 1);
    CHECK(built.at("wall_s") >= 0);
    CHECK(built.at("cpu_s") >= 0);

    const auto figures = [](json tree) {
        for (const char* key : {"source", "wall_s", "cpu_s"}) tree.erase(key);
        return tree;
    };
    const json kept = touchstone.tree(egg + " --leaves 100");
    CHECK(kept.at("source") == "cache");
    CHECK(figures(kept) == figures(built));
    const json rebuilt = touchstone.tree(egg + " --leaves 100 --no-cache --threads 1");
    CHECK(rebuilt.at("source") == "built");
    CHECK(figures(rebuilt) == figures(built));  // for any number of threads

    const Answer words = touchstone("tree " + egg + " --leaves 100");
    CHECK_THAT(words.out, Contains("egg: ") && Contains(" leaves") && Contains("proven covered, closed") &&
                              Contains("from the cache"));
    CHECK(std::count(words.out.begin(), words.out.end(), '\n') == 1);
}

TEST_CASE("program: tree accepts its size as leaves, levels or an error", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile();
    CHECK(touchstone.tree(egg + " --leaves 1").at("leaves") == 1);
    CHECK(touchstone.tree(egg + " --levels 1").at("leaves") == 1);
    const json third = touchstone.tree(egg + " --levels 3");
    CHECK(third.at("leaves") <= 64);
    CHECK(third.at("levels") == 3);
    for (const auto& [text, most] : std::map<std::string, double>{
             {"0.5", 0.5}, {"0.5mm", 0.5}, {"'0.5 mm'", 0.5}, {"2%", 0.02 * std::sqrt(2900.)}}) {
        const json tree = touchstone.tree(egg + " --max-error " + text);
        INFO(text);
        CHECK(tree.at("protrusion_mm").get<double>() <= most * (1 + 1e-6));
        CHECK(tree.at("leaves") < 1000);  // the fewest that suffice: some hundred
    }
    const json best = touchstone.tree(egg + " --leaves 64 --quality best --interior solid --seed 7");
    CHECK(best.at("quality") == "best");
    CHECK(best.at("interior") == "solid");
    CHECK(best.at("seed") == 7);
}

TEST_CASE("program: tree reads a mesh in its own unit", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile();
    const double mm = touchstone.tree(egg + " --leaves 64").at("diagonal_mm");
    for (const auto& [unit, factor] : std::map<std::string, double>{{"mm", 1}, {"cm", 10}, {"m", 1000}, {"in", 25.4}})
        CHECK(touchstone.tree(egg + " --leaves 64 --unit " + unit).at("diagonal_mm").get<double>() ==
              Approx(factor * mm));
}

TEST_CASE("program: a tree's file and its .sph hold the same leaves, and can be read back", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile(), tree = touchstone.file("egg.spheres"),
                      sph = touchstone.file("egg.sph"), again = touchstone.file("again.spheres");
    const std::string unit = GENERATE(as<std::string>{}, "mm", "in");
    INFO(unit);
    const json made = touchstone.tree(egg + " --unit " + unit + " --leaves 100 -o " + tree + " --export " + sph);
    const SphereTree saved = loadTree(tree);
    CHECK(saved.leafCount() == made.at("leaves"));
    CHECK(saved.certificate.protrusion == made.at("protrusion_mm"));

    // The header, and the root in the unit of the mesh: as large as the egg, and about its center.
    std::istringstream text(textOf(sph));
    int levels = 0, branching = 0;
    double x = 0, y = 0, z = 0, r = 0;
    text >> levels >> branching >> x >> y >> z >> r;
    CHECK(levels == made.at("levels"));
    CHECK(branching == 8);
    CHECK(r > 15);
    CHECK(r < 30);
    CHECK(std::hypot(x, y, z) < 10);

    const json imported = touchstone.tree(egg + " --unit " + unit + " --import " + sph + " -o " + again);
    CHECK(imported.at("source") == "import");
    CHECK(imported.at("leaves") == made.at("leaves"));
    CHECK(imported.at("covered") == true);
    CHECK(imported.at("closed") == true);
    // Both are the largest radius - depth over the same leaves, measured by different code; see the radii below.
    CHECK(imported.at("protrusion_mm").get<double>() == Approx(made.at("protrusion_mm").get<double>()).epsilon(1e-5));
    const SphereTree returned = loadTree(again);
    REQUIRE(returned.leafCount() == saved.leafCount());
    const auto sorted = [](const SphereTree& from) {
        std::vector<std::array<float, 4>> leaves;
        for (int i = 0; i < from.leafCount(); ++i)
            leaves.push_back({from.leaf(i).x, from.leaf(i).y, from.leaf(i).z, from.leaf(i).r});
        std::sort(leaves.begin(), leaves.end());
        return leaves;
    };
    const auto before = sorted(saved), after = sorted(returned);
    for (std::size_t i = 0; i < before.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) REQUIRE(after[i][k] == before[i][k]);
        // Scaling by 25.4 and back is inexact, and the radius is then rounded up to the next float.
        const float up = unit == "mm" ? before[i][3] : std::nextafter(before[i][3], HUGE_VALF);
        REQUIRE(after[i][3] >= before[i][3]);
        REQUIRE(after[i][3] <= up);
    }
}

TEST_CASE("program: an imported tree with a gap is reported as not covering", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile();
    // One ball of radius 12 in an egg of 20 x 30 x 40: it protrudes by 2 at the waist and leaves both ends uncovered.
    const std::string ball = touchstone.with("ball.sph", "1 8\n0 0 0 12 1\n");
    const json tree = touchstone.tree(egg + " --import " + ball + " --export " + touchstone.file("back.sph"));
    CHECK(tree.at("leaves") == 1);
    CHECK(tree.at("covered") == false);
    CHECK(tree.at("closed") == true);
    // The egg has 24 slices: halfway between two of them its waist is a little thinner.
    CHECK(tree.at("protrusion_mm").get<double>() == Approx(2).margin(0.15));
    CHECK_THAT(tree.at("note").get<std::string>(), Contains("uncovered"));
    std::istringstream back(textOf(touchstone.file("back.sph")));
    std::string header;
    std::getline(back, header);
    double x = 1, y = 1, z = 1, r = 0;
    back >> x >> y >> z >> r;
    CHECK(std::hypot(x, y, z) == 0);
    CHECK(r == 12);
}

TEST_CASE("program: tree check measures .spheres and .sph files alike", "[program]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile(), tree = touchstone.file("egg.spheres"),
                      sph = touchstone.file("egg.sph");
    const json made = touchstone.tree(egg + " --unit cm --leaves 100 -o " + tree + " --export " + sph);
    const std::string few = " --samples 5000 --poses 4 --seed 3";
    for (const std::string& file : {tree, sph}) {
        INFO(file);
        const Answer answer = touchstone("tree check " + file + " " + egg + " --unit cm --json" + few);
        INFO(answer.err);
        REQUIRE(answer.code == 0);
        const json m = json::parse(answer.out);
        CHECK(m.at("leaves") == made.at("leaves"));
        CHECK(m.at("coverage_proven") == true);
        CHECK(m.at("uncovered_percent") == 0);
        CHECK(m.at("largest_gap_mm") == 0);
        CHECK(m.at("leaves_outside_ancestor") == 0);
        CHECK(m.at("pairs_missed") == 0);
        CHECK(m.at("poses") == 4);
        CHECK(m.at("diagonal_mm").get<double>() == Approx(made.at("diagonal_mm").get<double>()));
        const double certified = m.at("protrusion_certified_mm");
        CHECK(certified == Approx(made.at("protrusion_mm").get<double>()).epsilon(1e-5));
        CHECK(m.at("protrusion_max_mm") <= certified * (1 + 1e-9));
        CHECK(m.at("protrusion_rms_mm") <= m.at("protrusion_max_mm"));
        CHECK(m.at("volume_ratio") > 1);
        CHECK(m.at("walk_us").is_null() == (file == sph));
    }
    const Answer table = touchstone("tree check " + tree + " " + egg + " --unit cm" + few);
    CHECK(table.code == 0);
    for (const char* row : {"surface uncovered", "largest gap", "certified bound", "RMS", "Hausdorff", "normal error",
                            "outside an ancestor", "walk misses", " mm ", "%D", "µs"})
        CHECK_THAT(table.out, Contains(row));
}

TEST_CASE("program: each part of a scene with a role gets the tree that the scene specifies", "[program]") {
    const TreeProgram touchstone;
    const std::string scene = partsScene(touchstone);
    const std::vector<json> all = touchstone.trees(scene);
    REQUIRE(all.size() == 3);
    CHECK(all[0].at("part") == "peg");
    CHECK(all[0].at("role") == "tool");
    CHECK(all[0].at("interior") == "solid");
    CHECK(all[0].at("protrusion_mm") <= 1);
    CHECK(all[1].at("role") == "obstacle");
    CHECK(all[1].at("leaves") <= 32);
    CHECK(all[2].at("leaves") <= 64);
    CHECK(all[2].at("diagonal_mm").get<double>() == Approx(40 * std::sqrt(3.)));

    // The command line overrides the scene, --part selects any node with triangles.
    const json peg = touchstone.tree(scene + " --part peg --leaves 16 --interior shell");
    CHECK(peg.at("leaves") <= 16);
    CHECK(peg.at("interior") == "shell");
    const json lamp = touchstone.tree(scene + " --part lamp --levels 2 --export " + touchstone.file("lamp.sph"));
    CHECK(lamp.at("role").is_null());
    CHECK(lamp.at("leaves") <= 8);
    // Scenes are in meters in the frame of the node: the lamp is at y = 0.1 m, but the root is near the origin.
    std::istringstream text(textOf(touchstone.file("lamp.sph")));
    double levels = 0, branching = 0, x = 0, y = 0, z = 0, r = 0;
    text >> levels >> branching >> x >> y >> z >> r;
    CHECK(std::hypot(x, y, z) < 0.01);
    CHECK(r == Approx(0.026).margin(0.01));  // half the diagonal of 30 mm, plus the protrusion of the leaves
    const Answer check = touchstone("tree check " + touchstone.file("lamp.sph") + " " + scene +
                                    " --part lamp --samples 1000 --poses 1 --json");
    INFO(check.err);
    REQUIRE(check.code == 0);
    CHECK(json::parse(check.out).at("coverage_proven") == true);
}

TEST_CASE("program: a scene without roles is one mesh", "[program]") {
    const TreeProgram touchstone;
    engine::Scene scene;
    addBox(scene, "a", glm::vec3(0.01f), nullptr, {.translation = {0.015, 0, 0}});
    addBox(scene, "b", glm::vec3(0.01f), nullptr, {.translation = {-0.015, 0, 0}});
    engine::writeGltf(scene, touchstone.file("plain.glb"));
    const json tree = touchstone.tree(touchstone.file("plain.glb") + " --leaves 64");
    CHECK(tree.at("part") == "plain");
    CHECK(tree.at("triangles") == 24);
    CHECK(tree.at("diagonal_mm").get<double>() == Approx(std::sqrt(1600. + 100 + 100)));
}

TEST_CASE("program: tree reports an open mesh", "[program]") {
    const TreeProgram touchstone;
    std::vector<Corners> cup = egg(12, 24);
    cup.resize(cup.size() / 2);  // the triangles are ordered by stacks
    const Answer answer = touchstone("tree " + touchstone.with("cup.obj", objOf(cup)) + " --leaves 100");
    CHECK(answer.code == 0);
    CHECK_THAT(answer.out, Contains("proven covered, open") && Contains("note: "));
}

TEST_CASE("program: meshes in every common dialect are one closed part", "[program]") {
    const TreeProgram touchstone;
    // A cube of 10 in every dialect of OBJ: quads, two groups, negative indices, a polygon with collinear corners,
    // missing or odd normals, a missing material library.
    const std::string cube =
        "mtllib none.mtl\no cube\nv 0 0 0 1.0\nv 10 0 0 1.0\nv 10 10 0\nv 0 10 0\nv 0 0 10\nv 10 0 10\nv 10 10 10\nv 0 "
        "10 10\n"
        "vt 0 0\nvn 0 0 1\n";
    const std::string closed = cube +
                               "g bottom\nusemtl red\nf 1 4 3 2\ng rest\nf -4/1 -3/1 -2/1 -1/1\nf 1//1 2//1 6//1 5//1\n"
                               "s 1\nf 2/1/1 3/1/1 7/1/1 6/1/1\nf 3 4 8\nf 3 8 7\nf 4 1 5 8\n";
    const std::string pentagon =
        cube + "v 5 0 0\nf 1 4 3 2 9\nf 5 6 7 8\nf 1 9 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    for (const std::string& text : {closed, pentagon}) {
        const json tree = touchstone.tree(touchstone.with("cube.obj", text) + " --leaves 64 --no-cache");
        INFO(text);
        CHECK(tree.at("covered") == true);
        CHECK(tree.at("closed") == true);
        CHECK(tree.at("diagonal_mm").get<double>() == Approx(10 * std::sqrt(3.)));
    }
    // An L of six corners, extruded: the triangles of its concave faces must stay inside it.
    const std::string ell =
        "v 0 0 0\nv 20 0 0\nv 20 10 0\nv 10 10 0\nv 10 20 0\nv 0 20 0\n"
        "v 0 0 5\nv 20 0 5\nv 20 10 5\nv 10 10 5\nv 10 20 5\nv 0 20 5\n"
        "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nf 4 5 11 10\nf 5 6 12 11\nf 6 1 7 12\n";
    const std::string ellFile = touchstone.with("ell.obj", ell);
    const json tree = touchstone.tree(ellFile + " --leaves 512 -o " + touchstone.file("ell.spheres"));
    CHECK(tree.at("triangles") == 2 * 4 + 6 * 2);
    CHECK(tree.at("closed") == true);
    const SphereTree leaves = loadTree(touchstone.file("ell.spheres"));
    for (int i = 0; i < leaves.leafCount(); ++i) {
        const Sphere s = leaves.leaf(i);
        // The depth to which it reaches into the notch x > 10, y > 10.
        CHECK(std::min(s.x - 10, s.y - 10) <= 1e-3);
    }
    // The egg again as STL of both kinds, the binary one begins like the ASCII one.
    const json fromObj = touchstone.tree(touchstone.eggFile() + " --leaves 64");
    for (const std::string& file :
         {touchstone.with("b.stl", binaryStlOf(egg(12, 24))), touchstone.with("A.STL", asciiStlOf(egg(12, 24)))}) {
        const json stl = touchstone.tree(file + " --leaves 64");
        CHECK(stl.at("triangles") == fromObj.at("triangles"));
        CHECK(stl.at("closed") == true);
        CHECK(stl.at("diagonal_mm").get<double>() == Approx(fromObj.at("diagonal_mm").get<double>()).epsilon(1e-5));
    }
}

TEST_CASE("program: help of tree has examples", "[program]") {
    const TreeProgram touchstone;
    const Answer help = touchstone("tree --help");
    CHECK(help.code == 0);
    for (const char* word : {"Examples", "--max-error", "--levels", "--interior", "--import", "check", "--picture"})
        CHECK_THAT(help.out, Contains(word));
    CHECK_THAT(touchstone("tree check --help").out, Contains("Example") && Contains("--poses"));
}

TEST_CASE("program: a picture of a tree shows leaves, and the uncovered surface in violet", "[program][gl]") {
    const TreeProgram touchstone;
    const std::string egg = touchstone.eggFile();
    struct Counts {
        int gold = 0, violet = 0;
    };
    const auto pictured = [&](const std::string& args) {
        const std::string file = touchstone.file("egg.png");
        touchstone.tree(egg + " " + args + " --picture " + file);
        const engine::Image image = engine::readPng(file);
        CHECK(image.width == 800);
        CHECK(image.height == 800);
        Counts counts;
        for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
            const int red = image.rgba[i], green = image.rgba[i + 1], blue = image.rgba[i + 2];
            counts.gold += red > blue + 40 && green > blue + 10;
            counts.violet += blue > green + 40 && red > green + 20;
        }
        return counts;
    };
    const Counts whole = pictured("--leaves 64");
    CHECK(whole.gold > 100000);  // of 640,000: the egg fills most of one dimension
    CHECK(whole.violet < 20);    // single pixels on its outline
    // The ball of radius 12 is wider than the egg at its waist, and the ends of the egg protrude from it.
    const Counts bare = pictured("--import " + touchstone.with("ball.sph", "1 8\n0 0 0 12 1\n"));
    CHECK(bare.gold > 20000);
    CHECK(bare.violet > 20000);
}

}  // namespace touchstone::tree_program_tests
