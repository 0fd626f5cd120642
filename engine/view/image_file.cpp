#include "engine/view/image_file.hpp"

#include <stb_image.h>
#include <stb_image_write.h>

#include <memory>
#include <stdexcept>

namespace touchstone::engine {

void writePng(const std::filesystem::path& path, const Image& image) {
    if (!stbi_write_png(path.c_str(), image.width, image.height, 4, image.rgba.data(), 4 * image.width))
        throw std::runtime_error("Picture " + path.string() +
                                 " cannot be written; check that its folder exists and may be written to.");
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
