#include "haptics/builder/tree_file.hpp"

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include "haptics/files/output_file.hpp"
#include "haptics/math/hash.hpp"

namespace touchstone {
namespace {

constexpr char kMagic[8] = {'T', 'S', 'S', 'P', 'H', 'E', 'R', 'E'};
constexpr std::uint32_t kVersion = 3;  // version of the file format

template <class T>
void appendBytes(std::string& out, const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// Reads consecutive values. `ok` becomes false at the first value that is missing.
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

std::string encoded(const SphereTree& tree, std::uint64_t key) {
    const TreeCertificate& c = tree.certificate;
    std::string out;
    appendBytes(out, kMagic);
    appendBytes(out, kVersion);
    appendBytes(out, key);
    appendBytes(out, c.protrusion);
    appendBytes(out, c.diagonal);
    appendBytes(out, c.hollow);
    appendBytes(out, static_cast<std::uint8_t>(c.covered));
    appendBytes(out, static_cast<std::uint8_t>(c.closed));
    appendBytes(out, static_cast<std::uint32_t>(c.note.size()));
    out += c.note;
    appendBytes(out, static_cast<std::uint32_t>(tree.leafCount()));
    for (int i = 0; i < tree.leafCount(); ++i) appendBytes(out, tree.leaf(i));
    appendBytes(out, Hash().add(out.data(), out.size()).value());
    return out;
}

bool isSound(const Sphere& s) {
    return std::isfinite(s.x) && std::isfinite(s.y) && std::isfinite(s.z) && std::isfinite(s.r) && s.r >= 0;
}

/// Decodes a complete file of this version. Throws one sentence about what is wrong otherwise.
TreeFile decoded(const std::string& bytes, const std::string& name) {
    const auto fail = [&](const char* what) { throw std::invalid_argument(name + " " + what); };
    const std::string damaged = "is cut or damaged; build the tree again";
    if (bytes.size() < sizeof kMagic || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
        fail("is not a sphere tree of Touchstone");
    Reader in{bytes, sizeof kMagic};
    if (in.take<std::uint32_t>() != kVersion && in.ok)
        fail("was written by another version of Touchstone; build the tree again");
    if (bytes.size() < sizeof kMagic + sizeof(std::uint64_t)) fail(damaged.c_str());
    const std::size_t body = bytes.size() - sizeof(std::uint64_t);
    if (Reader{bytes, body}.take<std::uint64_t>() != Hash().add(bytes.data(), body).value()) fail(damaged.c_str());

    TreeFile out;
    TreeCertificate certificate;
    out.key = in.take<std::uint64_t>();
    certificate.protrusion = in.take<double>();
    certificate.diagonal = in.take<double>();
    certificate.hollow = in.take<double>();
    certificate.covered = in.take<std::uint8_t>() != 0;
    certificate.closed = in.take<std::uint8_t>() != 0;
    const auto noteSize = in.take<std::uint32_t>();
    if (!in.ok || in.at > body || noteSize > body - in.at) fail(damaged.c_str());
    certificate.note = bytes.substr(in.at, noteSize);
    in.at += noteSize;
    const auto count = in.take<std::uint32_t>();
    if (!in.ok || count == 0 || in.at > body || body - in.at != count * sizeof(Sphere)) fail(damaged.c_str());
    std::vector<Sphere> leaves;
    for (std::uint32_t i = 0; i < count; ++i) {
        leaves.push_back(in.take<Sphere>());
        if (!isSound(leaves.back())) fail(damaged.c_str());
    }
    out.tree = makeSphereTree(std::move(leaves), std::move(certificate), LeafOrder::Given);
    return out;
}

}  // namespace

void saveTree(const SphereTree& tree, const std::filesystem::path& file, std::uint64_t key) {
    std::error_code error;
    if (file.has_parent_path()) std::filesystem::create_directories(file.parent_path(), error);
    writeFile(file, "the sphere tree", encoded(tree, key));
}

TreeFile readTree(const std::filesystem::path& file) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
        throw std::invalid_argument(file.string() + " is not a file; check the path");
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    return decoded(bytes, file.string());
}

}  // namespace touchstone
