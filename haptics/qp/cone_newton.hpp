#pragma once
// The exact solver for Coulomb friction: an augmented Lagrangian, solved by Newton's method in six unknowns.
#include <array>
#include <vector>

#include "haptics/math/simd.hpp"
#include "haptics/qp/friction.hpp"

namespace touchstone {

/// The forces are f_n = max(0, w_n) and f_t = P(w_t) with w = f⁰ - ρ (s, u) and P the projection on the disc of radius
/// µ f_n. Newton's method finds the pose at which they balance the springs, and each step corrects f⁰, until w and the
/// law agree. The unknowns are the pose and not the forces, so redundant contacts do no harm; of several distributions
/// of force the answer is near the start. Only contacts that carry force or are crossed take part.
///
/// If the steps circle, f⁰ is held while the pose is sought, then replaced by its forces, and so on, with ρ that grows,
/// from three values in turn. If that circles as well, up to six contacts are left out one by one; of several that bear
/// the same load, not all have force. The rest is only for problems in which the tool can stay where it is: gaps >= 0
/// and no slip before.
/// Others may have no answer. Contacts join one by one; then the answers are followed along a path of problems that
/// begins without any contact: the wanted increment grows from 0 to h while every gap shrinks to its own. With f⁰ = 0
/// the forces resist every increment (x·J'f <= 0), so such a path leads from the only answer of the first problem to an
/// answer of the last, over its folds. What is not exact then is the attempt that is nearest to the law.
///
/// Real time: the constructor takes all memory; no function allocates, locks or throws; a solve evaluates the forces
/// about kMostEvaluations times at most. Source: Alart and Curnier 1991, condensed to the pose.
class ConeNewton final : public FrictionSolver {
  public:
    /// Bound on the evaluations, each O(contacts); the last round may exceed it by its corrections. The Newton steps
    /// take 3 to 20, rounds with growing ρ 2 to 150, a path 50 to 900. A smaller bound leaves more ticks without an
    /// exact answer; a larger one makes the longest ticks longer.
    static constexpr int kMostEvaluations = 1500;

    explicit ConeNewton(int capacity)
        : states_(std::size_t(capacity)), forces_(std::size_t(capacity)), found_(std::size_t(capacity)) {}

    FrictionResult solve(const FrictionProblem& problem, const Vec6& start) noexcept override;

  private:
    enum class Piece : std::uint8_t { Open, Stick, Slide };
    struct State {
        Vec3 f0, f;
        Vec3 before;                        ///< f of the last round
        Vec3 drift;                         ///< of w along a path, N: w = f⁰ - ρ (s, u) - (1 - α) drift
        Vec3 along;                         ///< a: direction of w_t
        double share;                       ///< of what slides: K = ρ (share (1 - aa') + (1 - share) nn' + µ an')
        double weight, first;               ///< ρ, N/mm, and its first value
        double normal, tangential, beyond;  ///< w_n, |w_t|, and |w_t| - µ w_n
        double normalBefore, beyondBefore;
        Piece piece, pieceBefore;
        bool takesPart, leftOut;
        bool slid;  ///< f⁰ was at the edge of its cone when Newton's steps began
    };
    /// How evaluate() selects the pieces of the forces.
    enum class Pieces {
        Start,   ///< what pushes or did before slides if it did, and else sticks until it is released
        Newton,  ///< by the law; with derivatives for steps that correct f⁰ as well
        Held,    ///< likewise, but a contact that slid one way does not slide back
        ByLaw,
        Frozen,  ///< as at the last evaluation
    };

    /// K m, where K is -∂f/∂(motion of the contact), N/mm.
    static Vec3 resistance(const FrictionContact& c, const State& state, const Vec3& m) {
        if (state.piece == Piece::Stick) return state.weight * m;
        const double normal = c.n.dot(m);
        return state.weight * (state.share * m + (1 - state.share) * normal * c.n +
                               (c.coefficient * normal - state.share * state.along.dot(m)) * state.along);
    }
    struct Steps {
        Vec6 first, second;
        bool reversed;  ///< the determinant is negative
    };
    Steps solveFor(const Vec6& first, const Vec6& second);
    void begin(const FrictionProblem& problem, double penalty);
    Vec6 evaluate(const Vec6& x, const Vec6& wanted, double away, Pieces pieces);
    double nearlyBalanced() const;
    bool newton(Vec6& x);
    bool passOn();
    FrictionStatus climb(Vec6& x, double weight);
    struct Error {
        double distance, energy;  ///< mm, mJ
        double worst() const { return distance > energy ? distance : energy; }
    };
    bool findPose(Vec6& x, double weight, Error& error);
    Error errorAt(const Vec6& x) const;
    bool follow(Vec6& x);
    FrictionStatus followAndClimb(Vec6& x);
    double stepToEvent(const Vec6& dx, double dAlpha) const;
    bool addCrossed(const Vec6& x);

    std::vector<State> states_;
    std::vector<Vec3> forces_;  ///< of the best round
    std::vector<Vec3> found_;   ///< of the answer
    const FrictionProblem* problem_ = nullptr;
    double force_ = 0;      ///< scale of the forces, N
    double stiffness_ = 0;  ///< k, N/mm
    double lever_ = 0;      ///< at which the two springs are equally stiff, mm
    int evaluations_ = 0;
    // Of the last evaluate():
    std::array<simd::Double8, 6> derivative_;  ///< of the imbalance by x: its rows
    Vec6 push_;                                ///< -∂imbalance/∂α, of the drifts
    double change_ = 0;                        ///< greatest |f - f⁰|, N
    bool changed_ = false;                     ///< a contact has another piece than before
};

}  // namespace touchstone
