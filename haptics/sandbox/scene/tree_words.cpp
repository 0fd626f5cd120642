#include "haptics/sandbox/scene/tree_words.hpp"

#include <algorithm>
#include <cmath>

#include "engine/scene/text.hpp"

namespace touchstone::sandbox {

using engine::formatted;

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

std::string meshWords(const Surface& surface) {
    return formatted("%d faces, %d convex edges and %d vertices that can touch first",
                     int(surface.features.faces.size()), int(surface.features.edges.size()),
                     int(surface.features.vertices.size()));
}

}  // namespace touchstone::sandbox
