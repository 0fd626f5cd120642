#pragma once
// What a file is that should be glTF and is something else.
#include <cstdint>
#include <span>
#include <string>

namespace touchstone::engine {

/// Empty for what could be the JSON of a .gltf. Else the end of a sentence, "is a PNG picture, not glTF; ...", that
/// says what the bytes are, as far as they tell, and what to do.
std::string whatInstead(std::span<const std::uint8_t> bytes);

}  // namespace touchstone::engine
