#pragma once
// PQP in a compute shader as a solver of the tick.

namespace touchstone::sandbox {

/// Adds the solver pqp-gpu to solverTable(): the updates of pqp (gpu_pqp.hpp), from a cold start at every call. One
/// thread owns the card for all of them; solve() hands a problem over and waits without a lock, for at most
/// SolverSettings::longestWait. The processor's pqp answers (SolveResult::byProcessor) if the card cannot be used, is
/// lost or late, solves for another thread as long, or if there are more than GpuPqp::kMaxRows rows. The card computes
/// in single precision, so a recorded run is repeated to the bit by the same card and driver only.
void addGpuSolver();

}  // namespace touchstone::sandbox
