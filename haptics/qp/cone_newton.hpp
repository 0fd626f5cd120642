#pragma once
// The exact solver for Coulomb friction: an augmented Lagrangian, solved by Newton's method in six unknowns.
#include <array>
#include <vector>

#include "haptics/math/simd.hpp"
#include "haptics/qp/cone.hpp"
#include "haptics/qp/friction.hpp"

namespace touchstone {

/// The forces are f = P(w) with w = f⁰ - ρ (s, u) and P the projection onto the cone. Newton's method finds the pose at
/// which they balance the springs. Each step also corrects f⁰, until w and the law agree. The unknowns are the pose and
/// not the forces, so redundant contacts do no harm. Only contacts that carry force or are crossed take part.
///
/// If the steps circle, rounds follow: the pose is found with f⁰ held, its forces become f⁰, and ρ grows.
///
/// If that circles as well, continuation follows the answers as ρ grows from nothing, with corners of the law rounded
/// less and less, and once more without f⁰. If gaps are >= 0 and slip begins here, contacts resist every increment, so
/// the path stays bounded. Else, or if the evaluations are spent first, there may be no answer, and the nearest to the
/// law is returned.
///
/// Real time: the constructor takes all memory; no function allocates, locks or throws; a solve evaluates the forces
/// about kEvaluationsOfSolve times at most. Source: Alart and Curnier 1991, condensed to the pose.
class ConeNewton final : public FrictionSolver {
  public:
    explicit ConeNewton(int capacity)
        : states_(std::size_t(capacity)),
          forces_(std::size_t(capacity)),
          best_(std::size_t(capacity)),
          found_(std::size_t(capacity)) {}

    FrictionResult solve(const FrictionProblem& problem, const Vec6& start) noexcept override;

  private:
    struct State {
        Vec3 f0;
        ConeForce law;
        Vec3 before;    ///< force of the last round; f⁰ of a path
        double soft;    ///< stiffness of the springs at the contact, N/mm
        double weight;  ///< ρ, N/mm
        bool takesPart;
        bool slid;  ///< f⁰ was at the edge of its cone when Newton's steps began
    };
    enum class Modes {
        Start,   ///< what pushes now or before keeps its mode: it slides if it slid, and sticks otherwise
        Newton,  ///< by the law, with derivatives for steps that correct f⁰ as well. A contact that slid one way does
                 ///< not slide back: if the answer lies between two slopes, steps would go back and forth between them
        ByLaw,   ///< rounded by rounding_
    };
    struct Steps {
        Vec6 first, second;
        bool reversed;  ///< the determinant is negative
    };

    void begin(const FrictionProblem& problem);
    Vec6 evaluate(const Vec6& x, Modes modes);
    Steps solveFor(const Vec6& first, const Vec6& second);
    bool addCrossed(const Vec6& x);
    double errorAt(const Vec6& x) const;
    CoulombResiduals residualsAt(const Vec6& x);
    double nearlyBalanced() const;
    bool newton(Vec6& x);
    bool findPose(Vec6& x, double weight, double& error);
    bool climb(Vec6& x);
    void stiffen(double logarithm);
    bool follow(Vec6& x);

    std::vector<State> states_;
    std::vector<Vec3> forces_;  ///< of residualsAt()
    std::vector<Vec3> best_;    ///< of the best round, or of a point of a path
    std::vector<Vec3> found_;   ///< of the answer
    const FrictionProblem* problem_ = nullptr;
    double force_ = 0;     ///< scale of the forces, N
    double lever_ = 0;     ///< at which the two springs are equally stiff, mm
    double rounding_ = 0;  ///< N
    int evaluations_ = 0;
    // Results of the last evaluate():
    std::array<simd::Double8, 6> derivative_;  ///< of the imbalance by x: its rows
    Vec6 push_;                                ///< -∂imbalance/∂log ρ, if rounded
    double change_ = 0;                        ///< greatest |f - f⁰|, N
    bool changed_ = false;                     ///< a contact changed its mode
};

}  // namespace touchstone
