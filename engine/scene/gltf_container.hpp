#pragma once
// The two container formats of glTF: .gltf is JSON only; .glb is a header, a JSON chunk and a binary chunk.
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

/// Kind of a file that is not regular: "a folder", "a pipe", ...
const char* kindOf(std::filesystem::file_status status);

/// Reads a regular file of less than 2 GiB into memory. `object`: its role, for error messages. Throws SceneError.
std::vector<std::uint8_t> readBytes(const std::filesystem::path& file, const std::string& object = {});

/// Writes a temporary file and renames it, so that `file` holds either the old or the new bytes. Throws SceneError.
void writeBytes(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);

struct GltfContainer {
    bool binary = false;  ///< .glb
    std::string json;
    std::vector<std::uint8_t> bytes;          ///< the whole file
    std::span<const std::uint8_t> bin;        ///< contents of the binary chunk, within `bytes`
    std::span<const std::uint8_t> followers;  ///< chunks after the JSON chunk, with headers, within `bytes`
};

/// Splits a file into its chunks. Throws SceneError for a wrong header or a chunk that exceeds the file.
GltfContainer readContainer(const std::filesystem::path& file);

/// The bytes as a URI, in base64.
std::string dataUri(std::span<const std::uint8_t> bytes);

/// A binary chunk with its header, padded to a multiple of 4 bytes.
std::vector<std::uint8_t> binChunk(std::vector<std::uint8_t> contents);

/// Transform fields of a glTF node: a matrix if it is sheared, else the parts that differ from the identity.
nlohmann::json placeFields(const LocalTransform& local);

/// Wraps JSON and following chunks (each a multiple of 4 bytes with its header) into a .glb.
std::vector<std::uint8_t> glbBytes(std::string json, std::span<const std::uint8_t> followers);

/// Parses JSON of bounded nesting depth, since copying a value recurses. Throws SceneError naming line and column.
nlohmann::json parseJson(const std::filesystem::path& file, const std::string& text);
nlohmann::ordered_json parseOrderedJson(const std::filesystem::path& file, const std::string& text);

}  // namespace touchstone::engine
