#pragma once
// The exact solver of the tick.
#include <memory>

#include "haptics/qp/solver.hpp"

namespace touchstone {

/// Dual active set for six unknowns. With z = G^½(x-h) and every row scaled to unit length in the metric of G, the
/// problem is the point of a polyhedron nearest to the origin; the active rows' planes and their nearest point are
/// kept, and the row violated most is added until none is. At most seven rows are ever active, so a pivot is one scan
/// of the rows and a few 7 x 7 products. When Solved, rows of unit length are violated by at most
/// v = 1e-14 (1 + depth of h), so |x - x*|² <= 2 v (sum of forces) in that metric, and far less unless planes nearly
/// coincide; only after 100 pivots may it be 1e-12, and where rows contradict each other 1e-10 times as much. Where
/// planes nearly coincide, residuals in extended precision bring x and the forces to their last bits before rows are
/// judged by them, so that rounding decides neither what pushes nor what contradicts; an answer that does not settle is
/// not called Solved.
///
/// Contradicting rows (forces above 1e10 (1 + depth) count as such), or 400 pivots: Elastic, the exact answer of min
/// ½(x-h)'G(x-h) + ½ w s² s.t. J x + s >= -g, rows scaled to unit length in the metric of G. A row shorter than 1e-15
/// in that metric is dropped; with g < 0 nothing can meet it, so the others' answer is returned, as Elastic. Pivots
/// bounded by the settings: IterationLimit with the iterate. Shapes: up to `capacity` rows; more are Invalid. Real
/// time: as Solver; O(m) a pivot. Source: Goldfarb and Idnani, Math. Programming 27 (1983).
std::unique_ptr<Solver> makeDualActiveSet(int capacity);

}  // namespace touchstone
