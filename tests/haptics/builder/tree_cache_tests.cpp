#include <atomic>
#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <thread>

#include "haptics/builder/tree_builder.hpp"
#include "haptics/files/file_lock.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::tree_cache_tests {

using test::TempFolder;

namespace {

namespace fs = std::filesystem;

struct Folder {
    TempFolder folder;
    const fs::path& path = folder.path();

    std::vector<fs::path> files() const {
        std::vector<fs::path> out;
        for (const auto& entry : fs::directory_iterator(path)) out.push_back(entry.path());
        return out;
    }
};

std::string read(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void write(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }

bool same(const SphereTree& a, const SphereTree& b) {
    if (a.leafCount() != b.leafCount() || a.certificate.protrusion != b.certificate.protrusion ||
        a.certificate.covered != b.certificate.covered || a.certificate.closed != b.certificate.closed ||
        a.certificate.note != b.certificate.note || a.certificate.diagonal != b.certificate.diagonal)
        return false;
    for (int i = 0; i < a.leafCount(); ++i) {
        const Sphere x = a.leaf(i), y = b.leaf(i);
        if (std::memcmp(&x, &y, sizeof x) != 0) return false;
    }
    return true;
}

const TriangleMesh kMesh = test::boxMesh(Vec3(10, 20, 30));
const TreeOptions kOptions{.leaves = 16};

/// Whether the tree had to be built: a build reports progress many times, a cached entry once.
std::pair<SphereTree, bool> get(const fs::path& folder) {
    int calls = 0;
    SphereTree tree = cachedSphereTree(kMesh, kOptions, folder, [&](const BuildStatus&) { return ++calls > 0; });
    return {std::move(tree), calls > 1};
}

TEST_CASE("tree cache: the second request reads the tree, with the same bits", "[tree]") {
    const Folder folder;
    const auto [fresh, built] = get(folder.path / "new" / "folders");
    const auto [kept, again] = get(folder.path / "new" / "folders");
    CHECK(built);
    CHECK_FALSE(again);
    CHECK(same(fresh, kept));
}

TEST_CASE("tree cache: an entry with any byte changed is rebuilt and replaced", "[tree]") {
    const Folder folder;
    const SphereTree good = get(folder.path).first;
    REQUIRE(folder.files().size() == 1);
    const fs::path file = folder.files().front();
    const std::string bytes = read(file);
    // Every region: magic, version, key, certificate, note and counts byte by byte, then leaves and checksum in steps.
    for (std::size_t i = 0; i < bytes.size(); i += i < 48 || i + 10 > bytes.size() ? 1 : 29) {
        INFO("byte " << i);
        std::string bad = bytes;
        bad[i] = static_cast<char>(bad[i] ^ 0x40);
        write(file, bad);
        const auto [tree, built] = get(folder.path);
        CHECK(built);
        CHECK(same(tree, good));
        CHECK(read(file) == bytes);
    }
}

TEST_CASE("tree cache: a truncated, lengthened, empty or foreign entry is rebuilt", "[tree]") {
    const Folder folder;
    const SphereTree good = get(folder.path).first;
    const fs::path file = folder.files().front();
    const std::string bytes = read(file);
    for (std::size_t size = 0; size < bytes.size(); size += 37) {
        write(file, bytes.substr(0, size));
        const auto [tree, built] = get(folder.path);
        CHECK(built);
        CHECK(same(tree, good));
    }
    write(file, bytes + "x");
    CHECK(get(folder.path).second);

    // A valid entry, but of another tree.
    cachedSphereTree(kMesh, {.leaves = 8}, folder.path);
    for (const fs::path& other : folder.files())
        if (other != file) write(file, read(other));
    const auto [tree, built] = get(folder.path);
    CHECK(built);
    CHECK(same(tree, good));
}

TEST_CASE("tree cache: without a writable folder trees are built without a cache", "[tree]") {
    const Folder folder;
    write(folder.path / "file", "not a folder");
    for (int i = 0; i < 2; ++i) {
        const auto [tree, built] = get(folder.path / "file" / "below");
        CHECK(built);
        CHECK(tree.certificate.covered);
    }
    // A folder at the path of the entry.
    const fs::path file = [&] {
        get(folder.path / "a");
        return fs::directory_iterator(folder.path / "a")->path().filename();
    }();
    fs::create_directories(folder.path / "b" / file / "full");
    CHECK(get(folder.path / "b").first.certificate.covered);
}

TEST_CASE("tree cache: simultaneous writers leave one valid entry and nothing else", "[tree][thread]") {
    const Folder folder;
    const SphereTree good = get(folder.path / "reference").first;
    const fs::path shared = folder.path / "shared";
    std::vector<std::thread> threads;
    std::vector<char> sound(4, 1);
    for (std::size_t t = 0; t < sound.size(); ++t)
        threads.emplace_back([&, t] {
            for (int i = 0; i < 10; ++i) {
                if (i % 3 == static_cast<int>(t % 3)) {
                    std::error_code ignored;
                    for (const auto& entry : fs::directory_iterator(shared, ignored))
                        if (entry.path().extension() == ".spheres") fs::remove(entry.path(), ignored);
                }
                sound[t] = static_cast<char>(sound[t] && same(cachedSphereTree(kMesh, kOptions, shared), good));
            }
        });
    for (std::thread& t : threads) t.join();
    CHECK(std::all_of(sound.begin(), sound.end(), [](char s) { return s != 0; }));
    get(shared);
    CHECK(std::distance(fs::directory_iterator(shared), fs::directory_iterator()) == 1);
    CHECK_FALSE(get(shared).second);
}

TEST_CASE("tree cache: of several that need the same tree, one builds it and the others wait", "[tree][thread]") {
    const Folder folder;
    std::vector<std::thread> threads;
    std::atomic<int> built{0};
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&] {
            CacheReport report;
            cachedSphereTree(test::blobMesh(10, 60, 40), {.leaves = 64}, folder.path, {}, &report);
            built += report.built;
        });
    for (std::thread& t : threads) t.join();
    CHECK(built == 1);
    CHECK(folder.files().size() == 1);
}

TEST_CASE("tree cache: who waits for another's build can cancel, and builds itself if the other ends without a tree",
          "[tree]") {
    const Folder folder;
    get(folder.path);
    const fs::path entry = folder.files().front();
    fs::remove(entry);
    std::optional<FileLock> other(fs::path(entry).replace_extension(".lock"));
    REQUIRE(other->tryLock());
    int calls = 0;
    CHECK_THROWS_AS(cachedSphereTree(kMesh, kOptions, folder.path, [&](const BuildStatus&) { return ++calls < 3; }),
                    BuildCancelled);
    CHECK(calls == 3);
    calls = 0;
    CacheReport report;
    const auto progress = [&](const BuildStatus&) {
        if (++calls == 2) other.reset();
        return true;
    };
    cachedSphereTree(kMesh, kOptions, folder.path, progress, &report);
    CHECK(report.built);
    CHECK(folder.files() == std::vector{entry});
}

TEST_CASE("tree cache: the key depends on mesh and options", "[tree]") {
    std::set<std::uint64_t> keys{treeKey(kMesh, kOptions)};
    TriangleMesh nudged = kMesh, turned = kMesh, fewer = kMesh;
    nudged.vertices[3].y() = std::nextafter(nudged.vertices[3].y(), 1e9);
    std::swap(turned.triangles[0][0], turned.triangles[0][1]);
    fewer.triangles.pop_back();
    for (const TriangleMesh& m : {nudged, turned, fewer}) keys.insert(treeKey(m, kOptions));
    keys.insert(treeKey(kMesh, {.leaves = 17, .seed = 1}));
    keys.insert(treeKey(kMesh, {.leaves = 16, .seed = 2}));
    CHECK(keys.size() == 6);
    CHECK(treeKey(kMesh, kOptions) == *keys.find(treeKey(test::boxMesh(Vec3(10, 20, 30)), {.leaves = 16})));
}

TEST_CASE("tree cache: cancelling leaves no entry", "[tree]") {
    const Folder folder;
    CHECK_THROWS_AS(cachedSphereTree(kMesh, kOptions, folder.path, [](const BuildStatus&) { return false; }),
                    BuildCancelled);
    CHECK(folder.files().empty());
    get(folder.path);
    CHECK_THROWS_AS(cachedSphereTree(kMesh, kOptions, folder.path, [](const BuildStatus&) { return false; }),
                    BuildCancelled);
}

}  // namespace
}  // namespace touchstone::tree_cache_tests
