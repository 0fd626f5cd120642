#include "engine/scene/transforms.hpp"

#include <glm/gtc/matrix_transform.hpp>

namespace touchstone::engine {
namespace {

/// Orthonormal columns that span the given columns in order. A column that depends on earlier ones (within 1e-9 of its
/// length) is replaced by a direction that completes the frame.
glm::dmat3 orthonormalFrame(const glm::dmat3& columns) {
    glm::dmat3 frame(0);
    bool found[3] = {};
    const auto withoutFound = [&](glm::dvec3 v) {
        // The second pass removes the rounding errors of the first.
        for (int pass = 0; pass < 2; ++pass)
            for (int i = 0; i < 3; ++i)
                if (found[i]) v -= glm::dot(frame[i], v) * frame[i];
        return v;
    };
    for (int i = 0; i < 3; ++i) {
        const double length = glm::length(columns[i]);
        if (!(length > 0)) continue;
        const glm::dvec3 residual = withoutFound(columns[i] / length);
        found[i] = glm::length(residual) > 1e-9;
        if (found[i]) frame[i] = glm::normalize(residual);
    }
    for (int i = 0; i < 3; ++i) {
        if (found[i]) continue;
        glm::dvec3 best(0);
        for (int j = 0; j < 3; ++j) {
            // The missing column's own axis comes first, so that a zero matrix gives the identity.
            glm::dvec3 axis(0);
            axis[(i + j) % 3] = 1;
            const glm::dvec3 residual = withoutFound(axis);
            if (glm::length(residual) > glm::length(best) + 1e-9) best = residual;
        }
        frame[i] = glm::normalize(best);
        found[i] = true;
    }
    return frame;
}

}  // namespace

RigidPart rigidPart(const glm::dmat4& matrix) {
    const glm::dmat3 linear(matrix);
    glm::dmat3 frame = orthonormalFrame(linear);
    if (glm::determinant(frame) < 0) frame[0] = -frame[0];
    RigidPart part;
    part.translation = matrix[3];
    part.rotation = glm::normalize(glm::quat_cast(frame));
    part.rest = glm::transpose(frame) * linear;
    return part;
}

glm::dmat4 rigidMatrix(const RigidPart& part) {
    glm::dmat4 matrix(glm::mat3_cast(part.rotation));
    matrix[3] = glm::dvec4(part.translation, 1);
    return matrix;
}

glm::dmat4 localMatrix(const LocalTransform& local) {
    glm::dmat3 linear = local.shear;
    for (int column = 0; column < 3; ++column) linear[column] *= local.scale;
    glm::dmat4 matrix(glm::mat3_cast(local.rotation) * linear);
    matrix[3] = glm::dvec4(local.translation, 1);
    return matrix;
}

LocalTransform localTransform(const glm::dmat4& matrix) {
    const RigidPart part = rigidPart(matrix);
    LocalTransform local;
    local.translation = part.translation;
    local.rotation = part.rotation;
    const glm::dvec3 scale(part.rest[0][0], part.rest[1][1], part.rest[2][2]);
    if (scale.x == 0 || scale.y == 0 || scale.z == 0) {
        local.shear = part.rest;  // singular: the scale cannot be divided out
        return local;
    }
    local.scale = scale;
    // Off-diagonal values below 1e-12 are rounding errors, not shear.
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) {
            const double value = part.rest[column][row] / scale[row];
            local.shear[column][row] = row == column ? 1 : std::abs(value) > 1e-12 ? value : 0;
        }
    return local;
}

void updateWorldTransforms(Scene& scene) {
    Registry& registry = scene.registry;
    struct Visit {
        Entity node;
        glm::dmat4 parent;
    };
    std::vector<Visit> open;
    for (const Entity root : scene.roots) open.push_back({root, glm::dmat4(1)});
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        const LocalTransform* local = registry.find<LocalTransform>(visit.node);
        const Hierarchy* hierarchy = registry.find<Hierarchy>(visit.node);
        if (!local) continue;
        const glm::dmat4 world = visit.parent * localMatrix(*local);
        registry.add(visit.node, WorldTransform{world});
        if (!hierarchy) continue;
        for (const Entity child : hierarchy->children) open.push_back({child, world});
    }
}

glm::dmat4 worldMatrix(const Registry& registry, Entity node) {
    glm::dmat4 matrix(1);
    while (const LocalTransform* local = registry.find<LocalTransform>(node)) {
        matrix = localMatrix(*local) * matrix;
        const Hierarchy* hierarchy = registry.find<Hierarchy>(node);
        node = hierarchy ? hierarchy->parent : Entity{};
    }
    return matrix;
}

RigidPart worldPose(const Registry& registry, Entity node) {
    return rigidPart(registry.get<WorldTransform>(node).matrix);
}

MeshData bakedMesh(const MeshData& mesh, const glm::dmat4& matrix) {
    const glm::dmat3 linear(matrix);
    const double determinant = glm::determinant(linear);
    // Normals transform by the cofactor matrix, which also exists for singular matrices. Mirroring flips them.
    const glm::dmat3 cofactors(glm::cross(linear[1], linear[2]), glm::cross(linear[2], linear[0]),
                               glm::cross(linear[0], linear[1]));
    MeshData baked = mesh;
    for (glm::vec3& position : baked.positions) position = glm::dvec3(matrix * glm::dvec4(position, 1));
    for (glm::vec3& normal : baked.normals) {
        const glm::dvec3 turned = cofactors * glm::dvec3(normal) * (determinant < 0 ? -1.0 : 1.0);
        const double length = glm::length(turned);
        if (length > 0) normal = turned / length;
    }
    if (determinant < 0)
        for (std::size_t i = 0; i + 2 < baked.indices.size(); i += 3)
            std::swap(baked.indices[i + 1], baked.indices[i + 2]);
    return baked;
}

}  // namespace touchstone::engine
