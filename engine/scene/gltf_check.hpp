#pragma once
// Finds the objects of a glTF document that the chosen scene uses, and checks them.
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/scene/warnings.hpp"

namespace touchstone::engine {

/// For each top-level array, flags of the objects that the scene uses.
using UsedObjects = std::map<std::string, std::vector<bool>, std::less<>>;

struct CheckedGltf {
    /// The properties that this engine reads, for each object that the scene uses. Every index, byte range and number
    /// is within its bounds, and the nodes form trees. Unused objects are replaced by empty ones.
    nlohmann::json document;
    std::size_t scene = 0;
    UsedObjects used;
};

/// Checks a document for one scene; -1: the default scene, else the first one. Broken objects that the scene does not
/// use become warnings. An animation is used when it moves a node of the scene. Time and memory are linear in the size
/// of the document. Throws SceneError naming the object and the property.
CheckedGltf checkGltf(const std::filesystem::path& file, const nlohmann::json& document, int scene, Warnings& warnings);

}  // namespace touchstone::engine
