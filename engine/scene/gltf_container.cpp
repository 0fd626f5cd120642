#include "engine/scene/gltf_container.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/scene/file_kind.hpp"

namespace touchstone::engine {
namespace fs = std::filesystem;
namespace {

constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 31;
constexpr std::size_t kHeader = 12, kChunkHeader = 8;
constexpr std::uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinChunk = 0x004E4942;

std::uint32_t littleEndian(std::span<const std::uint8_t> bytes, std::size_t offset) {
    return bytes[offset] | bytes[offset + 1] << 8 | bytes[offset + 2] << 16 |
           static_cast<std::uint32_t>(bytes[offset + 3]) << 24;
}

void append(std::vector<std::uint8_t>& bytes, std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(word >> shift));
}

void splitChunks(const fs::path& file, GltfContainer& container) {
    const std::span<const std::uint8_t> all(container.bytes);
    const std::string cut = "the file is truncated; copy or export it again";
    if (all.size() < kHeader + kChunkHeader) failIn(file, "header", cut);
    if (const auto version = littleEndian(all, 4); version != 2)
        failIn(file, "header", "has version " + std::to_string(version) + ", not 2; export it as glTF 2.0");
    const std::uint64_t length = littleEndian(all, 8);
    if (length < kHeader + kChunkHeader || length > all.size())
        failIn(
            file, "header",
            "declares " + std::to_string(length) + " bytes but " + std::to_string(all.size()) + " are there; " + cut);
    bool first = true;
    for (std::uint64_t offset = kHeader; offset + kChunkHeader <= length; first = false) {
        const std::uint64_t size = littleEndian(all, offset), start = offset + kChunkHeader;
        const std::uint32_t type = littleEndian(all, offset + 4);
        if (size > length - start)
            failIn(file, first ? "JSON chunk" : "binary chunk", "ends after the end of the file; " + cut);
        const auto contents = all.subspan(start, size);
        if (first != (type == kJsonChunk))
            failIn(file, "header", "does not start with exactly one JSON chunk; export it again");
        if (first) {
            container.json.assign(contents.begin(), contents.end());
            while (!container.json.empty() && container.json.back() == '\0') container.json.pop_back();
            container.followers = all.subspan(start + size, length - start - size);
        } else if (type == kBinChunk && !container.bin.data()) {
            container.bin = contents;
        }
        offset = start + size;
    }
}

/// Nesting depth of braces and brackets outside strings. The parser's callback could count it as well, but takes time
/// quadratic in the number of objects.
int depthOf(const std::string& text) {
    int depth = 0, deepest = 0;
    bool inText = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c == '"')
            inText = !inText;
        else if (inText)
            i += c == '\\' ? 1 : 0;
        else if (c == '{' || c == '[')
            deepest = std::max(deepest, ++depth);
        else if (c == '}' || c == ']')
            --depth;
    }
    return deepest;
}

template <class Json>
Json parse(const fs::path& file, const std::string& text) {
    constexpr int kMaxDepth = 200;
    if (depthOf(text) > kMaxDepth) failIn(file, "JSON", "is nested deeper than 200 levels; flatten it");
    try {
        return Json::parse(text);
    } catch (const nlohmann::json::parse_error& error) {
        const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
        const auto lineStart = std::find(std::make_reverse_iterator(end), text.rend(), '\n').base();
        failIn(file, "JSON",
               "is broken at line " + std::to_string(1 + std::count(text.begin(), end, '\n')) + ", column " +
                   std::to_string(end - lineStart) +
                   "; the file is truncated or was edited incorrectly, so export it again");
    } catch (const nlohmann::json::exception&) {
        failIn(file, "JSON", "holds a number or text that cannot be stored; export it again");
    }
}

}  // namespace

void failIn(const fs::path& file, const std::string& object, const std::string& problem) {
    throw SceneError(escaped(file.string() + ": " + (object.empty() ? "" : object + ": ") + problem));
}

const char* kindOf(fs::file_status status) {
    switch (status.type()) {
        case fs::file_type::directory:
            return "a folder";
        case fs::file_type::fifo:
            return "a pipe";
        case fs::file_type::socket:
            return "a socket";
        case fs::file_type::character:
        case fs::file_type::block:
            return "a device";
        default:
            return "not a regular file";
    }
}

std::vector<std::uint8_t> readBytes(const fs::path& file, const std::string& object) {
    std::error_code error;
    const fs::file_status status = fs::status(file, error);
    if (!fs::exists(status)) failIn(file, object, "the file does not exist; check its name");
    if (!fs::is_regular_file(status)) failIn(file, object, std::string("is ") + kindOf(status) + "; name a file");
    const std::uintmax_t size = fs::file_size(file, error);
    if (error) failIn(file, object, "cannot be read; check its permissions");
    if (size >= kLargestFile) failIn(file, object, "is larger than 2 GiB; split or simplify it");
    std::vector<std::uint8_t> bytes(size);
    std::ifstream stream(file, std::ios::binary);
    if (!stream) failIn(file, object, "cannot be opened; check its permissions");
    if (!stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size)))
        failIn(file, object, "cannot be read to its end; copy it again");
    return bytes;
}

void writeBytes(const fs::path& file, std::span<const std::uint8_t> bytes) {
    std::error_code error;
    const fs::path target = fs::is_symlink(file, error) ? fs::weakly_canonical(file, error) : file;
    // Write to a temporary file in the same folder and rename it when complete. Other targets than regular files (a
    // pipe, /dev/null) can only be written to directly.
    const bool direct = fs::exists(target, error) && !fs::is_regular_file(target, error);
    fs::path aside = target;
    if (!direct) aside += ".part" + std::to_string(::getpid());
    errno = 0;
    std::ofstream stream(aside, std::ios::binary | std::ios::trunc);
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    error.clear();
    if (!stream)
        error.assign(errno ? errno : EIO, std::generic_category());
    else if (!direct)
        fs::rename(aside, target, error);
    if (!error) return;
    std::error_code ignored;
    if (!direct) fs::remove(aside, ignored);
    failIn(file, "",
           "cannot be written (" + error.message() + "); check the folder, its permissions and the free space");
}

GltfContainer readContainer(const fs::path& file) {
    GltfContainer container;
    container.bytes = readBytes(file);
    if (container.bytes.empty()) failIn(file, "", "is empty; export it again");
    container.binary = container.bytes.size() >= 4 && littleEndian(container.bytes, 0) == kGlbMagic;
    if (container.binary)
        splitChunks(file, container);
    else if (const std::string kind = foreignFileProblem(container.bytes); !kind.empty())
        failIn(file, "", kind);
    else
        container.json.assign(container.bytes.begin(), container.bytes.end());
    return container;
}

std::vector<std::uint8_t> glbBytes(std::string json, std::span<const std::uint8_t> followers) {
    json.resize((json.size() + 3) / 4 * 4, ' ');
    std::vector<std::uint8_t> bytes;
    bytes.reserve(kHeader + kChunkHeader + json.size() + followers.size());
    append(bytes, kGlbMagic);
    append(bytes, 2);
    append(bytes, static_cast<std::uint32_t>(kHeader + kChunkHeader + json.size() + followers.size()));
    append(bytes, static_cast<std::uint32_t>(json.size()));
    append(bytes, kJsonChunk);
    bytes.insert(bytes.end(), json.begin(), json.end());
    bytes.insert(bytes.end(), followers.begin(), followers.end());
    return bytes;
}

std::string dataUri(std::span<const std::uint8_t> bytes) {
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text = "data:application/octet-stream;base64,";
    text.reserve(text.size() + (bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t group = 0;
        for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < left ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += k <= left ? kDigits[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

std::vector<std::uint8_t> binChunk(std::vector<std::uint8_t> contents) {
    contents.resize((contents.size() + 3) / 4 * 4, 0);
    std::vector<std::uint8_t> chunk;
    append(chunk, static_cast<std::uint32_t>(contents.size()));
    append(chunk, kBinChunk);
    chunk.insert(chunk.end(), contents.begin(), contents.end());
    return chunk;
}

nlohmann::json parseJson(const fs::path& file, const std::string& text) { return parse<nlohmann::json>(file, text); }

nlohmann::ordered_json parseOrderedJson(const fs::path& file, const std::string& text) {
    return parse<nlohmann::ordered_json>(file, text);
}

}  // namespace touchstone::engine
