// Arbitrary bytes as a sphere tree in the text form of the common toolkit; a tree that is read is written and read
// again.
#include <stdexcept>

#include "haptics/builder/sphere_hierarchy.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using fuzz::require;

namespace {

void checkHierarchy(const SphereHierarchy& h) {
    require(!h.nodes.empty() && h.branching >= 1, "there is a root");
    require(h.nodes[0].parent == -1, "the root has no parent");
    int children = 1;
    for (int i = 0; i < static_cast<int>(h.nodes.size()); ++i) {
        const SphereNode& node = h.nodes[i];
        require(node.center.allFinite() && node.radius >= 0, "spheres are finite");
        require(node.children >= 0 && node.children <= h.branching, "no more children than the branching");
        children += node.children;
        for (int k = 0; k < node.children; ++k) {
            const int child = node.firstChild + k;
            require(child > i && child < static_cast<int>(h.nodes.size()), "children follow their parent");
            require(h.nodes[child].parent == i, "children know their parent");
        }
    }
    require(children == static_cast<int>(h.nodes.size()), "every node has one parent");
    for (const Sphere& s : h.leaves()) require(std::isfinite(s.x + s.y + s.z) && s.r >= 0, "leaves are finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFile file(".sph");
    SphereHierarchy read;
    try {
        read = readSph(file.write(data, size));
    } catch (const std::invalid_argument& error) {
        fuzz::requireSentence(error.what());
        require(std::string(error.what()).find(file.path().filename().string()) != std::string::npos, "names the file");
        return 0;
    }
    checkHierarchy(read);
    writeSph(read, file.path());
    const SphereHierarchy again = readSph(file.path());
    require(again.nodes.size() == read.nodes.size() && again.branching == read.branching, "as many come back");
    for (std::size_t i = 0; i < read.nodes.size(); ++i)
        require(again.nodes[i].center == read.nodes[i].center && again.nodes[i].radius == read.nodes[i].radius &&
                    again.nodes[i].parent == read.nodes[i].parent && again.nodes[i].children == read.nodes[i].children,
                "what was written is read");
    return 0;
}
