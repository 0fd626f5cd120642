#include "engine/view/image_file.hpp"

#include <stb_image.h>

#include <memory>
#include <stdexcept>
#include <vector>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_write.hpp"

namespace touchstone::engine {

void writePng(const std::filesystem::path& path, const Image& image) {
    const std::vector<std::uint8_t> png = pngBytes(image);
    if (png.empty()) failIn(path, "", "the picture cannot be stored as PNG; make it smaller");
    writeBytes(path, png);
}

Image readPng(const std::filesystem::path& path) {
    int width = 0, height = 0, channels = 0;
    const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(stbi_load(path.c_str(), &width, &height, &channels, 4),
                                                           stbi_image_free);
    if (!pixels)
        throw std::runtime_error("Picture " + path.string() + " cannot be read (" + stbi_failure_reason() +
                                 "); check that it is a PNG file.");
    return {width, height, {pixels.get(), pixels.get() + 4 * static_cast<std::size_t>(width) * height}};
}

}  // namespace touchstone::engine
