#include "tests/step/step_thread.hpp"

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRep_Builder.hxx>
#include <Geom2d_BezierCurve.hxx>
#include <Geom2d_Line.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt.hxx>
#include <TColgp_Array1OfPnt2d.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <gp_Pln.hxx>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace touchstone {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kTolerance = 1e-6;  // mm: above the error of the splines, below any clearance
constexpr int kDegree = 5;

/// A point with its first two derivatives by the curve's parameter.
struct Jet {
    gp_XYZ p, d, dd;
};

/// Control points of a spline of degree 5 with equal pieces that has the curve's value and two derivatives at both ends
/// of each piece. On a helix with 16 pieces a turn it is 1e-7 of the radius away.
std::vector<gp_XYZ> splinePoles(const std::function<Jet(double)>& curve, double from, double to, int pieces) {
    std::vector<gp_XYZ> poles;
    const double h = (to - from) / pieces;
    for (int i = 0; i < pieces; ++i) {
        const Jet a = curve(from + i * h), b = curve(from + (i + 1) * h);
        if (i == 0) poles.push_back(a.p);
        poles.push_back(a.p + a.d * (h / 5));
        poles.push_back(a.p + a.d * (2 * h / 5) + a.dd * (h * h / 20));
        poles.push_back(b.p - b.d * (2 * h / 5) + b.dd * (h * h / 20));
        poles.push_back(b.p - b.d * (h / 5));
        poles.push_back(b.p);
    }
    return poles;
}

/// Bézier pieces, as the poles above are given.
void knots(double from, double to, int pieces, TColStd_Array1OfReal& values, TColStd_Array1OfInteger& multiplicities) {
    for (int i = 0; i <= pieces; ++i) {
        values.SetValue(i + 1, from + (to - from) * i / pieces);
        multiplicities.SetValue(i + 1, i == 0 || i == pieces ? kDegree + 1 : kDegree);
    }
}

int piecesOf(double turned) { return std::max(1, int(std::ceil(std::abs(turned) / (kPi / 8)))); }

Handle(Geom_BSplineCurve) splineCurve(const std::function<Jet(double)>& curve, double to, int pieces) {
    const std::vector<gp_XYZ> points = splinePoles(curve, 0, to, pieces);
    TColgp_Array1OfPnt poles(1, int(points.size()));
    for (int i = 0; i < int(points.size()); ++i) poles.SetValue(i + 1, gp_Pnt(points[std::size_t(i)]));
    TColStd_Array1OfReal values(1, pieces + 1);
    TColStd_Array1OfInteger multiplicities(1, pieces + 1);
    knots(0, to, pieces, values, multiplicities);
    return new Geom_BSplineCurve(poles, values, multiplicities, kDegree);
}

/// A corner of the profile in the half plane at angle 0.
struct Corner {
    double r, z;
};

/// The point of the helix through that corner at the angle, with the derivatives by it.
Jet onHelix(const Corner& corner, double lead, double angle) {
    const double c = std::cos(angle), s = std::sin(angle), r = corner.r;
    return {
        {r * c, r * s, corner.z + lead * angle / (2 * kPi)}, {-r * s, r * c, lead / (2 * kPi)}, {-r * c, -r * s, 0}};
}

/// The strip between two neighboring helices, over all angles at which it meets the slab between 0 and `length`.
Handle(Geom_BSplineSurface) strip(const Corner& a, const Corner& b, double lead, double length) {
    const double from = -2 * kPi * b.z / lead, to = 2 * kPi * (length - a.z) / lead;
    const int pieces = piecesOf(to - from);
    const auto first = splinePoles([&](double u) { return onHelix(a, lead, u); }, from, to, pieces);
    const auto second = splinePoles([&](double u) { return onHelix(b, lead, u); }, from, to, pieces);
    TColgp_Array2OfPnt poles(1, int(first.size()), 1, 2);
    for (int i = 0; i < int(first.size()); ++i) {
        poles.SetValue(i + 1, 1, gp_Pnt(first[std::size_t(i)]));
        poles.SetValue(i + 1, 2, gp_Pnt(second[std::size_t(i)]));
    }
    TColStd_Array1OfReal u(1, pieces + 1), v(1, 2);
    TColStd_Array1OfInteger uTimes(1, pieces + 1), vTimes(1, 2);
    knots(from, to, pieces, u, uTimes);
    v.SetValue(1, 0);
    v.SetValue(2, 1);
    vTimes.Init(2);
    return new Geom_BSplineSurface(poles, u, v, uTimes, vTimes, kDegree, 1);
}

/// The edge where the plane of an end cuts a strip: there radius and angle change at a constant rate.
TopoDS_Edge endEdge(const Corner& a, double angleA, const Corner& b, double angleB, double z, const TopoDS_Vertex& from,
                    const TopoDS_Vertex& to) {
    const double dr = b.r - a.r, w = angleB - angleA;
    const auto spiral = [&](double t) {
        const double r = a.r + t * dr, c = std::cos(angleA + t * w), s = std::sin(angleA + t * w);
        return Jet{{r * c, r * s, z},
                   {dr * c - r * w * s, dr * s + r * w * c, 0},
                   {-2 * dr * w * s - r * w * w * c, 2 * dr * w * c - r * w * w * s, 0}};
    };
    return BRepBuilderAPI_MakeEdge(splineCurve(spiral, 1, piecesOf(w)), from, to, 0, 1);
}

TopoDS_Vertex vertex(const gp_XYZ& p) {
    TopoDS_Vertex made;
    BRep_Builder().MakeVertex(made, gp_Pnt(p), kTolerance);
    return made;
}

/// The face of a strip without its wire, and the edges that bound it, in the plane of its parameters.
struct StripFace {
    TopoDS_Face face;
    TopoDS_Wire wire;

    explicit StripFace(const Handle(Geom_BSplineSurface) & surface) {
        BRep_Builder().MakeFace(face, surface, kTolerance);
        BRep_Builder().MakeWire(wire);
    }
    void addHelix(const TopoDS_Edge& edge, double angle, double v, TopAbs_Orientation orientation) {
        BRep_Builder().UpdateEdge(edge, new Geom2d_Line(gp_Pnt2d(angle, v), gp_Dir2d(1, 0)), face, kTolerance);
        BRep_Builder().Add(wire, edge.Oriented(orientation));
    }
    void addEnd(const TopoDS_Edge& edge, double angleA, double angleB, TopAbs_Orientation orientation) {
        TColgp_Array1OfPnt2d poles(1, 2);
        poles.SetValue(1, gp_Pnt2d(angleA, 0));
        poles.SetValue(2, gp_Pnt2d(angleB, 1));
        BRep_Builder().UpdateEdge(edge, new Geom2d_BezierCurve(poles), face, kTolerance);
        BRep_Builder().Add(wire, edge.Oriented(orientation));
    }
    TopoDS_Face closed() {
        BRep_Builder().Add(face, wire);
        return face;
    }
};

TopoDS_Wire wireOf(const std::vector<TopoDS_Edge>& edges, TopAbs_Orientation orientation) {
    TopoDS_Wire wire;
    BRep_Builder().MakeWire(wire);
    for (const TopoDS_Edge& edge : edges) BRep_Builder().Add(wire, edge.Oriented(orientation));
    return wire;
}

struct Thread {
    std::vector<TopoDS_Face> strips;       ///< with normals away from the axis
    std::vector<TopoDS_Edge> bottom, top;  ///< clockwise seen from above
};

Thread thread(const ThreadedPart& part) {
    const double lead = part.starts * part.pitch, cut = 0.625 * std::sqrt(3.0) / 2 * part.pitch;
    const double crest = part.diameter / 2 - part.inward, root = crest - cut;
    const double half = part.pitch / 16, flank = cut * std::tan(kPi / 6);
    std::vector<Corner> corners;
    for (int start = 0; start < part.starts; ++start) {
        const double z = start * part.pitch;
        corners.insert(
            corners.end(),
            {{crest, z - half}, {crest, z + half}, {root, z + half + flank}, {root, z + part.pitch - half - flank}});
    }
    const std::size_t count = corners.size();
    const auto bottomAngle = [&](const Corner& corner) { return -2 * kPi * corner.z / lead; };
    const auto topAngle = [&](const Corner& corner) { return 2 * kPi * (part.length - corner.z) / lead; };
    const double turned = 2 * kPi * part.length / lead;

    std::vector<TopoDS_Vertex> low, high;
    std::vector<TopoDS_Edge> helices;
    for (const Corner& corner : corners) {
        const auto at = [&](double t) { return onHelix(corner, lead, bottomAngle(corner) + t); };
        low.push_back(vertex(at(0).p));
        high.push_back(vertex(at(turned).p));
        helices.push_back(
            BRepBuilderAPI_MakeEdge(splineCurve(at, turned, piecesOf(turned)), low.back(), high.back(), 0, turned));
    }
    Thread made;
    for (std::size_t i = 0; i < count; ++i) {
        const std::size_t next = (i + 1) % count;
        const Corner a = corners[i], b{corners[next].r, corners[next].z + (next == 0 ? lead : 0)};
        made.bottom.push_back(endEdge(a, bottomAngle(a), b, bottomAngle(b), 0, low[i], low[next]));
        made.top.push_back(endEdge(a, topAngle(a), b, topAngle(b), part.length, high[i], high[next]));
        StripFace face(strip(a, b, lead, part.length));
        face.addHelix(helices[i], bottomAngle(a), 0, TopAbs_FORWARD);
        face.addEnd(made.top.back(), topAngle(a), topAngle(b), TopAbs_FORWARD);
        face.addHelix(helices[next], bottomAngle(b), 1, TopAbs_REVERSED);
        face.addEnd(made.bottom.back(), bottomAngle(a), bottomAngle(b), TopAbs_REVERSED);
        made.strips.push_back(face.closed());
    }
    return made;
}

/// A hexagonal prism around the z axis without its two ends.
struct Hexagon {
    std::vector<TopoDS_Edge> bottom, top;  ///< counterclockwise seen from above
    std::vector<TopoDS_Face> sides;
};

Hexagon hexagon(double acrossFlats, double low, double high) {
    Hexagon made;
    std::vector<TopoDS_Vertex> under, over;
    const double r = acrossFlats / std::sqrt(3.0);
    for (int i = 0; i < 6; ++i) {
        const double c = r * std::cos(i * kPi / 3), s = r * std::sin(i * kPi / 3);
        under.push_back(vertex({c, s, low}));
        over.push_back(vertex({c, s, high}));
    }
    std::vector<TopoDS_Edge> upright;
    for (std::size_t i = 0; i < 6; ++i) {
        upright.push_back(BRepBuilderAPI_MakeEdge(under[i], over[i]));
        made.bottom.push_back(BRepBuilderAPI_MakeEdge(under[i], under[(i + 1) % 6]));
        made.top.push_back(BRepBuilderAPI_MakeEdge(over[i], over[(i + 1) % 6]));
    }
    for (std::size_t i = 0; i < 6; ++i) {
        TopoDS_Wire wire;
        BRep_Builder().MakeWire(wire);
        BRep_Builder().Add(wire, made.bottom[i]);
        BRep_Builder().Add(wire, upright[(i + 1) % 6]);
        BRep_Builder().Add(wire, made.top[i].Reversed());
        BRep_Builder().Add(wire, upright[i].Reversed());
        const double angle = (double(i) + 0.5) * kPi / 3;
        const gp_Dir out(std::cos(angle), std::sin(angle), 0);
        made.sides.push_back(BRepBuilderAPI_MakeFace(gp_Pln(gp_Pnt(out.XYZ() * (acrossFlats / 2)), out), wire, false));
    }
    return made;
}

/// The plane at this height with normal +z, bounded by wires that run around it in that sense.
TopoDS_Face level(double z, const TopoDS_Wire& outer, const TopoDS_Wire& hole = {}) {
    BRepBuilderAPI_MakeFace made(gp_Pln(gp_Pnt(0, 0, z), gp::DZ()), outer, false);
    if (!hole.IsNull()) made.Add(hole);
    return made;
}

TopoDS_Shape solidOf(const std::vector<TopoDS_Face>& faces, bool left) {
    BRep_Builder builder;
    TopoDS_Shell shell;
    builder.MakeShell(shell);
    for (const TopoDS_Face& face : faces) builder.Add(shell, face);
    shell.Closed(true);
    TopoDS_Solid solid;
    builder.MakeSolid(solid);
    builder.Add(solid, shell);
    if (!BRepCheck_Analyzer(solid).IsValid()) throw std::logic_error("the threaded solid is not valid");
    if (!left) return solid;
    gp_Trsf mirror;
    mirror.SetMirror(gp_Ax2(gp::Origin(), gp::DY()));
    return BRepBuilderAPI_Transform(solid, mirror, true).Shape();
}

}  // namespace

TopoDS_Shape threadedBolt(const ThreadedPart& part) {
    const Thread made = thread(part);
    const Hexagon head = hexagon(part.acrossFlats, -part.head, 0);
    std::vector<TopoDS_Face> faces = made.strips;
    faces.insert(faces.end(), head.sides.begin(), head.sides.end());
    faces.push_back(level(0, wireOf(head.top, TopAbs_FORWARD), wireOf(made.bottom, TopAbs_FORWARD)));
    faces.push_back(level(part.length, wireOf(made.top, TopAbs_REVERSED)));
    faces.push_back(TopoDS::Face(level(-part.head, wireOf(head.bottom, TopAbs_FORWARD)).Reversed()));
    return solidOf(faces, part.left);
}

TopoDS_Shape threadedNut(const ThreadedPart& part) {
    const Thread made = thread(part);
    const Hexagon body = hexagon(part.acrossFlats, 0, part.length);
    std::vector<TopoDS_Face> faces = body.sides;
    for (const TopoDS_Face& face : made.strips) faces.push_back(TopoDS::Face(face.Reversed()));
    faces.push_back(level(part.length, wireOf(body.top, TopAbs_FORWARD), wireOf(made.top, TopAbs_FORWARD)));
    faces.push_back(
        TopoDS::Face(level(0, wireOf(body.bottom, TopAbs_FORWARD), wireOf(made.bottom, TopAbs_FORWARD)).Reversed()));
    return solidOf(faces, part.left);
}

}  // namespace touchstone
