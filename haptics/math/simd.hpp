#pragma once
// SIMD with eight lanes for processors with AVX2 and FMA (x86-64-v3) or AVX-512. GCC's vector types provide the
// arithmetic; this file adds the few operations that they lack.
#include <immintrin.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

// Without AVX-512 the ABI of a 64-byte result is not defined. Functions that return one are always inlined, so that
// none crosses an ABI boundary; arguments are passed by reference for the same reason.
#pragma GCC diagnostic ignored "-Wpsabi"

#define TOUCHSTONE_INLINE inline __attribute__((always_inline))

namespace touchstone::simd {

typedef float Float8 __attribute__((vector_size(32)));
typedef std::int32_t Int8 __attribute__((vector_size(32)));

#ifdef __AVX512F__
typedef double Double8 __attribute__((vector_size(64)));
typedef std::int64_t Long8 __attribute__((vector_size(64)));
#else
typedef double Double4 __attribute__((vector_size(32)));
typedef std::int64_t Long4 __attribute__((vector_size(32)));

/// Eight numbers in two registers. GCC 12 takes comparisons and choices of its own vectors of 64 bytes apart into
/// single numbers, and moves them through memory, which made the solvers two to six times as slow.
template <class Four, class Number>
struct Halves {
    Four low, high;

    constexpr Halves() : low{}, high{} {}
    TOUCHSTONE_INLINE constexpr Halves(const Four& low_, const Four& high_) : low(low_), high(high_) {}
    /// The numbers that are not given are 0.
    TOUCHSTONE_INLINE constexpr Halves(Number a, Number b, Number c, Number d, Number e = 0, Number f = 0, Number g = 0,
                                       Number h = 0)
        : low{a, b, c, d}, high{e, f, g, h} {}
    TOUCHSTONE_INLINE static Halves all(Number v) { return {v - Four{}, v - Four{}}; }

    TOUCHSTONE_INLINE Number operator[](int i) const {
        if (!__builtin_constant_p(i)) return reinterpret_cast<const Number*>(this)[i];
        return i < 4 ? low[i] : high[i - 4];
    }
    TOUCHSTONE_INLINE Number& operator[](int i) { return reinterpret_cast<Number*>(this)[i]; }

    TOUCHSTONE_INLINE friend Halves operator+(const Halves& a, const Halves& b) {
        return {a.low + b.low, a.high + b.high};
    }
    TOUCHSTONE_INLINE friend Halves operator-(const Halves& a, const Halves& b) {
        return {a.low - b.low, a.high - b.high};
    }
    TOUCHSTONE_INLINE friend Halves operator*(const Halves& a, const Halves& b) {
        return {a.low * b.low, a.high * b.high};
    }
    TOUCHSTONE_INLINE friend Halves operator/(const Halves& a, const Halves& b) {
        return {a.low / b.low, a.high / b.high};
    }
    TOUCHSTONE_INLINE friend Halves operator&(const Halves& a, const Halves& b) {
        return {a.low & b.low, a.high & b.high};
    }
    TOUCHSTONE_INLINE friend Halves operator|(const Halves& a, const Halves& b) {
        return {a.low | b.low, a.high | b.high};
    }
    TOUCHSTONE_INLINE friend Halves operator+(const Halves& a, Number b) { return {a.low + b, a.high + b}; }
    TOUCHSTONE_INLINE friend Halves operator-(const Halves& a, Number b) { return {a.low - b, a.high - b}; }
    TOUCHSTONE_INLINE friend Halves operator*(const Halves& a, Number b) { return {a.low * b, a.high * b}; }
    TOUCHSTONE_INLINE friend Halves operator*(Number a, const Halves& b) { return {a * b.low, a * b.high}; }
    TOUCHSTONE_INLINE friend Halves operator/(const Halves& a, Number b) { return {a.low / b, a.high / b}; }
    TOUCHSTONE_INLINE friend Halves operator/(Number a, const Halves& b) { return {a / b.low, a / b.high}; }
    TOUCHSTONE_INLINE Halves operator-() const { return {-low, -high}; }
    TOUCHSTONE_INLINE Halves operator~() const { return {~low, ~high}; }
    template <class Other>
    TOUCHSTONE_INLINE Halves& operator+=(const Other& b) {
        return *this = *this + b;
    }
    template <class Other>
    TOUCHSTONE_INLINE Halves& operator-=(const Other& b) {
        return *this = *this - b;
    }
    template <class Other>
    TOUCHSTONE_INLINE Halves& operator*=(const Other& b) {
        return *this = *this * b;
    }
    TOUCHSTONE_INLINE Halves& operator|=(const Halves& b) { return *this = *this | b; }
};
using Double8 = Halves<Double4, double>;
using Long8 = Halves<Long4, std::int64_t>;
#endif

inline constexpr Double8 kZeros{};

/// One bit for each lane, lane 0 lowest.
using Mask = std::uint32_t;

inline Float8 load(const float* p) { return reinterpret_cast<Float8>(_mm256_loadu_ps(p)); }
inline void store(float* p, Float8 v) { _mm256_storeu_ps(p, reinterpret_cast<__m256>(v)); }
TOUCHSTONE_INLINE Double8 load(const double* p) {
#ifdef __AVX512F__
    return reinterpret_cast<Double8>(_mm512_loadu_pd(p));
#else
    return {reinterpret_cast<Double4>(_mm256_loadu_pd(p)), reinterpret_cast<Double4>(_mm256_loadu_pd(p + 4))};
#endif
}
TOUCHSTONE_INLINE void store(double* p, const Double8& v) { std::memcpy(p, &v, sizeof v); }
/// Four numbers of each of eight rows, from `first` on: numbers[k] holds first + k of all rows.
TOUCHSTONE_INLINE void transpose(const float* const rows[8], int first, Float8 numbers[4]) {
    const auto pair = [&](int i) {
        return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(rows[i] + first)),
                                    _mm_loadu_ps(rows[i + 4] + first), 1);
    };
    const __m256 a = pair(0), b = pair(1), c = pair(2), d = pair(3);
    const __m256 ab = _mm256_unpacklo_ps(a, b), cd = _mm256_unpacklo_ps(c, d), ab2 = _mm256_unpackhi_ps(a, b),
                 cd2 = _mm256_unpackhi_ps(c, d);
    numbers[0] = reinterpret_cast<Float8>(_mm256_shuffle_ps(ab, cd, 0x44));
    numbers[1] = reinterpret_cast<Float8>(_mm256_shuffle_ps(ab, cd, 0xee));
    numbers[2] = reinterpret_cast<Float8>(_mm256_shuffle_ps(ab2, cd2, 0x44));
    numbers[3] = reinterpret_cast<Float8>(_mm256_shuffle_ps(ab2, cd2, 0xee));
}
inline Float8 splat(float v) { return reinterpret_cast<Float8>(_mm256_set1_ps(v)); }
inline Int8 splat(std::int32_t v) { return reinterpret_cast<Int8>(_mm256_set1_epi32(v)); }
inline Int8 lanes() { return Int8{0, 1, 2, 3, 4, 5, 6, 7}; }

/// The maximum of each lane; where `a` is NaN, the result is b.
inline Float8 max(Float8 a, Float8 b) { return a > b ? a : b; }
inline Float8 min(Float8 a, Float8 b) { return a < b ? a : b; }
inline Float8 abs(Float8 a) { return max(a, -a); }

#ifdef __AVX512F__
TOUCHSTONE_INLINE auto low(const Double8& v) { return __builtin_shufflevector(v, v, 0, 1, 2, 3); }
TOUCHSTONE_INLINE auto high(const Double8& v) { return __builtin_shufflevector(v, v, 4, 5, 6, 7); }
TOUCHSTONE_INLINE Double8 splat(double v) { return v - Double8{}; }
TOUCHSTONE_INLINE Double8 toDouble(Float8 v) { return __builtin_convertvector(v, Double8); }
TOUCHSTONE_INLINE Float8 toFloat(const Double8& v) { return __builtin_convertvector(v, Float8); }
TOUCHSTONE_INLINE Long8 less(const Double8& a, const Double8& b) { return a < b; }
TOUCHSTONE_INLINE Long8 atMost(const Double8& a, const Double8& b) { return a <= b; }
/// a where the lane of `which` is set, and else b.
TOUCHSTONE_INLINE Double8 choose(const Long8& which, const Double8& a, const Double8& b) { return which ? a : b; }
TOUCHSTONE_INLINE Double8 sqrt(const Double8& v) {
    return reinterpret_cast<Double8>(_mm512_maskz_sqrt_pd(0xff, reinterpret_cast<__m512d>(v)));
}
#else
TOUCHSTONE_INLINE Double4 low(const Double8& v) { return v.low; }
TOUCHSTONE_INLINE Double4 high(const Double8& v) { return v.high; }
TOUCHSTONE_INLINE Double8 splat(double v) { return Double8::all(v); }
TOUCHSTONE_INLINE Double8 toDouble(Float8 v) {
    const __m256 all = reinterpret_cast<__m256>(v);
    return {reinterpret_cast<Double4>(_mm256_cvtps_pd(_mm256_castps256_ps128(all))),
            reinterpret_cast<Double4>(_mm256_cvtps_pd(_mm256_extractf128_ps(all, 1)))};
}
TOUCHSTONE_INLINE Float8 toFloat(const Double8& v) {
    return reinterpret_cast<Float8>(_mm256_set_m128(_mm256_cvtpd_ps(reinterpret_cast<__m256d>(v.high)),
                                                    _mm256_cvtpd_ps(reinterpret_cast<__m256d>(v.low))));
}
TOUCHSTONE_INLINE Long8 less(const Double8& a, const Double8& b) { return {a.low < b.low, a.high < b.high}; }
TOUCHSTONE_INLINE Long8 atMost(const Double8& a, const Double8& b) { return {a.low <= b.low, a.high <= b.high}; }
/// a where the lane of `which` is set, and else b.
TOUCHSTONE_INLINE Double8 choose(const Long8& which, const Double8& a, const Double8& b) {
    return {which.low ? a.low : b.low, which.high ? a.high : b.high};
}
TOUCHSTONE_INLINE Double8 sqrt(const Double8& v) {
    const auto root = [](const Double4& four) {
        return reinterpret_cast<Double4>(_mm256_sqrt_pd(reinterpret_cast<__m256d>(four)));
    };
    return {root(v.low), root(v.high)};
}
#endif
/// The minimum of each lane; where `a` is NaN, the result is b.
TOUCHSTONE_INLINE Double8 min(const Double8& a, const Double8& b) { return choose(less(a, b), a, b); }
TOUCHSTONE_INLINE Double8 max(const Double8& a, const Double8& b) { return choose(less(b, a), a, b); }
TOUCHSTONE_INLINE Double8 abs(const Double8& a) { return max(a, -a); }

/// The distance between two intervals, 0 if they overlap.
TOUCHSTONE_INLINE Float8 apart(const Float8& lo, const Float8& hi, const Float8& otherLo, const Float8& otherHi) {
    return max(max(lo - otherHi, otherLo - hi), splat(0.0f));
}

inline Float8 sqrt(Float8 v) { return reinterpret_cast<Float8>(_mm256_sqrt_ps(reinterpret_cast<__m256>(v))); }

TOUCHSTONE_INLINE float least(Float8 v) {
    const __m256 all = reinterpret_cast<__m256>(v);
    __m128 four = _mm_min_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps(all, 1));
    four = _mm_min_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_min_ss(four, _mm_movehdup_ps(four)));
}

// Multiply-adds: a b + c and c - a b, rounded once. Results fuse where these are written and nowhere else, since the
// compiler must not choose (cmake/compiler.cmake). Without FMA they round twice, which is correct but not equal.
inline Float8 fma(Float8 a, Float8 b, Float8 c) {
#ifdef __FMA__
    return reinterpret_cast<Float8>(
        _mm256_fmadd_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b), reinterpret_cast<__m256>(c)));
#else
    return a * b + c;
#endif
}
inline Float8 fnma(Float8 a, Float8 b, Float8 c) {
#ifdef __FMA__
    return reinterpret_cast<Float8>(
        _mm256_fnmadd_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b), reinterpret_cast<__m256>(c)));
#else
    return c - a * b;
#endif
}
inline float fma(float a, float b, float c) {
#ifdef __FMA__
    return __builtin_fmaf(a, b, c);
#else
    return a * b + c;
#endif
}
inline float fnma(float a, float b, float c) { return fma(-a, b, c); }
inline Float8 fma(float a, Float8 b, Float8 c) { return fma(splat(a), b, c); }
inline Float8 fnma(float a, Float8 b, Float8 c) { return fnma(splat(a), b, c); }
#ifdef __AVX512F__
TOUCHSTONE_INLINE Double8 fma(const Double8& a, const Double8& b, const Double8& c) {
    return reinterpret_cast<Double8>(
        _mm512_fmadd_pd(reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b), reinterpret_cast<__m512d>(c)));
}
TOUCHSTONE_INLINE Double8 fnma(const Double8& a, const Double8& b, const Double8& c) {
    return reinterpret_cast<Double8>(
        _mm512_fnmadd_pd(reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b), reinterpret_cast<__m512d>(c)));
}
#elif defined __FMA__
TOUCHSTONE_INLINE Double8 fma(const Double8& a, const Double8& b, const Double8& c) {
    const auto four = [](const Double4& x, const Double4& y, const Double4& z) {
        return reinterpret_cast<Double4>(
            _mm256_fmadd_pd(reinterpret_cast<__m256d>(x), reinterpret_cast<__m256d>(y), reinterpret_cast<__m256d>(z)));
    };
    return {four(a.low, b.low, c.low), four(a.high, b.high, c.high)};
}
TOUCHSTONE_INLINE Double8 fnma(const Double8& a, const Double8& b, const Double8& c) {
    const auto four = [](const Double4& x, const Double4& y, const Double4& z) {
        return reinterpret_cast<Double4>(
            _mm256_fnmadd_pd(reinterpret_cast<__m256d>(x), reinterpret_cast<__m256d>(y), reinterpret_cast<__m256d>(z)));
    };
    return {four(a.low, b.low, c.low), four(a.high, b.high, c.high)};
}
#else
TOUCHSTONE_INLINE Double8 fma(const Double8& a, const Double8& b, const Double8& c) { return a * b + c; }
TOUCHSTONE_INLINE Double8 fnma(const Double8& a, const Double8& b, const Double8& c) { return c - a * b; }
#endif
TOUCHSTONE_INLINE Double8 fma(double a, const Double8& b, const Double8& c) { return fma(splat(a), b, c); }
TOUCHSTONE_INLINE Double8 fnma(double a, const Double8& b, const Double8& c) { return fnma(splat(a), b, c); }

/// a b + c d (+ e f). Lanes: Float8, Double8 or float; the first factors may be single numbers.
template <class Lanes>
TOUCHSTONE_INLINE Lanes sumOfProducts(const auto& a, const Lanes& b, const auto& c, const Lanes& d) {
    return fma(c, d, a * b);
}
template <class Lanes>
TOUCHSTONE_INLINE Lanes sumOfProducts(const auto& a, const Lanes& b, const auto& c, const Lanes& d, const auto& e,
                                      const Lanes& f) {
    return fma(e, f, sumOfProducts(a, b, c, d));
}

TOUCHSTONE_INLINE double sum(const Double8& a) {
    const auto four = low(a) + high(a);
    const auto two = __builtin_shufflevector(four, four, 0, 1) + __builtin_shufflevector(four, four, 2, 3);
    return two[0] + two[1];
}
TOUCHSTONE_INLINE double least(const Double8& a) {
    const auto pick = [](auto x, auto y) { return x < y ? x : y; };
    const auto four = pick(low(a), high(a));
    const auto two = pick(__builtin_shufflevector(four, four, 0, 1), __builtin_shufflevector(four, four, 2, 3));
    return two[0] < two[1] ? two[0] : two[1];
}

TOUCHSTONE_INLINE double largest(const Double8& a) { return -least(-a); }

/// matrix * x, column by column: sum over k < columns of x[k] matrix[k].
template <int columns>
TOUCHSTONE_INLINE Double8 times(const Double8 (&matrix)[columns], const Double8& x) {
    Double8 even{}, odd{};  // two chains halve the latency of the additions
#pragma GCC unroll 8
    for (int k = 0; k < columns; ++k) (k % 2 ? odd : even) = fma(x[k], matrix[k], k % 2 ? odd : even);
    return even + odd;
}

/// Lanes in which a <= b; false for NaN.
inline Mask lessEqual(Float8 a, Float8 b) {
    return Mask(
        _mm256_movemask_ps(_mm256_cmp_ps(reinterpret_cast<__m256>(a), reinterpret_cast<__m256>(b), _CMP_LE_OQ)));
}

/// One bit for each lane of a comparison.
inline Mask toMask(Int8 lanes) { return Mask(_mm256_movemask_ps(reinterpret_cast<__m256>(lanes))); }

inline Mask lessEqual(Double8 a, Double8 b) {
#ifdef __AVX512F__
    return _mm512_cmp_pd_mask(reinterpret_cast<__m512d>(a), reinterpret_cast<__m512d>(b), _CMP_LE_OQ);
#else
    const Long8 lanes = atMost(a, b);
    const auto bits = [](const Long4& four) { return Mask(_mm256_movemask_pd(reinterpret_cast<__m256d>(four))); };
    return bits(lanes.low) | bits(lanes.high) << 4;
#endif
}

namespace detail {
/// For each mask, the indices of its lanes, moved to the front.
constexpr std::array<std::array<std::int32_t, 8>, 256> makeCompressTable() {
    std::array<std::array<std::int32_t, 8>, 256> table{};
    for (int mask = 0; mask < 256; ++mask)
        for (int lane = 0, n = 0; lane < 8; ++lane)
            if (mask >> lane & 1) table[mask][n++] = lane;
    return table;
}
alignas(32) inline constexpr auto kCompress = makeCompressTable();
}  // namespace detail

/// Writes the lanes of the mask to consecutive places. It always writes eight values, so out[0..7] must be writable.
inline void compressStore(std::int32_t* out, Int8 v, Mask mask) {
    const __m256i order = _mm256_load_si256(reinterpret_cast<const __m256i*>(detail::kCompress[mask].data()));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out),
                        _mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(v), order));
}

inline void compressStore(float* out, Float8 v, Mask mask) {
    compressStore(reinterpret_cast<std::int32_t*>(out), reinterpret_cast<Int8>(v), mask);
}

inline void compressStore(double* out, Double8 v, Mask mask) {
#ifdef __AVX512F__
    _mm512_storeu_pd(out, _mm512_maskz_compress_pd(__mmask8(mask), reinterpret_cast<__m512d>(v)));
#else
    for (; mask; mask &= mask - 1) *out++ = v[std::countr_zero(mask)];
#endif
}

inline void compressStore(std::uint64_t* out, Long8 v, Mask mask) {
#ifdef __AVX512F__
    _mm512_storeu_si512(out, _mm512_maskz_compress_epi64(__mmask8(mask), reinterpret_cast<__m512i>(v)));
#else
    for (; mask; mask &= mask - 1) *out++ = std::uint64_t(v[std::countr_zero(mask)]);
#endif
}

}  // namespace touchstone::simd
