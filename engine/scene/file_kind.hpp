#pragma once
// Recognizes files that are not glTF, for helpful error messages.
#include <cstdint>
#include <span>
#include <string>

namespace touchstone::engine {

/// Empty if the bytes could be the JSON of a .gltf. Else the rest of a sentence, e.g. "is a PNG picture, not glTF;
/// ...", that says what the bytes appear to be and what to do.
std::string foreignFileProblem(std::span<const std::uint8_t> bytes);

}  // namespace touchstone::engine
