#include "haptics/surface/part.hpp"

#include <algorithm>
#include <stdexcept>

#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/mesh_words.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/surface/surface.hpp"

namespace touchstone {
namespace {

double combined(double a, double b, FrictionRule rule) {
    switch (rule) {
        case FrictionRule::Average:
            return (a + b) / 2;
        case FrictionRule::Minimum:
            return std::min(a, b);
        case FrictionRule::Maximum:
            return std::max(a, b);
        case FrictionRule::Multiply:
            break;
    }
    return a * b;
}

}  // namespace

Friction frictionBetween(const std::optional<Material>& a, const std::optional<Material>& b) {
    if (!a || !b) return {};
    const FrictionRule rule = std::min(a->rule, b->rule);
    return {combined(a->friction.atRest, b->friction.atRest, rule),
            combined(a->friction.sliding, b->friction.sliding, rule)};
}

Part Part::fromTriangles(const TriangleMesh& mesh, const PartOptions& options) {
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t corner : mesh.triangles[i])
            if (corner >= mesh.vertices.size())
                throw std::invalid_argument("triangle " + std::to_string(i) + " has corner " + std::to_string(corner) +
                                            ", but there are " + std::to_string(mesh.vertices.size()) +
                                            " vertices: correct the index");
    if (options.spheres < 0 || options.spheres > TreeOptions::kMaxLeaves)
        throw std::invalid_argument("PartOptions::spheres is " + std::to_string(options.spheres) +
                                    ", but must be from 0 to " + std::to_string(TreeOptions::kMaxLeaves));
    const RepairedMesh body = repairMesh(mesh);
    Part part;
    if (body.closed())
        part.surface = std::make_shared<const Surface>(surfaceFeatures(body));
    else if (options.spheres == 0)
        throw std::invalid_argument("the mesh is not closed: it has " + words(defectsOf(body)) +
                                    "; close it, or ask for spheres, which then touch in its place");
    if (options.spheres > 0)
        part.spheres = std::make_shared<const SphereTree>(buildSphereTree(mesh, {.leaves = options.spheres}));
    return part;
}

Vec3 Part::center() const { return surface ? surface->extent.center : spheres->center(); }
double Part::reach() const { return surface ? surface->extent.reach : spheres->reach(); }

}  // namespace touchstone
