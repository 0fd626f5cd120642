#pragma once
// The contact forces with friction: which rows carry them, and what is remembered from tick to tick.
#include <vector>

#include "haptics/qp/cone_newton.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone {

/// What the owner of the rows knows of their contacts.
class RowContacts {
  public:
    virtual ~RowContacts() = default;
    struct Place {
        Vec3 r = Vec3::Zero();           ///< the contact point from C, mm; only its part along the normal is used
        Vec3 slipped = Vec3::Zero();     ///< FrictionContact::slipped
        double atRest = 0, sliding = 0;  ///< the coefficients of friction
        Vec3 pushed = Vec3::Zero();      ///< motion against an obstacle that moves in this tick, since it began, mm
    };
    virtual Place placeOf(std::uint64_t id) const noexcept = 0;
};

/// Solves a tick's QpProblem with friction. Only contacts that carry force need their place: those that did in the last
/// tick, and those that an answer crosses. A contact that stuck in the last tick has the coefficient at rest, one that
/// slid the other; a new one slides if another contact of its obstacle did. Where a baseline has no answer, the exact
/// solver takes over, so that no baseline holds a tool that could move. Real time: as FrictionSolver.
class ContactForces {
  public:
    /// Maximum number of contacts in a solve; flat parts touch at some dozens. If more are crossed, the solve fails.
    static constexpr int kMaxContacts = 256;

    ContactForces() : exact_(kMaxContacts) {
        contacts_.reserve(kMaxContacts);
        begun_.reserve(kMaxContacts);
        startForces_.reserve(kMaxContacts);
        last_.reserve(kMaxContacts);
        before_.reserve(kMaxContacts);
    }

    using Contact = ContactForce;
    struct Result {
        SolveStatus status = SolveStatus::Invalid;  ///< Elastic: there is no friction in the answer
        FrictionStatus friction = FrictionStatus::None;
        Vec6 x = Vec6::Zero();
        bool replaced = false;   ///< the answer is that of the exact solver, because `solver` had none
        bool restarted = false;  ///< slip counts from where the tool is: counted since the tick began it had no answer
        FrictionStage stage = FrictionStage::None;  ///< the furthest of its solves
        int iterations = 0;
        double slack = 0;    ///< as in SolveResult
        double overlap = 0;  ///< largest violation of a row, mm
        CoulombResiduals residuals;
    };
    /// `frictionless`: the exact solver, which answers first where nothing is remembered and tells which of many
    /// crossed rows to add. `exact`: whether `solver` is.
    Result solve(const QpProblem& problem, const SolverSettings& settings, const RowContacts& rows,
                 Solver& frictionless, FrictionSolver& solver, bool exact) noexcept;
    /// Contacts of the last solve(), with the forces that it started from.
    std::span<const FrictionContact> contacts() const noexcept { return contacts_; }
    /// Contacts with force in the last solve(), or else in the last tick.
    std::span<const Contact> loaded() const noexcept { return last_; }
    /// Keeps the contacts of the last solve() for the next tick.
    void endTick() noexcept;
    /// Nothing touches.
    void clear() noexcept { last_.clear(); }
    /// Forgets the solves since the last endTick().
    void restartTick() noexcept { last_ = before_; }
    void forget() noexcept { last_.clear(), before_.clear(); }

  private:
    bool add(const QpProblem& problem, const RowContacts& rows, int row, const Vec3& force) noexcept;
    bool stayInside(const RowContacts& rows) noexcept;
    bool restartSlip() noexcept;
    void restoreStartForces() noexcept;
    bool knows(std::uint64_t id) const noexcept;
    bool addExpected(const QpProblem& problem, const SolverSettings& settings, const RowContacts& rows,
                     Solver& frictionless, const FrictionResult& answer, Result& result) noexcept;
    bool solveWith(FrictionSolver& solver, const QpProblem& problem, const SolverSettings& settings,
                   const RowContacts& rows, Solver& frictionless, Vec6 start, FrictionResult& answer,
                   Result& result) noexcept;

    ConeNewton exact_;
    bool restarted_ = false;  ///< of the last solve, as in Result
    std::vector<FrictionContact> contacts_;
    std::vector<FrictionContact> begun_;  ///< contacts_ before any solve
    std::vector<Vec3> startForces_;       ///< of contacts_, before any round
    std::vector<Contact> last_;           ///< of the last solve
    std::vector<Contact> before_;         ///< of the last tick
};

}  // namespace touchstone
