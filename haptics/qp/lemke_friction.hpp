#pragma once
// A baseline for friction: a linear complementarity problem with a faceted cone, solved by Lemke's method.
#include <memory>

#include "haptics/qp/friction.hpp"

namespace touchstone {

/// Most unknowns of a tableau, facets + 2 for each contact: 24 contacts with 8 facets, 40 with 4. A pivot costs the
/// square of this number, and the tableau takes 0.5 MB.
inline constexpr int kMostLemkeUnknowns = 240;

/// Replaces the friction cone by a pyramid with the unit directions d of `facets` edges. With forces f_n, β and a
/// multiplier λ for each contact, and x = h + G⁻¹ Σ J'(n f_n + Σ d β), it solves
///     0 <= f_n ⟂ s >= 0,    0 <= β ⟂ d·u + λ >= 0,    0 <= λ ⟂ µ f_n - Σ β >= 0,
/// by lexicographic pivots, so degenerate contacts do not make it cycle. The answer is exact for the pyramid: a
/// friction force is between cos(π/facets) and 1 of that of the cone, and its direction is wrong by at most π/facets.
///
/// Status: Approximate with an answer. None if the path ends in a ray, after 10 pivots per unknown or by limitWork(),
/// if rounding spoiled the answer, or if there are more contacts than kMostLemkeUnknowns allows: then x is `start` and
/// all forces are zero, since an intermediate basis balances nothing. iterations: pivots. startForce is ignored:
/// Lemke's path begins without force. Shapes: up to `capacity` contacts, `facets` even and >= 4. Units: mm, N. Real
/// time: as FrictionSolver; O(unknowns²) a pivot. Source: Stewart and Trinkle 1996; Lemke 1965; Cottle, Pang and Stone,
/// The Linear Complementarity Problem, 4.4 and 4.9.
std::unique_ptr<FrictionSolver> makeLemkeFriction(int capacity, int facets);

}  // namespace touchstone
