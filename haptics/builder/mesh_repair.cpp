#include "haptics/builder/mesh_repair.hpp"

#include <array>
#include <cassert>
#include <map>
#include <numeric>
#include <stdexcept>
#include <tuple>

#include "haptics/builder/mesh_shells.hpp"
#include "haptics/builder/mesh_tidy.hpp"

namespace touchstone {
namespace {

// Weld tolerance, as a share of the diagonal: smaller than any feature, larger than the rounding of text files.
constexpr double kWeld = 1e-6;
// Least tolerance along open edges, as a share of the diagonal: modeling programs leave cracks of 4e-6 along seams,
// below what can be felt.
constexpr double kMinSeam = 1e-5;
// Largest tolerance along open edges, as a share of the diagonal. A larger one would close slits of parts with coarse
// coordinates; a smaller one leaves small parts open whose grid is coarse.
constexpr double kMaxSeam = 2.5e-3;
// Largest altitude of faces whose direction does not count, as a share of the diagonal. With a larger one the steps of
// a part with coarse coordinates would not be felt; with a smaller one slivers of small parts hide edges.
constexpr double kMaxThin = 2e-4;
// Largest coordinate and smallest extent, mm. Single precision ends at 3e38 and 1e-38; spheres need some range beyond
// the mesh.
constexpr double kLargest = 1e35, kSmallest = 1e-30;
constexpr const char* kNoSurface = "the mesh has no triangle with an area; check the exported surface";

}  // namespace

bool RepairedMesh::closed() const {
    return holes == 0 && std::none_of(faces.begin(), faces.end(), [](const Face& f) { return f.exposed; });
}

MeshDefects defectsOf(const RepairedMesh& body) {
    std::map<std::array<double, 3>, int> places;
    std::map<std::pair<int, int>, int> uses;
    for (const Face& face : body.faces) {
        if (face.role == FaceRole::Cap || (face.role == FaceRole::Sheet && !face.exposed)) continue;
        std::array<int, 3> at;
        for (int k = 0; k < 3; ++k) {
            const Vec3& p = face.corners[k];
            at[k] = places.try_emplace({p.x() + 0, p.y() + 0, p.z() + 0}, int(places.size())).first->second;
        }
        for (int k = 0; k < 3; ++k) ++uses[std::minmax(at[k], at[(k + 1) % 3])];
    }
    MeshDefects defects;
    defects.insideOut = body.insideOut;
    DisjointSets rims(places.size());
    for (const auto& [edge, count] : uses) {
        defects.crowdedEdges += count > 2;
        if (count != 1) continue;
        ++defects.openEdges;
        rims.join(edge.first, edge.second);
    }
    std::map<int, Box> groups;
    std::vector<Vec3> points(places.size());
    for (const auto& [p, index] : places) points[std::size_t(index)] = Vec3(p[0], p[1], p[2]) / body.scale;
    for (const auto& [edge, count] : uses)
        if (count == 1)
            for (const int v : {edge.first, edge.second}) groups[rims.find(edge.first)].add(points[std::size_t(v)]);
    defects.holes = int(groups.size());
    for (const auto& [group, box] : groups)
        if (const double across = (box.hi - box.lo).norm(); across > defects.largest.across)
            defects.largest = {box.center(), across, 0};
    return defects;
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
    if (TriangleMesh far; const auto near = withoutFar(mesh, far)) {
        const RepairedMesh alone = repairMesh(far, heartbeat);
        if (alone.walls.empty()) {
            RepairedMesh body = repairMesh(near->mesh, heartbeat);
            if (!body.walls.empty()) {
                body.loose.insert(body.loose.begin(), near->loose.begin(), near->loose.end());
                return body;
            }
        }
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
    // Rounding moves two places by up to half a grid along each axis.
    const double apart = std::sqrt(3.0) * mesh.grid * out.scale, weld = kWeld * out.diagonal;
    WeldedMesh welded = weldMesh(mesh, out.scale, box,
                                 {weld, std::clamp(apart, kMinSeam * out.diagonal, kMaxSeam * out.diagonal)}, pulse);
    out.weld = welded.moved;
    out.thin = std::min(apart, kMaxThin * out.diagonal);
    out.repairs = welded.repairs;
    const std::vector<Corners> membranes = std::move(welded.membranes);
    const std::vector<int> crumbs = std::move(welded.crumbs), placeOf = std::move(welded.placeOf);
    Shells shells(std::move(welded), apart, pulse);
    out.holes = shells.holes();
    out.insideOut = shells.insideOut();
    out.closedHoles = shells.closedHoles();
    for (MeshPatch& hole : out.closedHoles) {
        hole.place /= out.scale;
        hole.across /= out.scale;
    }
    // A crumb must be covered, but it does not make a body with closed shells open.
    for (const int i : crumbs) out.faces.push_back({scaled(i), FaceRole::Sheet, !shells.anyClosed()});
    double exposed = 0;
    std::vector<std::vector<int>> sheets;
    for (const Corners& c : membranes) {
        const Triangle t = shells.triangle(c);
        if (!isUsable(t)) continue;
        out.faces.push_back({t, FaceRole::Sheet, !shells.encloses(t)});
        if (!out.faces.back().exposed) continue;
        exposed += areaOf(t);
        sheets.emplace_back(c.begin(), c.end());
    }
    out.repairs.turned = shells.turned();
    shells.append(out.faces, out.cover);
    if (shells.anyClosed() && shells.addLooseSheets(exposed, sheets)) {
        // Repaired again without the sheets, so that the tolerances follow from the part alone.
        Tidied tidied = withoutSheets(mesh, placeOf, shells.vertices().size(), sheets, shells.keptFaces());
        if (!tidied.loose.empty() && !tidied.mesh.triangles.empty()) {
            RepairedMesh body = repairMesh(tidied.mesh, heartbeat);
            body.loose.insert(body.loose.begin(), tidied.loose.begin(), tidied.loose.end());
            return body;
        }
    }
    // What is thinner than the tolerance everywhere is kept as it came.
    if (out.faces.empty())
        for (const Triangle& t : out.cover) out.faces.push_back({t, FaceRole::Sheet, true});
    out.repairs.inner = int(std::count_if(out.faces.begin(), out.faces.end(), [](const Face& f) {
        return f.role == FaceRole::Buried || (f.role == FaceRole::Sheet && !f.exposed);
    }));
    out.buried = shells.buriedWalls();
    std::tie(out.vertices, out.walls) = std::move(shells).walls();
    return out;
}

}  // namespace touchstone
