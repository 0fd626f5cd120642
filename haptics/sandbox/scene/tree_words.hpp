#pragma once
// How sphere trees and meshes are described: the same words in scene files, on the console and in the window.
#include <array>
#include <string>

#include "haptics/builder/tree_builder.hpp"
#include "haptics/surface/surface.hpp"

namespace touchstone::sandbox {

inline constexpr std::array kQualityNames{"fast", "best"};
inline constexpr std::array kInteriorNames{"shell", "solid"};
inline const char* name(TreeQuality quality) { return kQualityNames[static_cast<std::size_t>(quality)]; }
inline const char* name(Interior interior) { return kInteriorNames[static_cast<std::size_t>(interior)]; }

/// The options: "4096 leaves, fast, shell", or "protrusion at most 0.02 mm, best, solid".
std::string words(const TreeOptions& options);

/// "0.123 mm (0.149 %)": how far the leaves may reach out of the surface; the percentage is of the mesh's diagonal.
std::string protrusionWords(const TreeCertificate& certificate);

/// What is proven about the surface: covered or not, closed or open, and the hollow inside if it was measured.
std::string surfaceWords(const TreeCertificate& certificate);

/// True if the certificate is incomplete or the builder has a note for the user.
bool needsAttention(const TreeCertificate& certificate);

/// One line with leaves, spheres, protrusion and surface; without the builder's note.
std::string words(const SphereTree& tree);

/// "12 s left", rounded, since it is an estimate; empty if `seconds` is negative or not finite.
std::string timeLeft(double seconds);

/// The features of a mesh: "69666 faces, 51234 convex edges and 20123 vertices that can touch first".
std::string meshWords(const Surface& surface);

}  // namespace touchstone::sandbox
