#pragma once
// The paper's baseline: a textbook primal active-set method.
#include <memory>

#include "haptics/qp/solver.hpp"

namespace touchstone {

/// Walks from a feasible point along the constraints in a working set, adding the row that blocks a step and dropping one
/// whose multiplier is negative. x = 0 starts it when all g >= 0, together with the last answer's rows that touch there; else
/// a seventh unknown t >= 0 relaxes all rows by t and costs M t (phase 1, "big M"). Where t stays positive the rows contradict
/// each other: Elastic, as in the exact solver, as are rows without direction and g < 0. More than 10 m + 100 steps, or the
/// settings' bound: IterationLimit with the iterate.
/// Accuracy: rows met to 1e-9 in mm times the row's length. Shapes: up to `capacity` rows; more are Invalid. Real time: as
/// Solver; O(m) and a QR of at most 7 x 7 a step.
/// Source: Nocedal and Wright, Numerical Optimization, 2nd ed., algorithm 16.3 and section 16.5.
std::unique_ptr<Solver> makeActiveSet(int capacity);

}  // namespace touchstone
