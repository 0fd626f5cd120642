#pragma once
// A baseline for friction: projected Gauss-Seidel, contact by contact.
#include <memory>

#include "haptics/qp/friction.hpp"

namespace touchstone {

struct GaussSeidelSettings {
    int maxSweeps = 2000;      ///< over all contacts
    double tolerance = 1e-10;  ///< greatest change of a force in a sweep, relative to 1 N + |G h|, at which it ends
};

/// Visits one contact after the other: the normal force that closes the gap, max(0, f_n - s/a_n), then the tangential
/// force projected on the disc, P(f_t - u/a_t), with the compliances a of the springs at the contact; a_t is the
/// largest in the tangent plane. x follows every change, so forces and springs always balance and forces lie in their
/// cones; what is left is in the gaps and slips. A fixed point obeys Coulomb's law with the round cone.
///
/// Status: Approximate, converged or not, since what ends at the sweep cap is the answer that such solvers render; then
/// iterations == maxSweeps. None only if x is not finite. iterations: sweeps. It starts from startForce, projected onto
/// the cone; `start` is ignored. Convergence is linear, and slow where many contacts share a load; a small change in a
/// sweep does not bound the error. Shapes: up to `capacity` contacts. Units: mm, N. Real time: as FrictionSolver;
/// O(contacts) a sweep. Source: Jourdan, Alart and Jean 1998.
std::unique_ptr<FrictionSolver> makeGaussSeidelFriction(int capacity, const GaussSeidelSettings& settings = {});

}  // namespace touchstone
