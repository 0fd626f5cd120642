#pragma once
// What a glTF document must look like before anything is read from it.
#include <filesystem>
#include <nlohmann/json.hpp>

namespace touchstone::engine {

/// Checks types, ranges and references of all properties this engine reads (glTF 2.0, chapter 5), and returns a copy
/// with these alone. Thereafter every index is inside its array and every number a finite one inside its range.
/// Throws SceneError naming the object and the property.
nlohmann::json checkedDocument(const std::filesystem::path& file, const nlohmann::json& document);

}  // namespace touchstone::engine
