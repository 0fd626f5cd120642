#include "engine/scene/gltf_load.hpp"

#include <stb_image.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>

#include "engine/scene/gltf_check.hpp"
#include "engine/scene/gltf_container.hpp"

namespace touchstone::engine {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

constexpr int kLargestImageSide = 16384;
constexpr std::string_view kUnused = "unused";

/// Virtual files for tinygltf by name. Their bytes are moved out when read.
using VirtualFiles = std::map<std::string, Bytes, std::less<>>;

std::string labelOf(const json& document, const char* array, const char* kind, std::size_t index) {
    return objectLabel(kind, index, document[array][index].value("name", std::string()));
}

std::string percentDecoded(std::string_view text) {
    const auto digit = [](char c) { return c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10; };
    std::string decoded;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '%' && i + 2 < text.size() && std::isxdigit(static_cast<unsigned char>(text[i + 1])) &&
            std::isxdigit(static_cast<unsigned char>(text[i + 2]))) {
            decoded += static_cast<char>(digit(text[i + 1]) * 16 + digit(text[i + 2]));
            i += 2;
        } else {
            decoded += text[i];
        }
    }
    return decoded;
}

bool hasScheme(std::string_view uri) {
    const std::size_t colon = uri.find(':');
    return colon != uri.npos && colon > 0 && std::all_of(uri.begin(), uri.begin() + colon, [](unsigned char c) {
               return std::isalnum(c) || c == '+' || c == '.' || c == '-';
           });
}

/// Whether the path, in normal form, stays in the folder that it is relative to.
bool leavesNoFolder(const fs::path& relative) {
    return !relative.empty() && !relative.is_absolute() && *relative.begin() != "..";
}

/// Reads a file in the scene's folder. Paths that leave the folder by `..`, as absolute path or by links are refused.
Bytes externalBytes(const fs::path& file, const std::string& label, const std::string& uri) {
    const std::string name = percentDecoded(uri), shown = "\"" + printable(name) + "\"";
    const std::string outside = "refers to " + shown + " outside the scene's folder; put the file into that folder";
    if (hasScheme(name) || name.find('\0') != name.npos) failIn(file, label, outside);
    const fs::path relative = fs::path(name).lexically_normal();
    if (!leavesNoFolder(relative)) failIn(file, label, outside);
    std::error_code error;
    const fs::path folder = fs::canonical(file.has_parent_path() ? file.parent_path() : ".", error);
    const fs::path found = error ? fs::path() : fs::canonical(folder / relative, error);
    if (error) failIn(file, label, "refers to the missing file " + shown + "; put it into the scene's folder");
    if (std::mismatch(folder.begin(), folder.end(), found.begin(), found.end()).first != folder.end())
        failIn(file, label, outside);
    if (const fs::file_status status = fs::status(found, error); !fs::is_regular_file(status))
        failIn(file, label, "refers to " + shown + ", which is " + kindOf(status) + "; put the file there");
    return readBytes(found, label);
}

Bytes dataUriBytes(const fs::path& file, const std::string& label, const std::string& uri) {
    constexpr std::string_view kMarker = ";base64,";
    const std::size_t marker = uri.find(kMarker);
    if (marker > 256) failIn(file, label, "has a data URI without base64; export the file again");
    Bytes bytes;
    std::string mimeType;
    // tinygltf knows few media types, but decoding does not depend on the type.
    tinygltf::DecodeDataURI(&bytes, mimeType,
                            "data:application/octet-stream;base64," + uri.substr(marker + kMarker.size()), 0, false);
    return bytes;
}

Bytes uriBytes(const fs::path& file, const std::string& label, const std::string& uri) {
    return uri.starts_with("data:") ? dataUriBytes(file, label, uri) : externalBytes(file, label, uri);
}

/// Explains why a buffer has no bytes.
std::string missingBytesProblem(const json& raw) {
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"})
        if (raw.contains("extensions") && raw["extensions"].is_object() && raw["extensions"].contains(name))
            return std::string("is only present in the compressed form of ") + name +
                   ", which is not supported; export without that";
    return "has no \"uri\" and no binary chunk; export the file again with its buffers";
}

/// Reads the used buffers into virtual files, and replaces their URIs in `checked` by the names of these.
void resolveBuffers(const GltfContainer& container, const LoadedGltf& loaded, json& checked, VirtualFiles& files) {
    const fs::path& file = loaded.file;
    for (std::size_t i = 0; i < checked["buffers"].size(); ++i) {
        json& buffer = checked["buffers"][i];
        const auto length = buffer["byteLength"].get<std::size_t>();
        if (!loaded.uses("buffers", i)) {
            buffer["uri"] = kUnused;
            continue;
        }
        const std::string label = labelOf(checked, "buffers", "buffer", i);
        Bytes bytes;
        if (buffer.contains("uri"))
            bytes = uriBytes(file, label, buffer["uri"].get_ref<const std::string&>());
        else if (i == 0 && container.binary)
            bytes.assign(container.bin.begin(), container.bin.end());
        else
            failIn(file, label, missingBytesProblem(loaded.document["buffers"][i]));
        if (bytes.size() < length)
            failIn(file, label,
                   "needs " + std::to_string(length) + " bytes but only " + std::to_string(bytes.size()) +
                       " are present; the data is truncated, so copy or export it again");
        bytes.resize(length);  // padding after the end is allowed
        const std::string name = "buffer" + std::to_string(i);
        buffer["uri"] = name;
        files[name] = std::move(bytes);
    }
}

/// Reads the used images that are in files or data URIs into virtual files. Unused images refer to a dummy file.
void resolveImages(const LoadedGltf& loaded, json& checked, VirtualFiles& files) {
    const fs::path& file = loaded.file;
    for (std::size_t i = 0; i < checked["images"].size(); ++i) {
        json& image = checked["images"][i];
        if (!loaded.uses("images", i)) {
            image["uri"] = kUnused;
            continue;
        }
        const std::string label = labelOf(checked, "images", "image", i);
        if (image.contains("uri") == image.contains("bufferView"))
            failIn(file, label, "must have either \"uri\" or \"bufferView\"; export the file again");
        if (!image.contains("uri")) continue;
        Bytes bytes = uriBytes(file, label, image["uri"].get_ref<const std::string&>());
        if (bytes.empty()) failIn(file, label, "is empty; export the image again");
        const std::string name = "image" + std::to_string(i);
        image["uri"] = name;
        files[name] = std::move(bytes);
    }
}

/// Removes channels without a node, which glTF allows but tinygltf does not.
void removeChannelsWithoutNode(json& checked, Warnings& warnings) {
    for (std::size_t i = 0; i < checked["animations"].size(); ++i) {
        json kept = json::array();
        for (json& channel : checked["animations"][i]["channels"])
            if (channel["target"].contains("node"))
                kept.push_back(std::move(channel));
            else
                warnings.add(labelOf(checked, "animations", "animation", i),
                             "has channels without a target node; they are ignored");
        checked["animations"][i]["channels"] = std::move(kept);
    }
}

struct ImageLoading {
    const LoadedGltf& loaded;
    std::string problem = {};
};

bool decodeImage(tinygltf::Image* image, int index, std::string* error, std::string* warning, int, int,
                 const unsigned char* bytes, int size, void* userData) {
    ImageLoading& loading = *static_cast<ImageLoading*>(userData);
    if (!loading.loaded.uses("images", static_cast<std::size_t>(index))) return true;
    int width = 0, height = 0, channels = 0;
    if (!stbi_info_from_memory(bytes, size, &width, &height, &channels))
        loading.problem = "is neither PNG nor JPEG; export the image again";
    else if (width > kLargestImageSide || height > kLargestImageSide)
        loading.problem = "is larger than 16384 pixels per side; scale it down";
    else if (!tinygltf::LoadImageData(image, index, error, warning, 0, 0, bytes, size, nullptr))
        loading.problem = "cannot be decoded; export the image again";
    if (loading.problem.empty()) return true;
    loading.problem = objectLabel("image", static_cast<std::size_t>(index), image->name) + ": " + loading.problem;
    return false;
}

tinygltf::FsCallbacks virtualFileCallbacks(VirtualFiles& files) {
    tinygltf::FsCallbacks callbacks{};
    callbacks.user_data = &files;
    callbacks.FileExists = [](const std::string& name, void* data) {
        return static_cast<VirtualFiles*>(data)->contains(name);
    };
    callbacks.ExpandFilePath = [](const std::string& name, void*) { return name; };
    callbacks.ReadWholeFile = [](Bytes* out, std::string*, const std::string& name, void* data) {
        Bytes& bytes = static_cast<VirtualFiles*>(data)->find(name)->second;
        if (name == kUnused)
            *out = bytes;
        else
            *out = std::move(bytes);
        return true;
    };
    callbacks.WriteWholeFile = [](std::string*, const std::string&, const Bytes&, void*) { return false; };
    return callbacks;
}

}  // namespace

LoadedGltf loadGltf(const fs::path& file, int scene, Warnings& warnings) {
    const GltfContainer container = readContainer(file);
    LoadedGltf loaded{file, parseJson(file, container.json), {}, 0, {}};
    CheckedGltf checked = checkGltf(file, loaded.document, scene, warnings);
    loaded.scene = checked.scene;
    loaded.used = std::move(checked.used);
    VirtualFiles files;
    files[std::string(kUnused)] = {0};
    resolveBuffers(container, loaded, checked.document, files);
    resolveImages(loaded, checked.document, files);
    removeChannelsWithoutNode(checked.document, warnings);

    tinygltf::TinyGLTF loader;
    ImageLoading loading{loaded};
    loader.SetFsCallbacks(virtualFileCallbacks(files));
    loader.SetImageLoader(decodeImage, &loading);
    const std::string text = checked.document.dump();
    std::string error, warning;
    if (!loader.LoadASCIIFromString(&loaded.model, &error, &warning, text.data(), static_cast<unsigned>(text.size()),
                                    "")) {
        if (!loading.problem.empty()) failIn(file, "", loading.problem);
        failIn(file, "", "is rejected by the glTF parser (" + printable(error) + "); export it again");
    }
    return loaded;
}

std::vector<fs::path> externalFiles(const fs::path& file) {
    const json document = parseJson(file, readContainer(file).json);
    std::vector<fs::path> found;
    for (const char* array : {"buffers", "images"}) {
        if (!document.is_object() || !document.contains(array) || !document[array].is_array()) continue;
        for (const json& entry : document[array]) {
            if (!entry.is_object() || !entry.contains("uri") || !entry["uri"].is_string()) continue;
            const std::string name = percentDecoded(entry["uri"].get_ref<const std::string&>());
            const fs::path relative = fs::path(name).lexically_normal();
            std::error_code error;
            if (!hasScheme(name) && leavesNoFolder(relative) &&
                fs::is_regular_file(file.parent_path() / relative, error) &&
                std::find(found.begin(), found.end(), relative) == found.end())
                found.push_back(relative);
        }
    }
    return found;
}

}  // namespace touchstone::engine
