// What preparation leaves of a part still bounds it: whatever approaches any triangle of its file crosses a feature.
#include <catch2/catch.hpp>

#include "haptics/surface/feature_list.hpp"
#include "tests/support/exact_judge.hpp"
#include "tests/support/fine_parts.hpp"
#include "tests/support/mesh_world.hpp"

namespace touchstone::bounding_tests {

using namespace touchstone::test;

namespace {

/// The distance that ticks keep, mm. A step crosses features that it brings nearer than half of it, so that surfaces
/// that preparation moves by less stay apart.
constexpr double kDistance = 2e-3;

/// Where a part of few triangles can touch, and the outward direction there.
struct Aim {
    Vec3 at, outward;
};

/// A slender tetrahedron whose tip, edges and faces probe a part.
struct Probe {
    explicit Probe(double size) {
        mesh.vertices = {Vec3(0, 0, 0), Vec3(size, 0.3 * size, 0), Vec3(-0.2 * size, size, 0.1 * size),
                         Vec3(0.3 * size, 0.4 * size, 2 * size)};
        mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
        Vec3 center = Vec3::Zero();
        for (const Vec3& p : mesh.vertices) center += p / 4;
        for (Vec3& p : mesh.vertices) p -= center;
        // All faces of the larger copy are at least half the distance kept outside those of the probe.
        double inner = HUGE_VAL;
        for (int f = 0; f < 4; ++f) inner = std::min(inner, normal(f).dot(corner(f, 0)));
        wide = moved(mesh, 1 + kDistance / 2 / inner, Vec3::Zero());
    }
    Vec3 corner(int face, int k) const { return mesh.vertices[mesh.triangles[std::size_t(face)][std::size_t(k)]]; }
    Vec3 normal(int face) const {
        return (corner(face, 1) - corner(face, 0)).cross(corner(face, 2) - corner(face, 0)).normalized();
    }
    /// kind: 0 a corner, 1 an edge, 2 a face.
    Aim aim(int kind, std::mt19937& random) const {
        std::uniform_real_distribution<double> uniform(0.05, 0.95);
        const int f = int(random() % 4), k = int(random() % 3);
        const Vec3 a = corner(f, k), b = corner(f, (k + 1) % 3), c = corner(f, (k + 2) % 3);
        if (kind == 0) return {a, a.normalized()};
        if (kind == 2) return {pointOn({a, b, c}, uniform(random), uniform(random)), normal(f)};
        const Vec3 at = a + uniform(random) * (b - a);
        return {at, (at - at.dot(b - a) / (b - a).squaredNorm() * (b - a)).normalized()};
    }

    TriangleMesh mesh, wide;
};

struct Tally {
    int approached = 0, entered = 0, through = 0;
};

/// Lets a probe approach random triangles of a part, half of them among its thinnest: the tip, an edge or a face first,
/// steeply and flatly, from far and near. `entered`: steps at whose end the file's triangles overlap, by exact
/// predicates; `through`: those of them that cross no feature or count as free.
Tally approach(const TriangleMesh& part, int steps, unsigned seed, double size) {
    const Probe probe(size);
    const Surface tool = surfaceOf(probe.mesh), obstacle = surfaceOf(part);
    const ExactJudge judge(probe.mesh, part), early(probe.wide, part);
    FeatureList list(tool, obstacle, 0);
    list.keepApart(kDistance);
    std::vector<Triangle> all = trianglesOf(part);
    std::erase_if(all, [](const Triangle& t) { return !(areaOf(t) > 0); });
    const auto altitude = [](const Triangle& t) { return areaOf(t) / std::sqrt(longestEdge(t).length2); };
    std::sort(all.begin(), all.end(), [&](const Triangle& a, const Triangle& b) { return altitude(a) < altitude(b); });
    Random random(seed);
    std::uniform_real_distribution<double> uniform;
    Tally tally;
    for (int i = 0; i < steps; ++i) {
        const std::size_t among = i % 2 ? all.size() : std::max<std::size_t>(all.size() / 10, 4);
        const Triangle& t = all[random.engine() % among];
        const int kind = i / 2 % 3;
        const Aim aim = probe.aim(kind, random.engine);
        const Vec3 at = kind == 2 ? t[random.engine() % 3] : pointOn(t, uniform(random.engine), uniform(random.engine));
        const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
        const Vec3 facing = (normal + (i % 5 ? 0.5 : 2.0) * random.vector()).normalized();
        const Vec3 axis = aim.outward.cross(-facing);
        const Quat turned = expRotation(10 * uniform(random.engine) * facing) *
                            expRotation(std::atan2(axis.norm(), -aim.outward.dot(facing)) * axis.normalized());
        const Vec3 way = (facing + (i % 7 ? 0.3 : 3.0) * random.vector()).normalized();
        const auto length = [&](double most) { return most * std::pow(10, -2.5 * uniform(random.engine)); };
        const Pose before{at + length(0.3) * way - turned * aim.at, turned};
        if (early.overlap(before)) continue;
        // Turns of up to what a tick allows: the arc that a point then leaves its straight way by bends less than is
        // kept.
        const double turn =
            i % 3 ? 0 : std::pow(10, -uniform(random.engine)) * std::sqrt(kDistance / tool.extent.reach);
        const StraightMotion step{before, at - length(0.3) * way - turned * aim.at - before.p,
                                  turn * random.vector().normalized()};
        const Pose after = step.end(tool.extent.center);
        ++tally.approached;
        if (!judge.overlap(after)) continue;
        ++tally.entered;
        list.forget();
        REQUIRE(list.complete(list.coverageOf(step, 0), 0.1));
        const bool crosses = list.remeasure(before, after, 0).deeper, isFree = list.freeShare(step, 1) == 1;
        tally.through += !crosses || isFree;
    }
    return tally;
}

struct Part {
    std::string name;
    TriangleMesh mesh;
};

/// Kinds of parts with fillets of this radius, mm.
std::vector<Part> partsWith(double fillet, int teeth) {
    const std::string name = " with fillets of " + std::to_string(int(1000 * fillet)) + " um";
    const Outline square{{-4, -4}, {4, -4}, {4, 4}, {-4, 4}};
    const TriangleMesh block = extruded(filleted(square, fillet, 5), 20);
    return {
        {"block" + name, block},
        {"gear" + name, extruded(gearOutline(teeth, 16, 20, fillet, 4), 20)},
        {"thread" + name, threadMesh(5, 6, 1, 3, 20, fillet, 3)},
        {"two blocks" + name, joined(block, extruded(filleted(square, 2 * fillet, 3), 10))},
    };
}

/// A part as it is, as files of few digits have it, and as careless meshers do. A grid as coarse as the fillets would
/// fold them.
std::vector<Part> writtenFrom(const Part& part, double fillet, unsigned seed) {
    const TriangleMesh rounded = roundedTo(part.mesh, 1e-4);
    const TriangleMesh coarse = roundedTo(part.mesh, std::min(5e-4, fillet / 10));
    return {part,
            {part.name + ", rounded to 0.1 um", rounded},
            {part.name + ", with slivers", withSlivers(rounded, 0.2, seed)},
            {part.name + ", on a coarse grid with slivers", withSlivers(coarse, 0.2, seed + 1)}};
}

void checkThatAllBound(double fillet, int teeth, int steps, unsigned seed) {
    for (const Part& part : partsWith(fillet, teeth))
        for (const auto& [name, mesh] : writtenFrom(part, fillet, seed)) {
            CAPTURE(name);
            const RepairedMesh body = repairMesh(mesh);
            CHECK(body.closed());
            REQUIRE(body.thin / body.scale < kDistance / 2);
            for (const double size : {0.05, 1.0}) {
                CAPTURE(size);
                const Tally tally = approach(mesh, steps, unsigned(1e6 * fillet) + seed, size);
                CHECK(tally.entered > steps / 20);
                CHECK(tally.through == 0);
            }
        }
}

}  // namespace

TEST_CASE("bounding: what approaches any triangle of a part crosses a feature, however fine the part is", "[surface]") {
    for (const double fillet : {1e-3, 3e-3, 0.1}) checkThatAllBound(fillet, 6, 300, 3);
}

TEST_CASE("bounding: what approaches any triangle of a part crosses a feature, in many steps", "[surface][long]") {
    for (const unsigned seed : {7u, 101u})
        for (const double fillet : {1e-3, 2e-3, 5e-3, 0.02}) checkThatAllBound(fillet, 24, 1500, seed);
}

}  // namespace touchstone::bounding_tests
