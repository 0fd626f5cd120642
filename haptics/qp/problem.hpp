#pragma once
// The quadratic program of the tick: min ½(x-h)'G(x-h)  s.t.  J x >= -g.
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "haptics/math/aligned.hpp"
#include "haptics/math/rigid.hpp"
#include "haptics/qp/solver_values.hpp"

namespace touchstone {

/// Contact rows J (m x 6) and gaps g (m), stored column by column so that eight rows are scanned at once. In default
/// mode a row is (n, r x n) with a unit normal n, so s = J x + g is a distance in mm. Storage is fixed at construction.
/// Rows from size() to the next multiple of eight are zero with an infinite gap, so they are never violated. Eight
/// entries may be written from any row up to capacity(), so that SIMD stores need no tail.
class RowSet {
  public:
    explicit RowSet(int capacity);

    int size() const { return size_; }
    int capacity() const { return capacity_; }
    const double* column(int k) const { return columns_[k].data(); }  ///< k in 0..5: J(:, k); k = 6: g
    double* column(int k) { return columns_[k].data(); }
    const double* gap() const { return column(6); }
    double* gap() { return column(6); }
    /// Identity of the contact a row came from, stable over ticks: the key of warm starts.
    std::uint64_t id(int i) const { return ids_[i]; }
    std::uint64_t* ids() { return ids_.data(); }
    Vec6 row(int i) const;
    /// The row of a contact, or -1. It is a binary search: if the ids do not ascend it may miss a row, but it never
    /// returns a wrong one.
    int find(std::uint64_t id) const;

    void clear() { size_ = 0; }
    void push(const Vec6& j, double gap, std::uint64_t id);  ///< Pre: size() < capacity().
    /// Declares that the first n rows were written through column() and ids(), and pads the block behind them.
    void setSize(int n);
    void erase(int i);  ///< Pre: i < size(). The others keep their order. O(rows).
    /// Adds the rows of another set in order of identity. Pre: the ids of both sets ascend, and the rows fit. O(rows).
    void merge(const RowSet& other);

  private:
    int size_ = 0;
    int capacity_ = 0;
    AlignedVector<double> columns_[7];
    AlignedVector<std::uint64_t> ids_;
};

struct QpProblem {
    Vec6 stiffness = Vec6::Ones();  ///< diagonal of G: three N/mm, three mN·m/rad; positive
    Vec6 wanted = Vec6::Zero();     ///< h: mm, rad
    const RowSet* rows = nullptr;
};

/// The difference between the wrenches on the hand of two answers to the same problem.
struct WrenchError {
    double force_N = 0, torque_mNm = 0;
};
WrenchError wrenchError(const QpProblem& problem, const Vec6& x, const Vec6& exact);

/// A row that carries load: index into the problem's rows and its multiplier y, N on unit rows.
struct Multiplier {
    int row = 0;
    double value = 0;
};

/// Residuals of x and the multipliers (all other y are zero). O(m), no allocation.
KktResiduals kktResiduals(const QpProblem& problem, const Vec6& x, std::span<const Multiplier> multipliers);
/// The same if the least J x + g is already known: O(multipliers).
KktResiduals kktResiduals(const QpProblem& problem, const Vec6& x, std::span<const Multiplier> multipliers,
                          double leastGap);

}  // namespace touchstone
