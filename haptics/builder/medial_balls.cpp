#include "haptics/builder/medial_balls.hpp"

#include <algorithm>
#include <atomic>

namespace touchstone {
namespace {

constexpr double kThinSlack = 0.2;  // of the radius: a thin part must not be lost in the slack
constexpr double kSlack = 0.15;     // of the growth
constexpr std::uint64_t kCutsASample = 16;
constexpr double kGrow = 3;
constexpr double kDepthSlack = 0.004;  // of the slack: around a sphere's centre all of its facets are about as near
constexpr double kLargestRadius = 4;   // the body's diagonal is below 2

/// Walks the faces in an order that stays near, cuts them into pieces, and takes every so many pieces one sample.
class Sampler {
  public:
    /// Stops when all samplers together have more than `limit`. `owed` in (0, 1] of a sample to begin with.
    Sampler(const SolidDepth& solid, double protrusion, double spacing, std::size_t limit, GrowthLaw law,
            std::atomic<std::size_t>& total, double owed)
        : solid_(solid), e_(protrusion), k_(spacing), limit_(limit), law_(law), total_(total), owed_(owed) {}

    void add(const Face& face) {
        const Vec3 normal = (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]);
        inward_ = -normal.normalized();
        haveBall_ = haveBall_ && role_ == face.role;
        role_ = face.role;
        cut(face.corners, 0);
    }
    SurfaceSamples take() { return std::move(out_); }
    bool full() const { return total_.load(std::memory_order_relaxed) > limit_; }

  private:
    double patchSquared(double depth) const {
        const double growth = law_(depth, e_);
        return k_ * k_ * (2 * growth * depth + growth * growth);
    }

    Ball ballAt(const Vec3& p) const {
        if (role_ == FaceRole::Wall) return touchingBall(solid_, p, inward_, kSlack * e_, std::max(last_.depth, e_));
        return {p, solid_.hasWalls() ? std::max(0.0, solid_.depth(p)) : 0.0};
    }

    void cut(const Triangle& t, int level) {
        if (full()) return;
        const Vec3 p = (t[0] + t[1] + t[2]) / 3;
        const auto [longest, edge2] = longestEdge(t);
        // Depth changes about as fast as the point moves: measure it again only where that leaves the answer open.
        constexpr double kSplit = 1.5;
        bool exact = false;
        const auto settle = [&] {
            last_ = ballAt(p);
            lastPoint_ = p;
            haveBall_ = exact = true;
        };
        const double moved = haveBall_ ? (p - lastPoint_).norm() : HUGE_VAL;
        bool split = edge2 > kSplit * patchSquared(std::max(0.0, last_.depth - moved));
        if (split && !(edge2 > kSplit * patchSquared(last_.depth + moved))) {
            settle();
            split = edge2 > kSplit * patchSquared(last_.depth);
        }
        if (split && level < 40) {
            const Vec3 &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
            const Vec3 m = 0.5 * (a + b);
            // Needles can be cut for ever without an area that gives a sample: cuts count, too.
            if (++cuts_ % kCutsASample == 0) total_.fetch_add(1, std::memory_order_relaxed);
            cut({a, m, c}, level + 1);
            cut({m, b, c}, level + 1);
            return;
        }
        const double depth = exact ? last_.depth : std::max(0.0, last_.depth - moved);
        const double area = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
        owed_ += std::min(1.0, area / patchSquared(depth));
        if (owed_ < 1) return;
        owed_ -= 1;
        if (!exact) settle();
        out_.points.push_back(p);
        out_.balls.push_back(last_);
        total_.fetch_add(1, std::memory_order_relaxed);
    }

    const SolidDepth& solid_;
    double e_, k_;
    std::size_t limit_;
    GrowthLaw law_;
    std::atomic<std::size_t>& total_;
    double owed_;
    std::uint64_t cuts_ = 0;
    SurfaceSamples out_;
    Vec3 inward_ = Vec3::Zero(), lastPoint_ = Vec3::Zero();
    FaceRole role_ = FaceRole::Sheet;
    Ball last_;
    bool haveBall_ = false;
};

/// A number in (0, 1] for a seed and a place. Source: Steele, Lea and Flood's SplitMix64 (2014).
double phase(std::uint64_t seed, std::uint64_t place) {
    std::uint64_t z = (seed * 0x100000001b3u + place + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (static_cast<double>((z ^ (z >> 31)) >> 11) + 1) * 0x1p-53;
}

}  // namespace

Ball touchingBall(const SolidDepth& solid, const Vec3& p, const Vec3& inward, double slack, double guess) {
    // A first radius that turns out too small to be hindered says little: go on from a larger one.
    double start = std::clamp(guess, 1e-9, kLargestRadius), radius = 0;
    for (;; start = std::min(kGrow * start, kLargestRadius)) {
        radius = solid.tangentRadius(p, inward, start, slack);
        if (radius < start || start >= kLargestRadius) break;
    }
    if (slack > kThinSlack * radius) {
        slack = kThinSlack * radius;
        radius = solid.tangentRadius(p, inward, radius, slack);
    }
    // Only an exact answer tells on which side of a thin part the centre lies. Is there a wall within the slack?
    const bool thin = solid.wall(p + slack * inward, slack * (1 - 1e-6), 0, 0).triangle >= 0;
    const double tolerance = thin ? 0 : kDepthSlack * slack;
    for (bool strict = false;; strict = true) {
        const Vec3 c = p + radius * inward;
        const TriangleBvh::Hit hit = solid.wall(c, radius * (1 + 1e-9) + 1e-12, 0, tolerance);
        // In front of the nearest wall: the slack let it through a thin part and out of its other side.
        const bool out = hit.triangle >= 0 && hit.front;
        if (!out) return {c, std::max(0.0, std::min(hit.distance, radius) - tolerance)};
        if (strict) return {p, 0};
        radius = solid.tangentRadius(p, inward, radius, 0);
    }
}

SurfaceSamples sampleSurface(const RepairedMesh& mesh, const SolidDepth& solid, double protrusion, double spacing,
                             std::size_t limit, GrowthLaw law, std::uint64_t seed, const Workers& workers) {
    std::vector<Box> boxes;
    std::vector<const Face*> faces;
    for (const Face& f : mesh.faces) {
        if (f.role == FaceRole::Cap) continue;
        faces.push_back(&f);
        boxes.emplace_back();
        for (const Vec3& v : f.corners) boxes.back().add(v);
    }
    const BoxTree tree(boxes);
    const std::size_t grain = std::clamp<std::size_t>(faces.size() / 128, 1, 512);
    for (double k = spacing;; k *= 1.5) {
        std::vector<SurfaceSamples> parts((faces.size() + grain - 1) / grain);
        std::atomic<std::size_t> total{0};
        workers.eachRange(faces.size(), grain, [&](std::size_t first, std::size_t last) {
            Sampler sampler(solid, protrusion, k, limit, law, total, phase(seed, first));
            for (std::size_t i = first; i < last && !sampler.full(); ++i) sampler.add(*faces[tree.order()[i]]);
            parts[first / grain] = sampler.take();
        });
        if (total > limit) continue;
        SurfaceSamples out;
        for (SurfaceSamples& part : parts) {
            out.points.insert(out.points.end(), part.points.begin(), part.points.end());
            out.balls.insert(out.balls.end(), part.balls.begin(), part.balls.end());
            part = {};
        }
        return out;
    }
}

}  // namespace touchstone
