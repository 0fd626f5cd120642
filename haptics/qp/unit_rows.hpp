#pragma once
// The rows of a problem in the metric of G, where the problem is the point of a polyhedron nearest to the origin.
#include "haptics/math/aligned.hpp"
#include "haptics/qp/problem.hpp"

namespace touchstone {

/// With z = G^½(x-h) and l_i = |G^-½ J_i'| the problem reads min ½|z|² s.t. b_i·z + e_i >= 0, b_i = G^-½ J_i' / l_i of
/// unit length, e_i = (J_i h + g_i) / l_i; a multiplier y_i becomes u_i = l_i y_i. Rows shorter than 1e-15 have no
/// direction: they are dropped (b = 0, e = kNeverMet, 1/l = 0) and noted when nothing can meet them (g < 0). So is the
/// padding to eight rows.
struct UnitRows {
    explicit UnitRows(int capacity);

    /// False when an entry is NaN or infinite, G is not positive or the rows are more than the capacity. O(m), no
    /// allocation.
    bool assign(const QpProblem& problem);

    Vec6 increment(const double* z) const;  ///< x = h + G^-½ z, z of six

    static constexpr double kNeverMet = 1e300;  ///< finite, so that zero times it is zero

    int size = 0;
    bool hopeless = false;            ///< a dropped row has g < 0
    Vec6 wanted, root;                ///< h and G^½
    AlignedVector<double> column[6];  ///< b
    AlignedVector<double> offset;     ///< e
    AlignedVector<double> inverse;    ///< 1/l, 0 for dropped rows

  private:
    int capacity_;
};

}  // namespace touchstone
