#include "tools/step/step_pattern.hpp"

#include <BRepAdaptor_Surface.hxx>
#include <BRepTools.hxx>
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

#include "tools/step/step_faces.hpp"
#include "tools/step/step_polygons.hpp"
#include "tools/step/step_reader.hpp"

namespace touchstone::step {

using engine::CadFace;

namespace {

constexpr int kFewestFacets = 16;
constexpr int kMostFacets = 100'000;
// Fraction of a facet within which a point counts as on a line. The splines of a thread's flank and crest agree to less
// on their turns.
constexpr double kOnLine = 0.01;
constexpr double kSameAxis = 1e-5;  // of the radius, and rad

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
    Pattern pattern;
    bool coneSeam = false;

    /// Across the lines, or across the rows.
    double across(double t, bool rows = false) const {
        const gp_Pnt2d uv = curve->Value(t);
        if (rows) return pattern.rowStart + pattern.rowRate * uv.Y();
        return pattern.start + pattern.rate * (pattern.alongV ? uv.Y() : uv.X());
    }
    /// The same; what is nearly on a line is on it.
    double snapped(double t, bool rows = false) const {
        const double s = across(t, rows), whole = std::round(s);
        return std::abs(s - whole) < kOnLine ? whole : s;
    }
    /// Across the lines and along them, turned as the parameters (u, v) are.
    SlabNode at(double t) const {
        if (pattern.rowRate > 0) return {snapped(t), snapped(t, true)};
        const gp_Pnt2d uv = curve->Value(t);
        const double along = pattern.alongV ? -uv.X() : uv.Y();
        return {snapped(t), pattern.rate > 0 ? along : -along};
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
        const GeomAbs_CurveType type = curve_.IsNull() ? GeomAbs_Line : GeomAdaptor_Curve(curve_).GetType();
        // Where the edge turns back between two samples, its line does not cross what it passes twice.
        const int samples = type == GeomAbs_Line ? 1 : 64;
        for (int i = 0; i <= samples; ++i) t.push_back(along(double(i) / samples));
        const std::vector<double> sampled = t;
        cross();
        std::erase_if(
            t, [&](double at) { return at != first_ && at != last_ && std::ranges::binary_search(sampled, at); });
        // Open Cascade divides the seam of a cone if it has no point within, and meshes the cone by itself then.
        if (std::ranges::any_of(sides_, &Side::coneSeam)) t.insert(t.begin() + 1, along(0.5));
        if (type != GeomAbs_Line) refine();
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

    /// Adds points as far as pieces deviate from lines.
    void refine() {
        const std::vector<double> before = std::move(out_.parameters);
        out_.parameters.clear();
        for (std::size_t i = 0; i + 1 < before.size(); ++i) bisect(before[i], before[i + 1], 0);
        out_.parameters.push_back(before.back());
    }

    /// Adds the beginning of the piece, and points within as far as it deviates from a line.
    void bisect(double a, double b, int depth) {
        constexpr int kDeepest = 14;
        constexpr double kRounding = 1.01;  // a facet's own arc deviates by exactly as much as is allowed
        const gp_Pnt p = curve_->Value(a), q = curve_->Value(b), middle = curve_->Value((a + b) / 2);
        const bool fine = middle.Distance(gp_Pnt((p.XYZ() + q.XYZ()) / 2)) <= kRounding * deviation_;
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
            for (const Side& side : sides_)
                for (const bool rows : {false, true}) {
                    if (rows && side.pattern.rowRate == 0) continue;
                    const double a = side.snapped(t[i], rows), b = side.snapped(t[i + 1], rows);
                    for (double line = std::floor(std::min(a, b)) + 1; line < std::max(a, b); ++line) {
                        const double at = root(side, rows, line, t[i], t[i + 1]);
                        // The other side may have a line there already.
                        const auto isNear = [&](double known) {
                            return std::abs(side.across(known, rows) - line) < kOnLine;
                        };
                        if (std::ranges::none_of(added, isNear) && !isNear(t[i + 1])) added.push_back(at);
                    }
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

    static double root(const Side& side, bool rows, double line, double low, double high) {
        const bool rises = side.across(high, rows) > line;
        constexpr int kHalvings = 60;
        for (int i = 0; i < kHalvings; ++i) {
            const double middle = (low + high) / 2, s = side.across(middle, rows);
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

Side sideOf(const TopoDS_Edge& edge, const TopoDS_Face& face, const Pattern& pattern) {
    double first = 0, last = 0;
    return {.curve = BRep_Tool::CurveOnSurface(edge, face, first, last), .pattern = pattern};
}

/// Makes and stores the triangles of one face. False if its boundary does not enclose an area.
bool triangulate(const TopoDS_Face& oriented, const Pattern& pattern, const TopTools_IndexedMapOfShape& edges,
                 const std::vector<EdgePoints>& pointsOf) {
    const TopoDS_Face face = TopoDS::Face(oriented.Oriented(TopAbs_FORWARD));
    struct Use {
        TopoDS_Edge edge;
        std::vector<int> nodes;  // from the edge's first to its last parameter
    };
    SlabArea area;
    area.rows = pattern.rowRate > 0;
    std::vector<gp_Pnt> points;
    std::vector<gp_Pnt2d> parameters;
    std::vector<Use> uses;
    std::vector<std::pair<TopoDS_Vertex, int>> corners;
    for (TopExp_Explorer i(face, TopAbs_EDGE); i.More(); i.Next()) {
        const TopoDS_Edge& edge = TopoDS::Edge(i.Current());
        if (edge.Orientation() != TopAbs_FORWARD && edge.Orientation() != TopAbs_REVERSED) continue;
        const EdgePoints& along = pointsOf[std::size_t(edges.FindIndex(edge)) - 1];
        const Side side = sideOf(edge, face, pattern);
        if (side.curve.IsNull()) return false;
        const TopoDS_Vertex ends[]{TopExp::FirstVertex(edge), TopExp::LastVertex(edge)};
        Use& use = uses.emplace_back(Use{edge, {}});
        const std::size_t count = along.parameters.size();
        for (std::size_t k = 0; k < count; ++k) {
            const SlabNode place = side.at(along.parameters[k]);
            const gp_Pnt2d uv = side.curve->Value(along.parameters[k]);
            const bool isEnd = k == 0 || k + 1 == count;
            const TopoDS_Vertex& vertex = ends[k > 0];
            const auto corner = std::ranges::find_if(corners, [&](const auto& known) {
                const SlabNode& there = area.nodes[std::size_t(known.second)];
                return isEnd && known.first.IsSame(vertex) && std::abs(there.s - place.s) < 0.5 &&
                       (!area.rows || std::abs(there.v - place.v) < 0.5);
            });
            if (corner != corners.end()) {
                use.nodes.push_back(corner->second);
                continue;
            }
            const int node = int(points.size());
            area.nodes.push_back(place);
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
    if (area.rows) {
        area.addCrossings();
        const BRepAdaptor_Surface surface(face, false);
        for (std::size_t k = points.size(); k < area.nodes.size(); ++k) {
            const SlabNode& node = area.nodes[k];
            const gp_Pnt2d uv((node.s - pattern.start) / pattern.rate, (node.v - pattern.rowStart) / pattern.rowRate);
            points.push_back(surface.Value(uv.X(), uv.Y()));
            parameters.push_back(uv);
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

/// The least distances at which a free-form surface counts as a pattern's.
constexpr double kStraight = 0.1;  // of the deviation: how far lines across the turns may bend
constexpr double kEven = 0.05;     // of a facet: how far its turns may run ahead of its parameter

/// Sets where the lines of a thread or another free-form surface about an axis lie, if one of its parameters runs
/// evenly about the axis and the other along straight lines. Else it has no pattern.
void findLines(const TopoDS_Face& shape, const CadFace& face, double deviation, Pattern& pattern) {
    const BRepAdaptor_Surface surface(shape, false);
    const double low[]{surface.FirstUParameter(), surface.FirstVParameter()};
    const double high[]{surface.LastUParameter(), surface.LastVParameter()};
    // Angles count from the same direction on all faces about an axis, whatever its sign and last digits.
    const glm::dvec3 axis = face.axis;
    const glm::dvec3 least = std::abs(axis.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 zero = glm::normalize(least - glm::dot(least, axis) * axis), quarter = glm::cross(axis, zero);
    for (const bool alongV : {false, true}) {
        const auto value = [&](double about, double across) {
            const double p = low[alongV] + about * (high[alongV] - low[alongV]);
            const double q = low[!alongV] + across * (high[!alongV] - low[!alongV]);
            return meters((alongV ? surface.Value(q, p) : surface.Value(p, q)).XYZ());
        };
        constexpr int kSamples = 2000;  // of up to 500 turns
        std::vector<double> angles;
        bool isStraight = true;
        for (int i = 0; i <= kSamples && isStraight; ++i) {
            const double about = double(i) / kSamples;
            const glm::dvec3 middle = value(about, 0.5), from = middle - face.origin;
            double angle = std::atan2(glm::dot(from, quarter), glm::dot(from, zero));
            if (!angles.empty())
                angle += 2 * std::numbers::pi * std::round((angles.back() - angle) / (2 * std::numbers::pi));
            angles.push_back(angle);
            if (i % 50 == 0)
                isStraight = glm::length((value(about, 0) + value(about, 1)) / 2.0 - middle) <
                             kStraight * deviation * kMetersPerUnit;
        }
        if (!isStraight) continue;
        const double whole = angles.back() - angles.front(), perFacet = 2 * std::numbers::pi / pattern.facets;
        bool isEven = std::abs(whole) > perFacet;
        for (int i = 0; i <= kSamples && isEven; ++i)
            isEven = std::abs(angles[std::size_t(i)] - angles[0] - whole * i / kSamples) < kEven * perFacet;
        if (!isEven) continue;
        pattern.alongV = alongV;
        pattern.rate = whole / (high[alongV] - low[alongV]) / perFacet;
        pattern.start = angles[0] / perFacet - pattern.rate * low[alongV];
        return;
    }
    pattern.facets = 0;
}

/// Half of what chords of circles may deviate, since triangles on a sphere or torus deviate by those of both
/// directions.
constexpr double kOfBoth = 0.5;

/// How many chords that deviate by that much a circle has.
double chordsIn(double radius, double deviation) {
    const double part = deviation / radius;
    return part < 1 ? std::ceil(std::numbers::pi / std::acos(1 - part) - 1e-9) : 0;
}

/// Sets where the rows of a sphere or torus lie: from one end of the face to the other.
void findRows(const TopoDS_Face& shape, const CadFace& face, double deviation, Pattern& pattern) {
    constexpr double kFewestRows = 8;  // in a whole turn
    double u1 = 0, u2 = 0, v1 = 0, v2 = 0;
    BRepTools::UVBounds(shape, u1, u2, v1, v2);
    const double radius = face.surface == engine::CadSurface::Sphere ? face.radius : face.minorRadius;
    const double turn = std::max(chordsIn(radius, kOfBoth * deviation * kMetersPerUnit), kFewestRows);
    const double rows = std::ceil(turn * (v2 - v1) / (2 * std::numbers::pi) - 1e-9);
    pattern.rowRate = rows / (v2 - v1);
    pattern.rowStart = -v1 * pattern.rowRate;
}

/// The largest distance of the face from its axis, m.
double reachOf(const TopoDS_Face& shape, const CadFace& face) {
    if (isDoublyRound(face)) {
        double u1 = 0, u2 = 0, v1 = 0, v2 = 0;
        BRepTools::UVBounds(shape, u1, u2, v1, v2);
        // The distance grows with the cosine of v.
        const double turns = std::ceil(v1 / (2 * std::numbers::pi)) * 2 * std::numbers::pi;
        const double cosine = turns <= v2 ? 1 : std::max(std::cos(v1), std::cos(v2));
        return face.surface == engine::CadSurface::Sphere ? face.radius * cosine
                                                          : face.radius + face.minorRadius * cosine;
    }
    if (face.surface != engine::CadSurface::Helicoid) {
        const double slope = std::tan(face.halfAngle);
        return std::max(std::abs(face.radius + slope * face.from), std::abs(face.radius + slope * face.to));
    }
    double reach = 0;
    for (TopExp_Explorer k(shape, TopAbs_VERTEX); k.More(); k.Next()) {
        const glm::dvec3 from = meters(BRep_Tool::Pnt(TopoDS::Vertex(k.Current())).XYZ()) - face.origin;
        reach = std::max(reach, glm::length(from - glm::dot(from, face.axis) * face.axis));
    }
    return reach;
}

}  // namespace

bool isDoublyRound(const CadFace& face) {
    return face.surface == engine::CadSurface::Sphere || face.surface == engine::CadSurface::Torus;
}

std::vector<Pattern> patternsOf(const std::vector<TopoDS_Face>& faces, const std::vector<CadFace>& described,
                                double deviation, bool inStep) {
    std::vector<Pattern> patterns(faces.size());
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
        if (face.surface != engine::CadSurface::Cylinder && face.surface != engine::CadSurface::Cone &&
            face.surface != engine::CadSurface::Helicoid && !isDoublyRound(face))
            continue;
        const double share = isDoublyRound(face) ? kOfBoth : 1;
        const double count = chordsIn(reachOf(faces[i], face), share * deviation * kMetersPerUnit);
        patterns[i].facets = int(std::clamp<double>(count, kFewestFacets, kMostFacets));
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
        int& most = patterns[rootOf(i)].facets;
        most = std::max(most, patterns[i].facets);
    }
    for (std::size_t i = 0; i < faces.size(); ++i)
        if (patterns[i].facets > 0) patterns[i].facets = patterns[rootOf(i)].facets;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        Pattern& pattern = patterns[i];
        if (pattern.facets == 0) continue;
        while (!isAllowed(pattern.facets, described[i].hollow, inStep)) ++pattern.facets;
        const GeomAbs_SurfaceType type = BRepAdaptor_Surface(faces[i], false).GetType();
        if (type == GeomAbs_Cylinder || type == GeomAbs_Cone || isDoublyRound(described[i]))
            pattern.rate = pattern.facets / (2 * std::numbers::pi);
        if (isDoublyRound(described[i]))
            findRows(faces[i], described[i], deviation, pattern);
        else if (pattern.rate == 0)
            findLines(faces[i], described[i], deviation, pattern);
    }
    return patterns;
}

bool applyPatterns(const std::vector<TopoDS_Face>& faces, const std::vector<Pattern>& patterns, double deviation) {
    TopTools_IndexedMapOfShape edges;
    std::vector<std::vector<Side>> sides;
    for (std::size_t i = 0; i < faces.size(); ++i) {
        if (patterns[i].facets == 0) continue;
        const TopoDS_Face face = TopoDS::Face(faces[i].Oriented(TopAbs_FORWARD));
        for (TopExp_Explorer k(face, TopAbs_EDGE); k.More(); k.Next()) {
            const int at = edges.Add(k.Current());
            sides.resize(std::size_t(edges.Extent()));
            Side side = sideOf(TopoDS::Edge(k.Current()), face, patterns[i]);
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
        if (patterns[i].facets > 0 && !triangulate(faces[i], patterns[i], edges, points)) return false;
    return true;
}

}  // namespace touchstone::step
