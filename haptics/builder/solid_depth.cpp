#include "haptics/builder/solid_depth.hpp"

#include <algorithm>

namespace touchstone {
namespace {

template <class Predicate>
std::vector<Triangle> facesWhere(const RepairedMesh& mesh, Predicate&& wanted) {
    std::vector<Triangle> out;
    for (const Face& f : mesh.faces)
        if (wanted(f.role)) out.push_back(f.corners);
    return out;
}

bool bounds(FaceRole r) { return r == FaceRole::Wall || r == FaceRole::Cap; }

std::vector<Triangle> closedShells(const RepairedMesh& mesh) {
    const bool buried =
        std::any_of(mesh.faces.begin(), mesh.faces.end(), [](const Face& f) { return f.role == FaceRole::Buried; });
    if (!buried) return {};  // the walls alone give the same winding number
    return facesWhere(mesh, [](FaceRole r) { return bounds(r) || r == FaceRole::Buried; });
}

}  // namespace

SolidDepth::SolidDepth(const RepairedMesh& mesh)
    : walls_(facesWhere(mesh, bounds)),
      sheets_(facesWhere(mesh, [](FaceRole r) { return r == FaceRole::Sheet; })),
      shells_(closedShells(mesh)) {}

bool SolidDepth::inside(const Vec3& p) const {
    return !walls_.empty() && (shells_.empty() ? walls_ : shells_).windingNumber(p) >= 0.5;
}

double SolidDepth::depth(const Vec3& p) const {
    const double toWall = walls_.closest(p).distance;
    if (inside(p)) return toWall;
    return -std::min(toWall, sheets_.closest(p, toWall).distance);
}

}  // namespace touchstone
