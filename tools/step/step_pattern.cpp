#include "tools/step/step_pattern.hpp"

#include <BRepAdaptor_Surface.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_Curve.hxx>
#include <GeomAdaptor_Curve.hxx>
#include <Geom_Curve.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <TColStd_HArray1OfReal.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Vertex.hxx>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tools/step/step_polygons.hpp"
#include "tools/step/step_reader.hpp"

namespace touchstone::step {

using engine::CadFace;

namespace {

constexpr int kFewestFacets = 16;
constexpr int kMostFacets = 100'000;
constexpr double kOnLine = 1e-6;    // of a facet: nearer to a line counts as on it
constexpr double kSameAxis = 1e-6;  // of the radius, and rad

/// The counts of holes have no other prime factors than 2 and 3, those of shafts neither: so no two of them share one.
/// In step, all are powers of 2.
bool isAllowed(int count, bool hollow, bool inStep) {
    if (!inStep && !hollow) return count % 2 != 0 && count % 3 != 0;
    while (count % 2 == 0) count /= 2;
    while (!inStep && count % 3 == 0) count /= 3;
    return count == 1;
}

bool areCoaxial(const CadFace& a, const CadFace& b) {
    const double size = std::max(a.radius, b.radius);
    const glm::dvec3 between = b.origin - a.origin;
    return a.hollow == b.hollow && glm::length(glm::cross(a.axis, b.axis)) < kSameAxis &&
           glm::length(between - glm::dot(between, a.axis) * a.axis) < kSameAxis * size;
}

/// One side of an edge, on a face with a pattern.
struct Side {
    Handle(Geom2d_Curve) curve;
    int facets = 0;
    bool coneSeam = false;

    /// In facets from the line where the surface begins; whole numbers lie on lines.
    double at(double t) const {
        const double s = curve->Value(t).X() * facets / (2 * std::numbers::pi), whole = std::round(s);
        return std::abs(s - whole) < kOnLine ? whole : s;
    }
};

/// The points of an edge, from its first to its last parameter.
struct EdgePoints {
    std::vector<double> parameters;
    std::vector<gp_Pnt> points;
};

class EdgeDivider {
  public:
    EdgeDivider(const TopoDS_Edge& edge, std::vector<Side> sides, double deviation)
        : edge_(edge), sides_(std::move(sides)), deviation_(deviation) {
        if (!BRep_Tool::Degenerated(edge)) curve_ = BRep_Tool::Curve(edge, first_, last_);
        if (curve_.IsNull()) BRep_Tool::Range(edge, first_, last_);
    }

    EdgePoints divide() {
        std::vector<double>& t = out_.parameters;
        t = {first_, last_};
        const GeomAbs_CurveType type = curve_.IsNull() ? GeomAbs_Line : GeomAdaptor_Curve(curve_).GetType();
        if (type != GeomAbs_Line && type != GeomAbs_Circle) {
            constexpr int kSeeds = 8;
            t.clear();
            for (int i = 0; i < kSeeds; ++i) bisect(along(double(i) / kSeeds), along(double(i + 1) / kSeeds), 0);
            t.push_back(last_);
        } else if (std::ranges::any_of(sides_, &Side::coneSeam)) {
            // Open Cascade divides the seam of a cone if it has no point within, and meshes the cone by itself then.
            t.insert(t.begin() + 1, along(0.5));
        }
        // A point that is added on one side may bend the other side's line across one of its lines.
        constexpr int kRounds = 20;
        for (int round = 0; round < kRounds && cross(); ++round) {
        }
        for (const double at : t) out_.points.push_back(curve_.IsNull() ? vertex() : curve_->Value(at));
        return std::move(out_);
    }

  private:
    double along(double part) const { return part < 1 ? first_ + part * (last_ - first_) : last_; }
    gp_Pnt vertex() const { return BRep_Tool::Pnt(TopExp::FirstVertex(edge_)); }

    /// Adds the beginning of the piece, and points within as far as it deviates from a line.
    void bisect(double a, double b, int depth) {
        constexpr int kDeepest = 14;
        const gp_Pnt p = curve_->Value(a), q = curve_->Value(b), middle = curve_->Value((a + b) / 2);
        const bool fine = middle.Distance(gp_Pnt((p.XYZ() + q.XYZ()) / 2)) <= deviation_;
        if (fine || depth == kDeepest) {
            out_.parameters.push_back(a);
            return;
        }
        bisect(a, (a + b) / 2, depth + 1);
        bisect((a + b) / 2, b, depth + 1);
    }

    /// Adds the points where the edge crosses lines. False if there are none.
    bool cross() {
        std::vector<double> all;
        const std::vector<double>& t = out_.parameters;
        for (std::size_t i = 0; i + 1 < t.size(); ++i) {
            std::vector<double> added{t[i]};
            for (const Side& side : sides_) {
                const double a = side.at(t[i]), b = side.at(t[i + 1]);
                for (double line = std::floor(std::min(a, b)) + 1; line < std::max(a, b); ++line)
                    added.push_back(root(side, line, t[i], t[i + 1]));
            }
            std::sort(added.begin(), added.end());
            const double near = 1e-9 * (last_ - first_);
            for (const double at : added)
                if (all.empty() || at - all.back() > near) all.push_back(at);
        }
        all.push_back(t.back());
        const bool found = all.size() > t.size();
        out_.parameters = std::move(all);
        return found;
    }

    static double root(const Side& side, double line, double low, double high) {
        const bool rises = side.at(high) > line;
        constexpr int kHalvings = 60;
        for (int i = 0; i < kHalvings; ++i) {
            const double middle = (low + high) / 2, s = side.at(middle);
            if (s == line) return middle;
            ((s < line) == rises ? low : high) = middle;
        }
        return (low + high) / 2;
    }

    const TopoDS_Edge& edge_;
    std::vector<Side> sides_;
    double deviation_;
    Handle(Geom_Curve) curve_;
    double first_ = 0, last_ = 0;
    EdgePoints out_;
};

Side sideOf(const TopoDS_Edge& edge, const TopoDS_Face& face, int facets) {
    double first = 0, last = 0;
    return {.curve = BRep_Tool::CurveOnSurface(edge, face, first, last), .facets = facets};
}

/// Makes and stores the triangles of one face. False if its boundary does not enclose an area.
bool triangulate(const TopoDS_Face& oriented, int facets, const TopTools_IndexedMapOfShape& edges,
                 const std::vector<EdgePoints>& pointsOf) {
    const TopoDS_Face face = TopoDS::Face(oriented.Oriented(TopAbs_FORWARD));
    struct Use {
        TopoDS_Edge edge;
        std::vector<int> nodes;  // from the edge's first to its last parameter
    };
    SlabArea area;
    std::vector<gp_Pnt> points;
    std::vector<gp_Pnt2d> parameters;
    std::vector<Use> uses;
    std::vector<std::pair<TopoDS_Vertex, int>> corners;
    for (TopExp_Explorer i(face, TopAbs_EDGE); i.More(); i.Next()) {
        const TopoDS_Edge& edge = TopoDS::Edge(i.Current());
        if (edge.Orientation() != TopAbs_FORWARD && edge.Orientation() != TopAbs_REVERSED) continue;
        const EdgePoints& along = pointsOf[std::size_t(edges.FindIndex(edge)) - 1];
        const Side side = sideOf(edge, face, facets);
        if (side.curve.IsNull()) return false;
        const TopoDS_Vertex ends[]{TopExp::FirstVertex(edge), TopExp::LastVertex(edge)};
        Use& use = uses.emplace_back(Use{edge, {}});
        const std::size_t count = along.parameters.size();
        for (std::size_t k = 0; k < count; ++k) {
            const double s = side.at(along.parameters[k]);
            const gp_Pnt2d uv = side.curve->Value(along.parameters[k]);
            const bool isEnd = k == 0 || k + 1 == count;
            const TopoDS_Vertex& vertex = ends[k > 0];
            const auto corner = std::ranges::find_if(corners, [&](const auto& known) {
                return isEnd && known.first.IsSame(vertex) &&
                       std::abs(area.nodes[std::size_t(known.second)].s - s) < 0.5;
            });
            if (corner != corners.end()) {
                use.nodes.push_back(corner->second);
                continue;
            }
            const int node = int(points.size());
            area.nodes.push_back({s, uv.Y()});
            points.push_back(along.points[k]);
            parameters.push_back(uv);
            use.nodes.push_back(node);
            if (isEnd) corners.emplace_back(vertex, node);
        }
        for (std::size_t k = 0; k + 1 < use.nodes.size(); ++k) {
            const bool forward = edge.Orientation() == TopAbs_FORWARD;
            area.chords.push_back({use.nodes[forward ? k : k + 1], use.nodes[forward ? k + 1 : k]});
        }
    }
    std::vector<std::array<int, 3>> triangles;
    if (!area.triangulate(triangles) || triangles.empty()) return false;

    const Handle(Poly_Triangulation) mesh = new Poly_Triangulation(int(points.size()), int(triangles.size()), true);
    TopLoc_Location location;
    BRep_Tool::Surface(face, location);
    const gp_Trsf toFace = location.Transformation().Inverted();
    for (std::size_t k = 0; k < points.size(); ++k) {
        mesh->SetNode(int(k) + 1, location.IsIdentity() ? points[k] : points[k].Transformed(toFace));
        mesh->SetUVNode(int(k) + 1, parameters[k]);
    }
    for (std::size_t k = 0; k < triangles.size(); ++k)
        mesh->SetTriangle(int(k) + 1, {triangles[k][0] + 1, triangles[k][1] + 1, triangles[k][2] + 1});
    mesh->Deflection(0);  // so that Open Cascade finds it fine enough
    const BRep_Builder builder;
    builder.UpdateFace(face, mesh);
    const auto polygon = [&](const Use& use) {
        const std::vector<double>& t = pointsOf[std::size_t(edges.FindIndex(use.edge)) - 1].parameters;
        const Handle(Poly_PolygonOnTriangulation) along = new Poly_PolygonOnTriangulation(int(use.nodes.size()), true);
        for (std::size_t k = 0; k < use.nodes.size(); ++k) {
            along->SetNode(int(k) + 1, use.nodes[k] + 1);
            along->SetParameter(int(k) + 1, t[k]);
        }
        along->Deflection(0);
        return along;
    };
    for (const Use& use : uses) {
        const auto other = std::ranges::find_if(uses, [&](const Use& candidate) {
            return candidate.edge.IsSame(use.edge) && candidate.edge.Orientation() != use.edge.Orientation();
        });
        if (other == uses.end())
            builder.UpdateEdge(use.edge, polygon(use), mesh, location);
        else if (use.edge.Orientation() == TopAbs_FORWARD)
            builder.UpdateEdge(use.edge, polygon(use), polygon(*other), mesh, location);
    }
    return true;
}

}  // namespace

std::vector<int> facetsOf(const std::vector<TopoDS_Face>& faces, const std::vector<CadFace>& described,
                          double deviation, bool inStep) {
    std::vector<int> facets(faces.size(), 0);
    std::vector<std::size_t> group(faces.size());
    std::iota(group.begin(), group.end(), std::size_t(0));
    const auto rootOf = [&](std::size_t i) {
        while (group[i] != i) i = group[i] = group[group[i]];
        return i;
    };
    TopTools_IndexedMapOfShape edges;
    std::vector<std::vector<std::size_t>> facesAt;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        const CadFace& face = described[i];
        // A free-form surface that is a cylinder has other parameters.
        const GeomAbs_SurfaceType type = BRepAdaptor_Surface(faces[i], false).GetType();
        if (type != GeomAbs_Cylinder && type != GeomAbs_Cone) continue;
        const double slope = std::tan(face.halfAngle);
        const double radius =
            std::max(std::abs(face.radius + slope * face.from), std::abs(face.radius + slope * face.to));
        const double part = deviation * kMetersPerUnit / radius;
        const double count = part < 1 ? std::ceil(std::numbers::pi / std::acos(1 - part) - 1e-9) : 0;
        facets[i] = int(std::clamp<double>(count, kFewestFacets, kMostFacets));
        for (TopExp_Explorer k(faces[i], TopAbs_EDGE); k.More(); k.Next()) {
            const int at = edges.Add(k.Current());
            facesAt.resize(std::size_t(edges.Extent()));
            facesAt[std::size_t(at) - 1].push_back(i);
        }
    }
    // Faces about one axis that meet, as a hole and its chamfer, have the same lines.
    for (const std::vector<std::size_t>& here : facesAt)
        for (const std::size_t other : here)
            if (areCoaxial(described[here.front()], described[other])) group[rootOf(other)] = rootOf(here.front());
    for (std::size_t i = 0; i < faces.size(); ++i) {
        int& most = facets[rootOf(i)];
        most = std::max(most, facets[i]);
    }
    for (std::size_t i = 0; i < faces.size(); ++i)
        if (facets[i] > 0) {
            facets[i] = facets[rootOf(i)];
            while (!isAllowed(facets[i], described[i].hollow, inStep)) ++facets[i];
        }
    return facets;
}

bool applyPatterns(const std::vector<TopoDS_Face>& faces, const std::vector<int>& facets, double deviation) {
    TopTools_IndexedMapOfShape edges;
    std::vector<std::vector<Side>> sides;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        if (facets[i] == 0) continue;
        const TopoDS_Face face = TopoDS::Face(faces[i].Oriented(TopAbs_FORWARD));
        for (TopExp_Explorer k(face, TopAbs_EDGE); k.More(); k.Next()) {
            const int at = edges.Add(k.Current());
            sides.resize(std::size_t(edges.Extent()));
            Side side = sideOf(TopoDS::Edge(k.Current()), face, facets[i]);
            if (side.curve.IsNull()) return false;
            side.coneSeam = BRepAdaptor_Surface(face, false).GetType() == GeomAbs_Cone &&
                            BRep_Tool::IsClosed(TopoDS::Edge(k.Current()), face);
            sides[std::size_t(at) - 1].push_back(std::move(side));
        }
    }
    std::vector<EdgePoints> points;
    for (int i = 1; i <= edges.Extent(); ++i)
        points.push_back(EdgeDivider(TopoDS::Edge(edges(i)), std::move(sides[std::size_t(i) - 1]), deviation).divide());
    for (std::size_t i = 0; i < faces.size(); ++i)
        if (facets[i] > 0 && !triangulate(faces[i], facets[i], edges, points)) return false;
    return true;
}

}  // namespace touchstone::step
