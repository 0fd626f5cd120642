#include "haptics/sandbox/scene/tree_words.hpp"

#include <algorithm>
#include <cmath>

#include "engine/scene/text.hpp"

namespace touchstone::sandbox {

using engine::formatted;

namespace {

constexpr std::size_t kListed = 3;  // most places that are named

std::string placeWords(const MeshPatch& patch) {
    return formatted("%.3g mm across at (%.1f, %.1f, %.1f) mm", patch.across, patch.place.x(), patch.place.y(),
                     patch.place.z());
}

std::string counted(int n, const char* what) { return formatted("%d %s%s", n, what, n == 1 ? "" : "s"); }

}  // namespace

std::string words(const TreeOptions& options) {
    std::string text = options.maxError > 0 ? formatted("protrusion at most %g mm", options.maxError)
                                            : formatted("%d leaves", options.leaves);
    return text + ", " + name(options.quality) + ", " + name(options.interior);
}

std::string protrusionWords(const TreeCertificate& certificate) {
    return formatted("%.3g mm (%.3g %%)", certificate.protrusion,
                     100 * certificate.protrusion / std::max(certificate.diagonal, 1e-300));
}

std::string surfaceWords(const TreeCertificate& certificate) {
    std::string text = certificate.covered ? "surface proven covered" : "surface not proven covered";
    text += certificate.closed ? ", closed" : ", open";
    if (certificate.hollow >= 0) text += formatted(", hollow for balls up to %.3g mm", certificate.hollow);
    return text;
}

bool needsAttention(const TreeCertificate& certificate) {
    return !certificate.covered || !certificate.closed || !certificate.note.empty();
}

std::string words(const SphereTree& tree) {
    return formatted("%d leaves (%d spheres, %d levels), protrusion at most ", tree.leafCount(), tree.nodeCount(),
                     static_cast<int>(tree.levels.size())) +
           protrusionWords(tree.certificate) + ", " + surfaceWords(tree.certificate);
}

std::string timeLeft(double seconds) {
    if (seconds < 0 || !std::isfinite(seconds)) return {};
    if (seconds < 1) return "almost done";
    if (seconds < 100) return formatted("%.0f s left", seconds);
    return formatted("%.0f min left", std::ceil(seconds / 60));
}

std::string words(const MeshDefects& defects) {
    std::string text;
    if (defects.holes > 0)
        text = counted(defects.holes, "hole") + " (" + counted(defects.openEdges, "open edge") + "), " +
               (defects.holes == 1 ? "" : "the widest ") + placeWords(defects.largest);
    if (defects.crowdedEdges > 0)
        text += (text.empty() ? "" : ", and ") + counted(defects.crowdedEdges, "edge") + " of more than two faces";
    if (defects.insideOut > 0)
        text += (text.empty() ? "" : ", and ") + counted(defects.insideOut, "shell") + " partly inside out";
    return text.empty() ? "faces that bound no volume" : text;
}

std::string words(const RepairedMesh& body) {
    const MeshRepairs& repairs = body.repairs;
    const double moved = body.weld / body.scale;
    std::string text;
    const auto add = [&](int n, const char* what, const char* done) {
        if (n > 0) text += (text.empty() ? "" : ", ") + counted(n, what) + " " + done;
    };
    add(repairs.joined, "corner", "joined");
    add(repairs.stitched, "corner", "set into edges");
    if (repairs.joined + repairs.stitched > 0) text += formatted(" (by up to %.2g mm)", moved);
    add(repairs.degenerate, "triangle", "without area dropped");
    add(repairs.duplicates, "duplicate", "dropped");
    add(repairs.turned, "triangle", "turned over");
    add(repairs.inner, "triangle", "inside the part left out");
    const auto list = [&](const std::vector<MeshPatch>& patches, const std::string& what) {
        if (patches.empty()) return;
        text += (text.empty() ? "" : ", ") + what + ": ";
        for (std::size_t i = 0; i < std::min(kListed, patches.size()); ++i)
            text += (i > 0 ? ", " : "") + placeWords(patches[i]);
        if (patches.size() > kListed) text += ", ...";
    };
    list(body.closedHoles, counted(int(body.closedHoles.size()), "hole") + " closed");
    int triangles = 0;
    for (const MeshPatch& patch : body.loose) triangles += patch.triangles;
    list(body.loose, counted(triangles, "loose triangle") + " that enclosed nothing left out");
    return text;
}

std::string meshWords(const Surface& surface) {
    return formatted("%d faces, %d convex edges and %d vertices that can touch first",
                     int(surface.features.faces.size()), int(surface.features.edges.size()),
                     int(surface.features.vertices.size()));
}

}  // namespace touchstone::sandbox
