#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include "haptics/builder/tree_builder.hpp"
#include "haptics/builder/tree_check.hpp"
#include "haptics/builder/tree_file.hpp"
#include "haptics/files/file_lock.hpp"
#include "haptics/math/hash.hpp"

namespace touchstone {
namespace {

// Version of the builder. Increase it when the same mesh and options give a different tree.
constexpr std::uint32_t kBuilderVersion = 8;
// A program that was stopped while it builds keeps others waiting no longer than most trees take.
constexpr std::chrono::minutes kLongestWait{10};

std::string hex(std::uint64_t value) {
    std::string out(16, '0');
    for (std::size_t i = 16; i-- > 0; value >>= 4) out[i] = "0123456789abcdef"[value & 15];
    return out;
}

/// The entry, or nothing. If a damaged entry exists, `remark` receives the reason.
std::optional<SphereTree> load(const std::filesystem::path& file, std::uint64_t key, std::string& remark) {
    std::error_code error;
    if (!std::filesystem::exists(file, error)) return {};
    try {
        TreeFile entry = readTree(file);
        if (entry.key == key) return std::move(entry.tree);
        remark = file.string() + " holds a different tree than its name says, so it is built again";
    } catch (const std::invalid_argument& damage) {
        const std::string sentence = damage.what();
        remark = sentence.substr(0, sentence.find(';')) + ", so it is built again";
    }
    return {};
}

/// Waits while another holds the lock. Throws BuildCancelled.
void wait(FileLock& lock, const BuildProgress& progress) {
    const auto end = std::chrono::steady_clock::now() + kLongestWait;
    while (!lock.tryLock() && std::chrono::steady_clock::now() < end) {
        if (progress && !progress({0, -1})) throw BuildCancelled{};
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
}

}  // namespace

std::uint64_t treeKey(const TriangleMesh& mesh, const TreeOptions& options) {
    Hash hash;
    hash.add(kBuilderVersion).add(mesh.grid).add(mesh.vertices.size());
    for (const Vec3& v : mesh.vertices) hash.add(v.data(), 3 * sizeof(double));
    for (const auto& t : mesh.triangles) hash.add(t);
    return hash.add(options.maxError > 0 ? 0 : options.leaves)
        .add(options.maxError)
        .add(options.quality)
        .add(options.interior)
        .add(options.seed)
        .value();
}

SphereTree cachedSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const std::filesystem::path& folder,
                            const BuildProgress& progress, CacheReport* report) {
    CacheReport ignored;
    CacheReport& out = report ? *report : ignored;
    out = {};
    const std::uint64_t key = treeKey(mesh, options);
    const std::filesystem::path file = folder / (hex(key) + ".spheres");
    std::optional<FileLock> building;
    std::optional<SphereTree> kept = load(file, key, out.remark);
    if (!kept) {
        building.emplace(folder / (hex(key) + ".lock"));
        wait(*building, progress);
        kept = load(file, key, out.remark);  // another may have built it meanwhile
    }
    if (kept) {
        if (progress && !progress({1, 0})) throw BuildCancelled{};
        return std::move(*kept);
    }
    out.built = true;
    SphereTree tree = buildSphereTree(mesh, options, progress);
    if (const std::string fault = refuteCertificate(tree, mesh); !fault.empty()) {
        out.remark = fault + " The tree is not cached; please report the part.";
        return tree;
    }
    try {
        saveTree(tree, file, key);
    } catch (const std::runtime_error& error) {
        if (out.remark.empty()) out.remark = error.what();
    }
    return tree;
}

}  // namespace touchstone
