#include "haptics/collision/sphere_tree.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>

namespace touchstone {
namespace {

constexpr float kFarAway = 1e15f;

Vec3 centre(const Sphere& s) { return {s.x, s.y, s.z}; }

float roundedUp(double v) {
    const float f = float(v);
    return f >= v ? f : std::nextafter(f, std::numeric_limits<float>::infinity());
}

/// Half the diagonal of the box of the spheres' centres plus the largest radius: a cheap stand-in for the bounding
/// radius.
double looseRadius(std::span<const Sphere> spheres) {
    Vec3 lo = centre(spheres.front()), hi = lo;
    double r = 0;
    for (const Sphere& s : spheres) {
        lo = lo.cwiseMin(centre(s));
        hi = hi.cwiseMax(centre(s));
        r = std::max(r, double(s.r));
    }
    return (hi - lo).norm() / 2 + r;
}

/// The directions a cut may take: axes, face diagonals and space diagonals of the cube.
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

/// Puts the `left` leaves that lie lowest along `direction` in front; ties by all coordinates, so that the cut is
/// unique.
void cutAlong(std::span<Sphere> leaves, std::size_t left, const Vec3& direction) {
    std::nth_element(leaves.begin(), leaves.begin() + std::ptrdiff_t(left), leaves.end(),
                     [&](const Sphere& a, const Sphere& b) {
                         const double u = direction.dot(centre(a)), v = direction.dot(centre(b));
                         if (u != v) return u < v;
                         return std::tie(a.x, a.y, a.z, a.r) < std::tie(b.x, b.y, b.z, b.r);
                     });
}

/// Bisects until blocks of eight are left. Each cut is a multiple of the largest 8^k below the count, so every block
/// but the last of its level is full, and the halves are as small as the best of the directions makes them.
void order(std::span<Sphere> leaves) {
    const std::size_t n = leaves.size();
    if (n <= SphereTree::kBranching) return;
    std::size_t block = SphereTree::kBranching;
    while (block * SphereTree::kBranching < n) block *= SphereTree::kBranching;
    const std::size_t left = std::clamp((n / 2 + block / 2) / block * block, block, (n - 1) / block * block);

    const Vec3* best = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3& direction : cutDirections()) {
        cutAlong(leaves, left, direction);
        const double cost =
            std::pow(looseRadius(leaves.first(left)), 3) + std::pow(looseRadius(leaves.subspan(left)), 3);
        if (cost < least) {
            least = cost;
            best = &direction;
        }
    }
    cutAlong(leaves, left, *best);
    order(leaves.first(left));
    order(leaves.subspan(left));
}

/// A small sphere around all of the given ones: Badoiu and Clarkson's walk towards the farthest, which comes within
/// 1/steps of the least radius, then the exact radius about the centre found, rounded up.
Sphere boundingSphere(std::span<const Sphere> spheres) {
    constexpr int kSteps = 64;
    const auto reachFrom = [](const Vec3& c, const Sphere& s) { return (centre(s) - c).norm() + s.r; };
    Vec3 c = Vec3::Zero();
    for (const Sphere& s : spheres) c += centre(s) / double(spheres.size());
    for (int step = 1; step <= kSteps; ++step) {
        const Sphere& farthest =
            *std::max_element(spheres.begin(), spheres.end(),
                              [&](const Sphere& a, const Sphere& b) { return reachFrom(c, a) < reachFrom(c, b); });
        const double distance = (centre(farthest) - c).norm();
        if (distance == 0) break;
        // Towards the sphere's far point, which lies its radius beyond its centre.
        c += (centre(farthest) - c) * ((distance + farthest.r) / distance / (step + 1));
    }
    Sphere bound{float(c.x()), float(c.y()), float(c.z()), 0};
    double r = 0;
    for (const Sphere& s : spheres) r = std::max(r, reachFrom(centre(bound), s));
    bound.r = roundedUp(r);
    return bound;
}

TreeLevel makeLevel(std::span<const Sphere> leaves, std::size_t blockSize) {
    TreeLevel level;
    level.count = int((leaves.size() + blockSize - 1) / blockSize);
    const std::size_t padded = std::size_t(paddedToEight(level.count));
    for (auto* v : {&level.x, &level.y, &level.z, &level.lo[0], &level.lo[1], &level.lo[2], &level.hi[0], &level.hi[1],
                    &level.hi[2]})
        v->assign(padded, kFarAway);
    level.r.assign(padded, 0);
    level.leafRadius.assign(padded, 0);

    for (std::size_t b = 0; b < std::size_t(level.count); ++b) {
        const auto block = leaves.subspan(b * blockSize, std::min(blockSize, leaves.size() - b * blockSize));
        const Sphere bound = blockSize == 1 ? block.front() : boundingSphere(block);
        level.x[b] = bound.x;
        level.y[b] = bound.y;
        level.z[b] = bound.z;
        level.r[b] = bound.r;
        for (std::size_t i = 0; i < block.size(); ++i) {
            const float c[3] = {block[i].x, block[i].y, block[i].z};
            for (int k = 0; k < 3; ++k) {
                level.lo[k][b] = i ? std::min(level.lo[k][b], c[k]) : c[k];
                level.hi[k][b] = i ? std::max(level.hi[k][b], c[k]) : c[k];
            }
            level.leafRadius[b] = std::max(level.leafRadius[b], block[i].r);
        }
    }
    return level;
}

}  // namespace

SphereTree makeSphereTree(std::vector<Sphere> leaves, TreeCertificate certificate) {
    assert(!leaves.empty());
    order(leaves);
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

Vec3 SphereTree::center() const { return centre(block(int(levels.size()) - 1, 0)); }

double SphereTree::reach() const {
    double reach = 0;
    for (int i = 0; i < leafCount(); ++i) reach = std::max(reach, (centre(leaf(i)) - center()).norm());
    return reach;
}

}  // namespace touchstone
