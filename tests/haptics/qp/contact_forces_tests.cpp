// Contact forces with friction, from rows: a drawer between two rails, which jams.
#include <catch2/catch.hpp>
#include <random>

#include "haptics/qp/contact_forces.hpp"
#include "haptics/qp/solver.hpp"
#include "tests/support/alloc_count.hpp"

namespace touchstone::contact_forces_tests {

using test::AllocationCounter;

namespace {

const Vec6 kStiffness = (Vec6() << 1, 1, 1, 1000, 1000, 1000).finished();

/// A tool that may touch at some points.
struct Points final : RowContacts {
    double mu;
    std::vector<Vec3> r;
    RowSet rows{256};

    explicit Points(double mu_) : mu(mu_) {}
    void add(const Vec3& n, const Vec3& at, double gap) {
        Vec6 row;
        row << n, at.cross(n);
        rows.push(row, gap, r.size());
        r.push_back(at);
    }
    Place placeOf(std::uint64_t id) const noexcept override { return {r[std::size_t(id)], Vec3::Zero(), mu, mu}; }
};

}  // namespace

TEST_CASE("contact forces: what closes a gap and jams has an exact answer, or says that it has none",
          "[qp][friction]") {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> both(-1, 1);
    const auto about = [&](double x, double y, double z, double by) {
        return Vec3(x + by * both(random), y + by * both(random), z + by * both(random));
    };
    ConeNewton solver(ContactForces::kMaxContacts);
    ContactForces forces;
    const auto frictionless = findSolver(kExactSolver)->make(16);
    int none = 0;
    for (int trial = 0; trial < 900; ++trial) {
        CAPTURE(trial);
        // Pressed against the upper rail at two points; a third one comes to the lower rail.
        Points drawer(1.5);
        drawer.add(-Vec3::UnitZ(), about(-15.6, -2.6, 20.8, 1), 0);
        drawer.add(about(0.013, 0.145, 0.989, 0.05).normalized(), about(-3.2, -2.6, -19.8, 1), 0.0001);
        drawer.add(-Vec3::UnitZ(), about(-3.2, -3.7, 20.8, 1), 0);
        Vec6 wanted;
        wanted << about(-70, 50, -1.8, 6), about(0.17, 1.11, 0.32, 0.2);
        forces.forget();
        const Vec6 press = (Vec6() << 0, 0, 5, 0, 0, 0).finished();
        forces.solve({kStiffness, press, &drawer.rows}, {}, drawer, *frictionless, solver, true);
        forces.endTick();
        const AllocationCounter allocations;
        const ContactForces::Result result =
            forces.solve({kStiffness, wanted, &drawer.rows}, {}, drawer, *frictionless, solver, true);
        REQUIRE(allocations.count() == 0);
        none += result.friction != FrictionStatus::Exact;
        if (result.friction != FrictionStatus::Exact) continue;
        CHECK(result.residuals.isExact());
        const auto energy = [&](const Vec6& x) { return (x - wanted).dot(kStiffness.cwiseProduct(x - wanted)) / 2; };
        CHECK(energy(result.x) <= energy(Vec6::Zero()));
    }
    // What may not stick where it has slipped to in one increment has none.
    CHECK(none <= 40);
}

TEST_CASE("contact forces: a tool that is nearer than allowed at many points and jams there stays", "[qp][friction]") {
    Points slot(0.5);
    slot.add(Vec3::UnitZ(), {0, 0, -5}, 0);
    slot.add(-Vec3::UnitZ(), {1, 0, 5}, 0);
    ConeNewton solver(ContactForces::kMaxContacts);
    ContactForces forces;
    const auto frictionless = findSolver(kExactSolver)->make(slot.rows.capacity());
    const auto solve = [&](double pull) {
        Vec6 wanted = Vec6::Zero();
        wanted.head<3>() << pull, 0, -4;
        return forces.solve({kStiffness, wanted, &slot.rows}, {}, slot, *frictionless, solver, true);
    };
    solve(0.5);
    forces.endTick();
    for (int i = 0; i < 200; ++i)
        slot.add(Vec3::UnitZ(), {5 * std::cos(0.1 * i), 5 * std::sin(0.1 * i), -5}, -1e-6 * i);
    const ContactForces::Result result = solve(1);
    REQUIRE(result.friction == FrictionStatus::Exact);
    CHECK(result.x.norm() < 1e-12);
    CHECK(result.iterations < 500);
}

TEST_CASE("contact forces: of many rows that are crossed, those that will carry force are added together",
          "[qp][friction]") {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> both(-1, 1);
    const auto any = [&] { return Vec3(both(random), both(random), both(random)); };
    ConeNewton solver(ContactForces::kMaxContacts);
    const auto frictionless = findSolver(kExactSolver)->make(256);
    int evaluations = 0;
    for (int trial = 0; trial < 100; ++trial) {
        CAPTURE(trial);
        // Pressed onto three points, and then into a bowl of facets that it reaches beside them.
        Points bowl(0.4);
        for (int k = 0; k < 3; ++k)
            bowl.add(Vec3::UnitZ(), Vec3(10 * std::cos(2.1 * k), 10 * std::sin(2.1 * k), -5), 0);
        ContactForces forces;
        const Vec6 press = (Vec6() << 0, 0, -1, 0, 0, 0).finished();
        forces.solve({kStiffness, press, &bowl.rows}, {}, bowl, *frictionless, solver, true);
        forces.endTick();
        for (int i = 0; i < 120; ++i)
            bowl.add((Vec3::UnitZ() + 0.4 * any()).normalized(), Vec3(0, 0, -5) + 10 * any(),
                     0.002 * (1 + both(random)));
        Vec6 wanted;
        wanted << any() - 2 * Vec3::UnitZ(), 0.02 * any();
        const ContactForces::Result result =
            forces.solve({kStiffness, wanted, &bowl.rows}, {}, bowl, *frictionless, solver, true);
        CHECK(result.friction == FrictionStatus::Exact);
        CHECK(result.overlap == 0);
        evaluations += result.iterations;
    }
    CAPTURE(evaluations);
    CHECK(evaluations < 20000);
}

}  // namespace touchstone::contact_forces_tests
