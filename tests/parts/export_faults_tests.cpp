// Parts as other programs export them: what bounds a volume is read as closed, whatever its faults.
#include <catch2/catch.hpp>
#include <cmath>

#include "haptics/builder/mesh_repair.hpp"
#include "haptics/surface/surface.hpp"
#include "tests/parts/mesh_checks.hpp"
#include "tools/parts/export_faults.hpp"
#include "tools/parts/gears.hpp"
#include "tools/parts/hook.hpp"
#include "tools/parts/lock.hpp"
#include "tools/parts/nut.hpp"
#include "tools/parts/shapes.hpp"

namespace touchstone::app::export_faults_tests {
namespace {

struct Part {
    std::string name;
    engine::MeshData mesh;
};

ThreadFit thread(double diameter, double pitch, int segments) {
    return {.diameter = diameter, .pitch = pitch, .height = 13. / 16 * diameter, .segments = segments};
}

std::vector<Part> parts() {
    std::vector<Part> all;
    for (const auto& [diameter, pitch] : {std::pair{4.0, 0.7}, {8.0, 1.25}, {20.0, 2.5}}) {
        const std::string name = "M" + std::to_string(int(diameter));
        all.push_back({name + " nut", nut(thread(diameter, pitch, 96))});
        all.push_back({name + " bolt", bolt(thread(diameter, pitch, 96))});
    }
    all.push_back({"gear", looseGear({})});
    all.push_back({"fixed gear", fixedGear({})});
    all.push_back({"lock", lock({})});
    all.push_back({"hook", hook({})});
    all.push_back({"splined hole", splinedHole({})});
    all.push_back({"bracket", box({0.7, 12.3, 40.1}, 3)});
    return all;
}

TriangleMesh triangles(const engine::MeshData& mesh) {
    TriangleMesh out;
    for (const glm::vec3& p : mesh.positions) out.vertices.push_back(1000.0 * Vec3(p.x, p.y, p.z));
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        out.triangles.push_back({mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]});
    out.grid = 1000 * gridOf(mesh);
    return out;
}

/// mm³, of the walls.
double volumeOf(const RepairedMesh& body) {
    double sixfold = 0;
    for (const auto& [a, b, c] : body.walls) sixfold += body.vertices[a].dot(body.vertices[b].cross(body.vertices[c]));
    return sixfold / 6 / std::pow(body.scale, 3);
}

double areaOf(const engine::MeshData& mesh) {
    double area = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        area +=
            glm::length(glm::cross(corner(mesh, i + 1) - corner(mesh, i), corner(mesh, i + 2) - corner(mesh, i))) / 2;
    return area;
}

const std::pair<const char*, ExportFaults> kFaults[] = {
    {"rounded", {}},
    {"junctions", {.junctions = 0.2}},
    {"slivers", {.slivers = 0.01}},
    {"without area", {.degenerate = 0.01}},
    {"turned over", {.flipped = 0.3}},
    {"twice", {.everythingTwice = true}},
    {"inner walls", {.innerWalls = 0.05}},
    {"all", kUsualFaults},
    {"ten micrometers", {.grid = 1e-5, .junctions = 0.1, .slivers = 0.01}},
    {"another seed", {.junctions = 0.3, .slivers = 0.05, .flipped = 0.1, .innerWalls = 0.02, .seed = 5}},
    {"float", {.grid = 0, .junctions = 0.1, .slivers = 0.01}},
};

}  // namespace

TEST_CASE("export faults: a part is read as closed and keeps its volume", "[parts]") {
    for (const Part& part : parts()) {
        const double area = areaOf(part.mesh), expected = volume(part.mesh);
        for (const auto& [name, faults] : kFaults) {
            const TriangleMesh mesh = triangles(withFaults(part.mesh, faults));
            const RepairedMesh body = repairMesh(mesh);
            const MeshDefects defects = defectsOf(body);
            INFO(part.name << ", " << name << ", grid " << mesh.grid << " mm: " << defects.openEdges << " open edges, "
                           << defects.crowdedEdges << " of more than two faces");
            CHECK(body.closed());
            const double grid = std::max(1000 * faults.grid, 1e-5);
            CHECK(std::abs(volumeOf(body) - expected) < area * grid);
            CHECK(body.weld / body.scale < (faults.grid > 1e-6 ? 14 : 4) * grid);  // an upper bound, of all rounds
        }
    }
}

TEST_CASE("export faults: each is counted", "[parts]") {
    const auto repairsOf = [](const ExportFaults& faults) {
        return repairMesh(triangles(withFaults(nut(thread(8, 1.25, 96)), faults))).repairs;
    };
    CHECK(repairsOf({.grid = 0}) == MeshRepairs{});
    CHECK(repairsOf({.junctions = 0.2}).stitched > 100);
    CHECK(repairsOf({.degenerate = 0.01}).degenerate > 10);
    CHECK(repairsOf({.flipped = 0.3}).turned > 100);
    CHECK(repairsOf({.everythingTwice = true}).duplicates > 1000);
    CHECK(repairsOf({.innerWalls = 0.05}).inner > 50);
}

}  // namespace touchstone::app::export_faults_tests
