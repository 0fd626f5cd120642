#pragma once
// What settings and records say about solvers: plain values, without the solvers.
#include <cstdint>
#include <string_view>

namespace touchstone {

/// The solvers that are exact and fastest, by their names in solverTable() and frictionSolverTable().
inline constexpr std::string_view kExactSolver = "dual-active-set", kExactFrictionSolver = "cone-newton";
inline constexpr std::string_view kNoSolver = "none";

/// Redundant rows that are removed before an approximate solver (RowScreen).
enum class Screening : std::uint8_t {
    None,
    Screen,   ///< removes rows that another row implies everywhere in the trust ball: exact if the answer lies in it
    Cluster,  ///< removes rows with nearly the direction of a row with a smaller gap: fewer rows remain; not exact
};

enum class SolveStatus : std::uint8_t {
    Solved,
    Elastic,         ///< the rows contradict each other; the answer solves the softened problem
    IterationLimit,  ///< the work limit ended the solve; the answer is the iterate
    Invalid,         ///< the problem has NaN or infinity, or the solver has no finite answer; x = 0
};
const char* name(SolveStatus status);

/// How far (x, y) is from the Karush-Kuhn-Tucker conditions of a QpProblem.
struct KktResiduals {
    double primal_mm = 0;           ///< max(0, -s_i)
    double dual_N = 0;              ///< max(0, -y_i)
    double stationarity_N = 0;      ///< |G(x-h) - J'y| with its torque part divided by the lever sqrt(k_r/k_t)
    double complementarity_mJ = 0;  ///< max |y_i s_i|
};

/// How far forces and increment are from Coulomb's law, recomputed from the definitions of a FrictionProblem.
struct CoulombResiduals {
    double balance_N = 0;           ///< |G(x - h) - Σ (f, r x f)|, torque divided by the lever sqrt(k_r/k_t)
    double overlap_mm = 0;          ///< max(0, -s_i)
    double cone_N = 0;              ///< max(0, |f_t| - µ f_n, -f_n)
    double complementarity_mJ = 0;  ///< max |f_n s|
    double direction_mJ = 0;        ///< max µ f_n |u| + f_t·u: 0 where friction is greatest and opposes the slip
    double dissipation_mJ = 0;      ///< -Σ f_t·u: the heat of the tick, >= 0
    double worst_N() const { return balance_N > cone_N ? balance_N : cone_N; }
    double worst() const;  ///< of all but the heat: N, mm or mJ
    /// Residuals at which an answer is exact: what a hand on springs of 1 N/mm feels as 1e-6 N. Between walls, rows
    /// that are rounded contradict each other by up to about 1e-8 mm, and no answer can obey all of them any closer.
    static constexpr double kExact = 1e-6;
    bool isExact() const { return worst() <= kExact; }
};

}  // namespace touchstone
