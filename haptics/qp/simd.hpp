#pragma once
// Eight doubles at once, in the compiler's vector extension: one AVX-512 register, two of AVX2, the same source for
// both.
#include <cstring>

// Without AVX-512 a 64-byte result has no settled ABI; what returns one is inlined, so none crosses one. Arguments go
// by reference for the same reason.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace touchstone {

using Vec8 = double __attribute__((vector_size(64)));
using Mask8 = decltype(Vec8{} < Vec8{});  ///< all ones in a lane where the comparison holds

#define TOUCHSTONE_INLINE inline __attribute__((always_inline))

/// Pre: p is aligned to 64 bytes.
TOUCHSTONE_INLINE Vec8 load8(const double* p) {
    Vec8 a;
    std::memcpy(&a, __builtin_assume_aligned(p, 64), sizeof a);
    return a;
}
TOUCHSTONE_INLINE void store8(double* p, const Vec8& a) { std::memcpy(__builtin_assume_aligned(p, 64), &a, sizeof a); }
TOUCHSTONE_INLINE Vec8 all8(double a) { return a - Vec8{}; }

/// Lane by lane; a lane of `a` that is NaN gives b's.
TOUCHSTONE_INLINE Vec8 min8(const Vec8& a, const Vec8& b) { return a < b ? a : b; }
TOUCHSTONE_INLINE Vec8 max8(const Vec8& a, const Vec8& b) { return a > b ? a : b; }
TOUCHSTONE_INLINE Vec8 abs8(const Vec8& a) { return max8(a, -a); }
TOUCHSTONE_INLINE Vec8 sqrt8(const Vec8& a) {
    Vec8 root{};
    for (int lane = 0; lane < 8; ++lane) root[lane] = __builtin_sqrt(a[lane]);
    return root;
}

TOUCHSTONE_INLINE double sum8(const Vec8& a) {
    const auto four = __builtin_shufflevector(a, a, 0, 1, 2, 3) + __builtin_shufflevector(a, a, 4, 5, 6, 7);
    const auto two = __builtin_shufflevector(four, four, 0, 1) + __builtin_shufflevector(four, four, 2, 3);
    return two[0] + two[1];
}
TOUCHSTONE_INLINE double least8(const Vec8& a) {
    const auto pick = [](auto x, auto y) { return x < y ? x : y; };
    const auto four = pick(__builtin_shufflevector(a, a, 0, 1, 2, 3), __builtin_shufflevector(a, a, 4, 5, 6, 7));
    const auto two = pick(__builtin_shufflevector(four, four, 0, 1), __builtin_shufflevector(four, four, 2, 3));
    return two[0] < two[1] ? two[0] : two[1];
}

/// matrix * x, column by column: sum over k < columns of x[k] matrix[k].
template <int columns>
TOUCHSTONE_INLINE Vec8 times8(const Vec8 (&matrix)[columns], const Vec8& x) {
    Vec8 even{}, odd{};  // two chains halve the latency of the additions
#pragma GCC unroll 8
    for (int k = 0; k < columns; ++k) (k % 2 ? odd : even) += x[k] * matrix[k];
    return even + odd;
}

}  // namespace touchstone
