#pragma once
// The two wrappings of glTF: .gltf is JSON alone, .glb is a header, a JSON chunk and a binary chunk.
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// Throws SceneError `file: object: problem`; `object` may be empty. `problem` ends with what to do.
[[noreturn]] void failIn(const std::filesystem::path& file, const std::string& object, const std::string& problem);

/// "a folder", "a pipe" or what else is no regular file.
const char* kindOf(std::filesystem::file_status status);

/// A whole regular file of at most 2 GiB in memory. `object`: what it is to the reader, for the sentence.
std::vector<std::uint8_t> readBytes(const std::filesystem::path& file, const std::string& object = {});

/// Writes aside and renames, so that `file` holds either the old or the new bytes. Throws SceneError.
void writeBytes(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);

struct GltfContainer {
    bool binary = false;  ///< .glb
    std::string json;
    std::vector<std::uint8_t> bytes;          ///< all of the file
    std::span<const std::uint8_t> bin;        ///< contents of the binary chunk, within `bytes`
    std::span<const std::uint8_t> followers;  ///< all chunks after the JSON chunk with their headers, within `bytes`
};

/// Splits a file into its chunks. Throws SceneError for a wrong header or a chunk that ends behind the file.
GltfContainer readContainer(const std::filesystem::path& file);

/// A binary chunk with its header, padded to a multiple of 4 bytes.
std::vector<std::uint8_t> binChunk(std::vector<std::uint8_t> contents);

/// Fields of a glTF node that stands there: a matrix if it is sheared, else what differs from the identity.
nlohmann::json placeFields(const LocalTransform& local);

/// Wraps JSON and following chunks (each a multiple of 4 bytes with its header) into a .glb.
std::vector<std::uint8_t> glbBytes(std::string json, std::span<const std::uint8_t> followers);

/// Parses JSON of bounded depth, since whoever copies it recurses. Throws SceneError naming line and column.
nlohmann::json parseJson(const std::filesystem::path& file, const std::string& text);
nlohmann::ordered_json parseOrderedJson(const std::filesystem::path& file, const std::string& text);

}  // namespace touchstone::engine
