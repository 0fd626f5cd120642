#pragma once
// PNG files.
#include <filesystem>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::engine {

/// Writes a picture as PNG. Throws std::runtime_error naming the path if it cannot be written.
void writePng(const std::filesystem::path& path, const Image& image);

/// Reads a PNG as RGBA. Throws std::runtime_error naming the path and the reason if it cannot be read.
Image readPng(const std::filesystem::path& path);

}  // namespace touchstone::engine
