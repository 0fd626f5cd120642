#pragma once
// The paper's baseline: a textbook primal active-set method.
#include <memory>

#include "haptics/qp/solver.hpp"

namespace touchstone {

/// Walks from a feasible point along the constraints in a working set. It adds the row that blocks a step and drops a
/// row whose multiplier is negative. If all g >= 0, the walk starts from x = 0 and holds those rows of the last answer
/// that touch there. Otherwise a seventh unknown t >= 0 relaxes all rows by t and costs M t (phase 1, "big M"). If t
/// stays positive, the rows contradict each other and the status is Elastic, as in the exact solver; it is also Elastic
/// for a row without direction and with g < 0. More than 10 m + 100 steps, or more than the settings allow, give
/// IterationLimit with the iterate. Forces that sum to more than 1e6 N count as a contradiction. Ties at degenerate
/// vertices are broken by moving the planes apart by 1e-9; if the rows found in this way do not solve the problem with
/// the true planes, the status is IterationLimit. Rows of unit length are satisfied to 1e-10 (1 + depth of h).
/// Shapes: up to `capacity` rows; more are Invalid. Real time: as Solver; a step costs O(m) and a few 7 x 7 products.
/// Source: Nocedal and Wright, Numerical Optimization, 2nd ed., algorithm 16.3 and section 16.5.
std::unique_ptr<Solver> makeActiveSet(int capacity);

}  // namespace touchstone
