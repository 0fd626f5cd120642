#include "haptics/builder/sphere_hierarchy.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "haptics/files/output_file.hpp"

namespace touchstone {
namespace {

constexpr int kMaxLevels = 32;           // maximum number of levels in a file
constexpr long kMaxSlots = 1L << 26;     // maximum number of slots in a file
constexpr double kLargestNumber = 1e35;  // mm; leaves are stored in single precision, which ends at 3e38
// Least and greatest number of numbers in a line: x y z r, and what the toolkit appends.
constexpr std::size_t kMinNumbers = 4, kMaxNumbers = 10;

/// Number of slots of a tree, used or unused; kMaxSlots + 1 if there are more than kMaxSlots.
long slotsOf(long levels, long branching) {
    long total = 0, level = 1;
    for (long l = 0; l < levels; ++l) {
        total += level;
        if (total > kMaxSlots || level > kMaxSlots) return kMaxSlots + 1;
        level *= branching;
    }
    return total;
}

/// Reads the lines of a file as numbers. Skips blank lines and comments.
class NumberLines {
  public:
    explicit NumberLines(const std::filesystem::path& file) : name_(file.string()) {
        std::error_code error;
        if (std::filesystem::is_regular_file(file, error)) in_.open(file);
        if (!in_.is_open()) throw std::invalid_argument(name_ + ": the file cannot be read.");
    }

    /// The numbers of the next line; nothing at the end of the file. A line that is not a list of numbers gives an
    /// empty list.
    std::optional<std::vector<double>> next() {
        std::string line;
        while (std::getline(in_, line)) {
            ++at_;
            std::string_view rest = line;
            rest = rest.substr(0, rest.find('#'));
            if (rest.find_first_not_of(kBlank) == rest.npos) continue;
            return numbersOf(rest);
        }
        if (in_.bad()) refuse("the file cannot be read to its end");
        return {};
    }

    [[noreturn]] void refuse(const std::string& why) const {
        throw std::invalid_argument(name_ + ", line " + std::to_string(std::max(1L, at_)) + ": " + why + ".");
    }

  private:
    static constexpr const char* kBlank = " \t\r\v\f";

    static std::vector<double> numbersOf(std::string_view rest) {
        std::vector<double> out;
        for (;;) {
            rest.remove_prefix(std::min(rest.find_first_not_of(kBlank), rest.size()));
            if (rest.empty()) return out;
            std::string_view word = rest.substr(0, rest.find_first_of(kBlank));
            rest.remove_prefix(word.size());
            if (word.front() == '+') word.remove_prefix(1);  // from_chars rejects a plus sign
            double value = 0;
            const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
            if (error != std::errc{} || end != word.data() + word.size() || out.size() == kMaxNumbers) return {};
            out.push_back(value);
        }
    }

    std::string name_;
    std::ifstream in_;
    long at_ = 0;
};

void appendNumber(std::string& out, double value) {
    std::array<char, 32> digits;
    const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
    assert(error == std::errc{});
    out.append(digits.data(), end);
}

}  // namespace

std::vector<Sphere> SphereHierarchy::leaves() const {
    std::vector<Sphere> out;
    for (const SphereNode& node : nodes) {
        if (node.children > 0) continue;
        out.push_back({static_cast<float>(node.center.x()), static_cast<float>(node.center.y()),
                       static_cast<float>(node.center.z()), static_cast<float>(node.radius)});
    }
    // Rounding moves the center, so the radius grows by that distance and by the error in computing it. This needs a
    // separate loop: g++ 12 at -O2 drops the rounding of coordinates that are cast to float and back.
    auto sphere = out.begin();
    for (const SphereNode& node : nodes) {
        if (node.children > 0) continue;
        const double moved = (Vec3(sphere->x, sphere->y, sphere->z) - node.center).norm();
        const double radius = moved > 0 ? (node.radius + moved) * (1 + 1e-15) : node.radius;
        sphere->r = static_cast<float>(radius);
        if (sphere->r < radius) sphere->r = std::nextafter(sphere->r, std::numeric_limits<float>::max());
        ++sphere;
    }
    return out;
}

SphereHierarchy hierarchyOf(const SphereTree& tree) {
    SphereHierarchy out;
    out.branching = SphereTree::kBranching;
    out.nodes.reserve(static_cast<std::size_t>(tree.nodeCount()));
    int above = 0;  // index of the first node of the level above
    for (int level = static_cast<int>(tree.levels.size()) - 1; level >= 0; --level) {
        const int begin = static_cast<int>(out.nodes.size());
        for (int i = 0; i < tree.levels[level].count; ++i) {
            const Sphere s = tree.block(level, i);
            SphereNode node{Vec3(s.x, s.y, s.z), s.r};
            if (begin > 0) {
                node.parent = above + i / SphereTree::kBranching;
                SphereNode& parent = out.nodes[node.parent];
                if (parent.children++ == 0) parent.firstChild = begin + i;
            }
            out.nodes.push_back(node);
        }
        above = begin;
    }
    return out;
}

SphereHierarchy readSph(const std::filesystem::path& file, double mmPerUnit) {
    assert(mmPerUnit > 0);
    NumberLines lines(file);
    const auto header = lines.next();
    const auto isCount = [](double x) { return x >= 1 && x <= kMaxSlots && x == std::floor(x); };
    if (!header || header->size() != 2 || !isCount((*header)[0]) || !isCount((*header)[1]))
        lines.refuse("a sphere tree begins with two whole numbers, its levels and its branching");
    const auto levels = static_cast<long>((*header)[0]), branching = static_cast<long>((*header)[1]);
    const long slots = slotsOf(levels, branching);
    if (levels > kMaxLevels || slots > kMaxSlots)
        lines.refuse("a tree of " + std::to_string(levels) + " levels and branching " + std::to_string(branching) +
                     " has more spheres than can be read");

    // Memory grows with the lines that were read, not with the counts in the header, so a wrong header does no harm.
    SphereHierarchy out;
    out.branching = static_cast<int>(branching);
    std::vector<int> above{-1}, here;  // node of each slot of a level; -1 for an unused slot
    long levelSlots = 1, read = 0;
    for (long level = 0; level < levels; ++level, levelSlots *= branching) {
        for (long slot = 0; slot < levelSlots; ++slot, ++read) {
            const auto line = lines.next();
            if (!line)
                lines.refuse("the file ends after " + std::to_string(read) + " of the " + std::to_string(slots) +
                             " spheres that its first line announces");
            if (line->size() < kMinNumbers) lines.refuse("a sphere needs the numbers x y z radius");
            const double radius = (*line)[3] * mmPerUnit;
            const Vec3 center = Vec3((*line)[0], (*line)[1], (*line)[2]) * mmPerUnit;
            if (!(std::abs(radius) <= kLargestNumber && (center.array().abs() <= kLargestNumber).all()))
                lines.refuse("a number is not finite or too large");
            here.push_back(-1);
            if (radius < 0) continue;
            SphereNode node{center, radius};
            if (level > 0) {
                node.parent = above[slot / branching];
                if (node.parent < 0) lines.refuse("the parent of this sphere is an unused slot");
                SphereNode& parent = out.nodes[node.parent];
                if (parent.children++ == 0) parent.firstChild = static_cast<int>(out.nodes.size());
            }
            here.back() = static_cast<int>(out.nodes.size());
            out.nodes.push_back(node);
        }
        if (out.nodes.empty()) lines.refuse("the root is unused, so the tree has no sphere");
        above.swap(here);
        here.clear();
    }
    // The toolkit writes its options and statistics after the spheres, as text.
    if (const auto line = lines.next(); line && line->size() >= kMinNumbers)
        lines.refuse("there are more spheres than the " + std::to_string(slots) + " that the first line announces");
    return out;
}

void writeSph(const SphereHierarchy& hierarchy, const std::filesystem::path& file, double mmPerUnit) {
    assert(mmPerUnit > 0 && !hierarchy.nodes.empty() && hierarchy.branching >= 1);
    const auto& nodes = hierarchy.nodes;
    long levels = 1;
    std::vector<int> level(nodes.size(), 1);
    for (std::size_t i = 1; i < nodes.size(); ++i)
        levels = std::max<long>(levels, level[i] = level[static_cast<std::size_t>(nodes[i].parent)] + 1);
    if (levels > kMaxLevels || slotsOf(levels, hierarchy.branching) > kMaxSlots)
        throw std::runtime_error("cannot write the sphere tree to '" + file.string() +
                                 "': it is too deep for a file that lists every slot");

    std::string text = std::to_string(levels) + " " + std::to_string(hierarchy.branching) + "\n";
    std::vector<int> slots{0}, below;
    for (long l = 0; l < levels; ++l) {
        below.clear();
        for (const int slot : slots) {
            const int children = slot < 0 ? 0 : nodes[slot].children;
            assert(children <= hierarchy.branching);
            for (int k = 0; k < hierarchy.branching && l + 1 < levels; ++k)
                below.push_back(k < children ? nodes[slot].firstChild + k : -1);
            if (slot < 0) {
                text += "0 0 0 -1 0\n";
                continue;
            }
            assert(nodes[slot].radius >= 0);
            for (const double x :
                 {nodes[slot].center.x(), nodes[slot].center.y(), nodes[slot].center.z(), nodes[slot].radius}) {
                appendNumber(text, x / mmPerUnit);
                text += ' ';
            }
            text += "1\n";
        }
        slots.swap(below);
    }

    writeFile(file, "the sphere tree", text);
}

}  // namespace touchstone
