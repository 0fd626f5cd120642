#pragma once
// Parallel quadratic programming: the paper's solver, as published and in a robust form.
#include <memory>

#include "haptics/qp/solver.hpp"

namespace touchstone {

/// Multiplicative updates of the dual: min F(y) = ½y'Qy - y'd over y >= 0, Q = J G⁻¹ J', d = -(g + J h), and x = h +
/// G⁻¹J'y.
///
/// Paper form: equations (16)-(19) as printed, from y0 = 0.001 at every call, until |ΔF| < tolerance. Solved says no
/// more than this; the KKT residuals show the true error. It forms Q, so more than 1,024 rows are Invalid, and so is a
/// non-finite answer (one all-zero row is enough to cause it). O(m²) an iteration, bounded by
/// rows² x iterations <= workLimit.
///
/// Robust form: O(m) an iteration without Q, damped and extrapolated, with a warm start by contact identity, until
/// max_i |min(y_i, s_i/q_i)| < tolerance, bounded by rows x iterations <= workLimit. Rows without direction are
/// dropped; if such a row has g < 0, the status is Elastic as in the exact solver. Rows that contradict each other end
/// in IterationLimit, with forces that grow without bound. Multipliers list every kept row, since all y are positive.
/// Shapes: up to `capacity` rows; more are Invalid. Real time: as Solver. Source: Yu, Wang and Zhang, equations
/// (16)-(19); Brand and Chen, IEEE MERL TR2011-056.
std::unique_ptr<Solver> makePqp(int capacity);

}  // namespace touchstone
