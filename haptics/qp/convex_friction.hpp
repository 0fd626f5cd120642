#pragma once
// A baseline for friction: the convex relaxation, which is a quadratic program.
#include <memory>

#include "haptics/qp/friction.hpp"

namespace touchstone {

enum class ConvexMethod {
    DualActiveSet,  ///< exact for the relaxation
    Pqp,            ///< until the tolerance holds, or for 10 million rows x iterations
};

/// Anitescu's relaxation on a pyramid with eight edges d: min ½(x-h)'G(x-h) s.t. s + µ d·u >= 0 for every contact and
/// edge. The multipliers are forces along the edges n + µ d of the pyramid.
///
/// It is not Coulomb's law: a contact that slides hovers at s = µ max(-d·u), about µ|u|, and the normal force grows by
/// what lifts it. Contacts that stick obey the law on the pyramid.
///
/// Status: Approximate when the QP is solved; None with its last iterate otherwise, as for rows that contradict each
/// other. iterations: those of the QP solver. Every solve starts cold, so that the answer depends on nothing but the
/// problem; `start` and startForce are ignored. Shapes: up to `capacity` contacts, eight rows each; `tolerance`: of
/// PQP, N, as SolverSettings::tolerance in its robust form. Units: mm, N. Real time: as FrictionSolver. Source:
/// Anitescu, Math. Programming 105 (2006).
std::unique_ptr<FrictionSolver> makeConvexFriction(int capacity, ConvexMethod method, double tolerance = 1e-6);

}  // namespace touchstone
