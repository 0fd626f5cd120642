// Parts of a CAD file as nodes of a scene.
#include "engine/scene/cad_scene.hpp"

#include <catch2/catch.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/scene/transforms.hpp"

namespace touchstone::cad_scene_tests {

using namespace touchstone::engine;

namespace {

/// A tetrahedron 3 m from its origin, with edges of 10 mm; at three places, once mirrored.
CadAssembly threeParts() {
    CadAssembly assembly;
    CadShape& shape = assembly.shapes.emplace_back();
    for (const glm::dvec3& corner : {glm::dvec3(0), glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)})
        shape.vertices.push_back(glm::dvec3(3, 0, 0) + 0.01 * corner);
    shape.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    assembly.parts = {{.name = "first"}, {.name = "second", .color = glm::vec3(1, 0, 0)}, {.name = "third"}};
    assembly.parts[1].placement = glm::translate(glm::dmat4(1), {-3, 0, 0});
    assembly.parts[2].placement = glm::scale(glm::dmat4(1), {-1, 1, 1});
    return assembly;
}

}  // namespace

TEST_CASE("cad scene: parts keep place, name and color, and share the mesh of their shape", "[cad]") {
    const std::vector<std::uint32_t> all{0, 1, 2};
    const Scene scene = sceneOf(threeParts(), all, {.name = "steel"}, 0.5);
    REQUIRE(scene.nodes.size() == 3);
    const auto node = [&](std::size_t i) { return scene.nodes[i]; };
    const auto mesh = [&](std::size_t i) { return scene.registry.get<MeshInstance>(node(i)).primitives.at(0); };
    CHECK(scene.registry.get<Name>(node(1)).value == "second");
    CHECK(mesh(0).mesh == mesh(2).mesh);
    CHECK(scene.materials.at(std::size_t(mesh(0).material)).name == "steel");
    CHECK(scene.materials.at(std::size_t(mesh(1).material)).baseColor == glm::vec4(1, 0, 0, 1));
    // Within 1 nm, as single precision has it 10 mm from a point near the part, and not 3 m from the origin.
    const auto distance = [&](std::size_t i, const glm::dvec3& corner) {
        double least = 1;
        for (const glm::vec3& p : mesh(i).mesh->positions)
            least = std::min(least,
                             glm::length(glm::dvec3(worldMatrix(scene.registry, node(i)) * glm::dvec4(p, 1)) - corner));
        return least;
    };
    CHECK(distance(0, {3, 0.01, 0}) < 1e-9);
    CHECK(distance(1, {0.01, 0, 0}) < 1e-9);
    CHECK(distance(2, {-3.01, 0, 0}) < 1e-9);
    CHECK(glm::determinant(glm::dmat3(worldMatrix(scene.registry, node(2)))) == Approx(-1));
}

TEST_CASE("cad scene: chosen parts alone, turned as a whole", "[cad]") {
    const std::vector<std::uint32_t> second{1};
    const glm::dmat4 turned = glm::rotate(glm::dmat4(1), std::acos(0.0), {0, 0, 1});
    const Scene scene = sceneOf(threeParts(), second, {}, 0.5, turned);
    REQUIRE(scene.nodes.size() == 1);
    const glm::dvec3 x = glm::dmat3(worldMatrix(scene.registry, scene.nodes[0])) * glm::dvec3(1, 0, 0);
    CHECK(glm::length(x - glm::dvec3(0, 1, 0)) < 1e-12);
}

}  // namespace touchstone::cad_scene_tests
