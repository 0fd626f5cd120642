#pragma once
// PQP in a compute shader: many problems in one dispatch, one to a workgroup (shaders/pqp.comp).
#include <memory>
#include <span>
#include <string>

#include "haptics/qp/solver.hpp"

namespace touchstone::sandbox {

/// Wall-clock time of a batch, µs.
struct GpuTimes {
    double upload = 0;    ///< of the rows, from their rounding to single precision until the card has them
    double dispatch = 0;  ///< until the driver has taken the commands
    double solve = 0;     ///< from then on until the last problem is solved
    double download = 0;  ///< of the forces, until the last answer is computed from them
    GpuTimes& operator+=(const GpuTimes& other) {
        upload += other.upload, dispatch += other.dispatch, solve += other.solve, download += other.download;
        return *this;
    }
    double total() const { return upload + dispatch + solve + download; }
};

/// The updates of the solver pqp in both its forms, from a cold start, on an OpenGL 4.3 context of its own without a
/// display. The card computes in single precision; x and the residuals are computed from its forces in double. Not real
/// time. One thread at a time may call it, and each call makes its context current.
class GpuPqp {
  public:
    static constexpr int kMaxRows = 4096;

    /// Throws std::runtime_error with one sentence if there is no context, no OpenGL 4.3, or the shader does not
    /// compile.
    GpuPqp();
    ~GpuPqp();
    GpuPqp(const GpuPqp&) = delete;
    GpuPqp& operator=(const GpuPqp&) = delete;

    /// The driver's version and name of the card.
    const std::string& card() const;

    /// The answers, valid until the next call. A problem with more than kMaxRows rows, or numbers that are not finite,
    /// is answered Invalid. settings.workLimit bounds the iterations as on the CPU. Throws std::runtime_error with one
    /// sentence if the context is lost or the card has not enough memory.
    std::span<const SolveResult> solve(std::span<const QpProblem> problems, const SolverSettings& settings);
    /// Times of the last solve().
    const GpuTimes& times() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace touchstone::sandbox
