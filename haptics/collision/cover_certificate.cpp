#include "haptics/collision/cover_certificate.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone {
namespace {

std::vector<Box> boxesOf(const std::vector<Triangle>& triangles) {
    std::vector<Box> boxes(triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i)
        for (const Vec3& v : triangles[i]) boxes[i].add(v);
    return boxes;
}

constexpr int kDeepest = 60;  // halvings of one triangle; beyond that its corners coincide

}  // namespace

/// One descent: tree node, triangle, piece, each with the balls that may touch it, listed behind its parent's list.
class CoverCertificate::Walk {
  public:
    Walk(const CoverCertificate& c, std::span<const Ball> balls, double growth, double resolution,
         const Heartbeat& heartbeat)
        : c_(c), balls_(balls), growth_(growth), resolution_(resolution), heartbeat_(heartbeat) {}

    bool raise = false;     ///< grow instead of reporting gaps
    std::size_t limit = 0;  ///< of gaps
    std::vector<Gap> gaps;
    Proof proof;  ///< filled when raising

    void run() {
        near_.resize(balls_.size());
        for (std::size_t i = 0; i < balls_.size(); ++i) near_[i] = static_cast<int>(i);
        // What is listed for a box must stay complete while the growth rises a little below it.
        visitNode(0, 0, near_.size());
    }
    double growth() const { return growth_; }

  private:
    bool full() const { return !raise && gaps.size() >= limit; }

    // Appends those of [first, last) that touch the box, and returns where the new list ends.
    std::size_t narrow(const Box& box, std::size_t first, std::size_t last) {
        near_.resize(last);
        const double margin = raise ? 1.5 * growth_ : growth_;
        for (std::size_t i = first; i < last; ++i) {
            const Ball& b = balls_[near_[i]];
            const Vec3 off = (box.lo - b.center).cwiseMax(b.center - box.hi).cwiseMax(0.0);
            const double r = b.depth + margin;
            if (r >= 0 && off.squaredNorm() <= r * r) near_.push_back(near_[i]);
        }
        return near_.size();
    }

    void visitNode(int n, std::size_t first, std::size_t last) {
        const BoxTree::Node& node = c_.tree_.nodes()[n];
        for (int k = 0; k < 4 && !full(); ++k) {
            if (node.count[k] < 0) continue;
            Box box;
            for (int a = 0; a < 3; ++a) {
                box.lo[a] = node.lo[a][k];
                box.hi[a] = node.hi[a][k];
            }
            const std::size_t end = narrow(box, first, last);
            if (node.count[k] == 0) {
                visitNode(node.first[k], last, end);
                continue;
            }
            heartbeat_();
            for (int i = 0; i < node.count[k] && !full(); ++i) visitPiece(c_.surface_[node.first[k] + i], last, end, 0);
        }
    }

    void assign(int ball, double least, const Triangle& piece) {
        proof.need[ball] = std::max(proof.need[ball], least);
        proof.pieces.emplace_back(ball, piece);
    }

    double need(int ball, const Vec3& p) const { return (p - balls_[ball].center).norm() - balls_[ball].depth; }

    void visitPiece(const Triangle& t, std::size_t first, std::size_t last, int level) {
        // The ball that covers the piece with the least growth, and the corner that is farthest from being covered.
        double least = HUGE_VAL;
        std::array<double, 3> corner{HUGE_VAL, HUGE_VAL, HUGE_VAL};
        int best = -1;
        for (std::size_t i = first; i < last; ++i) {
            const std::array<double, 3> f{need(near_[i], t[0]), need(near_[i], t[1]), need(near_[i], t[2])};
            for (int k = 0; k < 3; ++k) corner[k] = std::min(corner[k], f[k]);
            const double worst = std::max({f[0], f[1], f[2]});
            if (worst < least) {
                least = worst;
                best = near_[i];
            }
        }
        if (least <= growth_) {
            if (raise) assign(best, least, t);
            return;
        }
        int longest = 0;
        double edge2 = 0;
        for (int k = 0; k < 3; ++k)
            if (const double l2 = (t[(k + 1) % 3] - t[k]).squaredNorm(); l2 > edge2) {
                edge2 = l2;
                longest = k;
            }
        const int bare = static_cast<int>(std::max_element(corner.begin(), corner.end()) - corner.begin());
        const bool small = edge2 <= resolution_ * resolution_ || level >= kDeepest;
        if (raise) {
            if (best < 0) {
                // Nothing near: ask every ball.
                for (int i = 0; i < static_cast<int>(balls_.size()); ++i) {
                    const double worst = std::max({need(i, t[0]), need(i, t[1]), need(i, t[2])});
                    if (worst < least) {
                        least = worst;
                        best = i;
                    }
                }
            }
            growth_ = std::max(growth_, std::min(least, small ? HUGE_VAL : corner[bare]));
            if (small || least <= growth_) {
                growth_ = std::max(growth_, least);
                assign(best, least, t);
                return;
            }
        } else if (small || corner[bare] > growth_) {
            gaps.push_back({t[bare], std::min(std::sqrt(edge2), resolution_)});
            return;
        }
        const Vec3 &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
        const Vec3 m = 0.5 * (a + b);
        for (const Triangle& half : {Triangle{a, m, c}, Triangle{m, b, c}}) {
            if (full()) return;
            Box box;
            for (const Vec3& v : half) box.add(v);
            const std::size_t end = narrow(box, first, last);
            visitPiece(half, last, end, level + 1);
        }
    }

    const CoverCertificate& c_;
    std::span<const Ball> balls_;
    double growth_, resolution_;
    const Heartbeat& heartbeat_;
    std::vector<int> near_;
};

CoverCertificate::CoverCertificate(std::vector<Triangle> surface) : tree_(boxesOf(surface)) {
    for (int i : tree_.order()) surface_.push_back(surface[i]);
}

std::vector<CoverCertificate::Gap> CoverCertificate::gaps(std::span<const Ball> balls, double growth, double resolution,
                                                          std::size_t limit, const Heartbeat& heartbeat) const {
    Walk walk(*this, balls, growth, resolution, heartbeat);
    walk.limit = limit;
    walk.run();
    return std::move(walk.gaps);
}

CoverCertificate::Proof CoverCertificate::prove(std::span<const Ball> balls, double growth, double resolution,
                                                const Heartbeat& heartbeat) const {
    Walk walk(*this, balls, growth, resolution, heartbeat);
    walk.raise = true;
    walk.proof.need.assign(balls.size(), -HUGE_VAL);
    walk.run();
    walk.proof.growth = walk.growth();
    return std::move(walk.proof);
}

}  // namespace touchstone
