#pragma once
// Redundant rows removed before a solver that pays for each.
#include "haptics/math/aligned.hpp"
#include "haptics/qp/problem.hpp"

namespace touchstone {

enum class Screening : std::uint8_t {
    None,
    Screen,  ///< rows that another implies for every increment within the trust ball: exact where the answer lies in it
    Cluster,  ///< rows whose direction is nearly that of another with less gap: fewer are left, and it is not exact
};

/// In coordinates a = (n, (r x n)/ρ), in which |(δp, ρδθ)| <= t is the trust ball, row k implies row i when
/// g_i - g_k >= |a_i - a_k| t, and is of its cluster when cos(a_i, a_k) >= kCosine and g_i >= g_k. Greedy: the row of
/// least gap is kept and takes what it implies with it, again and again, kMostPasses times at most; what is then left
/// is kept. Real time: no allocation after construction; O(m) a pass. Source: Yu, Wang and Zhang's future work.
class RowScreen {
  public:
    static constexpr int kMostPasses = 256;
    static constexpr double kCosine = 0.98;

    explicit RowScreen(int capacity);

    /// The rows that are left, in their order and with their identities; `rows` itself with Screening::None. Valid
    /// until the next call. ρ >= 0 and t: mm. Pre: at most `capacity` rows, finite.
    const RowSet& run(const RowSet& rows, Screening how, double reach, double trust);

    /// Whether an answer to the screened rows is one to all of them: by Screen, inside the ball.
    static bool isExact(Screening how, const Vec6& x, double reach, double trust);

  private:
    RowSet kept_;
    AlignedVector<double> rank_;  ///< gap of a row that is neither kept nor dropped, else infinite
    AlignedVector<double> keep_;  ///< 1 for a row that is kept
};

}  // namespace touchstone
