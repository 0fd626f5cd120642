#include "engine/scene/mesh_file.hpp"

#include <algorithm>
#include <array>
#include <cassert>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/mesh_readers.hpp"

namespace touchstone::engine {
namespace fs = std::filesystem;
namespace {

// Own readers, because assimp and tinyobjloader silently skip malformed numbers or turn them into zeros.
struct Format {
    std::string_view extension;
    void (*read)(std::string_view bytes, PolygonMesh& mesh);
};
constexpr Format kFormats[] = {{".obj", readObj}, {".ply", readPly}, {".stl", readStl}};

constexpr auto kExtensions = [] {
    std::array<std::string_view, std::size(kFormats)> extensions;
    std::transform(std::begin(kFormats), std::end(kFormats), extensions.begin(),
                   [](const Format& format) { return format.extension; });
    return extensions;
}();

const Format* formatOf(const fs::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const auto* format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                      [&](const Format& known) { return known.extension == extension; });
    return format == std::end(kFormats) ? nullptr : format;
}

}  // namespace

std::span<const std::string_view> meshExtensions() { return kExtensions; }

std::string meshExtensionWords(std::string_view conjunction) {
    std::string words;
    for (std::size_t i = 0; i < kExtensions.size(); ++i) {
        if (i > 0) words += i + 1 < kExtensions.size() ? ", " : " " + std::string(conjunction) + " ";
        words += kExtensions[i];
    }
    return words;
}

bool isMeshFile(const fs::path& file) { return formatOf(file) != nullptr; }

MeshFile readMeshFile(const fs::path& file, double metersPerUnit) {
    assert(metersPerUnit > 0);
    const Format* format = formatOf(file);
    if (!format) failIn(file, "", "is not a " + meshExtensionWords() + " file; export the part as one of these");

    PolygonMesh mesh(file, metersPerUnit);
    {
        const std::vector<std::uint8_t> bytes = readBytes(file);
        const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        if (text.empty()) failIn(file, "", "is empty; export the part again");
        if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
            failIn(file, "", "is text in UTF-16, which no mesh format allows; save it as UTF-8");
        format->read(text, mesh);
    }
    return mesh.build();
}

}  // namespace touchstone::engine
