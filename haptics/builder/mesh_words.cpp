#include "haptics/builder/mesh_words.hpp"

#include <algorithm>
#include <cstdio>

namespace touchstone {
namespace {

constexpr std::size_t kListed = 3;  // most places that are named

std::string placeWords(const MeshPatch& patch, const PlaceUnit& unit) {
    char text[256];
    int n = std::snprintf(text, sizeof text, "%.3g mm across at (%.1f, %.1f, %.1f) mm", patch.across, patch.place.x(),
                          patch.place.y(), patch.place.z());
    if (unit.mm != 1)
        std::snprintf(text + n, sizeof text - std::size_t(n), ", which is (%.4g, %.4g, %.4g) %s",
                      patch.place.x() / unit.mm, patch.place.y() / unit.mm, patch.place.z() / unit.mm, unit.name);
    return text;
}

std::string counted(int n, const char* what) { return std::to_string(n) + " " + what + (n == 1 ? "" : "s"); }

}  // namespace

std::string words(const MeshDefects& defects, const PlaceUnit& unit) {
    std::string text;
    if (defects.holes > 0)
        text = counted(defects.holes, "hole") + " (" + counted(defects.openEdges, "open edge") + "), " +
               (defects.holes == 1 ? "" : "the widest ") + placeWords(defects.largest, unit);
    if (defects.crowdedEdges > 0)
        text += (text.empty() ? "" : ", and ") + counted(defects.crowdedEdges, "edge") + " of more than two faces";
    if (defects.insideOut > 0)
        text += (text.empty() ? "" : ", and ") + counted(defects.insideOut, "shell") + " partly inside out";
    return text.empty() ? "faces that bound no volume" : text;
}

std::string words(const RepairedMesh& body, const PlaceUnit& unit) {
    const MeshRepairs& repairs = body.repairs;
    char moved[64];
    std::snprintf(moved, sizeof moved, " (by up to %.2g mm)", body.weld / body.scale);
    std::string text;
    const auto add = [&](int n, const char* what, const char* done) {
        if (n > 0) text += (text.empty() ? "" : ", ") + counted(n, what) + " " + done;
    };
    add(repairs.joined, "corner", "joined");
    add(repairs.stitched, "corner", "set into edges");
    if (repairs.joined + repairs.stitched > 0) text += moved;
    add(repairs.degenerate, "triangle", "without area dropped");
    add(repairs.duplicates, "duplicate", "dropped");
    add(repairs.turned, "triangle", "turned over");
    add(repairs.inner, "triangle", "inside the part left out");
    const auto list = [&](const std::vector<MeshPatch>& patches, const std::string& what) {
        if (patches.empty()) return;
        text += (text.empty() ? "" : ", ") + what + ": ";
        for (std::size_t i = 0; i < std::min(kListed, patches.size()); ++i)
            text += (i > 0 ? ", " : "") + placeWords(patches[i], unit);
        if (patches.size() > kListed) text += ", ...";
    };
    list(body.closedHoles, counted(int(body.closedHoles.size()), "hole") + " closed");
    int triangles = 0;
    for (const MeshPatch& patch : body.loose) triangles += patch.triangles;
    list(body.loose, counted(triangles, "loose triangle") + " that enclosed nothing left out");
    return text;
}

bool changedSurface(const RepairedMesh& body) {
    const MeshRepairs& repairs = body.repairs;
    return repairs.joined + repairs.stitched + repairs.turned > 0 || !body.closedHoles.empty() || !body.loose.empty();
}

}  // namespace touchstone
