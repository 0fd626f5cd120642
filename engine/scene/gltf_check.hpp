#pragma once
// Which objects of a glTF document the chosen scene uses, and that these are sound.
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/scene/warnings.hpp"

namespace touchstone::engine {

/// Of each top-level array, which of its objects the scene uses.
using UsedObjects = std::map<std::string, std::vector<bool>, std::less<>>;

struct CheckedGltf {
    /// Of each object that the scene uses the properties that are read, with every index, range of bytes and number
    /// inside its bounds; in place of the others objects that hold nothing. The nodes form trees.
    nlohmann::json document;
    std::size_t scene = 0;
    UsedObjects used;
};

/// Checks a document for one scene; -1: the default scene, else the first one. Objects of which the scene makes no use
/// may be broken: they become warnings. An animation is used when it moves a node of the scene. Time and memory are
/// linear in the size of the document. Throws SceneError naming the object and the property.
CheckedGltf checkGltf(const std::filesystem::path& file, const nlohmann::json& document, int scene, Warnings& warnings);

}  // namespace touchstone::engine
