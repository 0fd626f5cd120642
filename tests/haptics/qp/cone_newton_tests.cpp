// The exact solver for friction, alone, judged by answers that follow from Coulomb's law.
#include <array>
#include <catch2/catch.hpp>
#include <numbers>
#include <numeric>
#include <random>

#include "haptics/math/statistics.hpp"
#include "haptics/qp/cone_newton.hpp"
#include "tests/support/alloc_count.hpp"

namespace touchstone::cone_newton_tests {

using test::AllocationCounter;

namespace {

constexpr double kPi = std::numbers::pi;
const Vec6 kStiffness = (Vec6() << 1, 1, 1, 1000, 1000, 1000).finished();

/// A pad at r whose floor is its lower side, pressed with `force` N.
FrictionContact pad(const Vec3& r, double mu, double force) {
    FrictionContact c;
    c.r = r;
    c.coefficient = mu;
    c.startForce = Vec3(0, 0, force);
    return c;
}

/// Random vectors in a box around a point.
class Around {
  public:
    explicit Around(unsigned seed) : random_(seed) {}
    double share() { return both_(random_); }
    Vec3 operator()(double x, double y, double z, double by) {
        return Vec3(x + by * share(), y + by * share(), z + by * share());
    }

  private:
    std::mt19937_64 random_;
    std::uniform_real_distribution<double> both_{-1, 1};
};

Vec6 wantedOf(double x, double y, double z, double turn = 0) { return (Vec6() << x, y, z, 0, 0, turn).finished(); }

/// The torque of friction about z on a tool that is pressed with 2 N and turned by the hand by `turn` rad.
double torqueOf(const std::vector<FrictionContact>& contacts, double turn) {
    ConeNewton solver(int(contacts.size()));
    const FrictionProblem problem{kStiffness, wantedOf(0, 0, -2, turn), contacts};
    const FrictionResult result = solver.solve(problem, Vec6::Zero());
    REQUIRE(result.status == FrictionStatus::Exact);
    const CoulombResiduals residuals = coulombResiduals(problem, result.x, result.forces);
    REQUIRE(residuals.worst_N() < 1e-6);
    REQUIRE(residuals.direction_mJ < 1e-6);
    double torque = 0;
    for (std::size_t i = 0; i < contacts.size(); ++i) torque += contacts[i].r.cross(result.forces[i]).z();
    return -torque;
}

void checkExact(ConeNewton& solver, const std::vector<FrictionContact>& contacts, const Vec6& wanted,
                double mostOverlap_mm) {
    const FrictionProblem problem{kStiffness, wanted, contacts};
    const FrictionResult result = solver.solve(problem, Vec6::Zero());
    REQUIRE(result.status == FrictionStatus::Exact);
    const CoulombResiduals residuals = coulombResiduals(problem, result.x, result.forces);
    CHECK(residuals.worst_N() < 1e-6);
    CHECK(residuals.overlap_mm < mostOverlap_mm);
    CHECK(residuals.complementarity_mJ < 1e-6);
    CHECK(residuals.direction_mJ < 1e-6);
}

}  // namespace

TEST_CASE("friction solver: a ring of pads that is spun resists with µ F r", "[qp][friction]") {
    const double mu = 0.4, force = 2, radius = 8;
    for (int n = 3; n <= 64; ++n) {
        CAPTURE(n);
        std::vector<FrictionContact> ring;
        for (int i = 0; i < n; ++i)
            ring.push_back(pad({radius * std::cos(2 * kPi * i / n), radius * std::sin(2 * kPi * i / n), -3}, mu, 0.01));
        CHECK(torqueOf(ring, 0.1) == Approx(mu * force * radius).epsilon(1e-6));
        // Below that torque it holds.
        const double held = 0.9 * mu * force * radius;
        CHECK(torqueOf(ring, held / 1000) == Approx(held).epsilon(1e-6));
    }
}

TEST_CASE("friction solver: a peg that touches its hole at two points jams as Whitney's diagram says",
          "[qp][friction]") {
    // The lower end touches the left wall, the right side the mouth of the hole.
    const double mu = 0.3, radius = 4, depth = 10, push = 1;
    FrictionContact tip, mouth;
    tip.n = Vec3::UnitX(), tip.r = Vec3(-radius, 0, 0);
    mouth.n = -Vec3::UnitX(), mouth.r = Vec3(radius, 0, depth);
    tip.coefficient = mouth.coefficient = mu;
    mouth.id = 1;
    const std::vector<FrictionContact> contacts{tip, mouth};
    for (double side = -0.9; side < 1; side += 0.2) {
        const double across = side * push / mu;
        CAPTURE(across);
        const auto jams = [&](double torque) {
            ConeNewton solver(2);
            Vec6 wanted = wantedOf(across, 0, -push);
            wanted[4] = torque / kStiffness[4];
            const FrictionResult result = solver.solve({kStiffness, wanted, contacts}, Vec6::Zero());
            REQUIRE(result.status == FrictionStatus::Exact);
            return result.x.norm() < 1e-9;
        };
        // Both points slide inward at the boundary: the forces across, along and about the peg give the torque there.
        const double mouthForce = (push / mu + across) / 2;
        const double boundary = mu * radius * across + depth * mouthForce;
        CHECK(jams(boundary + 1e-6 * depth * push));
        CHECK_FALSE(jams(boundary - 1e-6 * depth * push));
    }
}

TEST_CASE("friction solver: a disc of even pressure that is spun resists with 2/3 µ F R", "[qp][friction]") {
    const double mu = 0.4, force = 2, radius = 10;
    std::vector<FrictionContact> disc;
    for (int i = 0; i < 1000; ++i) {  // Vogel's spiral covers a disc evenly
        const double r = radius * std::sqrt((i + 0.5) / 1000), angle = i * kPi * (3 - std::sqrt(5.0));
        disc.push_back(pad({r * std::cos(angle), r * std::sin(angle), 0}, mu, force / 1000));
    }
    CHECK(torqueOf(disc, 0.1) == Approx(2.0 / 3 * mu * force * radius).epsilon(1e-3));
}

TEST_CASE("friction solver: a sliding block is pulled back with µ F along its slip, and does not hover",
          "[qp][friction]") {
    const double mu = 0.3;
    for (int k = 0; k < 64; ++k) {
        const Vec3 along(std::cos(2 * kPi * k / 64), std::sin(2 * kPi * k / 64), 0);
        const std::vector<FrictionContact> feet{pad({5, 5, 0}, mu, 0.5), pad({-5, 5, 0}, mu, 0.5),
                                                pad({5, -5, 0}, mu, 0.5), pad({-5, -5, 0}, mu, 0.5)};
        ConeNewton solver(4);
        const FrictionProblem problem{kStiffness, wantedOf(3 * along.x(), 3 * along.y(), -2), feet};
        const FrictionResult result = solver.solve(problem, Vec6::Zero());
        REQUIRE(result.status == FrictionStatus::Exact);
        const Vec3 force = kStiffness.head<3>().cwiseProduct(result.x.head<3>() - problem.wanted.head<3>());
        CHECK(force.head<2>().norm() / force.z() == Approx(mu).epsilon(1e-9));
        CHECK((force.head<2>().normalized() + along.head<2>()).norm() < 1e-9);
        CHECK((result.x.head<3>() - (3 - 2 * mu) * along).norm() < 1e-9);
    }
}

TEST_CASE("friction solver: of random contacts most answers are exact, the others balance in the cones or are flagged",
          "[qp][friction]") {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> unit(0, 1);
    const auto direction = [&] { return Vec3(normal(random), normal(random), normal(random)).normalized(); };
    ConeNewton solver(32), again(32);
    int exact = 0, soft = 0, none = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        const Vec3 facing = direction();
        const double mu = std::array{0.2, 0.5, 0.9}[std::size_t(trial % 3)];
        std::vector<FrictionContact> contacts(1 + random() % 18);
        for (FrictionContact& c : contacts) {
            c.n = (facing + 0.9 * unit(random) * direction()).normalized();
            c.r = (10 + 40 * unit(random)) * direction();
            c.gap = 0.05 * unit(random) * unit(random);
            c.coefficient = mu;
        }
        Vec6 wanted;
        wanted << -(0.5 + 3 * unit(random)) * facing + 0.5 * direction(), 0.01 * direction();
        const FrictionProblem problem{kStiffness, wanted, contacts};
        const AllocationCounter allocations;
        const FrictionResult result = solver.solve(problem, Vec6::Zero());
        REQUIRE(allocations.count() == 0);
        REQUIRE(result.x.allFinite());
        REQUIRE(again.solve(problem, Vec6::Zero()).x == result.x);
        exact += result.status == FrictionStatus::Exact;
        soft += result.status == FrictionStatus::Regularized;
        none += result.status == FrictionStatus::None;
        if (result.status == FrictionStatus::None) continue;
        const CoulombResiduals residuals = coulombResiduals(problem, result.x, result.forces);
        CHECK(residuals.worst_N() < 1e-6);
        CHECK(residuals.overlap_mm < (result.status == FrictionStatus::Exact ? 1e-9 : 2e-3));
        if (result.status != FrictionStatus::Exact) continue;
        CHECK(residuals.complementarity_mJ < 1e-8);
        CHECK(residuals.direction_mJ < 1e-6);
        // Gaps are not negative and nothing else moves, so friction cannot drive the hand.
        CHECK(result.x.dot(kStiffness.cwiseProduct(result.x - wanted)) < 1e-9);
    }
    CAPTURE(exact, soft, none);
    CHECK(exact >= 1990);
    CHECK(none <= 5);
}

TEST_CASE("friction solver: two points on both sides of a tool jam it, however hard it is pulled", "[qp][friction]") {
    Around about(7);
    const double mu = 0.72;
    ConeNewton solver(2);
    for (int trial = 0; trial < 300; ++trial) {
        CAPTURE(trial);
        FrictionContact below = pad(about(-30, -19, -21, 3), mu, 0), above = pad(about(-34, -7, 20, 3), mu, 0);
        above.n = about(0, 0.05, -1, 0.05).normalized();
        below.startForce = Vec3(0, 0, 8);
        above.startForce = -below.startForce;
        Vec6 wanted;
        wanted << about(-15, -12, -2, 2), about(0.16, -0.04, -0.5, 0.05);
        checkExact(solver, {below, above}, wanted, 1e-9);
    }
}

TEST_CASE("friction solver: of several answers it takes the one that continues the forces it starts from",
          "[qp][friction]") {
    ConeNewton solver(4);
    const auto wrenchOf = [](const std::vector<FrictionContact>& contacts, const FrictionResult& result) {
        Vec6 wrench = Vec6::Zero();
        for (std::size_t i = 0; i < contacts.size(); ++i)
            wrench += (Vec6() << result.forces[i], contacts[i].r.cross(result.forces[i])).finished();
        return wrench;
    };
    SECTION("four feet share a load as they did") {
        for (const double share : {0.5, 0.2, 0.9}) {  // of one diagonal
            std::vector<FrictionContact> feet;
            for (const double x : {-10.0, 10.0})
                for (const double y : {-10.0, 10.0})
                    feet.push_back(pad({x, y, -5}, 0.4, x * y > 0 ? share : 1 - share));
            const FrictionResult result = solver.solve({kStiffness, wantedOf(0, 0, -2), feet}, Vec6::Zero());
            REQUIRE(result.status == FrictionStatus::Exact);
            CHECK(result.x.norm() < 1e-12);
            CHECK((wrenchOf(feet, result) - wantedOf(0, 0, 2)).norm() < 1e-9);
            for (std::size_t i = 0; i < feet.size(); ++i) CHECK((result.forces[i] - feet[i].startForce).norm() < 1e-9);
        }
    }
    SECTION("a wedge between two walls holds if it was clamped, and else lets go") {
        for (const double clamp : {0.0, 1.0}) {
            std::vector<FrictionContact> walls{pad({10, 0, 0}, 0.5, 0), pad({-10, 0, 0}, 0.5, 0)};
            walls[0].n = -Vec3::UnitX(), walls[1].n = Vec3::UnitX();
            for (FrictionContact& c : walls) c.startForce = clamp * c.n;
            const Vec6 wanted = wantedOf(0, 0, 0.6);  // less than 2 µ of the clamping force
            const FrictionResult result = solver.solve({kStiffness, wanted, walls}, Vec6::Zero());
            REQUIRE(result.status == FrictionStatus::Exact);
            CHECK((result.x - (clamp > 0 ? Vec6(Vec6::Zero()) : wanted)).norm() < 1e-12);
            CHECK((wrenchOf(walls, result) + (clamp > 0 ? wanted : Vec6(Vec6::Zero()))).norm() < 1e-9);
            if (clamp > 0)
                for (std::size_t i = 0; i < 2; ++i)
                    CHECK(walls[i].n.dot(result.forces[i]) == Approx(clamp).margin(1e-9));
        }
    }
    SECTION("a peg that touches its hole at two points stays jammed, or goes in") {
        for (const double jam : {0.0, 5.0}) {
            // The points face each other along a line within both cones, so that any force along it is balanced.
            std::vector<FrictionContact> points{pad({5, 0, 2}, 0.5, 0), pad({-5, 0, -2}, 0.5, 0)};
            points[0].n = -Vec3::UnitX(), points[1].n = Vec3::UnitX();
            for (FrictionContact& c : points) c.startForce = -jam * c.r.normalized();
            const Vec6 wanted = wantedOf(0, 0, -0.3);
            const FrictionResult result = solver.solve({kStiffness, wanted, points}, Vec6::Zero());
            REQUIRE(result.status == FrictionStatus::Exact);
            CHECK((result.x - (jam > 0 ? Vec6(Vec6::Zero()) : wanted)).norm() < 1e-12);
            CHECK((wrenchOf(points, result) + (jam > 0 ? wanted : Vec6(Vec6::Zero()))).norm() < 1e-9);
        }
    }
}

TEST_CASE("friction solver: two faces clamp a small part, which turns on stiffer springs than it moves on",
          "[qp][friction]") {
    Around about(3);
    ConeNewton solver(2);
    int missing = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        CAPTURE(trial);
        // A needle of half a millimeter, turned in a slot: the faces press with hundreds of N, the springs pull with 1.
        FrictionContact one = pad(about(0.24, -0.01, 0.165, 0.05), 0.3, 0), other = one;
        one.n = about(-0.914, 0.233, 0.332, 0.05).normalized();
        one.startForce = 0.15 * one.n;
        other.r = about(-0.245, 0.01, -0.185, 0.05);
        other.n = -one.n;
        other.gap = 1e-5 * std::abs(about.share());
        Vec6 wanted;
        wanted << about(-0.22, -0.19, -0.78, 0.1), about(0.14, 0.3, -0.18, 0.1);
        if (solver.solve({kStiffness, wanted, std::array{one, other}}, Vec6::Zero()).status == FrictionStatus::Exact)
            checkExact(solver, {one, other}, wanted, 1e-12);
        else
            ++missing;
    }
    CHECK(missing <= 3);  // those end with the budget
}

TEST_CASE("friction solver: what slides goes on in a few steps where its normals have turned a little",
          "[qp][friction]") {
    Around about(5);
    ConeNewton solver(2);
    int solves = 0, evaluations = 0, many = 0;
    for (int trial = 0; trial < 2000; ++trial) {
        CAPTURE(trial);
        std::vector<FrictionContact> contacts{pad(about(30, 0, -10, 10), 0.4, 0), pad(about(-30, 0, -10, 10), 0.4, 0)};
        contacts[0].n = about(-0.3, 0, 1, 0.2).normalized();
        contacts[1].n = about(0.3, 0, 1, 0.2).normalized();
        Vec6 wanted;
        wanted << about(0, 0, -4, 2), about(0, 0, 0, 0.02);
        const FrictionResult before = solver.solve({kStiffness, wanted, contacts}, Vec6::Zero());
        REQUIRE(before.status == FrictionStatus::Exact);
        bool slides = false, bear = true;
        for (std::size_t i = 0; i < contacts.size(); ++i) {
            FrictionContact& c = contacts[i];
            c.startForce = before.forces[i];
            c.slipped = c.slip(before.x);
            slides = slides || c.slipped.norm() > 1e-6;
            bear = bear && c.n.dot(c.startForce) > 0;
        }
        if (!slides || !bear) continue;
        for (FrictionContact& c : contacts) c.n = (c.n + 1e-4 * about(0, 0, 0, 1)).normalized();
        const FrictionResult after = solver.solve({kStiffness, wanted - before.x, contacts}, Vec6::Zero());
        REQUIRE(after.status == FrictionStatus::Exact);
        ++solves;
        evaluations += after.iterations;
        many += after.iterations > 20;
    }
    CHECK(solves > 500);
    CHECK(evaluations < 6 * solves);
    CHECK(many <= 5);
}

TEST_CASE("friction solver: where a tool that slides meets a second face, steps that circle end soon",
          "[qp][friction]") {
    Around about(11);
    ConeNewton solver(2);
    std::vector<int> evaluations;
    while (evaluations.size() < 10'000) {
        std::vector<FrictionContact> contacts{pad(about(30, 0, -10, 10), 0.4, 0), pad(about(-30, 0, -10, 10), 0.4, 0)};
        contacts[0].n = about(-0.3, 0, 1, 0.2).normalized();
        contacts[1].n = about(0.3, 0, 1, 0.5).normalized();
        Vec6 wanted;
        wanted << about(0, 0, -4, 2), about(0, 0, 0, 0.02);
        const FrictionResult before = solver.solve({kStiffness, wanted, std::span(contacts).first(1)}, Vec6::Zero());
        const double nearer = contacts[1].distance(before.x);
        if (before.forces[0].isZero(0) || nearer > -0.01) continue;
        contacts[0].startForce = before.forces[0];
        contacts[1].gap = -about.share() * nearer;
        if (contacts[1].gap < 0) continue;
        const FrictionResult after = solver.solve({kStiffness, wanted, contacts}, before.x);
        REQUIRE(after.status == FrictionStatus::Exact);
        evaluations.push_back(after.iterations);
    }
    CHECK(std::accumulate(evaluations.begin(), evaluations.end(), 0) < 12 * 10'000);
    CHECK(*percentile(evaluations, 99) <= 60);
}

TEST_CASE("friction solver: the residuals see each way in which an answer can be wrong", "[qp][friction]") {
    std::vector<FrictionContact> contacts{pad({0, 0, 0}, 0.5, 0)};
    const FrictionProblem problem{kStiffness, wantedOf(1, 0, -2), contacts};
    const auto residualsOf = [&](const Vec3& x, const Vec3& force) {
        Vec6 all = Vec6::Zero();
        all.head<3>() = x;
        return coulombResiduals(problem, all, std::array{force});
    };
    const CoulombResiduals right = residualsOf({0, 0, 0}, {-1, 0, 2});  // sticks at the edge of its cone
    CHECK(right.worst_N() < 1e-15);
    CHECK(right.overlap_mm + right.complementarity_mJ + std::abs(right.direction_mJ) < 1e-15);
    CHECK(residualsOf({0, 0, 0}, {-1, 0, 2.1}).balance_N == Approx(0.1));
    CHECK(residualsOf({0, 0, 0}, {-1.5, 0, 2}).cone_N == Approx(0.5));
    CHECK(residualsOf({0, 0, 0}, {0, 0, -1}).cone_N == Approx(1));
    CHECK(residualsOf({0, 0, -0.1}, {-1, 0, 2}).overlap_mm == Approx(0.1));
    CHECK(residualsOf({0, 0, 0.1}, {-1, 0, 2}).complementarity_mJ == Approx(0.2));
    CHECK(residualsOf({0.1, 0, 0}, {-0.5, 0, 2}).direction_mJ == Approx(0.05));
    CHECK(residualsOf({0.1, 0, 0}, {-1, 0, 2}).dissipation_mJ == Approx(0.1));
}

}  // namespace touchstone::cone_newton_tests
