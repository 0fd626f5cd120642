#include "haptics/builder/mesh_repair.hpp"

#include <cassert>
#include <stdexcept>
#include <tuple>

#include "haptics/builder/mesh_shells.hpp"

namespace touchstone {
namespace {

// Weld tolerance, as a share of the diagonal: smaller than any feature, larger than the rounding of text files.
constexpr double kWeld = 1e-6;
// Largest coordinate and smallest extent, mm. Single precision ends at 3e38 and 1e-38; spheres need some range beyond
// the mesh.
constexpr double kLargest = 1e35, kSmallest = 1e-30;
constexpr const char* kNoSurface = "the mesh has no triangle with an area; check the exported surface";

}  // namespace

bool RepairedMesh::closed() const {
    return holes == 0 && std::none_of(faces.begin(), faces.end(), [](const Face& f) { return f.exposed; });
}

RepairedMesh repairMesh(const TriangleMesh& mesh, const Heartbeat& heartbeat) {
    Pulse pulse(heartbeat);
    RepairedMesh out;
    Box box;
    for (const auto& t : mesh.triangles)
        for (const std::uint32_t i : t) {
            assert(i < mesh.vertices.size());
            const Vec3& v = mesh.vertices[i];
            if (!v.allFinite() || v.cwiseAbs().maxCoeff() > kLargest)
                throw std::invalid_argument(
                    "the mesh has coordinates that are not finite or too large for single precision; repair it or "
                    "scale it down");
            box.add(v);
        }
    const Vec3 size = box.hi - box.lo;
    const double extent = mesh.triangles.empty() ? 0 : size.maxCoeff();  // the squared diagonal might underflow
    if (!(extent > 0)) throw std::invalid_argument(kNoSurface);
    if (extent < kSmallest) throw std::invalid_argument("the mesh is too small for single precision; scale it up");
    int exponent = 0;
    std::frexp(extent * (size / extent).norm(), &exponent);
    out.scale = std::ldexp(1.0, 1 - exponent);
    out.diagonal = extent * (size / extent).norm() * out.scale;

    const auto scaled = [&](std::size_t i) {
        const auto& t = mesh.triangles[i];
        return Triangle{mesh.vertices[t[0]] * out.scale, mesh.vertices[t[1]] * out.scale,
                        mesh.vertices[t[2]] * out.scale};
    };
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        pulse();
        if (const Triangle t = scaled(i); isUsable(t)) out.cover.push_back(t);
    }
    if (out.cover.empty()) throw std::invalid_argument(kNoSurface);

    box.lo *= out.scale;
    box.hi *= out.scale;
    WeldedMesh welded = weldMesh(mesh, out.scale, box, kWeld * out.diagonal, pulse);
    out.weld = welded.moved;
    std::vector<Triangle> membranes;
    for (const Corners& c : welded.membranes)
        membranes.push_back({welded.vertices[c[0]], welded.vertices[c[1]], welded.vertices[c[2]]});
    const std::vector<int> crumbs = std::move(welded.crumbs);
    Shells shells(std::move(welded), pulse);
    out.holes = shells.holes();
    // A crumb must be covered, but it does not make a body with closed shells open.
    for (const int i : crumbs) out.faces.push_back({scaled(i), FaceRole::Sheet, !shells.anyClosed()});
    for (const Triangle& t : membranes)
        if (isUsable(t)) out.faces.push_back({t, FaceRole::Sheet, !shells.encloses(t)});
    shells.append(out.faces);
    std::tie(out.vertices, out.walls) = std::move(shells).walls();
    return out;
}

}  // namespace touchstone
