#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>

#include "haptics/collision/tree_builder.hpp"

namespace touchstone {
namespace {

constexpr char kMagic[8] = {'T', 'S', 'S', 'P', 'H', 'E', 'R', 'E'};
constexpr std::uint32_t kVersion = 1;  // of the file and of the builder: raise it when either changes
constexpr std::uint64_t kHashStart = 0xcbf29ce484222325u;

/// FNV-1a, 64 bits.
std::uint64_t hashed(std::uint64_t hash, const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 0x100000001b3u;
    return hash;
}

template <class T>
void append(std::string& out, const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Reads values one after the other; `ok` falls at the first that is not there.
struct Reader {
    const std::string& bytes;
    std::size_t at = 0;
    bool ok = true;

    template <class T>
    T take() {
        T value{};
        ok = ok && bytes.size() - at >= sizeof value;
        if (ok) {
            std::memcpy(&value, bytes.data() + at, sizeof value);
            at += sizeof value;
        }
        return value;
    }
};

/// What the cache keeps of a tree: the hierarchy follows from the leaves.
struct Entry {
    std::vector<Sphere> leaves;
    TreeCertificate certificate;
};

std::string encoded(const Entry& entry, std::uint64_t key) {
    std::string out;
    append(out, kMagic);
    append(out, kVersion);
    append(out, key);
    append(out, entry.certificate.protrusion);
    append(out, entry.certificate.diagonal);
    append(out, static_cast<std::uint8_t>(entry.certificate.covered));
    append(out, static_cast<std::uint8_t>(entry.certificate.closed));
    append(out, static_cast<std::uint32_t>(entry.certificate.note.size()));
    out += entry.certificate.note;
    append(out, static_cast<std::uint32_t>(entry.leaves.size()));
    for (const Sphere& s : entry.leaves) append(out, s);
    append(out, hashed(kHashStart, out.data(), out.size()));
    return out;
}

std::optional<Entry> decoded(const std::string& bytes, std::uint64_t key) {
    if (bytes.size() < sizeof kMagic + sizeof(std::uint64_t)) return {};
    const std::size_t body = bytes.size() - sizeof(std::uint64_t);
    if (Reader{bytes, body}.take<std::uint64_t>() != hashed(kHashStart, bytes.data(), body)) return {};
    if (std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0) return {};
    Reader in{bytes, sizeof kMagic};
    if (in.take<std::uint32_t>() != kVersion || in.take<std::uint64_t>() != key) return {};
    Entry entry;
    entry.certificate.protrusion = in.take<double>();
    entry.certificate.diagonal = in.take<double>();
    entry.certificate.covered = in.take<std::uint8_t>() != 0;
    entry.certificate.closed = in.take<std::uint8_t>() != 0;
    const auto noteSize = in.take<std::uint32_t>();
    if (!in.ok || noteSize > body - in.at) return {};
    entry.certificate.note = bytes.substr(in.at, noteSize);
    in.at += noteSize;
    const auto count = in.take<std::uint32_t>();
    if (!in.ok || count == 0 || body - in.at != count * sizeof(Sphere)) return {};
    for (std::uint32_t i = 0; i < count; ++i) {
        const auto s = in.take<Sphere>();
        if (!(std::isfinite(s.x) && std::isfinite(s.y) && std::isfinite(s.z) && std::isfinite(s.r) && s.r >= 0))
            return {};
        entry.leaves.push_back(s);
    }
    return entry;
}

std::optional<Entry> load(const std::filesystem::path& file, std::uint64_t key) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return {};
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    return decoded(bytes, key);
}

/// Writes beside the entry under a name of its own, then renames: a reader sees the old entry or the new one, whole.
void store(const std::filesystem::path& file, const std::string& bytes) {
    static std::atomic<unsigned> serial{0};
    std::error_code error;
    std::filesystem::create_directories(file.parent_path(), error);
    std::filesystem::path aside = file;
    aside += "." + std::to_string(::getpid()) + "." + std::to_string(serial++) + ".part";
    bool written = false;
    {
        std::ofstream out(aside, std::ios::binary);
        out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        out.flush();
        written = out.good();
    }
    if (written) std::filesystem::rename(aside, file, error);
    if (!written || error) std::filesystem::remove(aside, error);
}

std::string hex(std::uint64_t value) {
    std::string out(16, '0');
    for (std::size_t i = 16; i-- > 0; value >>= 4) out[i] = "0123456789abcdef"[value & 15];
    return out;
}

}  // namespace

std::uint64_t treeKey(const TriangleMesh& mesh, const TreeOptions& options) {
    const std::uint64_t vertices = mesh.vertices.size();
    std::uint64_t hash = hashed(kHashStart, &vertices, sizeof vertices);
    for (const Vec3& v : mesh.vertices) hash = hashed(hash, v.data(), 3 * sizeof(double));
    for (const auto& t : mesh.triangles) hash = hashed(hash, t.data(), sizeof t);
    hash = hashed(hash, &options.leaves, sizeof options.leaves);
    return hashed(hash, &options.seed, sizeof options.seed);
}

SphereTree cachedSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const std::filesystem::path& folder,
                            const BuildProgress& progress) {
    const std::uint64_t key = treeKey(mesh, options);
    const std::filesystem::path file = folder / (hex(key) + ".spheres");
    std::optional<Entry> entry = load(file, key);
    if (entry) {
        if (progress && !progress(1)) throw BuildCancelled{};
    } else {
        const SphereTree built = buildSphereTree(mesh, options, progress);
        entry.emplace();
        for (int i = 0; i < built.leafCount(); ++i) entry->leaves.push_back(built.leaf(i));
        entry->certificate = built.certificate;
        store(file, encoded(*entry, key));
    }
    // Fresh or kept, the tree is made from the same leaves in the same order, so it has the same bits.
    return makeSphereTree(std::move(entry->leaves), std::move(entry->certificate));
}

}  // namespace touchstone
