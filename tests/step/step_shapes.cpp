#include "tests/step/step_shapes.hpp"

#include <BRepAlgoAPI_Cut.hxx>
#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepPrimAPI_MakeRevol.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <GC_MakeArcOfCircle.hxx>
#include <GeomAPI_Interpolate.hxx>
#include <ShapeUpgrade_UnifySameDomain.hxx>
#include <TColgp_HArray1OfPnt.hxx>
#include <cmath>
#include <gp_Ax1.hxx>
#include <gp_Ax2.hxx>
#include <gp_Trsf.hxx>
#include <numbers>
#include <utility>
#include <vector>

namespace touchstone {
namespace {

constexpr double kPi = std::numbers::pi;

/// The solid that a closed polygon of radius and height sweeps about the z axis.
TopoDS_Shape revolved(const std::vector<std::pair<double, double>>& profile) {
    BRepBuilderAPI_MakePolygon polygon;
    for (const auto& [r, z] : profile) polygon.Add(gp_Pnt(r, 0, z));
    polygon.Close();
    return BRepPrimAPI_MakeRevol(BRepBuilderAPI_MakeFace(polygon.Wire()).Face(), gp::OZ()).Shape();
}

TopoDS_Shape box(double x0, double y0, double z0, double x1, double y1, double z1) {
    return BRepPrimAPI_MakeBox(gp_Pnt(x0, y0, z0), gp_Pnt(x1, y1, z1)).Shape();
}

TopoDS_Shape cylinder(double r, double z0, double z1, double x = 0, double y = 0) {
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(x, y, z0), gp::DZ()), r, z1 - z0).Shape();
}

TopoDS_Shape turned(const TopoDS_Shape& shape, double angle) {
    gp_Trsf turn;
    turn.SetRotation(gp::OZ(), angle);
    return BRepBuilderAPI_Transform(shape, turn, true).Shape();
}

/// Faces that a Boolean operation split are one again, as a designer would have drawn them.
TopoDS_Shape joined(const TopoDS_Shape& shape) {
    ShapeUpgrade_UnifySameDomain unify(shape);
    unify.Build();
    return unify.Shape();
}

TopoDS_Shape fuse(const TopoDS_Shape& a, const TopoDS_Shape& b) { return joined(BRepAlgoAPI_Fuse(a, b).Shape()); }
TopoDS_Shape cut(const TopoDS_Shape& a, const TopoDS_Shape& b) { return joined(BRepAlgoAPI_Cut(a, b).Shape()); }

/// A pin with a flat, `out` larger everywhere.
TopoDS_Shape flatPin(double diameter, double z0, double z1, double out) {
    const double flat = 0.35 * diameter + out, r = diameter / 2 + out;
    return cut(cylinder(r, z0, z1), box(flat, -2 * r, z0 - 1, 2 * r, 2 * r, z1 + 1));
}

/// A pin with keys, `out` larger everywhere.
TopoDS_Shape keyedPin(double diameter, double z0, double z1, int keys, double out) {
    const double half = kPi * diameter / keys / 5 + out;
    TopoDS_Shape made = cylinder(diameter / 2 + out, z0, z1);
    for (int i = 0; i < keys; ++i)
        made = BRepAlgoAPI_Fuse(made, turned(box(0, -half, z0, 0.6 * diameter + out, half, z1), 2 * kPi * i / keys))
                   .Shape();
    return joined(made);
}

}  // namespace

TopoDS_Shape shoulderPeg(double diameter, double length) {
    const double r = diameter / 2, chamfer = diameter / 20;
    return revolved({{0, -length},
                     {r - chamfer, -length},
                     {r, -length + chamfer},
                     {r, 0},
                     {1.4 * r, 0},
                     {1.4 * r, 0.5 * diameter},
                     {0, 0.5 * diameter}});
}

TopoDS_Shape holedBlock(double diameter, double length) {
    const double half = 1.25 * diameter, r = diameter / 2, chamfer = diameter / 25;
    return cut(box(-half, -half, -length, half, half, 0),
               revolved({{0, -length - 1}, {r, -length - 1}, {r, -chamfer}, {r + chamfer + 1, 1}, {0, 1}}));
}

TopoDS_Shape flatShaft(double diameter, double length) {
    return fuse(flatPin(diameter, -length, 0, 0), cylinder(0.7 * diameter, 0, 0.5 * diameter));
}

TopoDS_Shape flatHub(double diameter, double length, double clearance) {
    return cut(cylinder(1.1 * diameter, -length, 0), flatPin(diameter, -length - 1, 1, clearance));
}

TopoDS_Shape splineShaft(double diameter, double length, int keys) {
    return fuse(keyedPin(diameter, -length, 0, keys, 0), cylinder(0.75 * diameter, 0, 0.4 * diameter));
}

TopoDS_Shape splineHub(double diameter, double length, int keys, double clearance) {
    return cut(cylinder(diameter, -length, 0), keyedPin(diameter, -length - 1, 1, keys, clearance));
}

TopoDS_Shape bayonetPlug(double diameter) {
    const double r = diameter / 2, pin = 0.1 * diameter;
    TopoDS_Shape made = fuse(cylinder(r, -1.2 * diameter, 0), cylinder(1.3 * r, 0, 0.5 * diameter));
    for (const double way : {0.0, kPi}) {
        const TopoDS_Shape one =
            BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, -diameter), gp::DX()), pin, 1.3 * r).Shape();
        made = fuse(made, turned(one, way + kPi / 4));
    }
    return made;
}

TopoDS_Shape bayonetSocket(double diameter, double clearance) {
    const double r = diameter / 2, slot = 0.1 * diameter + clearance, deep = 1.3 * r + clearance, z = -diameter;
    TopoDS_Shape made = cut(cylinder(1.8 * r, -1.4 * diameter, 0), cylinder(r + clearance, -1.4 * diameter - 1, 1));
    const TopoDS_Shape ring = cut(cylinder(deep, z - slot, z + slot), cylinder(r / 2, z - slot - 1, z + slot + 1));
    for (const double way : {0.0, kPi}) {
        made = cut(made, turned(box(0, -slot, z - slot, deep, slot, 1), way));
        made = cut(made, turned(box(0, -slot, z - slot, deep, slot, z + slot), way + kPi / 4));
        // The sector between the two, cut from a ring by half spaces.
        TopoDS_Shape sector = cut(ring, turned(box(-3 * r, -3 * r, z - 2 * r, 3 * r, 0, z + 2 * r), way));
        sector = cut(sector, turned(box(-3 * r, 0, z - 2 * r, 3 * r, 3 * r, z + 2 * r), way + kPi / 4));
        made = cut(made, sector);
    }
    return made;
}

TopoDS_Shape spurGear(double module, int teeth, double width, double bore, double backlash) {
    const double pitch = module * teeth / 2, base = pitch * std::cos(kPi / 9), tip = pitch + module;
    const double root = pitch - 1.25 * module, from = std::max(base, root);
    const auto involute = [](double cosine) { return std::tan(std::acos(cosine)) - std::acos(cosine); };
    const double half = kPi / 2 / teeth - backlash / 4 / pitch + involute(base / pitch);
    const auto angleAt = [&](double r) { return half - involute(base / r); };
    const auto point = [](double r, double angle) { return gp_Pnt(r * std::cos(angle), r * std::sin(angle), 0); };
    BRepBuilderAPI_MakeWire wire;
    const auto flank = [&](double middle, double side, bool up) {
        constexpr int kPoints = 9;
        Handle(TColgp_HArray1OfPnt) points = new TColgp_HArray1OfPnt(1, kPoints);
        for (int i = 0; i < kPoints; ++i) {
            const double share = double(up ? i : kPoints - 1 - i) / (kPoints - 1);
            const double r = from + (tip - from) * share * share;
            points->SetValue(i + 1, point(r, middle + side * angleAt(r)));
        }
        GeomAPI_Interpolate curve(points, false, 1e-9);
        curve.Perform();
        wire.Add(BRepBuilderAPI_MakeEdge(curve.Curve()));
    };
    const auto line = [&](double r, double s, double angle) {
        if (from > root) wire.Add(BRepBuilderAPI_MakeEdge(point(r, angle), point(s, angle)));
    };
    const auto arc = [&](double r, double a, double b) {
        wire.Add(BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(point(r, a), point(r, (a + b) / 2), point(r, b)).Value()));
    };
    for (int i = 0; i < teeth; ++i) {
        const double middle = 2 * kPi * i / teeth, next = middle + 2 * kPi / teeth;
        line(root, from, middle - angleAt(from));
        flank(middle, -1, true);
        arc(tip, middle - angleAt(tip), middle + angleAt(tip));
        flank(middle, 1, false);
        line(from, root, middle + angleAt(from));
        arc(root, middle + angleAt(from), next - angleAt(from));
    }
    const TopoDS_Shape disk =
        BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(wire.Wire()).Face(), gp_Vec(0, 0, -width)).Shape();
    return BRepAlgoAPI_Cut(disk, cylinder(bore / 2, -width - 1, 1)).Shape();
}

TopoDS_Shape gearPins(double distance, double width, double pin) {
    const double edge = 3 * pin;
    TopoDS_Shape made = box(-edge, -edge, -width - pin, distance + edge, edge, -width);
    for (const double x : {0.0, distance}) made = fuse(made, cylinder(pin / 2, -width, 0, x));
    return made;
}

TopoDS_Shape plainScrew(double diameter, double length) {
    const double r = diameter / 2, point = diameter / 8;
    return revolved({{0, -length},
                     {r - point, -length},
                     {r, -length + point},
                     {r, 0},
                     {1.6 * r, 0},
                     {1.6 * r, diameter},
                     {0, diameter}});
}

TopoDS_Shape holedHousing(double hole, double depth, double pitch) {
    TopoDS_Shape made = box(-1.5 * pitch, -pitch, -1.5 * depth, 1.5 * pitch, pitch, 0);
    for (const double x : {-pitch, 0.0, pitch})
        for (const double y : {-pitch / 2, pitch / 2}) made = cut(made, cylinder(hole / 2, -depth, 1, x, y));
    return made;
}

TopoDS_Shape ball(double diameter, double rod) {
    const TopoDS_Shape whole = BRepPrimAPI_MakeSphere(diameter / 2).Shape();
    return rod > 0 ? fuse(whole, cylinder(rod / 2, 0, 1.5 * diameter)) : whole;
}

TopoDS_Shape ballSocket(double diameter) {
    return cut(box(-diameter, -diameter, -diameter, diameter, diameter, 0),
               BRepPrimAPI_MakeSphere(diameter / 2).Shape());
}

TopoDS_Shape wireRing(double diameter, double wire) { return BRepPrimAPI_MakeTorus(diameter / 2, wire / 2).Shape(); }

TopoDS_Shape groovedShaft(double diameter, double wire) {
    return cut(cylinder(diameter / 2, -diameter, diameter), wireRing(diameter, wire));
}

TopoDS_Shape bracket() {
    TopoDS_Shape made = fuse(box(0, 0, 0, 40, 25, 5), box(0, 0, 0, 5, 25, 30));
    made = cut(made, cylinder(4.05, -1, 6, 28, 9));
    return cut(made, box(30, 18, -1, 50, 30, 6));
}

}  // namespace touchstone
