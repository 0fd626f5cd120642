#include "tools/step/step_faces.hpp"

#include <BRepAdaptor_Curve.hxx>
#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_MakeSolid.hxx>
#include <BRepGProp.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <GProp_GProps.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <algorithm>
#include <cmath>
#include <gp_Vec.hxx>
#include <optional>
#include <vector>

#include "engine/scene/screw_surface.hpp"
#include "tools/step/step_reader.hpp"

namespace touchstone::step {

using engine::CadFace;
using engine::CadSurface;

namespace {

/// Sets the axis of a round surface, and whether its solid lies outside it.
void setRound(CadFace& face, const gp_Ax3& position, bool reversed) {
    face.origin = meters(position.Location().XYZ());
    const gp_XYZ axis = position.Direction().XYZ();
    face.axis = {axis.X(), axis.Y(), axis.Z()};
    face.hollow = reversed != !position.Direct();
}

/// Sets the axis of a free-form surface that is a thread or a cylinder, as which CAD programs export them.
void recognize(const TopoDS_Face& shape, const BRepAdaptor_Surface& surface, bool reversed, CadFace& face) {
    constexpr int kAcross = 24;
    double u1 = 0, u2 = 0, v1 = 0, v2 = 0;
    BRepTools::UVBounds(shape, u1, u2, v1, v2);
    // Points with outward normals, evenly over the parameters.
    std::vector<engine::SurfacePoint> points;
    for (int i = 0; i <= kAcross; ++i)
        for (int j = 0; j <= kAcross; ++j) {
            gp_Pnt place;
            gp_Vec du, dv;
            surface.D1(u1 + (u2 - u1) * i / kAcross, v1 + (v2 - v1) * j / kAcross, place, du, dv);
            const gp_XYZ normal = du.Crossed(dv).XYZ();
            if (!(normal.Modulus() > 0)) continue;
            const gp_XYZ n = normal / (reversed ? -normal.Modulus() : normal.Modulus());
            points.push_back({meters(place.XYZ()), {n.X(), n.Y(), n.Z()}});
        }
    const std::optional<engine::ScrewSurface> screw = engine::screwSurface(points);
    if (!screw) return;
    face.surface = screw->cylinder ? CadSurface::Cylinder : CadSurface::Helicoid;
    face.origin = screw->point;
    face.axis = screw->axis;
    face.lead = screw->lead;
    if (screw->cylinder) face.radius = (screw->inner + screw->outer) / 2;
    // Hollow if the normals point to the axis.
    double outward = 0;
    for (const engine::SurfacePoint& p : points) {
        const glm::dvec3 from = p.place - face.origin;
        outward += glm::dot(p.normal, from - glm::dot(from, face.axis) * face.axis);
    }
    face.hollow = outward < 0;
    face.from = HUGE_VAL;
    face.to = -HUGE_VAL;
    for (TopExp_Explorer i(shape, TopAbs_EDGE); i.More(); i.Next()) {
        if (BRep_Tool::Degenerated(TopoDS::Edge(i.Current()))) continue;
        const BRepAdaptor_Curve edge(TopoDS::Edge(i.Current()));
        for (int k = 0; k <= kAcross; ++k) {
            const double t = edge.FirstParameter() + (edge.LastParameter() - edge.FirstParameter()) * k / kAcross;
            const double along = glm::dot(meters(edge.Value(t).XYZ()) - face.origin, face.axis);
            face.from = std::min(face.from, along);
            face.to = std::max(face.to, along);
        }
    }
}

/// The number of edges that bound one face only.
int openEdges(const TopoDS_Shape& shell) {
    TopTools_IndexedDataMapOfShapeListOfShape faces;
    TopExp::MapShapesAndAncestors(shell, TopAbs_EDGE, TopAbs_FACE, faces);
    int open = 0;
    for (int i = 1; i <= faces.Extent(); ++i)
        open += faces(i).Extent() == 1 && !BRep_Tool::Degenerated(TopoDS::Edge(faces.FindKey(i)));
    return open;
}

}  // namespace

glm::dvec3 meters(const gp_XYZ& p) { return {p.X() * kMetersPerUnit, p.Y() * kMetersPerUnit, p.Z() * kMetersPerUnit}; }

CadFace describe(const TopoDS_Face& shape) {
    CadFace face;
    const BRepAdaptor_Surface surface(shape);
    const bool reversed = shape.Orientation() == TopAbs_REVERSED;
    double u1 = 0, u2 = 0, v1 = 0, v2 = 0;
    BRepTools::UVBounds(shape, u1, u2, v1, v2);
    const auto setExtent = [&](double from, double to) {
        face.from = std::min(from, to) * kMetersPerUnit;
        face.to = std::max(from, to) * kMetersPerUnit;
        face.turn = u2 - u1;
    };
    switch (surface.GetType()) {
        case GeomAbs_Plane: {
            face.surface = CadSurface::Plane;
            setRound(face, surface.Plane().Position(), reversed);
            if (face.hollow) face.axis = -face.axis;
            face.hollow = false;
            break;
        }
        case GeomAbs_Cylinder: {
            face.surface = CadSurface::Cylinder;
            setRound(face, surface.Cylinder().Position(), reversed);
            face.radius = surface.Cylinder().Radius() * kMetersPerUnit;
            setExtent(v1, v2);
            break;
        }
        case GeomAbs_Cone: {
            face.surface = CadSurface::Cone;
            setRound(face, surface.Cone().Position(), reversed);
            face.radius = surface.Cone().RefRadius() * kMetersPerUnit;
            face.halfAngle = surface.Cone().SemiAngle();
            double along = std::cos(face.halfAngle);
            if (face.halfAngle < 0) {
                face.halfAngle = -face.halfAngle;
                face.axis = -face.axis;
                along = -along;
            }
            setExtent(along * v1, along * v2);
            break;
        }
        case GeomAbs_Sphere: {
            face.surface = CadSurface::Sphere;
            setRound(face, surface.Sphere().Position(), reversed);
            face.radius = surface.Sphere().Radius() * kMetersPerUnit;
            setExtent(surface.Sphere().Radius() * std::sin(v1), surface.Sphere().Radius() * std::sin(v2));
            break;
        }
        case GeomAbs_Torus: {
            face.surface = CadSurface::Torus;
            setRound(face, surface.Torus().Position(), reversed);
            face.radius = surface.Torus().MajorRadius() * kMetersPerUnit;
            face.minorRadius = surface.Torus().MinorRadius() * kMetersPerUnit;
            setExtent(-surface.Torus().MinorRadius(), surface.Torus().MinorRadius());
            break;
        }
        default:
            recognize(shape, surface, reversed, face);
            break;
    }
    // Area and bounding box of the face itself.
    GProp_GProps area;
    BRepGProp::SurfaceProperties(shape, area);
    face.area = std::abs(area.Mass()) * kMetersPerUnit * kMetersPerUnit;
    Bnd_Box box;
    box.SetGap(0);
    BRepBndLib::Add(shape, box, false);
    if (!box.IsVoid()) {
        face.low = meters(box.CornerMin().XYZ());
        face.high = meters(box.CornerMax().XYZ());
    }
    return face;
}

double distanceToSurface(const BRepAdaptor_Surface& surface, const gp_Pnt& point, double u, double v) {
    gp_Pnt foot;
    gp_Vec du, dv;
    surface.D1(u, v, foot, du, dv);
    const gp_Vec from(foot, point);
    const gp_Vec normal = du.Crossed(dv);
    // Measured along the normal, since (u, v) of a triangle's middle is not exactly the foot of its perpendicular.
    return normal.Magnitude() > 1e-12 ? std::abs(from.Dot(normal)) / normal.Magnitude() : from.Magnitude();
}

TopoDS_Shape solidsOf(const TopoDS_Shape& shape, std::string& problem) {
    BRep_Builder builder;
    TopoDS_Compound compound;
    builder.MakeCompound(compound);
    std::vector<TopoDS_Shape> solids;
    for (TopExp_Explorer i(shape, TopAbs_SOLID); i.More(); i.Next()) solids.push_back(i.Current());
    int surfaces = 0, open = 0;
    for (TopExp_Explorer i(shape, TopAbs_SHELL, TopAbs_SOLID); i.More(); i.Next()) {
        const TopoDS_Shell& shell = TopoDS::Shell(i.Current());
        if (openEdges(shell) == 0 && BRep_Tool::IsClosed(shell))
            solids.push_back(BRepBuilderAPI_MakeSolid(shell).Solid());
        else
            ++surfaces;
        open += openEdges(shell);
    }
    for (TopExp_Explorer i(shape, TopAbs_FACE, TopAbs_SHELL); i.More(); i.Next()) ++surfaces;
    if (solids.empty()) {
        problem = surfaces == 0
                      ? "has no solid and no surface: export it from the CAD program as a solid"
                      : "is a surface model of " + std::to_string(surfaces) +
                            (surfaces == 1 ? " surface" : " surfaces") +
                            (open > 0 ? ", open at " + std::to_string(open) + (open == 1 ? " edge" : " edges") : "") +
                            ", not a solid: join the surfaces to a solid in the CAD program, and export it again";
        return {};
    }
    for (TopoDS_Shape& solid : solids) {
        int gaps = 0;
        for (TopExp_Explorer i(solid, TopAbs_SHELL); i.More(); i.Next()) gaps += openEdges(i.Current());
        if (gaps > 0) {
            problem = "has an open shell: " + std::to_string(gaps) + (gaps == 1 ? " edge bounds" : " edges bound") +
                      " one face only; close it in the CAD program, and export it again";
            return {};
        }
        GProp_GProps volume;
        BRepGProp::VolumeProperties(solid, volume);
        if (volume.Mass() < 0) solid.Reverse();
        builder.Add(compound, solid);
    }
    return compound;
}

std::vector<TopoDS_Face> facesOf(const TopoDS_Shape& solids) {
    std::vector<TopoDS_Face> faces;
    for (TopExp_Explorer i(solids, TopAbs_FACE); i.More(); i.Next()) faces.push_back(TopoDS::Face(i.Current()));
    return faces;
}

}  // namespace touchstone::step
