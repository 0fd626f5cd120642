#pragma once
// Selects few balls that cover all samples, and then moves them to better places.
#include <span>

#include "haptics/builder/cover_certificate.hpp"

namespace touchstone {

/// Points in a box tree, for range queries.
class PointIndex {
  public:
    explicit PointIndex(const std::vector<Vec3>& points);

    /// Calls visit(index, distance) for the points within `radius` of `center`.
    template <class Visit>
    void within(const Vec3& center, double radius, Visit&& visit) const;

  private:
    BoxTree tree_;
    /// Coordinates in the tree's order, with four more entries at the end for the SIMD steps.
    std::array<std::vector<double>, 3> at_;
};

/// Balls that grow by law(depth, growth).
struct Cover {
    std::vector<Ball> balls;
    double growth = 0;
    bool proven = false;  ///< it is proven that they cover the surface
};

/// Length of a piece at which the proof of a cover stops halving.
inline double proofResolution(double growth) { return 0.15 * growth; }

/// Finds balls that cover a surface when they grow by the law of the certificate. Lengths in the frame of RepairedMesh.
class CoverSearch {
  public:
    /// All references must outlive the search. The spacing of `samples` should suit the growths of the calls of
    /// cover().
    CoverSearch(SurfaceSamples samples, const SolidDepth& solid, const CoverCertificate& certificate,
                const Workers& workers);

    /// Covers the samples by a greedy choice among their balls, which grow by the law for `growth`, and then calls
    /// patch().
    Cover cover(double growth, std::size_t maxBalls);

    /// Adds balls where the certificate finds gaps, until there are none and the cover is proven. Ends with an unproven
    /// cover when it has more than `maxBalls` balls, or after ten rounds.
    void patch(Cover& cover, std::size_t maxBalls) const;

    /// Drops balls whose samples are almost all covered by other balls too. The cover is unproven afterwards.
    void dropRedundant(Cover& cover) const;

  private:
    /// For each ball, the samples that it reaches and the growth with which it covers each of them. Stored in blocks,
    /// so that the entries need no reallocation as they grow.
    struct Reach {
        struct Entry {
            int sample;
            float need;
        };
        struct Block {
            std::vector<Entry> entries;
            std::vector<std::uint32_t> start{0};
        };
        static constexpr std::size_t kBlock = 1024;  ///< number of balls in a block
        std::vector<Block> blocks;

        std::span<const Entry> of(std::size_t ball) const {
            const Block& block = blocks[ball / kBlock];
            const std::size_t i = ball % kBlock;
            return {block.entries.data() + block.start[i], block.entries.data() + block.start[i + 1]};
        }
    };

    Reach reachOf(const std::vector<Vec3>& points, const std::vector<Ball>& balls, double growth, double share) const;
    void coverGreedily(const Reach& reach, double growth, double share, std::size_t maxBalls,
                       std::vector<char>& covered, std::vector<Ball>& balls) const;

    SurfaceSamples samples_;
    const SolidDepth& solid_;
    const CoverCertificate& certificate_;
    const Workers& workers_;
    Reach reach_;
    double reachGrowth_ = 0;
};

/// Assigns each piece of the surface to the ball that covers it with the least growth, and drops the balls without
/// pieces. A proven cover stays proven.
CoverCertificate::Proof assignPieces(Cover& cover, const CoverCertificate& certificate, double resolution,
                                     const Workers& workers);

/// Moves each ball so that the pieces that `proof` assigns to it need less growth. A proven cover stays proven.
void relaxBalls(Cover& cover, const CoverCertificate::Proof& proof, const SolidDepth& solid, GrowthLaw law,
                const Workers& workers);

template <class Visit>
void PointIndex::within(const Vec3& center, double radius, Visit&& visit) const {
    const double r2 = radius * radius;
    std::array<int, BoxTree::kStack> stack;
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree_.nodes()[stack[--top]];
        const Eigen::Array4d box = node.squaredDistance(center);
        for (int k = 0; k < 4; ++k) {
            if (!(box[k] <= r2)) continue;
            const int first = node.first[k];
            if (node.count[k] == 0) {
                stack[top++] = first;
                continue;
            }
            Eigen::Array4d d2 = Eigen::Array4d::Zero();
            for (int a = 0; a < 3; ++a)
                d2 += (Eigen::Map<const Eigen::Array4d>(at_[a].data() + first) - center[a]).square();
            d2 = d2.sqrt();
            for (int i = 0; i < node.count[k]; ++i)
                if (d2[i] <= radius) visit(tree_.order()[first + i], d2[i]);
        }
    }
}

}  // namespace touchstone
