#include "tools/step/step_mesh.hpp"

#include <BRepAdaptor_Surface.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <IMeshTools_Parameters.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "tools/step/step_faces.hpp"
#include "tools/step/step_pattern.hpp"
#include "tools/step/step_reader.hpp"

namespace touchstone::step {

using engine::CadFace;
using engine::CadShape;
using engine::CadSurface;

namespace {

constexpr double kShare = 0.1;         // of the clearance
constexpr double kCoarsest = 0.05e-3;  // m
constexpr double kFinest = 0.2e-6;     // m
constexpr double kMostTriangles = 1e6;
constexpr double kMostByOcct = 1e5;  // of surfaces without a pattern, for which Open Cascade takes ever longer
constexpr double kAngle = 0.35;      // rad between neighboring triangles, on surfaces without a pattern

/// The triangles of all faces, whose common points are one.
struct Gathered {
    std::vector<glm::dvec3> vertices;                     // mm
    std::vector<std::array<std::uint32_t, 3>> triangles;  // by face
    std::vector<std::array<gp_Pnt2d, 3>> parameters;      // of the corners, on the face
    std::vector<std::uint32_t> counts;                    // of triangles of each face
    bool closed = true;                                   // neighbors share all edges
};

/// Sets of nodes that are one vertex.
class Joined {
  public:
    explicit Joined(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), std::size_t(0)); }
    std::size_t root(std::size_t i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(std::size_t a, std::size_t b) {
        a = root(a);
        b = root(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<std::size_t> parent_;
};

/// Whether each edge of each triangle belongs to another one that passes it the other way.
bool isClosed(const std::vector<std::array<std::uint32_t, 3>>& triangles) {
    std::unordered_set<std::uint64_t> edges;
    edges.reserve(3 * triangles.size());
    const auto key = [](std::uint64_t a, std::uint64_t b) { return a << 32 | b; };
    for (const auto& t : triangles)
        for (std::size_t k = 0; k < 3; ++k)
            if (!edges.insert(key(t[k], t[(k + 1) % 3])).second) return false;
    return std::ranges::all_of(edges, [&](std::uint64_t edge) { return edges.contains(edge << 32 | edge >> 32); });
}

/// Joins the nodes at which faces meet. False if they do not have the same ones.
bool joinAlongEdges(const TopoDS_Shape& solids, const std::vector<TopoDS_Face>& faces,
                    const std::vector<std::size_t>& firstNode, Joined& nodes) {
    TopTools_IndexedMapOfShape index;
    for (const TopoDS_Face& face : faces) index.Add(face);
    TopTools_IndexedDataMapOfShapeListOfShape facesAt;
    TopExp::MapShapesAndAncestors(solids, TopAbs_EDGE, TopAbs_FACE, facesAt);
    bool same = true;
    for (int i = 1; i <= facesAt.Extent(); ++i) {
        const TopoDS_Edge& edge = TopoDS::Edge(facesAt.FindKey(i));
        std::vector<std::vector<std::size_t>> lines;
        for (const TopoDS_Shape& shape : facesAt(i)) {
            const int face = index.FindIndex(shape);
            TopLoc_Location location;
            const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(TopoDS::Face(shape), location);
            if (face == 0 || mesh.IsNull()) continue;
            for (const TopAbs_Orientation side : {TopAbs_FORWARD, TopAbs_REVERSED}) {
                const Handle(Poly_PolygonOnTriangulation) along =
                    BRep_Tool::PolygonOnTriangulation(TopoDS::Edge(edge.Oriented(side)), mesh, location);
                if (along.IsNull()) continue;
                std::vector<std::size_t>& line = lines.emplace_back();
                for (int k = 1; k <= along->NbNodes(); ++k)
                    line.push_back(firstNode[std::size_t(face) - 1] + std::size_t(along->Node(k)) - 1);
            }
        }
        for (const std::vector<std::size_t>& line : lines)
            for (std::size_t k = 0; k < line.size(); ++k) {
                if (BRep_Tool::Degenerated(edge))
                    nodes.join(lines[0][0], line[k]);
                else if (line.size() == lines[0].size())
                    nodes.join(lines[0][k], line[k]);
                else
                    same = false;
            }
    }
    return same;
}

Gathered gather(const TopoDS_Shape& solids, const std::vector<TopoDS_Face>& faces) {
    Gathered all;
    std::vector<std::size_t> firstNode{0};
    for (const TopoDS_Face& face : faces) {
        TopLoc_Location location;
        const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(face, location);
        firstNode.push_back(firstNode.back() + (mesh.IsNull() ? 0 : std::size_t(mesh->NbNodes())));
    }
    Joined nodes(firstNode.back());
    all.closed = joinAlongEdges(solids, faces, firstNode, nodes);

    constexpr std::uint32_t kNone = ~0u;
    std::vector<std::uint32_t> vertexOf(firstNode.back(), kNone);
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const std::size_t before = all.triangles.size();
        TopLoc_Location location;
        const Handle(Poly_Triangulation) mesh = BRep_Tool::Triangulation(faces[i], location);
        for (int k = 1; !mesh.IsNull() && k <= mesh->NbTriangles(); ++k) {
            std::array<int, 3> corners;
            mesh->Triangle(k).Get(corners[0], corners[1], corners[2]);
            if (faces[i].Orientation() == TopAbs_REVERSED) std::swap(corners[1], corners[2]);
            std::array<std::uint32_t, 3> triangle;
            std::array<gp_Pnt2d, 3> uv;
            for (std::size_t c = 0; c < 3; ++c) {
                std::uint32_t& vertex = vertexOf[nodes.root(firstNode[i] + std::size_t(corners[c]) - 1)];
                if (vertex == kNone) {
                    vertex = std::uint32_t(all.vertices.size());
                    gp_Pnt point = mesh->Node(corners[c]);
                    if (!location.IsIdentity()) point.Transform(location.Transformation());
                    all.vertices.emplace_back(point.X(), point.Y(), point.Z());
                }
                triangle[c] = vertex;
                if (mesh->HasUVNodes()) uv[c] = mesh->UVNode(corners[c]);
            }
            if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) continue;
            all.triangles.push_back(triangle);
            all.parameters.push_back(uv);
        }
        all.counts.push_back(std::uint32_t(all.triangles.size() - before));
    }
    all.closed = all.closed && isClosed(all.triangles);
    return all;
}

void meshByDeflection(const TopoDS_Shape& solids, double deviation) {
    IMeshTools_Parameters parameters;
    parameters.Deflection = parameters.DeflectionInterior = deviation;
    parameters.Angle = parameters.AngleInterior = kAngle;
    parameters.InParallel = true;
    parameters.AllowQualityDecrease = false;
    BRepMesh_IncrementalMesh(solids, parameters);
}

/// Triangles that deviate by `deviation`, mm, where Open Cascade is asked for `deflection`. Sets the facets of the
/// faces.
Gathered meshOf(const TopoDS_Shape& solids, const std::vector<TopoDS_Face>& faces, double deviation, double deflection,
                bool inStep, std::vector<CadFace>& described) {
    BRepTools::Clean(solids);
    const std::vector<Pattern> patterns = patternsOf(faces, described, deviation, inStep);
    if (applyPatterns(faces, patterns, deviation)) {
        meshByDeflection(solids, deflection);
        Gathered all = gather(solids, faces);
        for (std::size_t i = 0; i < faces.size(); ++i) described[i].facets = std::uint32_t(patterns[i].facets);
        if (all.closed) return all;
    }
    // Open Cascade alone closes some parts that lines along the axis do not.
    BRepTools::Clean(solids);
    for (CadFace& face : described) face.facets = 0;
    meshByDeflection(solids, deflection);
    return gather(solids, faces);
}

/// The deviation at which the shape has no more triangles than the limit, if a mesh with another deviation has these.
double withinLimit(double asked, double deviation, const Gathered& mesh, const std::vector<CadFace>& faces) {
    // Triangles of surfaces that bend in no, one or both directions, and of those that are left to Open Cascade.
    double flat = 0, single = 0, both = 0, byOcct = 0;
    for (std::size_t i = 0; i < faces.size(); ++i)
        (faces[i].surface == CadSurface::Plane ? flat
         : faces[i].facets == 0                ? byOcct
         : isDoublyRound(faces[i])             ? both
                                               : single) += mesh.counts[i];
    double finer = asked;
    constexpr double kStep = 1.1;
    const auto fits = [&] {
        const double more = deviation / finer;
        return byOcct * more <= kMostByOcct &&
               flat + single * std::sqrt(more) + (both + byOcct) * more <= kMostTriangles;
    };
    while (!fits()) finer *= kStep;
    return finer;
}

/// Moves the vertices of holes outward until the middles of the facets touch the surface; those of hollow spheres by
/// the deviation, mm, by which their triangles lie inside at most. Tori bend both ways, so theirs stay.
void circumscribe(Gathered& mesh, const std::vector<CadFace>& faces, double deviation) {
    std::vector<bool> moved(mesh.vertices.size(), false);
    std::size_t next = 0;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const std::size_t end = next + mesh.counts[i];
        const CadFace& face = faces[i];
        const bool sphere = face.surface == CadSurface::Sphere;
        // The fewest facets and rows of a sphere lie inside by less than a tenth of its radius.
        const double inside = std::min(deviation * kMetersPerUnit, 0.1 * face.radius);
        const double factor = face.facets == 0 || face.surface == CadSurface::Torus ? 1
                              : sphere ? face.radius / (face.radius - inside)
                                       : 1 / std::cos(std::numbers::pi / face.facets);
        const glm::dvec3 origin = face.origin / kMetersPerUnit;
        for (; next < end; ++next)
            for (const std::uint32_t corner : mesh.triangles[next]) {
                if (!face.hollow || factor == 1 || moved[corner]) continue;
                moved[corner] = true;
                glm::dvec3& p = mesh.vertices[corner];
                const glm::dvec3 onAxis = sphere ? origin : origin + glm::dot(p - origin, face.axis) * face.axis;
                p = onAxis + factor * (p - onAxis);
            }
    }
}

/// Distances of corners, middles of edges and middles of triangles from the exact surface, m; the greatest for each
/// face.
void measure(const Gathered& mesh, const std::vector<TopoDS_Face>& faces, std::vector<CadFace>& described) {
    std::size_t next = 0;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const BRepAdaptor_Surface surface(faces[i], false);
        double greatest = 0;
        const std::size_t end = next + mesh.counts[i];
        for (; next < end; ++next) {
            std::array<gp_Pnt, 3> p;
            for (std::size_t k = 0; k < 3; ++k) {
                const glm::dvec3& v = mesh.vertices[mesh.triangles[next][k]];
                p[k] = gp_Pnt(v.x, v.y, v.z);
            }
            const std::array<gp_Pnt2d, 3>& uv = mesh.parameters[next];
            const auto add = [&](const gp_XYZ& point, const gp_XY& at) {
                greatest = std::max(greatest, distanceToSurface(surface, point, at.X(), at.Y()));
            };
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t other = (k + 1) % 3;
                add(p[k].XYZ(), uv[k].XY());
                add((p[k].XYZ() + p[other].XYZ()) / 2, (uv[k].XY() + uv[other].XY()) / 2);
            }
            add((p[0].XYZ() + p[1].XYZ() + p[2].XYZ()) / 3, (uv[0].XY() + uv[1].XY() + uv[2].XY()) / 3);
        }
        described[i].deviation = greatest * kMetersPerUnit;
    }
}

}  // namespace

void makeMesh(const TopoDS_Shape& solids, const MeshChoice& choice, CadShape& shape) {
    const std::vector<TopoDS_Face> faces = facesOf(solids);
    shape.asked = choice.deviation.value_or(
        shape.clearance > 0 ? std::clamp(kShare * shape.clearance, kFinest, kCoarsest) : kCoarsest);
    double deviation = shape.asked, share = 1;
    Gathered mesh;
    const auto meshAt = [&](double at) {
        mesh = meshOf(solids, faces, at / kMetersPerUnit, share * at / kMetersPerUnit, choice.inStep, shape.faces);
    };
    std::ptrdiff_t missing = std::ptrdiff_t(faces.size());  // faces that have no triangles even if these are coarse
    if (deviation < kCoarsest) {
        meshAt(kCoarsest);
        missing = std::ranges::count(mesh.counts, 0u);
        deviation = withinLimit(deviation, kCoarsest, mesh, shape.faces);
    }
    constexpr int kTries = 6;
    for (int i = 0; i < kTries; ++i) {
        meshAt(deviation);
        const bool isTooFine = i + 1 < kTries && std::ranges::count(mesh.counts, 0u) > missing;
        if (isTooFine || double(mesh.triangles.size()) > kMostTriangles) {
            deviation *= 2;
            continue;
        }
        if (choice.keepClearance) circumscribe(mesh, shape.faces, deviation / kMetersPerUnit);
        measure(mesh, faces, shape.faces);
        // Open Cascade may deviate by more than it is asked for; by far more only if the edges of a face lie beside it.
        constexpr double kBeside = 4;
        double most = 0;
        for (const CadFace& face : shape.faces)
            if (face.facets == 0) most = std::max(most, face.deviation);
        if (most <= deviation || most > kBeside * deviation) break;
        share *= 0.9 * deviation / most;
    }
    shape.limited = deviation > shape.asked;
    for (const CadFace& face : shape.faces) shape.deviation = std::max(shape.deviation, face.deviation);

    for (std::size_t i = 0; i < faces.size(); ++i)
        if (mesh.counts[i] == 0 && shape.faces[i].area > kLeastArea) {
            shape.problem =
                "has a face (number " + std::to_string(i + 1) + ", a " + name(shape.faces[i].surface) +
                ") that Open Cascade cannot triangulate: heal the part in the CAD program, and export it again";
            return;
        }
    std::size_t next = 0;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        CadFace& face = shape.faces[i];
        face.triangles = mesh.counts[i];
        if (face.triangles == 0) continue;
        face.low = glm::dvec3(HUGE_VAL);
        face.high = glm::dvec3(-HUGE_VAL);
        for (const std::size_t end = next + face.triangles; next < end; ++next)
            for (const std::uint32_t corner : mesh.triangles[next]) {
                face.low = glm::min(face.low, mesh.vertices[corner] * kMetersPerUnit);
                face.high = glm::max(face.high, mesh.vertices[corner] * kMetersPerUnit);
            }
    }
    shape.triangles = std::move(mesh.triangles);
    for (const glm::dvec3& vertex : mesh.vertices) shape.vertices.push_back(vertex * kMetersPerUnit);
}

}  // namespace touchstone::step
