#include "engine/scene/mesh_file.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "engine/scene/text.hpp"
#include "tests/engine/scene/gltf_fixture.hpp"

namespace touchstone::mesh_file_tests {

using namespace touchstone::engine;
using namespace touchstone::engine::test;

namespace {

const std::string kTetrahedron = R"(solid part
facet normal 0 0 -1
 outer loop
  vertex 0 0 0
  vertex 0 20 0
  vertex 10 0 0
 endloop
endfacet
facet normal 0 -1 0
 outer loop
  vertex 0 0 0
  vertex 10 0 0
  vertex 0 0 30
 endloop
endfacet
facet normal -1 0 0
 outer loop
  vertex 0 0 0
  vertex 0 0 30
  vertex 0 20 0
 endloop
endfacet
facet normal 1 1 1
 outer loop
  vertex 10 0 0
  vertex 0 20 0
  vertex -0 0 30
 endloop
endfacet
endsolid part
)";

Bytes binaryStl(const std::vector<std::array<float, 9>>& triangles) {
    Bytes bytes(80, 0);
    const auto append = [&](const void* data, std::size_t size) {
        bytes.insert(bytes.end(), static_cast<const std::uint8_t*>(data),
                     static_cast<const std::uint8_t*>(data) + size);
    };
    const auto count = static_cast<std::uint32_t>(triangles.size());
    append(&count, 4);
    for (const auto& triangle : triangles) {
        const float normal[3] = {0, 0, 1};
        append(normal, 12);
        append(triangle.data(), 36);
        append("\0", 2);
    }
    return bytes;
}

/// Six times the signed volume: positive when all triangles face outwards.
double volume(const MeshData& mesh) {
    double sum = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        sum += glm::dot(glm::dvec3(mesh.positions[mesh.indices[i]]),
                        glm::cross(glm::dvec3(mesh.positions[mesh.indices[i + 1]]),
                                   glm::dvec3(mesh.positions[mesh.indices[i + 2]])));
    return sum / 6;
}

}  // namespace

TEST_CASE("mesh file: an ASCII STL in millimeters is welded and scaled to meters", "[mesh]") {
    const TemporaryFolder folder;
    writeFile(folder / "part.stl", kTetrahedron);
    const MeshData mesh = readMeshFile(folder / "part.stl", 0.001).mesh;
    CHECK(mesh.positions.size() == 4);  // 12 corners at 4 places; -0 and 0 are equal
    CHECK(mesh.normals.size() == 4);
    CHECK(mesh.indices.size() == 12);
    CHECK(volume(mesh) == Approx(0.01 * 0.02 * 0.03 / 6).epsilon(1e-6));
    CHECK(std::find(mesh.positions.begin(), mesh.positions.end(), glm::vec3(0, 0, 0.03f)) != mesh.positions.end());
}

TEST_CASE("mesh file: reads a binary STL, also with an upper-case extension", "[mesh]") {
    const TemporaryFolder folder;
    writeFile(folder / "PART.STL", binaryStl({{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 1, 1, 0, 0, 1, 0}}));
    const MeshData mesh = readMeshFile(folder / "PART.STL", 1).mesh;
    CHECK(mesh.positions == std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}});
    CHECK(mesh.indices == std::vector<std::uint32_t>{0, 1, 2, 1, 3, 2});
    CHECK(mesh.normals[0] == glm::vec3(0, 0, 1));
}

TEST_CASE("mesh file: OBJ polygons become triangles, and the material library is not opened", "[mesh]") {
    const TemporaryFolder folder;
    writeFile(folder / "part.obj",
              "mtllib ../../../../etc/passwd\no first\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"
              "o second\nv 0 0 0\nv 0 0 2\nusemtl x\nf 5 -1 -4\nl 1 2\np 3\n");
    const MeshData mesh = readMeshFile(folder / "part.obj", 0.5).mesh;
    CHECK(mesh.indices.size() == 9);
    CHECK(mesh.positions.size() == 5);  // vertex 5 repeats vertex 1
}

TEST_CASE("mesh file: the triangles of a polygon cover exactly the polygon", "[mesh]") {
    const TemporaryFolder folder;
    // An L with a corner on the diagonal between two others, and a bow tie that crosses itself.
    const auto [corners, area] = GENERATE(table<std::string, float>({
        {"v 0 0 0\nv 20 0 0\nv 20 10 0\nv 10 10 0\nv 10 20 0\nv 0 20 0\nf 1 2 3 4 5 6\n", 300.f},
        {"v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nf 1 2 3 4\n", 2.f},
    }));
    writeFile(folder / "part.obj", corners);
    const MeshData mesh = readMeshFile(folder / "part.obj", 1).mesh;
    float covered = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
        const glm::vec3 a = mesh.positions[mesh.indices[i]];
        covered +=
            glm::length(glm::cross(mesh.positions[mesh.indices[i + 1]] - a, mesh.positions[mesh.indices[i + 2]] - a)) /
            2;
    }
    CHECK(covered == Approx(area));
}

TEST_CASE("mesh file: triangles without three distinct corners are dropped", "[mesh]") {
    const TemporaryFolder folder;
    writeFile(folder / "part.stl", binaryStl({{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 1, 0, 0, 0, 1, 0}}));
    CHECK(readMeshFile(folder / "part.stl", 1).mesh.indices.size() == 3);
    writeFile(folder / "thin.stl", binaryStl({{1, 0, 0, 1, 0, 0, 0, 1, 0}}));
    CHECK_THROWS_WITH(readMeshFile(folder / "thin.stl", 1), Catch::Contains("has no triangles"));
}

TEST_CASE("mesh file: broken files are refused in one sentence that names them", "[mesh]") {
    const TemporaryFolder folder;
    Bytes cut = binaryStl({{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 1, 1, 0, 0, 1, 0}});
    cut.resize(cut.size() - 60);
    const float nan = std::nanf(""), infinity = INFINITY;
    const std::vector<std::tuple<std::string, Bytes, std::string>> cases = {
        {"cut.stl", cut, "is truncated"},
        {"nan.stl", binaryStl({{0, 0, 0, 1, 0, 0, 0, nan, 0}}), "non-finite"},
        {"infinite.stl", binaryStl({{0, 0, 0, 1, 0, 0, 0, infinity, 0}}), "non-finite"},
        {"empty.stl", {}, ""},
        {"words.stl", {'h', 'e', 'l', 'l', 'o'}, ""},
        {"points.obj", {'v', ' ', '0', ' ', '0', ' ', '0', '\n'}, ""},
        {"empty.obj", {}, ""},
        {"part.step", {'I', 'S', 'O'}, "is not a " + meshExtensionWords("or")},
    };
    for (const auto& [name, bytes, words] : cases) {
        CAPTURE(name);
        writeFile(folder / name, bytes);
        try {
            readMeshFile(folder / name, 1);
            FAIL("the broken file was read");
        } catch (const SceneError& error) {
            const std::string sentence = error.what();
            CAPTURE(sentence);
            CHECK(sentence.find(name + ": ") != std::string::npos);
            CHECK(sentence.find(words) != std::string::npos);
            CHECK(sentence.find('\n') == std::string::npos);
        }
    }
    writeFile(folder / "range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    CHECK_THROWS_AS(readMeshFile(folder / "range.obj", 1), SceneError);
    CHECK_THROWS_WITH(readMeshFile(folder / "absent.stl", 1), Catch::Contains("the file does not exist"));
    CHECK_THROWS_WITH(readMeshFile(folder.path(), 1), Catch::Contains("is not a " + meshExtensionWords("or")));
}

TEST_CASE("mesh file: mutated files give a mesh or one sentence", "[mesh][fuzz]") {
    const unsigned seed = 99;
    CAPTURE(seed);
    std::mt19937 random(seed);
    const TemporaryFolder folder;
    const Bytes ascii(kTetrahedron.begin(), kTetrahedron.end());
    const Bytes binary = binaryStl({{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 1, 1, 0, 0, 1, 0}});
    const std::string objText =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1 -2 -3\n";
    const Bytes obj(objText.begin(), objText.end());
    int read = 0;
    for (int i = 0; i < 600; ++i) {
        CAPTURE(i);
        const int kind = i % 3;
        Bytes bytes = kind == 0 ? ascii : kind == 1 ? binary : obj;
        for (unsigned k = 0; k <= random() % 3; ++k)
            bytes[random() % bytes.size()] = static_cast<std::uint8_t>(random());
        if (random() % 4 == 0) bytes.resize(random() % bytes.size());
        const auto file = folder / (kind == 2 ? "part.obj" : "part.stl");
        writeFile(file, bytes);
        try {
            const MeshData mesh = readMeshFile(file, 0.001).mesh;
            ++read;
            REQUIRE(mesh.indices.size() % 3 == 0);
            for (const auto index : mesh.indices) REQUIRE(index < mesh.positions.size());
            for (const auto& p : mesh.positions) REQUIRE(std::isfinite(p.x + p.y + p.z));
        } catch (const SceneError&) {
        }
    }
    CHECK(read > 0);
    CHECK(read < 600);
}

TEST_CASE("mesh data: the grid of rounded coordinates is found, in whatever unit they are", "[mesh]") {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> place(-0.02, 0.03);
    const auto meshOf = [&](auto&& rounded) {
        MeshData mesh;
        for (int i = 0; i < 300; ++i)
            mesh.positions.emplace_back(rounded(place(random)), rounded(place(random)), rounded(place(random)));
        return mesh;
    };
    const auto toGrid = [](double grid) { return [grid](double x) { return float(std::round(x / grid) * grid); }; };
    for (const double grid : {1e-6, 1e-5, 1e-4}) CHECK(gridOf(meshOf(toGrid(grid))) == Approx(grid));
    // A text in millimeters, scaled in single precision.
    CHECK(gridOf(meshOf([](double x) { return float(std::round(1e3 * x / 1e-3) * 1e-3) * 0.001f; })) == Approx(1e-6));
    // Six digits: the largest coordinates have the coarsest grid.
    CHECK(gridOf(meshOf([](double x) { return std::stof(formatted("%.6g", x)); })) == Approx(1e-7));
    const auto normalized = [](double x) { return float(std::round(x / 0.03 * 32767)) / 32767; };
    CHECK(gridOf(meshOf(normalized)) == Approx(1.0 / 32767));
    // Not rounded: no coarser than the spacing of floats.
    CHECK(gridOf(meshOf([](double x) { return float(x); })) < 4e-9);
    // A part with round dimensions is exact: too few of its coordinates use the last digit.
    MeshData foil;
    for (int i = 0; i < 400; ++i)
        foil.positions.emplace_back(0.001f * float(i % 101), 0.001f * float(i % 77), 1e-4f * float(i % 2));
    CHECK(gridOf(foil) < 2e-8);
    CHECK(gridOf(MeshData{}) == 0);
    CHECK(gridOf(meshOf([](double) { return 0.0f; })) == 0);
}

}  // namespace touchstone::mesh_file_tests
