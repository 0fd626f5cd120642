#include "haptics/builder/medial_balls.hpp"

#include <algorithm>
#include <atomic>

namespace touchstone {
namespace {

// Maximum slack of a tangent ball, as a share of its radius: with more, a thin part could be lost in the slack.
constexpr double kThinSlack = 0.2;
// Slack of the samples' balls, as a share of the growth.
constexpr double kSlack = 0.15;
// This many cuts count as one sample toward the limit.
constexpr std::uint64_t kCutsASample = 16;
// Factor from one first radius to the next, larger one.
constexpr double kGrow = 3;
// Tolerance of the depth, as a share of the slack. Around the center of a sphere all facets are about equally near, and
// an exact search would visit them all.
constexpr double kDepthTolerance = 0.004;
// Largest radius that is tried; the body's diagonal is below 2 in the frame of RepairedMesh.
constexpr double kLargestRadius = 4;

/// Walks the faces in spatial order, cuts them into pieces and places a sample after each unit of weighted area.
class Sampler {
  public:
    /// Stops when all samplers together have more than `limit` samples. `due` in (0, 1] is the share of a sample that
    /// is due at the start.
    Sampler(const SolidDepth& solid, double protrusion, double spacing, std::size_t limit, GrowthLaw law,
            std::atomic<std::size_t>& total, double due)
        : solid_(solid),
          protrusion_(protrusion),
          spacing_(spacing),
          limit_(limit),
          law_(law),
          total_(total),
          due_(due) {}

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
        const double growth = law_(depth, protrusion_);
        return spacing_ * spacing_ * (2 * growth * depth + growth * growth);
    }

    Ball ballAt(const Vec3& p) const {
        if (role_ == FaceRole::Wall)
            return touchingBall(solid_, p, inward_, kSlack * protrusion_, std::max(last_.depth, protrusion_));
        return {p, solid_.hasWalls() ? std::max(0.0, solid_.depth(p)) : 0.0};
    }

    void cut(const Triangle& t, int level) {
        if (full()) return;
        const Vec3 p = (t[0] + t[1] + t[2]) / 3;
        const auto [longest, edge2] = longestEdge(t);
        // The depth changes at most about as much as the point moves. Measure it again only if that bound does not
        // decide whether to split.
        constexpr double kSplit = 1.5;  // squared longest side beyond which a piece is split, in squared spacings
        bool exact = false;
        const auto measure = [&] {
            last_ = ballAt(p);
            lastPoint_ = p;
            haveBall_ = exact = true;
        };
        const double moved = haveBall_ ? (p - lastPoint_).norm() : HUGE_VAL;
        bool split = edge2 > kSplit * patchSquared(std::max(0.0, last_.depth - moved));
        if (split && !(edge2 > kSplit * patchSquared(last_.depth + moved))) {
            measure();
            split = edge2 > kSplit * patchSquared(last_.depth);
        }
        if (split && level < 40) {
            const Vec3 &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
            const Vec3 m = 0.5 * (a + b);
            // A needle triangle can be cut very often without enough area for a sample, so cuts count toward the limit.
            if (++cuts_ % kCutsASample == 0) total_.fetch_add(1, std::memory_order_relaxed);
            cut({a, m, c}, level + 1);
            cut({m, b, c}, level + 1);
            return;
        }
        const double depth = exact ? last_.depth : std::max(0.0, last_.depth - moved);
        const double area = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm();
        due_ += std::min(1.0, area / patchSquared(depth));
        if (due_ < 1) return;
        due_ -= 1;
        if (!exact) measure();
        out_.points.push_back(p);
        out_.balls.push_back(last_);
        total_.fetch_add(1, std::memory_order_relaxed);
    }

    const SolidDepth& solid_;
    double protrusion_, spacing_;
    std::size_t limit_;
    GrowthLaw law_;
    std::atomic<std::size_t>& total_;
    double due_;
    std::uint64_t cuts_ = 0;
    SurfaceSamples out_;
    Vec3 inward_ = Vec3::Zero(), lastPoint_ = Vec3::Zero();
    FaceRole role_ = FaceRole::Sheet;
    Ball last_;
    bool haveBall_ = false;
};

/// A pseudo-random number in (0, 1] for a seed and an index. Source: SplitMix64 by Steele, Lea and Flood (2014).
double phase(std::uint64_t seed, std::uint64_t index) {
    std::uint64_t z = (seed * 0x100000001b3u + index + 1) * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (static_cast<double>((z ^ (z >> 31)) >> 11) + 1) * 0x1p-53;
}

}  // namespace

Ball touchingBall(const SolidDepth& solid, const Vec3& p, const Vec3& inward, double slack, double guess) {
    // If no wall limits the ball at the first radius, the answer is only a lower bound: continue with a larger one.
    double start = std::clamp(guess, 1e-9, kLargestRadius), radius = 0;
    for (;; start = std::min(kGrow * start, kLargestRadius)) {
        radius = solid.tangentRadius(p, inward, start, slack);
        if (radius < start || start >= kLargestRadius) break;
    }
    if (slack > kThinSlack * radius) {
        slack = kThinSlack * radius;
        radius = solid.tangentRadius(p, inward, radius, slack);
    }
    // In a thin part, with a wall within the slack, only an exact distance shows on which side the center lies.
    const bool thin = solid.wall(p + slack * inward, slack * (1 - 1e-6), 0, 0).triangle >= 0;
    const double tolerance = thin ? 0 : kDepthTolerance * slack;
    for (bool strict = false;; strict = true) {
        const Vec3 c = p + radius * inward;
        const TriangleBvh::Hit hit = solid.wall(c, radius * (1 + 1e-9) + 1e-12, 0, tolerance);
        // If the center is in front of the nearest wall, the slack allowed it to pass through a thin part and to leave
        // it.
        const bool out = hit.triangle >= 0 && hit.front;
        if (!out && radius >= kLargestRadius) return {p, 0};  // the face is folded over, and its ball outside
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
