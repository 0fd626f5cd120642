#pragma once
// Proof that balls cover a surface, piece by piece.
#include <span>
#include <utility>
#include <vector>

#include "haptics/builder/medial_balls.hpp"

namespace touchstone {

/// Triangles that balls are to cover. A ball is convex: a piece of a triangle with all corners in one ball is covered;
/// a piece that fails is halved along its longest side.
class CoverCertificate {
  public:
    explicit CoverCertificate(std::vector<Triangle> surface, GrowthLaw law = {});

    GrowthLaw law() const { return law_; }

    /// A corner that shows why a piece is not covered. A ball that covers it with `margin` to spare helps: one that is
    /// the piece's length to spare covers the piece.
    struct Gap {
        Vec3 point;
        double margin;
        Triangle piece;
    };

    /// The pieces that no ball covers, its radius depth + law(depth, growth), down to pieces `resolution` long. None
    /// proves the cover. Ends after `limit` gaps.
    std::vector<Gap> gaps(std::span<const Ball> balls, double growth, double resolution, std::size_t limit,
                          const Workers& workers) const;

    /// A proof with the least growth: each piece goes to the ball that covers it with the least.
    struct Piece {
        int ball;
        double need;  ///< growth that the piece asks of the ball
        Triangle corners;
    };
    struct Proof {
        double growth = 0;          ///< with it all is covered; at least the one given
        std::vector<double> need;   ///< of each ball, the most that its pieces ask for; -HUGE_VAL without pieces
        std::vector<Piece> pieces;  ///< together they are the surface
    };

    /// Raises `growth` wherever a piece of length `resolution` fails. Always succeeds if there is a ball.
    Proof prove(std::span<const Ball> balls, double growth, double resolution, const Workers& workers) const;

  private:
    class Walk;

    GrowthLaw law_;
    std::vector<Triangle> surface_;  ///< in the tree's order
    BoxTree tree_;
    /// What is walked apart: slots of nodes, {node, slot}.
    std::vector<std::pair<int, int>> parts_;
};

}  // namespace touchstone
