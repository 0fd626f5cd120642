#pragma once
// Observes the problems that a tick solves: it replaces a solver that renderer() or frictionRenderer() gives.
#include <functional>
#include <memory>
#include <utility>

#include "haptics/qp/friction.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone::sandbox {

/// Passes each problem on to another solver, and shows problem and answer to a callback.
class WatchedSolver final : public Solver {
  public:
    using Watch = std::function<void(const QpProblem&, const SolveResult&)>;
    WatchedSolver(std::unique_ptr<Solver> solver, Watch watch) : solver_(std::move(solver)), watch_(std::move(watch)) {}

    SolveResult solve(const QpProblem& problem, const SolverSettings& settings) noexcept override {
        const SolveResult result = solver_->solve(problem, settings);
        watch_(problem, result);
        return result;
    }
    void reset() noexcept override { solver_->reset(); }

  private:
    std::unique_ptr<Solver> solver_;
    Watch watch_;
};

/// Likewise with friction.
class WatchedFrictionSolver final : public FrictionSolver {
  public:
    using Watch = std::function<void(const FrictionProblem&, const FrictionResult&)>;
    WatchedFrictionSolver(std::unique_ptr<FrictionSolver> solver, Watch watch)
        : solver_(std::move(solver)), watch_(std::move(watch)) {}

    FrictionResult solve(const FrictionProblem& problem, const Vec6& start) noexcept override {
        const FrictionResult result = solver_->solve(problem, start);
        watch_(problem, result);
        return result;
    }
    void limitWork(std::int64_t limit) noexcept override { solver_->limitWork(limit); }

  private:
    std::unique_ptr<FrictionSolver> solver_;
    Watch watch_;
};

}  // namespace touchstone::sandbox
