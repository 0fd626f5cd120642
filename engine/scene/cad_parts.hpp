#pragma once
// Parts of a CAD file as plain data: exact surfaces, and triangles that approximate them. The program that reads CAD
// files writes them as bytes, and readStep() reads these. Lengths in meters.
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace touchstone::engine {

enum class CadSurface : std::uint8_t { Plane, Cylinder, Cone, Sphere, Torus, Helicoid, Other };

/// Completes "a" to a noun: "plane", "cylinder", "free-form surface".
const char* name(CadSurface surface);

/// One face of a shape, in the frame of the shape. What does not apply to its surface is 0.
struct CadFace {
    CadSurface surface = CadSurface::Other;
    bool hollow = false;          ///< the solid lies on the side away from the axis or center: a hole, not a shaft
    glm::dvec3 origin{0};         ///< on the plane; on the axis; the center of a sphere or torus
    glm::dvec3 axis{0};           ///< unit; a plane's outward normal; of a cone, toward its wider end
    double radius = 0;            ///< of a cylinder or sphere; of a cone at the origin; a torus's larger one
    double minorRadius = 0;       ///< of a torus
    double halfAngle = 0;         ///< rad, of a cone: above 0
    double lead = 0;              ///< of a helicoid: travel along the axis per turn, positive if right-handed
    double from = 0, to = 0;      ///< extent along the axis from the origin; of a plane, 0
    double turn = 0;              ///< rad about the axis that the face covers; a whole turn if it closes
    glm::dvec3 low{0}, high{0};   ///< the box around the face
    double area = 0;              ///< m²
    std::uint32_t triangles = 0;  ///< number; those of the first face come first
    std::uint32_t facets = 0;     ///< per turn, if its points follow a pattern about the axis; else 0
    double deviation = 0;         ///< the greatest distance measured from its triangles to the surface
    double clearance = 0;         ///< to the face of another part about the same axis; 0 if there is none
};

/// What one or several parts look like.
struct CadShape {
    std::vector<CadFace> faces = {};
    std::vector<glm::dvec3> vertices = {};
    std::vector<std::array<std::uint32_t, 3>> triangles = {};  ///< counter-clockwise seen from outside; by face
    double clearance = 0;                                      ///< least of its faces; 0 if there is none
    double asked = 0;      ///< the deviation of triangles from the surface that was asked for
    double deviation = 0;  ///< the greatest that was measured
    double volume = 0;     ///< m³, of the exact solid
    bool limited = false;  ///< the limit of triangles made the deviation coarser than a tenth of the clearance
    std::string problem =
        {};  ///< completes "the part ..." to a sentence if it has no triangles: a clause with a remedy
};

/// A shape at its place in the assembly.
struct CadPart {
    std::string name = {};    ///< of the instance, else of its shape
    std::string path = {};    ///< names from the root to the part, joined by "/"
    std::uint32_t shape = 0;  ///< index into CadAssembly::shapes
    glm::dmat4 placement{1};  ///< from the frame of the shape to that of the file; mirrored if its determinant is < 0
    std::optional<glm::vec3> color = {};  ///< linear
};

/// The content of one file.
struct CadAssembly {
    std::string name = {};    ///< of the root; may be empty
    std::string schema = {};  ///< "AP203", "AP214" or "AP242"; of another file, what its header says
    std::string unit = {};    ///< of lengths in the file: "mm", "in", ...
    double metersPerUnit = 0.001;
    std::vector<CadShape> shapes = {};
    std::vector<CadPart> parts = {};
    std::vector<std::string> notes = {};  ///< what was left out or repaired: one sentence each, without the file
};

/// The bytes of assemblies, and back. Nothing if the bytes are truncated or no assemblies.
std::string cadBytes(std::span<const CadAssembly> assemblies);
std::optional<std::vector<CadAssembly>> cadFromBytes(std::string_view bytes);

}  // namespace touchstone::engine
