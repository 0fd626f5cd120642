#include "engine/scene/transforms.hpp"

#include <catch2/catch.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <random>

namespace touchstone::transforms_tests {

using namespace touchstone::engine;

namespace {

double difference(const glm::dmat4& a, const glm::dmat4& b) {
    double worst = 0;
    for (int k = 0; k < 16; ++k) worst = std::max(worst, std::abs(a[k / 4][k % 4] - b[k / 4][k % 4]));
    return worst;
}

glm::dmat4 assembled(const RigidPart& part) { return rigidMatrix(part) * glm::dmat4(part.rest); }

struct RandomMatrices {
    std::mt19937 random;
    std::normal_distribution<double> normal;

    explicit RandomMatrices(unsigned seed) : random(seed) {}
    glm::dmat4 affine() {
        glm::dmat4 m(1);
        for (int column = 0; column < 4; ++column)
            for (int row = 0; row < 3; ++row) m[column][row] = normal(random);
        return m;
    }
    glm::dquat rotation() {
        return glm::normalize(glm::dquat(normal(random), normal(random), normal(random), normal(random)));
    }
};

// Rounding of products of a few matrices in double with entries near 1.
constexpr double kRounding = 1e-12;

}  // namespace

TEST_CASE("transforms: local matrix is translation, rotation, scale in this order", "[transforms]") {
    LocalTransform local;
    local.translation = {10, 0, 0};
    local.rotation = glm::angleAxis(glm::radians(90.0), glm::dvec3(0, 0, 1));
    local.scale = {2, 3, 4};
    // (1, 1, 1) -> scaled (2, 3, 4) -> turned (-3, 2, 4) -> moved (7, 2, 4).
    const glm::dvec4 point = localMatrix(local) * glm::dvec4(1, 1, 1, 1);
    CHECK(glm::length(point - glm::dvec4(7, 2, 4, 1)) < kRounding);
}

TEST_CASE("transforms: any affine matrix is its rigid part times its rest matrix", "[transforms]") {
    const unsigned seed = 3;
    CAPTURE(seed);
    RandomMatrices matrices(seed);
    for (int i = 0; i < 500; ++i) {
        const glm::dmat4 m = matrices.affine();
        const RigidPart part = rigidPart(m);
        CHECK(difference(assembled(part), m) < kRounding * 10);
        CHECK(glm::length(part.rotation) == Approx(1).epsilon(kRounding));
        CHECK(difference(localMatrix(localTransform(m)), m) < kRounding * 10);
    }
}

TEST_CASE("transforms: a rigid motion in front does not change the rest matrix", "[transforms]") {
    const unsigned seed = 5;
    CAPTURE(seed);
    RandomMatrices matrices(seed);
    for (int i = 0; i < 200; ++i) {
        const glm::dmat4 m = matrices.affine(), motion(glm::mat3_cast(matrices.rotation()));
        const RigidPart before = rigidPart(m), after = rigidPart(motion * m);
        // The worst-conditioned of 200 random matrices costs about three digits.
        CHECK(difference(glm::dmat4(before.rest), glm::dmat4(after.rest)) < 1e-9);
    }
}

TEST_CASE("transforms: decomposes a rotation with positive or mirrored scale", "[transforms]") {
    LocalTransform local;
    local.rotation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1, 2, 3)));
    for (const double x : {2.0, -2.0}) {
        local.scale = {x, 3, 4};
        const LocalTransform found = localTransform(localMatrix(local));
        CHECK(glm::length(found.scale - local.scale) < kRounding);
        CHECK(std::abs(glm::dot(found.rotation, local.rotation)) == Approx(1).epsilon(kRounding));
        CHECK(found.shear == glm::dmat3(1));
        const RigidPart part = rigidPart(localMatrix(local));
        CHECK(part.rest[0][0] == Approx(x).epsilon(kRounding));
    }
}

TEST_CASE("transforms: the decomposition of a singular matrix keeps the product", "[transforms]") {
    for (const glm::dvec3 scale : {glm::dvec3(0), glm::dvec3(1, 0, 2), glm::dvec3(0, 0, 1)}) {
        glm::dmat4 m = glm::rotate(glm::dmat4(1), 0.5, glm::dvec3(1, 1, 0)) * glm::scale(glm::dmat4(1), scale);
        CHECK(difference(assembled(rigidPart(m)), m) < kRounding);
        CHECK(difference(localMatrix(localTransform(m)), m) < kRounding);
    }
    const glm::dmat4 flat(1, 2, 3, 0, 2, 4, 6, 0, -1, -2, -3, 0, 0, 0, 0, 1);  // three parallel columns
    CHECK(difference(assembled(rigidPart(flat)), flat) < kRounding);
}

TEST_CASE("transforms: the world transform of a child is its parent's times its own", "[transforms]") {
    Scene scene;
    LocalTransform turn, move;
    turn.rotation = glm::angleAxis(glm::radians(90.0), glm::dvec3(0, 0, 1));
    move.translation = {1, 0, 0};
    const Entity parent = addNode(scene, "parent", {}, turn), child = addNode(scene, "child", parent, move);
    updateWorldTransforms(scene);
    const glm::dvec3 place(scene.registry.get<WorldTransform>(child).matrix[3]);
    CHECK(glm::length(place - glm::dvec3(0, 1, 0)) < kRounding);
    CHECK(difference(worldMatrix(scene.registry, child), scene.registry.get<WorldTransform>(child).matrix) < kRounding);
    CHECK(glm::length(worldPose(scene.registry, child).translation - glm::dvec3(0, 1, 0)) < kRounding);
}

TEST_CASE("transforms: a hundred thousand nested nodes do not exhaust the stack", "[transforms]") {
    Scene scene;
    LocalTransform step;
    step.translation = {0.5, 0, 0};
    Entity last;
    for (int i = 0; i < 100000; ++i) last = addNode(scene, "", last, step);
    updateWorldTransforms(scene);
    CHECK(scene.registry.get<WorldTransform>(last).matrix[3].x == 50000);
}

TEST_CASE("transforms: a baked mirror keeps triangles and normals facing outwards", "[transforms]") {
    const MeshData mesh{{{1, 0, 0}, {1, 1, 0}, {1, 0, 1}}, {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}}, {}, {0, 1, 2}};
    const MeshData baked = bakedMesh(mesh, glm::scale(glm::dmat4(1), glm::dvec3(-2, 1, 1)));
    CHECK(baked.positions[0] == glm::vec3(-2, 0, 0));
    CHECK(baked.indices == std::vector<std::uint32_t>{0, 2, 1});
    CHECK(baked.normals[0] == glm::vec3(-1, 0, 0));
    CHECK(smoothNormals(baked)[0] == glm::vec3(-1, 0, 0));
}

TEST_CASE("transforms: baked normals stay perpendicular to their triangles under shear and scale", "[transforms]") {
    const unsigned seed = 11;
    CAPTURE(seed);
    RandomMatrices matrices(seed);
    MeshData mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {}, {}, {0, 1, 2}};
    mesh.normals = smoothNormals(mesh);
    for (int i = 0; i < 200; ++i) {
        const MeshData baked = bakedMesh(mesh, matrices.affine());
        // Positions are in single precision; rounding of one coordinate turns the normal of a thin triangle by more.
        CHECK(glm::dot(baked.normals[0], smoothNormals(baked)[0]) > 0.999f);
    }
}

TEST_CASE("mesh: smooth normals weight triangles by area", "[transforms]") {
    // Vertex 0 belongs to a triangle of area 2 facing +z and one of area 1/2 facing +x: sum (1, 0, 4) / sqrt(17).
    MeshData mesh{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 1, 0}, {0, 0, 1}, {5, 5, 5}}, {}, {}, {0, 1, 2, 0, 3, 4}};
    const auto normals = smoothNormals(mesh);
    CHECK(glm::length(normals[0] - glm::vec3(1, 0, 4) / std::sqrt(17.0f)) < 1e-6f);
    CHECK(normals[1] == glm::vec3(0, 0, 1));
    CHECK(normals[4] == glm::vec3(1, 0, 0));
    CHECK(normals[5] == glm::vec3(0, 0, 1));  // belongs to no triangle
}

}  // namespace touchstone::transforms_tests
