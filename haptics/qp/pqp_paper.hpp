#pragma once
// The paper's solver as printed, for comparison.
#include "haptics/math/aligned.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone {

/// Equations (16)-(19) on min ½(x-h)'G(x-h) s.t. J x >= -g, with Q formed and without safeguards; see makePqp(). Q
/// takes up to 8 MiB. Real time: no allocation after construction.
class PaperPqp {
  public:
    static constexpr int kMaxRows = 1024;
    static constexpr double kStart = 0.001;  ///< y0

    explicit PaperPqp(int capacity);

    /// Iterates (18) until |ΔF| < tolerance; Invalid if F is not finite. Pre: finite entries, at most kMaxRows rows.
    SolveStatus solve(const QpProblem& problem, const SolverSettings& settings, int& iterations);
    /// The answer of the last solve(): N on unit rows.
    const double* y() const { return y_.data(); }

  private:
    void form(const QpProblem& problem);
    double update();

    int m_ = 0;
    AlignedVector<double> q_, d_, r_, y_, next_;
};

}  // namespace touchstone
