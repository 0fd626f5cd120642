#pragma once
// The exact solver of the tick.
#include <memory>

#include "haptics/qp/solver.hpp"

namespace touchstone {

/// Dual active set for six unknowns. With z = G^½(x-h) and every row scaled to unit length in the metric of G, the
/// problem is to find the point of a polyhedron that is nearest to the origin. The solver keeps the planes of the
/// active rows and their nearest point, and adds the row with the largest violation until no row is violated. At most
/// seven rows are active at a time, so a pivot costs one scan of the rows and a few 7 x 7 products. When Solved, rows
/// of unit length are violated by at most v = 1e-14 (1 + depth of h), so |x - x*|² <= 2 v (sum of forces) in that
/// metric, and far less unless planes nearly coincide. The factor 1e-14 grows to 1e-12 after 100 pivots, and to 1e-10
/// before rows are declared contradictory. Where planes nearly coincide, x and the forces are refined to their last
/// bits with residuals in extended precision before rows are judged by them, so that rounding decides neither which
/// rows push nor which contradict each other. An answer for which the refinement does not converge is not Solved.
///
/// Rows that contradict each other (forces above 1e10 (1 + depth) count as such), or 400 pivots, give Elastic: the
/// exact answer of min ½(x-h)'G(x-h) + ½ w s² s.t. J x + s >= -g, rows scaled to unit length in the metric of G. A row
/// shorter than 1e-15 in that metric is dropped; if its g < 0, nothing can satisfy it, and the answer of the other rows
/// is returned as Elastic. If the settings' limit ends the pivots, the status is IterationLimit with the iterate.
/// Shapes: up to `capacity` rows; more are Invalid. Real time: as Solver; O(m) a pivot. Source: Goldfarb and Idnani,
/// Math. Programming 27 (1983).
std::unique_ptr<Solver> makeDualActiveSet(int capacity);

}  // namespace touchstone
