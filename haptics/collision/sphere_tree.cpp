#include "haptics/collision/sphere_tree.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>

#include "haptics/math/single.hpp"

namespace touchstone {
namespace {

constexpr float kPaddingCoordinate = std::numeric_limits<float>::infinity();

/// A box that contains the spheres when it is grown by `round`, their smallest radius.
struct RoundedBox {
    Vec3 lo, hi;
    float round;
};

RoundedBox roundedBox(std::span<const Sphere> spheres) {
    RoundedBox box{Vec3::Constant(HUGE_VAL), Vec3::Constant(-HUGE_VAL), HUGE_VALF};
    for (const Sphere& s : spheres) box.round = std::min(box.round, s.r);
    for (const Sphere& s : spheres) {
        const double rest = double(s.r) - double(box.round);
        box.lo = box.lo.cwiseMin(s.center() - Vec3::Constant(rest));
        box.hi = box.hi.cwiseMax(s.center() + Vec3::Constant(rest));
    }
    return box;
}

/// The possible normals of a cut: axes, face diagonals and space diagonals of the cube.
std::span<const Vec3> cutDirections() {
    static const std::vector<Vec3> directions = [] {
        std::vector<Vec3> all;
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z)
                    if (x > 0 || (x == 0 && (y > 0 || (y == 0 && z > 0)))) all.push_back(Vec3(x, y, z).normalized());
        return all;
    }();
    return directions;
}

/// A leaf with its coordinate along the direction of a cut.
struct Placed {
    Sphere leaf;
    double place = 0;
};

/// Estimate of what a group of leaves costs a walk: the cube of its extent. It uses the mean of the radii, since the
/// largest radius would hide how compact the group is.
double costOf(std::span<const Placed> leaves) {
    Vec3 lo = Vec3::Constant(HUGE_VAL), hi = -lo;
    double r = 0;
    for (const auto& [leaf, place] : leaves) {
        lo = lo.cwiseMin(leaf.center());
        hi = hi.cwiseMax(leaf.center());
        r += leaf.r;
    }
    return std::pow((hi - lo).norm() / 2 + r / double(2 * leaves.size()), 3);
}

/// Moves the `left` leaves with the lowest coordinates along `direction` to the front. Ties are broken by all
/// coordinates, so that the cut is unique.
void cutAlong(std::span<Placed> leaves, std::size_t left, const Vec3& direction) {
    for (Placed& p : leaves) p.place = direction.dot(p.leaf.center());
    std::nth_element(leaves.begin(), leaves.begin() + std::ptrdiff_t(left), leaves.end(),
                     [](const Placed& a, const Placed& b) {
                         return std::tie(a.place, a.leaf.x, a.leaf.y, a.leaf.z, a.leaf.r) <
                                std::tie(b.place, b.leaf.x, b.leaf.y, b.leaf.z, b.leaf.r);
                     });
}

/// Bisects down to blocks of eight. Each cut is a multiple of the largest 8^k below the count, so every block except
/// the last of its level is full. The cut direction with the lowest cost is taken.
void order(std::span<Placed> leaves) {
    const std::size_t n = leaves.size();
    if (n <= SphereTree::kBranching) return;
    std::size_t block = SphereTree::kBranching;
    while (block * SphereTree::kBranching < n) block *= SphereTree::kBranching;
    const std::size_t left = std::clamp((n / 2 + block / 2) / block * block, block, (n - 1) / block * block);

    const Vec3* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3& direction : cutDirections()) {
        cutAlong(leaves, left, direction);
        const double cost = costOf(leaves.first(left)) + costOf(leaves.subspan(left));
        if (cost < least) {
            least = cost;
            best = &direction;
        }
    }
    cutAlong(leaves, left, *best);
    order(leaves.first(left));
    order(leaves.subspan(left));
}

/// A small sphere that contains the given ones. Badoiu and Clarkson's iteration moves the center toward the farthest
/// sphere and comes within 1/steps of the smallest radius; the exact radius about that center is then rounded up.
Sphere boundingSphere(std::span<const Sphere> spheres) {
    constexpr int kSteps = 64;  // the radius is within 1/64 of the smallest; more steps make the build longer
    const auto reachFrom = [](const Vec3& c, const Sphere& s) { return (s.center() - c).norm() + s.r; };
    Vec3 c = Vec3::Zero();
    for (const Sphere& s : spheres) c += s.center() / double(spheres.size());
    for (int step = 1; step <= kSteps; ++step) {
        const Sphere& farthest =
            *std::max_element(spheres.begin(), spheres.end(),
                              [&](const Sphere& a, const Sphere& b) { return reachFrom(c, a) < reachFrom(c, b); });
        const double distance = (farthest.center() - c).norm();
        if (distance == 0) break;
        // Move toward the farthest point of that sphere, which lies its radius beyond its center.
        c += (farthest.center() - c) * ((distance + farthest.r) / distance / (step + 1));
    }
    Sphere bound{toSingle(c.x()), toSingle(c.y()), toSingle(c.z()), 0};
    double r = 0;
    for (const Sphere& s : spheres) r = std::max(r, reachFrom(bound.center(), s));
    bound.r = toSingleUp(r);
    return bound;
}

TreeLevel makeLevel(std::span<const Sphere> leaves, std::size_t blockSize) {
    TreeLevel level;
    level.count = int((leaves.size() + blockSize - 1) / blockSize);
    const std::size_t padded = std::size_t(paddedToEight(level.count));
    for (auto* v : {&level.x, &level.y, &level.z, &level.lo[0], &level.lo[1], &level.lo[2], &level.hi[0], &level.hi[1],
                    &level.hi[2]})
        v->assign(padded, kPaddingCoordinate);
    level.r.assign(padded, 0);
    level.round.assign(padded, 0);

    for (std::size_t b = 0; b < std::size_t(level.count); ++b) {
        const auto block = leaves.subspan(b * blockSize, std::min(blockSize, leaves.size() - b * blockSize));
        const Sphere bound = blockSize == 1 ? block.front() : boundingSphere(block);
        level.x[b] = bound.x;
        level.y[b] = bound.y;
        level.z[b] = bound.z;
        level.r[b] = bound.r;
        const RoundedBox box = roundedBox(block);
        level.round[b] = box.round;
        for (int k = 0; k < 3; ++k) {
            level.lo[k][b] = -toSingleUp(-box.lo[k]);
            level.hi[k][b] = toSingleUp(box.hi[k]);
        }
    }
    return level;
}

}  // namespace

SphereTree makeSphereTree(std::vector<Sphere> leaves, TreeCertificate certificate, LeafOrder given) {
    assert(!leaves.empty());
    if (given == LeafOrder::Compact) {
        std::vector<Placed> placed;
        for (const Sphere& leaf : leaves) placed.push_back({leaf});
        order(placed);
        for (std::size_t i = 0; i < leaves.size(); ++i) leaves[i] = placed[i].leaf;
    }
    SphereTree tree;
    tree.certificate = std::move(certificate);
    std::size_t blockSize = 1;
    tree.levels.push_back(makeLevel(leaves, blockSize));
    do {
        blockSize *= SphereTree::kBranching;
        tree.levels.push_back(makeLevel(leaves, blockSize));
    } while (tree.levels.back().count > 1);
    return tree;
}

Sphere SphereTree::block(int level, int i) const {
    const TreeLevel& l = levels[level];
    return {l.x[i], l.y[i], l.z[i], l.r[i]};
}

Sphere SphereTree::leaf(int i) const { return block(0, i); }

int SphereTree::nodeCount() const {
    int n = 0;
    for (const TreeLevel& level : levels) n += level.count;
    return n;
}

Vec3 SphereTree::center() const { return block(int(levels.size()) - 1, 0).center(); }

double SphereTree::reach() const {
    double reach = 0;
    for (int i = 0; i < leafCount(); ++i) reach = std::max(reach, (leaf(i).center() - center()).norm());
    return reach;
}

}  // namespace touchstone
