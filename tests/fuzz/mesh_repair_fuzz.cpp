// Arbitrary bytes as a mesh that is repaired, whose features are found and, if the first byte says so, covered by a
// tree.
//   1 byte   kind of coordinates (low 2 bits), with a tree if the next 3 are set, leaves - 1 (high 3 bits)
//   1 byte   count of vertices - 1 (low 6 bits)
//   the vertices: three bytes each, or three floats
//   the triangles: three bytes each
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/surface/surface_features.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using fuzz::require;

namespace {

constexpr std::size_t kMaxTriangles = 80, kMaxTreeTriangles = 24;  // trees of more triangles take too long

struct Input {
    TriangleMesh mesh;
    bool tree = false;
    int leaves = 8;
};

Input decode(fuzz::Bytes bytes) {
    Input in;
    const auto kind = bytes.take<std::uint8_t>();
    in.tree = (kind & 28) == 28;  // one in eight, since it takes a hundred times as long
    in.leaves = 1 + (kind >> 5);
    const int vertices = 1 + bytes.take<std::uint8_t>() % 64;
    for (int i = 0; i < vertices; ++i) {
        Vec3 v;
        for (int k = 0; k < 3; ++k) {
            // Small whole numbers coincide in points, lines and planes; shifted by a few thousandths they nearly
            // coincide.
            const auto whole = [&] { return static_cast<double>(bytes.take<std::int8_t>()); };
            switch (kind & 3) {
                case 0:
                    v[k] = std::floor(whole() / 16);
                    break;
                case 1:
                    v[k] = whole();
                    break;
                case 2:
                    v[k] = 1000 + whole() / 16 + (i % 3) * 1e-6;
                    break;
                default:
                    v[k] = static_cast<double>(bytes.take<float>());
            }
        }
        in.mesh.vertices.push_back(v);
    }
    const std::size_t most = in.tree ? kMaxTreeTriangles : kMaxTriangles;
    while (bytes.left() > 0 && in.mesh.triangles.size() < most) {
        const auto corner = [&] { return static_cast<std::uint32_t>(bytes.take<std::uint8_t>() % vertices); };
        const std::uint32_t a = corner(), b = corner(), c = corner();
        in.mesh.triangles.push_back({a, b, c});
    }
    return in;
}

bool allFinite(const TriangleMesh& mesh) {
    return std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
        return std::all_of(t.begin(), t.end(), [&](std::uint32_t i) { return mesh.vertices[i].allFinite(); });
    });
}

void checkRepair(const RepairedMesh& body, std::size_t triangles) {
    require(body.diagonal >= 1 && body.diagonal < 2 + 1e-9, "the diagonal lies in [1, 2)");
    std::size_t caps = 0;
    for (const MeshPatch& hole : body.closedHoles) caps += std::size_t(hole.triangles);
    require(!body.cover.empty() && body.cover.size() <= triangles + caps,
            "what is to be covered is what came in, or closes a hole");
    require(body.weld >= 0 && body.weld < 1e-4 * body.diagonal,  // 1e-5 in each of several rounds
            "welding moves little");
    bool walls = false, guesses = false, exposed = false;
    for (const Face& f : body.faces) {
        for (const Vec3& v : f.corners) require(v.allFinite(), "corners are finite");
        require(f.role == FaceRole::Sheet || !f.exposed, "only sheets are exposed");
        walls = walls || f.role == FaceRole::Wall;
        guesses = guesses || f.role == FaceRole::Cap;
        exposed = exposed || f.exposed;
    }
    require(!body.faces.empty(), "some face is left");
    require(guesses == (body.holes > 0), "holes have caps");
    require(walls || exposed, "without walls the surface is open");
    require(body.closed() == (body.holes == 0 && !exposed), "closed is what has neither holes nor sheets in the open");
}

void checkFeatures(const SurfaceFeatures& found) {
    const auto arePoints = [&](const auto& points) {
        return std::all_of(points.begin(), points.end(), [&](int i) { return i >= 0 && i < int(found.points.size()); });
    };
    for (const auto& face : found.faces) require(arePoints(face.points) && face.normal.allFinite(), "a face is one");
    for (const auto& edge : found.edges)
        require(arePoints(edge.points) && std::all_of(edge.faces.begin(), edge.faces.end(),
                                                      [&](int f) { return f >= 0 && f < int(found.faces.size()); }),
                "an edge has two faces");
    for (const auto& vertex : found.vertices)
        require(arePoints(std::array{vertex.point}) && vertex.spokes >= 3 &&
                    vertex.firstSpoke + vertex.spokes <= int(found.spokes.size()),
                "a tip has spokes");
    require(arePoints(found.spokes), "spokes end in points");
}

void checkTree(const SphereTree& tree, const RepairedMesh& body, int leaves) {
    const TreeCertificate& c = tree.certificate;
    require(tree.leafCount() >= 1 && tree.leafCount() <= leaves, "at most the maximum leaf count");
    require(c.covered || !c.note.empty(), "covered, or says why not");
    require(std::isfinite(c.protrusion) && c.protrusion >= 0 && c.protrusion <= 20 * c.diagonal, "a sane protrusion");
    if (!c.covered) return;
    for (const Triangle& t : body.cover) {
        const Vec3 p = t[0] / body.scale, q = t[1] / body.scale, r = t[2] / body.scale;
        const Vec3 n = (q - p).cross(r - p);
        // Zero-area triangles need no cover; rounding decides whether the area is zero.
        if (!(n.norm() > 1e-9 * std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()})))
            continue;
        for (const Vec3& x : {p, q, r, Vec3((p + q + r) / 3)}) {
            bool covered = false;
            for (int i = 0; i < tree.leafCount() && !covered; ++i) {
                const Sphere s = tree.leaf(i);
                covered = (x - Vec3(s.x, s.y, s.z)).norm() <= s.r * (1 + 1e-12) + 1e-14 * x.norm();
            }
            require(covered, "the surface lies in the leaves");
        }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const Input in = decode({data, size});
    try {
        const RepairedMesh body = repairMesh(in.mesh);
        require(allFinite(in.mesh), "what is no number is refused");
        checkRepair(body, in.mesh.triangles.size());
        checkFeatures(surfaceFeatures(body));
    } catch (const std::invalid_argument& error) {
        fuzz::requireSentence(error.what());
        return 0;
    }
    if (in.tree)
        checkTree(buildSphereTree(in.mesh, {.leaves = in.leaves, .threads = 1}), repairMesh(in.mesh), in.leaves);
    return 0;
}
