#pragma once
// Proves that balls cover a surface, piece by piece.
#include <span>
#include <utility>
#include <vector>

#include "haptics/builder/medial_balls.hpp"

namespace touchstone {

/// A surface that balls should cover. A ball is convex, so a piece of a triangle with all corners in one ball is
/// covered. A piece that fails this test is halved at its longest side.
class CoverCertificate {
  public:
    explicit CoverCertificate(std::vector<Triangle> surface, GrowthLaw law = {});

    GrowthLaw law() const { return law_; }

    /// A piece that is not covered, and one of its bare corners. A ball that contains the corner at least `margin`
    /// inside its boundary helps: a ball with a margin of the piece's length covers the whole piece.
    struct Gap {
        Vec3 point;
        double margin;
        Triangle piece;
    };

    /// The pieces that no ball covers, where a ball's radius is depth + law(depth, growth). Pieces are halved down to
    /// the length `resolution`. An empty result proves the cover. The search ends after `limit` gaps.
    std::vector<Gap> gaps(std::span<const Ball> balls, double growth, double resolution, std::size_t limit,
                          const Workers& workers) const;

    /// A piece of the surface, assigned to the ball that covers it with the least growth.
    struct Piece {
        int ball;
        double need;  ///< growth with which the ball covers the piece
        Triangle corners;
    };
    struct Proof {
        double growth = 0;          ///< with it the balls cover the surface; not below the growth given to prove()
        std::vector<double> need;   ///< of each ball, the largest need of its pieces; -HUGE_VAL without pieces
        std::vector<Piece> pieces;  ///< together they make up the surface
    };

    /// Proves the cover, and raises the growth wherever a piece of length `resolution` is not covered. Always succeeds
    /// if there is at least one ball.
    Proof prove(std::span<const Ball> balls, double growth, double resolution, const Workers& workers) const;

  private:
    class Walk;

    GrowthLaw law_;
    std::vector<Triangle> surface_;  ///< in the tree's order
    BoxTree tree_;
    /// Parts of the tree that are visited in parallel, as {node, slot}.
    std::vector<std::pair<int, int>> parts_;
};

}  // namespace touchstone
