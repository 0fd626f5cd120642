#pragma once
// Sphere trees in words: the same in scene files, on the console and in the window.
#include <array>
#include <string>

#include "haptics/builder/tree_builder.hpp"

namespace touchstone::sandbox {

inline constexpr std::array kQualityNames{"fast", "best"};
inline constexpr std::array kInteriorNames{"shell", "solid"};
inline const char* name(TreeQuality quality) { return kQualityNames[static_cast<std::size_t>(quality)]; }
inline const char* name(Interior interior) { return kInteriorNames[static_cast<std::size_t>(interior)]; }

/// What is asked for: "4096 leaves, fast, shell", or "at most 0.02 mm out, best, solid".
std::string words(const TreeOptions& options);

/// "0.123 mm (0.149 %)": how far the leaves may reach out of the surface; the share is of the mesh's diagonal.
std::string protrusionWords(const TreeCertificate& certificate);

/// What is proven of the surface: "covered", or what is not, and the hollow inside if it was measured.
std::string surfaceWords(const TreeCertificate& certificate);

/// Something of the certificate does not hold, or the builder has a note for the user.
bool needsAttention(const TreeCertificate& certificate);

/// All of it in one line, but for the note: leaves, spheres, protrusion, surface.
std::string words(const SphereTree& tree);

/// "12 s left", rounded as an estimate deserves; empty when `seconds` is negative.
std::string timeLeft(double seconds);

}  // namespace touchstone::sandbox
