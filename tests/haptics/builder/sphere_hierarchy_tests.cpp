#include "haptics/builder/sphere_hierarchy.hpp"

#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>

namespace touchstone::sphere_hierarchy_tests {
namespace {

namespace fs = std::filesystem;

/// A temporary folder, removed at the end.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("touchstone_sph_" + std::to_string(::getpid()));
    Folder() {
        fs::remove_all(path);
        fs::create_directories(path);
    }
    ~Folder() { fs::remove_all(path); }

    fs::path write(const std::string& text) const {
        std::ofstream(path / "tree.sph", std::ios::binary) << text;
        return path / "tree.sph";
    }
};

std::string textOf(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<Sphere> randomLeaves(int count, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-50, 50);
    std::vector<Sphere> out;
    for (int i = 0; i < count; ++i)
        out.push_back({uniform(random), uniform(random), uniform(random), std::abs(uniform(random))});
    return out;
}

bool sameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

bool same(const SphereHierarchy& a, const SphereHierarchy& b) {
    return a.branching == b.branching &&
           std::equal(a.nodes.begin(), a.nodes.end(), b.nodes.begin(), b.nodes.end(),
                      [](const SphereNode& x, const SphereNode& y) {
                          return sameBits(x.center.x(), y.center.x()) && sameBits(x.center.y(), y.center.y()) &&
                                 sameBits(x.center.z(), y.center.z()) && sameBits(x.radius, y.radius) &&
                                 x.parent == y.parent && x.children == y.children &&
                                 (x.children == 0 || x.firstChild == y.firstChild);
                      });
}

/// The sentence with which readSph() refuses the file; empty if it reads it.
std::string refusal(const fs::path& file) {
    try {
        readSph(file);
        return {};
    } catch (const std::invalid_argument& e) {
        return e.what();
    }
}

TEST_CASE("sphere hierarchy: a sphere tree becomes nodes, each with its own sphere", "[tree]") {
    const SphereTree tree = makeSphereTree(randomLeaves(100, 1));  // 100 leaves, 13 buckets, 2, 1
    const SphereHierarchy h = hierarchyOf(tree);
    REQUIRE(h.nodes.size() == 116);
    CHECK(h.nodes[0].parent == -1);
    CHECK(h.nodes[0].children == 2);
    CHECK(h.nodes[1].children == 8);
    CHECK(h.nodes[2].children == 5);
    CHECK(h.nodes[15].children == 4);  // the last bucket: 12 · 8 + 4
    for (int i = 1; i < 116; ++i) {
        const SphereNode& parent = h.nodes[h.nodes[i].parent];
        CHECK(i >= parent.firstChild);
        CHECK(i < parent.firstChild + parent.children);
    }
    const std::vector<Sphere> leaves = h.leaves();
    REQUIRE(leaves.size() == 100);
    for (int i = 0; i < 100; ++i) {
        const Sphere leaf = tree.leaf(i);
        CHECK(std::memcmp(&leaves[i], &leaf, sizeof leaf) == 0);
    }
}

TEST_CASE("sphere hierarchy: leaves in single precision contain the given leaves", "[tree]") {
    SphereHierarchy h;
    h.nodes = {{Vec3(1.0 / 3, -2e3 / 7, 1e-9), 1.0 / 11, -1, 1, 2},
               {Vec3(1.0 / 3, 2.0 / 7, 1e-9), 1.0 / 11, 0},
               {Vec3(0.5, -0.25, 3), 0.1, 0}};
    const std::vector<Sphere> leaves = h.leaves();
    REQUIRE(leaves.size() == 2);
    for (int i = 0; i < 2; ++i) {
        const Sphere& s = leaves[i];
        const SphereNode& node = h.nodes[i + 1];
        CHECK((Vec3(s.x, s.y, s.z) - node.center).norm() + node.radius <= s.r);
        CHECK(s.r < node.radius + 1e-7);  // two roundings of numbers below one: 2^-24 each
    }
    CHECK(leaves[1].r == std::nextafter(0.1f, 0.0f) + 0x1p-27f);  // 0.1f is above 0.1: rounded up once, not twice
}

TEST_CASE("sphere files: a written tree is read back with the same bits", "[tree]") {
    const Folder folder;
    const fs::path file = folder.path / "tree.sph";
    for (int count : {1, 7, 8, 9, 64, 65, 600}) {
        INFO(count << " leaves");
        const SphereHierarchy h = hierarchyOf(makeSphereTree(randomLeaves(count, 2)));
        writeSph(h, file);
        CHECK(same(readSph(file), h));
        writeSph(h, file, 1024);  // a power of two: exact in both directions
        CHECK(same(readSph(file, 1024), h));
    }
    SphereHierarchy odd;
    odd.branching = 3;
    odd.nodes = {{Vec3(0.1, -0.0, 1e-300), 1.0 / 3, -1, 1, 2},
                 {Vec3(1e30, -1e-30, 5), 0, 0},
                 {Vec3(2.5, 3, M_PI), 1, 0, 3, 1},
                 {Vec3(1, 2, 3), 4, 2}};
    writeSph(odd, file);
    CHECK(same(readSph(file), odd));
    CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);  // no other file remains
}

TEST_CASE("sphere files: a full tree of six levels has a line for every slot", "[tree]") {
    const Folder folder;
    const fs::path file = folder.path / "tree.sph";
    const SphereHierarchy h = hierarchyOf(makeSphereTree(randomLeaves(30000, 6)));
    writeSph(h, file);
    const std::string text = textOf(file);
    CHECK(text.starts_with("6 8\n"));
    CHECK(std::count(text.begin(), text.end(), '\n') == 1 + 37449);  // 1 + 8 + ... + 32,768
    CHECK(same(readSph(file), h));
}

TEST_CASE("sphere files: branches of the toolkit's trees may end early", "[tree]") {
    const Folder folder;
    const std::string unused = "0.000000 0.000000 0.000000 -0.000078 1.000000\n";
    const SphereHierarchy h = readSph(
        folder.write("3 2\r\n"
                     "# the root\n\n"
                     "  0 0 0\t10.5 1.0  \r\n" +
                     unused +                      // the first child is missing
                     "1 +2 3 4 1 1 2 3 4 0.5\n" +  // with an auxiliary sphere
                     unused + unused + unused +    // no children of the missing child, no first child of the second
                     "5 6 7 8 # a leaf of four numbers\n"
                     "\n\nOptions : \n  branch = 2\n12 samples, 5 medial spheres\n1 2\n"),
        10);
    REQUIRE(h.nodes.size() == 3);
    CHECK(h.branching == 2);
    CHECK(h.nodes[0].children == 1);
    CHECK(h.nodes[0].firstChild == 1);
    CHECK(h.nodes[1].center == Vec3(10, 20, 30));
    CHECK(h.nodes[1].children == 1);
    CHECK(h.nodes[2].parent == 1);
    CHECK(h.nodes[2].radius == 80);
    CHECK(h.leaves().size() == 1);

    const SphereHierarchy early =
        readSph(folder.write("3 2\n0 0 0 9\n1 0 0 3\n2 0 0 4\n" + unused + unused + "3 0 0 1\n" + unused));
    REQUIRE(early.nodes.size() == 4);
    CHECK(early.nodes[1].children == 0);  // a leaf on the middle level
    CHECK(early.leaves().size() == 2);
    CHECK(readSph(folder.write("1 8\n1 2 3 0\n")).leaves().size() == 1);
    CHECK(readSph(folder.write("2 3\n0 0 0 9\n1 0 0 1\n2 0 0 1\n3 0 0 1")).leaves().size() == 3);  // no last newline
}

TEST_CASE("sphere files: a malformed file is refused in a sentence with its line", "[tree]") {
    const Folder folder;
    struct Case {
        const char *name, *text, *line, *says;
    };
    const std::vector<Case> cases{
        {"empty", "", "line 1", "begins with"},
        {"blank", "\n \n# nothing\n", "line 3", "begins with"},
        {"text", "\n\nsphere tree\n", "line 3", "begins with"},
        {"binary",
         "\x7f"
         "ELF\x02\x01",
         "line 1", "begins with"},
        {"one number", "4\n", "line 1", "begins with"},
        {"three numbers", "4 8 1\n", "line 1", "begins with"},
        {"fraction", "1.5 8\n0 0 0 1\n", "line 1", "begins with"},
        {"no levels", "0 8\n", "line 1", "begins with"},
        {"negative branching", "2 -8\n", "line 1", "begins with"},
        {"NaN levels", "nan 8\n", "line 1", "begins with"},
        {"huge levels", "1e300 8\n", "line 1", "begins with"},
        {"many levels", "60 1\n0 0 0 1\n", "line 1", "more spheres than"},
        {"too many slots", "20 8\n0 0 0 1\n", "line 1", "more spheres than"},
        {"absurd slots", "30 60000000\n0 0 0 1\n", "line 1", "more spheres than"},
        {"large promise", "8 8\n0 0 0 1\n", "line 2", "ends after 1 of the 2396745 spheres"},
        {"cut", "2 2\n0 0 0 1\n0 0 0 1\n", "line 3", "ends after 2 of the 3 spheres"},
        {"cut in a number", "2 2\n0 0 0 1\n0 0 0 1\n0 0 0", "line 4", "x y z radius"},
        {"three numbers a line", "1 8\n0 0 0\n", "line 2", "x y z radius"},
        {"a word", "1 8\n0 0 zero 1\n", "line 2", "x y z radius"},
        {"commas", "1 8\n0, 0, 0, 1\n", "line 2", "x y z radius"},
        {"eleven numbers", "1 8\n0 0 0 1 1 1 1 1 1 1 1\n", "line 2", "x y z radius"},
        {"NaN", "1 8\n0 nan 0 1\n", "line 2", "not finite"},
        {"NaN radius", "2 2\n0 0 0 1\n1 1 1 1\n0 0 0 nan 1\n", "line 4", "not finite"},
        {"infinite radius", "1 8\n0 0 0 inf\n", "line 2", "not finite"},
        {"too large", "1 8\n0 0 1e36 1\n", "line 2", "too large"},
        {"beyond double", "1 8\n0 0 1e999 1\n", "line 2", "x y z radius"},
        {"unused root", "1 8\n0 0 0 -1\n", "line 2", "root is unused"},
        {"all unused", "2 2\n0 0 0 -1\n0 0 0 -1\n0 0 0 -1\n", "line 2", "root is unused"},
        {"orphan", "3 2\n0 0 0 1\n0 0 0 1\n0 0 0 -1\n0 0 0 1\n0 0 0 -1\n0 0 0 2\n0 0 0 -1\n", "line 7", "unused slot"},
        {"too many", "1 8\n0 0 0 1\n0 0 0 1\n", "line 3", "more spheres than the 1"},
    };
    for (const Case& c : cases) {
        const std::string why = refusal(folder.write(c.text));
        INFO(c.name << ": " << why);
        CHECK(why.find("tree.sph, ") != why.npos);
        CHECK(why.find(std::string(c.line) + ":") != why.npos);
        CHECK(why.find(c.says) != why.npos);
        CHECK(why.back() == '.');
        CHECK(why.find('\n') == why.npos);
    }
    for (const fs::path& file : {folder.path, folder.path / "nowhere.sph"}) {
        const std::string why = refusal(file);
        CHECK(why.find(file.string()) == 0);
        CHECK(why.find("cannot be read") != why.npos);
    }
}

TEST_CASE("sphere files: a damaged file is either refused or read", "[tree]") {
    const Folder folder;
    writeSph(hierarchyOf(makeSphereTree(randomLeaves(11, 3))), folder.path / "tree.sph");
    const std::string good = textOf(folder.path / "tree.sph");
    int refused = 0;
    for (std::size_t size = 0; size < good.size(); size += 7)
        refused += !refusal(folder.write(good.substr(0, size))).empty();
    CHECK(refused > 0);
    std::mt19937 random(4);
    for (int i = 0; i < 200; ++i) {
        std::string bad = good;
        for (int k = 0; k < 3; ++k) bad[random() % bad.size()] = static_cast<char>(random());
        try {
            const SphereHierarchy h = readSph(folder.write(bad));
            CHECK_FALSE(h.nodes.empty());
            CHECK_FALSE(h.leaves().empty());
        } catch (const std::invalid_argument&) {
        }
    }
}

TEST_CASE("sphere files: a failed write leaves no file", "[tree]") {
    const Folder folder;
    const SphereHierarchy h = hierarchyOf(makeSphereTree(randomLeaves(3, 5)));
    CHECK_THROWS_AS(writeSph(h, folder.path / "no_such_folder" / "tree.sph"), std::runtime_error);
    fs::create_directories(folder.path / "taken" / "inside");
    CHECK_THROWS_AS(writeSph(h, folder.path / "taken"), std::runtime_error);
    CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);

    SphereHierarchy chain;  // a branch of 25 nodes in a tree of branching 8: 8^24 slots
    for (int i = 0; i < 25; ++i) chain.nodes.push_back({Vec3::Zero(), 1, i - 1, i + 1, i < 24 ? 1 : 0});
    CHECK_THROWS_AS(writeSph(chain, folder.path / "chain.sph"), std::runtime_error);
    chain.branching = 1;
    writeSph(chain, folder.path / "chain.sph");
    CHECK(same(readSph(folder.path / "chain.sph"), chain));
}

}  // namespace
}  // namespace touchstone::sphere_hierarchy_tests
