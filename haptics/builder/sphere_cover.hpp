#pragma once
// Which balls: the fewest that cover all samples, then better places for them.
#include <span>

#include "haptics/builder/cover_certificate.hpp"

namespace touchstone {

/// Points in buckets, for range queries.
class PointIndex {
  public:
    explicit PointIndex(const std::vector<Vec3>& points);

    /// Calls visit(index, distance) for the points within `radius` of `center`.
    template <class Visit>
    void within(const Vec3& center, double radius, Visit&& visit) const;

  private:
    BoxTree tree_;
    std::array<std::vector<double>, 3> at_;  ///< in the tree's order, four more at the end
};

/// Balls that grow by law(depth, growth).
struct Cover {
    std::vector<Ball> balls;
    double growth = 0;
    bool proven = false;  ///< they cover the surface
};

/// Where the proofs of a cover stop halving pieces.
inline double proofResolution(double growth) { return 0.15 * growth; }

/// Finds balls that cover a surface where each grows by the same length. Lengths in the frame of RepairedMesh.
class CoverSearch {
  public:
    /// All references must outlive the search. `samples` should be spaced for about the growths that are asked.
    CoverSearch(SurfaceSamples samples, const SolidDepth& solid, const CoverCertificate& certificate,
                const Workers& workers);

    /// Greedy set cover of the samples by their balls, each `growth` beyond its depth, then patch().
    Cover cover(double growth, std::size_t most);

    /// Adds balls where the certificate finds the cover bare, until it finds nothing and the cover is proven. Gives up,
    /// unproven, when there are more than `most`.
    void patch(Cover& cover, std::size_t most) const;

    /// Drops balls that have almost no sample to themselves. The cover is unproven then.
    void dropSpare(Cover& cover) const;

  private:
    /// For each ball the samples that it reaches, and the growth that each asks of it. In blocks, so that it never has
    /// to move as it grows.
    struct Reach {
        struct Entry {
            int sample;
            float need;
        };
        struct Block {
            std::vector<Entry> entries;
            std::vector<std::uint32_t> start{0};
        };
        static constexpr std::size_t kBlock = 1024;  ///< balls
        std::vector<Block> blocks;

        std::span<const Entry> of(std::size_t ball) const {
            const Block& block = blocks[ball / kBlock];
            const std::size_t i = ball % kBlock;
            return {block.entries.data() + block.start[i], block.entries.data() + block.start[i + 1]};
        }
    };

    Reach reachOf(const std::vector<Vec3>& points, const std::vector<Ball>& balls, double growth, double share) const;
    void coverGreedily(const Reach& reach, double growth, double share, std::size_t most, std::vector<char>& covered,
                       std::vector<Ball>& balls) const;

    SurfaceSamples samples_;
    const SolidDepth& solid_;
    const CoverCertificate& certificate_;
    const Workers& workers_;
    Reach reach_;
    double reachGrowth_ = 0;
};

/// Gives each piece of the surface to the ball that covers it with the least growth, and drops the balls without any. A
/// proven cover stays so.
CoverCertificate::Proof dropIdle(Cover& cover, const CoverCertificate& certificate, double resolution,
                                 const Workers& workers);

/// Moves each ball to where the pieces that `proof` gives it ask for least growth. A proven cover stays so.
void settleBalls(Cover& cover, const CoverCertificate::Proof& proof, const SolidDepth& solid, GrowthLaw law,
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
