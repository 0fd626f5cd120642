#pragma once
// The rows of a problem in the metric of G, where the answer is the point of a polyhedron nearest to the origin.
#include "haptics/math/aligned.hpp"
#include "haptics/qp/problem.hpp"

namespace touchstone {

/// With z = G^½(x-h) and l_i = |G^-½ J_i'| the problem is min ½|z|² s.t. b_i·z + e_i >= 0, with b_i = G^-½ J_i' / l_i
/// of unit length and e_i = (J_i h + g_i) / l_i; a multiplier y_i becomes u_i = l_i y_i. Rows shorter than 1e-15 have
/// no direction. They are dropped (b = 0, e = kInactive, 1/l = 0), and `unsatisfiable` is set if one of them has g < 0.
/// The padding to eight rows looks like a dropped row.
struct UnitRows {
    explicit UnitRows(int capacity);

    /// Returns false if an entry is NaN or infinite, G is not positive or there are more rows than the capacity. O(m),
    /// no allocation.
    bool assign(const QpProblem& problem);

    Vec6 increment(const double* z) const;  ///< x = h + G^-½ z, z of six

    static constexpr double kInactive =
        1e300;  ///< offset of a row that is never reached; finite, so that 0 times it is 0

    int size = 0;
    bool unsatisfiable = false;       ///< a dropped row has g < 0
    Vec6 wanted, root;                ///< h and G^½
    AlignedVector<double> column[6];  ///< b
    AlignedVector<double> offset;     ///< e
    AlignedVector<double> inverse;    ///< 1/l, 0 for dropped rows

  private:
    int capacity_;
};

}  // namespace touchstone
