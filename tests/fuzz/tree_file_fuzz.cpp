// Arbitrary bytes as a tree file. If the first byte is odd, the last eight become the checksum that the reader expects,
// because random bytes would never match it.
#include <stdexcept>
#include <vector>

#include "haptics/builder/tree_file.hpp"
#include "haptics/math/hash.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using fuzz::require;

namespace {

bool sameBits(const SphereTree& a, const SphereTree& b) {
    bool same = a.leafCount() == b.leafCount() && a.certificate.note == b.certificate.note &&
                a.certificate.covered == b.certificate.covered && a.certificate.closed == b.certificate.closed &&
                std::memcmp(&a.certificate.protrusion, &b.certificate.protrusion, sizeof(double)) == 0;
    for (int i = 0; i < a.leafCount() && same; ++i) {
        const Sphere s = a.leaf(i), t = b.leaf(i);
        same = std::memcmp(&s, &t, sizeof s) == 0;
    }
    return same;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    static const fuzz::ScratchFile file(".spheres");
    std::vector<std::uint8_t> bytes(data + 1, data + size);
    if (data[0] % 2 == 1 && bytes.size() >= sizeof(std::uint64_t)) {
        const std::size_t body = bytes.size() - sizeof(std::uint64_t);
        const std::uint64_t sum = Hash().add(bytes.data(), body).value();
        std::memcpy(bytes.data() + body, &sum, sizeof sum);
    }
    TreeFile read;
    try {
        read = readTree(file.write(bytes.data(), bytes.size()));
    } catch (const std::invalid_argument& error) {
        fuzz::requireSentence(error.what());
        return 0;
    }
    require(read.tree.leafCount() >= 1, "a tree has a leaf");
    saveTree(read.tree, file.path(), read.key);
    const TreeFile again = readTree(file.path());
    require(again.key == read.key && sameBits(again.tree, read.tree), "what was written is read");
    return 0;
}
