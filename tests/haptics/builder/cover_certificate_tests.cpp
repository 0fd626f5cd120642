#include "haptics/builder/cover_certificate.hpp"

#include <catch2/catch.hpp>

#include "tests/support/test_meshes.hpp"

namespace touchstone::cover_certificate_tests {
namespace {

const Workers kQuiet;

/// A square of n x n cells with a ball of radius r about the center of each. It is covered if r >= sqrt(1/2).
struct Quilt {
    std::vector<Triangle> surface;
    std::vector<Ball> balls;

    Quilt(int n, double r) {
        const double s = n;
        surface = {{Vec3(0, 0, 0), Vec3(s, 0, 0), Vec3(s, s, 0)}, {Vec3(0, 0, 0), Vec3(s, s, 0), Vec3(0, s, 0)}};
        for (int i = 0; i < n; ++i)
            for (int k = 0; k < n; ++k) balls.push_back({Vec3(i + 0.5, k + 0.5, 0), r});
    }
};

TEST_CASE("cover certificate: proves that a quilt of balls covers two large triangles", "[tree]") {
    const Quilt quilt(8, 0.72);
    const CoverCertificate certificate(quilt.surface);
    CHECK(certificate.gaps(quilt.balls, 0, 0.01, 10, kQuiet).empty());
    // The same with smaller balls that grow.
    const Quilt small(8, 0.32);
    CHECK(certificate.gaps(small.balls, 0.4, 0.01, 10, kQuiet).empty());
}

TEST_CASE("cover certificate: a removed ball leaves a gap in its place", "[tree]") {
    const Quilt quilt(8, 0.72);
    const CoverCertificate certificate(quilt.surface);
    for (std::size_t missing = 0; missing < quilt.balls.size(); ++missing) {
        std::vector<Ball> balls = quilt.balls;
        balls.erase(balls.begin() + static_cast<std::ptrdiff_t>(missing));
        const auto gaps = certificate.gaps(balls, 0, 0.01, 1000, kQuiet);
        REQUIRE_FALSE(gaps.empty());
        for (const auto& gap : gaps) CHECK((gap.point - quilt.balls[missing].center).norm() < 0.73);
    }
}

TEST_CASE("cover certificate: a ball that is slightly too small is refused", "[tree]") {
    Quilt quilt(4, 0.72);
    const CoverCertificate certificate(quilt.surface);
    quilt.balls[5].depth = 0.69;  // its neighbors reach 0.72 from their centers, so the corners of the cell stay bare
    CHECK(certificate.gaps(quilt.balls, 0, 0.01, 10, kQuiet)
              .empty());          // four balls meet there, and three of them still cover it
    quilt.balls[5].depth = 0.27;  // the center of the cell is 0.5 from its edges and 0.28 from the neighbors' balls
    CHECK_FALSE(certificate.gaps(quilt.balls, 0, 0.01, 10, kQuiet).empty());
    quilt.balls[0].depth = 0.70;  // the corner of the square has one ball only
    quilt.balls[5].depth = 0.72;
    CHECK_FALSE(certificate.gaps(quilt.balls, 0, 0.01, 10, kQuiet).empty());
}

TEST_CASE("cover certificate: a proof finds the necessary growth, and pieces that make up the surface", "[tree]") {
    const Quilt quilt(4, 0.3);
    const CoverCertificate certificate(quilt.surface);
    const auto proof = certificate.prove(quilt.balls, 0, 0.02, kQuiet);
    const double least = std::sqrt(0.5) - 0.3;
    CHECK(proof.growth >= least);
    CHECK(proof.growth < least + 0.03);  // the resolution, and a margin for pieces that are cut
    double area = 0;
    for (const auto& [ball, need, piece] : proof.pieces) {
        area += 0.5 * (piece[1] - piece[0]).cross(piece[2] - piece[0]).norm();
        for (const Vec3& v : piece) CHECK((v - quilt.balls[ball].center).norm() <= 0.3 + need + 1e-12);
        CHECK(need <= proof.need[ball]);
        CHECK(proof.need[ball] <= proof.growth);
    }
    CHECK(area == Approx(16));
}

TEST_CASE("cover certificate: a single distant ball still proves coverage, with enough growth", "[tree]") {
    const CoverCertificate certificate({{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}});
    const std::vector<Ball> far{{Vec3(-9, 0, 0), 2}};
    CHECK(certificate.prove(far, 0.1, 0.01, kQuiet).growth == Approx(8));
    CHECK_FALSE(certificate.gaps(std::vector<Ball>{}, 1, 0.01, 10, kQuiet).empty());
}

}  // namespace
}  // namespace touchstone::cover_certificate_tests
