#include "haptics/collision/medial_balls.hpp"

#include <algorithm>

namespace touchstone {
namespace {

constexpr int kShrinkSteps = 40;
constexpr double kThinSlack = 0.2;    // of the radius: a thin part must not be lost in the slack
constexpr double kLargestRadius = 4;  // the body's diagonal is below 2

/// Walks the faces in an order that stays near, cuts them into pieces, and takes every so many pieces one sample.
class Sampler {
  public:
    Sampler(const SolidDepth& solid, double protrusion, double spacing, std::size_t limit)
        : solid_(solid), e_(protrusion), k_(spacing), limit_(limit) {}

    void add(const Face& face) {
        const Vec3 normal = (face.corners[1] - face.corners[0]).cross(face.corners[2] - face.corners[0]);
        inward_ = -normal.normalized();
        haveBall_ = haveBall_ && role_ == face.role;
        role_ = face.role;
        cut(face.corners, 0);
    }
    SurfaceSamples take() { return std::move(out_); }
    std::size_t size() const { return out_.points.size(); }

  private:
    double patchSquared(double depth) const { return k_ * k_ * (2 * e_ * depth + e_ * e_); }

    Ball ballAt(const Vec3& p) const {
        if (role_ == FaceRole::Wall) return touchingBall(solid_, p, inward_, e_ / 4, std::max(last_.depth, e_));
        return {p, solid_.hasWalls() ? std::max(0.0, solid_.depth(p)) : 0.0};
    }

    void cut(const Triangle& t, int level) {
        if (out_.points.size() > limit_) return;
        const Vec3 p = (t[0] + t[1] + t[2]) / 3;
        int longest = 0;
        double edge2 = 0;
        for (int k = 0; k < 3; ++k)
            if (const double l2 = (t[(k + 1) % 3] - t[k]).squaredNorm(); l2 > edge2) {
                edge2 = l2;
                longest = k;
            }
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
    }

    const SolidDepth& solid_;
    double e_, k_;
    std::size_t limit_;
    SurfaceSamples out_;
    double owed_ = 1;  // the first piece gives a sample
    Vec3 inward_ = Vec3::Zero(), lastPoint_ = Vec3::Zero();
    FaceRole role_ = FaceRole::Sheet;
    Ball last_;
    bool haveBall_ = false;
};

}  // namespace

Ball touchingBall(const SolidDepth& solid, const Vec3& p, const Vec3& inward, double slack, double guess) {
    double radius = std::clamp(guess, 1e-9, kLargestRadius);
    Ball ball{p, 0};
    // Grow while free, then shrink onto what stands in the way.
    bool growing = true;
    for (int i = 0; i < kShrinkSteps; ++i) {
        const Vec3 c = p + radius * inward;
        const TriangleBvh::Hit hit = solid.wall(c, radius * (1 + 1e-9) + 1e-12);
        const double depth = std::min(hit.distance, radius);
        // In front of the nearest wall: through a thin part and out of its other side.
        const double allowed = hit.triangle >= 0 && hit.front ? 0 : std::min(slack, kThinSlack * radius);
        if (radius - depth <= allowed) {
            ball = {c, depth};
            if (!growing || radius >= kLargestRadius) return ball;
            radius = std::min(2 * radius, kLargestRadius);
            continue;
        }
        growing = false;
        const Vec3 to = hit.point - p;
        const double along = to.dot(inward);
        // |c - q| = r - allowed, solved for r.
        const double next = along > allowed ? (to.squaredNorm() - allowed * allowed) / (2 * (along - allowed)) : 0;
        if (0.98 * radius <= ball.depth) return ball;
        radius = std::clamp(next, ball.depth, 0.98 * radius);
    }
    return ball;
}

SurfaceSamples sampleSurface(const RepairedMesh& mesh, const SolidDepth& solid, double protrusion, double spacing,
                             std::size_t limit, const Heartbeat& heartbeat) {
    std::vector<Box> boxes;
    std::vector<const Face*> faces;
    for (const Face& f : mesh.faces) {
        if (f.role == FaceRole::Cap) continue;
        faces.push_back(&f);
        boxes.emplace_back();
        for (const Vec3& v : f.corners) boxes.back().add(v);
    }
    for (double k = spacing;; k *= 1.5) {
        Sampler sampler(solid, protrusion, k, limit);
        std::size_t done = 0;
        const BoxTree tree(boxes);
        for (int i : tree.order()) {
            if (++done % 256 == 0) heartbeat();
            sampler.add(*faces[i]);
            if (sampler.size() > limit) break;
        }
        if (sampler.size() <= limit) return sampler.take();
    }
}

}  // namespace touchstone
