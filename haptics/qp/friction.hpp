#pragma once
// Coulomb friction of a quasi-static tool: one problem, one interface for its solvers, and the distance from the law.
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>

#include "haptics/math/rigid.hpp"
#include "haptics/qp/solver_values.hpp"

namespace touchstone {

/// A point at which the tool may touch. Vectors are on world axes, r from C.
struct FrictionContact {
    std::uint64_t id = 0;            ///< as in RowSet
    Vec3 n = Vec3::UnitZ();          ///< unit normal, from the obstacle to the tool
    Vec3 r = Vec3::Zero();           ///< mm
    double gap = 0;                  ///< g, mm
    double coefficient = 0;          ///< µ of this tick
    Vec3 slipped = Vec3::Zero();     ///< motion against the obstacle before the increment, since the tick began, mm
    Vec3 startForce = Vec3::Zero();  ///< the force that a solver starts from, N

    /// Motion of the contact point for the increment x, mm.
    Vec3 motion(const Vec6& x) const { return x.head<3>() + x.tail<3>().cross(r); }
    /// s: distance after the increment, mm.
    double distance(const Vec6& x) const { return n.dot(motion(x)) + gap; }
    /// u: slip since the tick began, mm, in the tangent plane.
    Vec3 slip(const Vec6& x) const {
        const Vec3 u = motion(x) + slipped;
        return u - n * n.dot(u);
    }
};

/// With forces f_i on the tool, f_n = n·f and f_t the rest, find the increment x (mm, rad) and forces such that
///     G (x - h) = Σ (f_i, r_i x f_i),   0 <= f_n  ⟂  s_i(x) >= 0,   |f_t| <= µ f_n,   f_t = -µ f_n u/|u| where u != 0.
/// If all gaps are >= 0 and obstacles rest, x·G(x - h) <= 0 for every answer: friction never drives the hand.
struct FrictionProblem {
    Vec6 stiffness = Vec6::Ones();  ///< diagonal of G, as in QpProblem
    Vec6 wanted = Vec6::Zero();     ///< h: mm, rad
    std::span<const FrictionContact> contacts;
};

/// Pre: one force for each contact.
CoulombResiduals coulombResiduals(const FrictionProblem& problem, const Vec6& x, std::span<const Vec3> forces);

/// The worse of each residual; the dissipation is that of `b`.
CoulombResiduals worstOf(const CoulombResiduals& a, const CoulombResiduals& b);

enum class FrictionStatus : std::uint8_t {
    Exact,        ///< forces and increment obey the law to rounding
    Regularized,  ///< they balance inside the cones, but contacts give way by up to their force over the solver's ρ
    Approximate,  ///< the answer of a solver that does not aim at more
    None,         ///< no answer: x and the forces are the last iterate
};

/// What found an answer, or was the last to seek it: None without friction, Newton also for a solver that has no
/// stages.
enum class FrictionStage : std::uint8_t { None, Newton, Rounds, Continuation };

struct FrictionResult {
    FrictionStatus status = FrictionStatus::None;
    Vec6 x = Vec6::Zero();
    int iterations = 0;
    FrictionStage stage = FrictionStage::Newton;  ///< see ConeNewton
    std::span<const Vec3> forces;                 ///< on the tool, one for each contact, N; valid until the next call
};

/// A contact that carries force.
struct ContactForce {
    std::uint64_t id = 0;        ///< as in RowSet
    Vec3 force = Vec3::Zero();   ///< on the tool, N
    Vec3 normal = Vec3::Zero();  ///< from the obstacle to the tool
    bool slides = false;
};

/// Solves FrictionProblem. Pre: finite entries, at most as many contacts as its memory was made for. Real time: no
/// allocation, lock or throw in solve().
class FrictionSolver {
  public:
    virtual ~FrictionSolver() = default;
    /// `start`: an increment near the expected answer.
    virtual FrictionResult solve(const FrictionProblem& problem, const Vec6& start) noexcept = 0;
    /// Bounds the work of each later solve, in rows x iterations of PQP, as SolverSettings::workLimit. It ends sooner
    /// than by the solver's own bounds, never later. A solver without long iterations ignores it.
    virtual void limitWork(std::int64_t) noexcept {}
};

}  // namespace touchstone
