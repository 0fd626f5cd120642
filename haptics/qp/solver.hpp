#pragma once
// One interface and one table for every solver of the tick's QP.
#include <limits>
#include <memory>
#include <string>
#include <string_view>

#include "haptics/qp/problem.hpp"

namespace touchstone {

struct SolverSettings {
    /// Paper form: exactly the paper's algorithm if the solver has one (pqp: equations 16-19, y0 = 0.001, stop at
    /// |ΔF| < tolerance in N·mm, no safeguard). Otherwise the robust form: stop at max_i |min(y_i, s_i/q_i)| <
    /// tolerance in N, with s = Jx + g and q_i = J_i G⁻¹ J_i'. Exact solvers ignore the tolerance.
    bool paperForm = false;
    double tolerance = 0.01;
    int maxIterations = 1'000'000;
    /// Bound on rows x iterations (paper form of pqp: rows² x iterations). It is a count and not a time, so that runs
    /// are bit-reproducible.
    std::int64_t workLimit = 100'000'000;
    double elasticWeight = 1000;  ///< w of ½ w s² when rows contradict each other; rows scaled to unit G-length
    /// Time that a solver on another device than the processor may keep the caller, µs. Only a live loop sets it:
    /// beyond, the processor answers, see SolveResult::byProcessor.
    double longestWait = std::numeric_limits<double>::infinity();
};

struct SolveResult {
    SolveStatus status = SolveStatus::Invalid;
    Vec6 x = Vec6::Zero();
    int iterations = 0;
    double slack = 0;  ///< elastic slack s, in the scaled rows' unit; 0 when solved
    KktResiduals kkt;
    std::span<const Multiplier> multipliers;  ///< rows with y > 0; valid until the next call
    bool byProcessor = false;  ///< the solver's device was late, lost or too small, so that the processor answered
};

/// Solves QpProblem. NaN or infinity in the problem gives Invalid and x = 0. Real time: no allocation, lock, log or
/// throw in solve() and reset(); the constructor takes all memory for the given number of rows. A solver remembers the
/// contacts of its last answer and starts from them (warm_start.hpp) until reset().
class Solver {
  public:
    virtual ~Solver() = default;
    virtual SolveResult solve(const QpProblem& problem, const SolverSettings& settings) noexcept = 0;
    virtual void reset() noexcept = 0;
};

/// What a solver costs on another device than the processor, measured there.
struct RoundTrip {
    std::string trouble;  ///< one sentence why it cannot be used on this machine; empty: it can
    double us = 0;        ///< wall-clock time of a call without updates
    double updateUs = 0;  ///< of each update of 300 rows
};

struct SolverInfo {
    std::string_view name;     ///< as on the command line
    std::string_view summary;  ///< one sentence for help and tooltips
    bool exact;                ///< its answer needs no projection
    std::unique_ptr<Solver> (*make)(int capacity);
    /// Null: the processor solves. Else starts the device at the first call, which takes up to seconds.
    const RoundTrip& (*roundTrip)() = nullptr;
};

/// The solvers in the order in which users see them: dual-active-set, pqp, active-set. A new solver is one more row.
std::span<const SolverInfo> solverTable();
/// Whether this machine has what the solver needs; starts its device, if it has one.
inline bool isUsable(const SolverInfo& info) { return !info.roundTrip || info.roundTrip().trouble.empty(); }
/// Appends a solver that the core does not know. Only at the start of a program, before it reads the table.
void addSolver(const SolverInfo& info);
/// Row of solverTable(), or null.
const SolverInfo* findSolver(std::string_view name);

}  // namespace touchstone
