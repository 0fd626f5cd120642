#pragma once
// The paper's baseline: a textbook primal active-set method.
#include <memory>

#include "haptics/qp/solver.hpp"

namespace touchstone {

/// Walks from a feasible point along the constraints in a working set, adding the row that blocks a step and dropping
/// one whose multiplier is negative. x = 0 starts it when all g >= 0, together with the last answer's rows that touch
/// there; else a seventh unknown t >= 0 relaxes all rows by t and costs M t (phase 1, "big M"). Where t stays positive
/// the rows contradict each other: Elastic, as in the exact solver, as are rows without direction and g < 0. More than
/// 10 m + 100 steps, or the settings' bound: IterationLimit with the iterate. Forces that sum to more than
/// 1e6 N count as a contradiction. Ties at degenerate vertices are broken by moving the planes apart by 1e-9; where the
/// rows so found do not serve the true planes, IterationLimit. Rows of unit length are met to 1e-10 (1 + depth of h).
/// Shapes: up to `capacity` rows; more are Invalid. Real time: as Solver; O(m) and a few 7 x 7 products a step.
/// Source: Nocedal and Wright, Numerical Optimization, 2nd ed., algorithm 16.3 and section 16.5.
std::unique_ptr<Solver> makeActiveSet(int capacity);

}  // namespace touchstone
