#pragma once
// Parallel quadratic programming: the paper's solver, as published and as well as it can be done.
#include <memory>

#include "haptics/qp/solver.hpp"

namespace touchstone {

/// Multiplicative updates of the dual: min F(y) = ½y'Qy - y'd over y >= 0, Q = J G⁻¹ J', d = -(g + J h), and x = h +
/// G⁻¹J'y.
///
/// Paper form: equations (16)-(19) as printed, from y0 = 0.001 at every call, until |ΔF| < tolerance (Solved says no
/// more than that; the KKT residuals tell the rest). Forms Q, so more than 1,024 rows are Invalid, as is an answer that
/// is not finite (one all-zero row is enough). O(m²) an iteration; bound: rows² x iterations <= workLimit.
///
/// Robust form: O(m) an iteration without Q, damped and extrapolated, warm by contact identity, until
/// max_i |min(y_i, s_i/q_i)| < tolerance; bound: rows x iterations <= workLimit. Rows without direction are dropped,
/// and with g < 0 make the status Elastic as in the exact solver; contradicting rows end in IterationLimit, their
/// forces growing without bound. Multipliers list every kept row: all y are positive. Shapes: up to `capacity` rows;
/// more are Invalid. Real time: as Solver. Source: Yu, Wang and Zhang, equations (16)-(19); Brand and Chen, IEEE MERL
/// TR2011-056.
std::unique_ptr<Solver> makePqp(int capacity);

}  // namespace touchstone
