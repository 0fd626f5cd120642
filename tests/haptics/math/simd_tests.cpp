// Eight numbers at a time against one after the other, to the bit.
#include "haptics/math/simd.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <random>

namespace touchstone::simd_tests {

using namespace simd;

TEST_CASE("simd: eight doubles are compared, chosen and computed as one after the other", "[math]") {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = INFINITY;
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> unit(-2, 2);
    for (int trial = 0; trial < 200; ++trial) {
        double x[8], y[8], out[8];
        for (int i = 0; i < 8; ++i) x[i] = unit(random), y[i] = random() % 3 ? unit(random) : x[i];
        x[random() % 8] = trial % 2 ? kNan : -kInfinity;
        y[random() % 8] = trial % 3 ? kInfinity : kNan;
        const Double8 a = load(x), b = load(y);
        const Long8 lower = less(a, b), notAbove = atMost(a, b);
        const auto same = [&](const Double8& got, auto&& expected) {
            store(out, got);
            for (int i = 0; i < 8; ++i) {
                CAPTURE(trial, i, x[i], y[i]);
                const double want = expected(x[i], y[i]);
                CHECK((std::bit_cast<std::uint64_t>(out[i]) == std::bit_cast<std::uint64_t>(want) ||
                       (std::isnan(out[i]) && std::isnan(want))));
                CHECK((got[i] == out[i] || std::isnan(out[i])));
            }
        };
        Mask bits = 0;
        for (int i = 0; i < 8; ++i) {
            CHECK((lower[i] != 0) == (x[i] < y[i]));
            CHECK((notAbove[i] != 0) == (x[i] <= y[i]));
            bits |= Mask(x[i] <= y[i]) << i;
        }
        CHECK(lessEqual(a, b) == bits);
        same(choose(lower, a, b), [](double p, double q) { return p < q ? p : q; });
        same(min(a, b), [](double p, double q) { return p < q ? p : q; });
        same(max(a, b), [](double p, double q) { return p > q ? p : q; });
        same(simd::sqrt(a), [](double p, double) { return std::sqrt(p); });
        same(a + b, [](double p, double q) { return p + q; });
        same(a - b, [](double p, double q) { return p - q; });
        same(a * b, [](double p, double q) { return p * q; });
        same(a / b, [](double p, double q) { return p / q; });
        same(-a, [](double p, double) { return -p; });
        same(3 * a, [](double p, double) { return 3 * p; });
        same(1 / b, [](double, double q) { return 1 / q; });
#ifdef __FMA__
        same(fma(a, b, a), [](double p, double q) { return std::fma(p, q, p); });
        same(fnma(a, b, b), [](double p, double q) { return std::fma(-p, q, q); });
        same(fma(x[1], b, a), [&](double p, double q) { return std::fma(x[1], q, p); });
        const Float8 f = toFloat(a), g = toFloat(b), joined = fma(f, g, f), taken = fnma(f, g, f);
        for (int i = 0; i < 8; ++i) {
            const float p = f[i], q = g[i];
            CHECK((joined[i] == std::fma(p, q, p) || std::isnan(joined[i])));
            CHECK((taken[i] == std::fma(-p, q, p) || std::isnan(taken[i])));
            CHECK((fma(p, q, p) == joined[i] || std::isnan(joined[i])));
        }
#endif
        same(splat(x[0]), [&](double, double) { return x[0]; });
    }
    CHECK(sum(Double8{1, 2, 4, 8, 16, 32, 64, 128}) == 255);
    CHECK(least(Double8{3, 2, 4, 8, 1, 32, 64, 128}) == 1);
    CHECK(largest(Double8{3, 2, 4, 8, 1, 32, 64, 128}) == 128);
    CHECK(sumOfProducts(2.0, Double8{1, 1, 1, 1, 1, 1, 1, 1}, -1.0, splat(3.0), splat(5.0), splat(0.5))[7] == 1.5);
    const Double8 six{1, 2, 3, 4, 5, 6};
    CHECK((six[5] == 6 && six[6] == 0 && six[7] == 0));
    Double8 lane{};
    for (int i = 0; i < 8; ++i) lane[i] = i;
    CHECK(sum(lane) == 28);
    double packed[16] = {};
    compressStore(packed, lane, 0b10010110);
    CHECK((packed[0] == 1 && packed[1] == 2 && packed[2] == 4 && packed[3] == 7));
}

TEST_CASE("simd: a product is rounded before it is added, unless a multiply-add is written", "[math]") {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> unit(1, 2);
    for (int trial = 0; trial < 100; ++trial) {
        const double x = unit(random);
        volatile double kept = x * x;  // rounded, whatever the compiler does
        const double square = kept;
        CHECK(x * x - square == 0);
        CHECK(sum(splat(x) * splat(x) - splat(square)) == 0);
    }
}

}  // namespace touchstone::simd_tests
