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

TEST_CASE("mesh: normals are split at creases, and only there", "[transforms]") {
    // A prism of `sides` around y with its ends as fans.
    const auto prism = [](std::uint32_t sides) {
        MeshData mesh{{{0, -1, 0}, {0, 1, 0}}, {}, {}, {}};
        for (std::uint32_t k = 0; k < sides; ++k) {
            const float angle = 2 * 3.14159265f * static_cast<float>(k) / static_cast<float>(sides);
            for (const float y : {-1.0f, 1.0f}) mesh.positions.emplace_back(std::cos(angle), y, -std::sin(angle));
            const std::uint32_t a = 2 + 2 * k, b = 2 + 2 * ((k + 1) % sides);
            for (const std::uint32_t corner : {a, b, b + 1, a, b + 1, a + 1, 0u, b, a, 1u, a + 1, b + 1})
                mesh.indices.push_back(corner);
        }
        return mesh;
    };
    const double crease = 0.5236;  // 30 degrees
    const MeshData box = splitAtCreases(prism(4), crease);
    CHECK(box.positions.size() == 24 + 2);  // the centers of two sides
    for (std::size_t i = 0; i < box.indices.size(); i += 3) {
        const glm::vec3 a = box.positions[box.indices[i]];
        const glm::vec3 normal =
            glm::normalize(glm::cross(box.positions[box.indices[i + 1]] - a, box.positions[box.indices[i + 2]] - a));
        for (std::size_t k = 0; k < 3; ++k) {
            CHECK(box.positions[box.indices[i + k]] == prism(4).positions[prism(4).indices[i + k]]);
            CHECK(glm::length(box.normals[box.indices[i + k]] - normal) < 1e-6f);
        }
    }
    CHECK(splitAtCreases(prism(20), crease).positions.size() == 2 + 4 * 20);  // smooth around, sharp at the ends
    CHECK(splitAtCreases(prism(11), crease).positions.size() == 2 + 6 * 11);  // 33 degrees from side to side
    CHECK(splitAtCreases(prism(11), 0.6).positions.size() == 2 + 4 * 11);
    CHECK(splitAtCreases(prism(4), 3.1415).positions.size() == 2 + 2 * 4);

    // A triangle without area on the crease between two faces does not connect them.
    const MeshData bent{{{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 0, 1}},
                        {},
                        {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {4, 0}},
                        {0, 1, 3, 0, 2, 1, 0, 4, 2, 2, 4, 1}};
    const MeshData split = splitAtCreases(bent, crease);
    CHECK(split.normals[split.indices[0]] == glm::vec3(0, 0, 1));
    CHECK(split.normals[split.indices[6]] == glm::vec3(0, 1, 0));
    CHECK(split.texcoords[split.indices[2]] == glm::vec2(3, 0));
}

}  // namespace touchstone::transforms_tests
