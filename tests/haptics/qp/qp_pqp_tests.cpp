#include <catch2/catch.hpp>
#include <cmath>

#include "haptics/qp/pqp.hpp"
#include "tests/haptics/qp/qp_problems.hpp"

namespace touchstone::qp_pqp_tests {

using namespace touchstone::test;

namespace {

SolverSettings paperSettings(int iterations) {
    SolverSettings settings;
    settings.paperForm = true;
    settings.tolerance = 0;  // |ΔF| < 0 never holds, so the solver does exactly maxIterations
    settings.maxIterations = iterations;
    return settings;
}

std::vector<double> forces(const SolveResult& result, int m) {
    std::vector<double> y(m, 0);
    for (const Multiplier& multiplier : result.multipliers) y[multiplier.row] = multiplier.value;
    return y;
}

}  // namespace

TEST_CASE("pqp, paper form: starts every row at 0.001", "[qp][pqp]") {
    Contacts contacts(20);
    contacts.wanted << 0, 0, -1, 0, 0, 0;
    for (int i = 0; i < 19; ++i) contacts.wall(Vec3::UnitZ(), 0.1 * i);
    const auto solver = makePqp(20);
    const SolveResult result = solver->solve(contacts.problem(), paperSettings(0));
    REQUIRE(result.status == SolveStatus::IterationLimit);
    REQUIRE(result.iterations == 0);
    REQUIRE(forces(result, 19) == std::vector<double>(19, 0.001));
    REQUIRE(result.x[2] == Approx(-1 + 0.019).epsilon(1e-14));  // (19), (20)
}

TEST_CASE("pqp, paper form: one iteration of (18) by hand", "[qp][pqp]") {
    // J = [(0,0,1), (0.6,0,-0.8), (0,1,0)], G = I on translations: Q = [1 -0.8 0; -0.8 1 0; 0 0 1], so r = (1, 1, 1).
    // h = (0,0,-2), g = (0.5, 0, 1): d = -(g + J h) = (1.5, -1.6, -1). With y = 0.001 in every row:
    //   row 0: (1.5 + 0.0008 + 0.001) / (0   + 0.001 + 0.001)
    //   row 1: (0   + 0.0008 + 0.001) / (1.6 + 0.001 + 0.001)
    //   row 2: (0   + 0      + 0.001) / (1   + 0.001 + 0.001)
    Contacts contacts(3);
    contacts.wanted << 0, 0, -2, 0, 0, 0;
    contacts.wall(Vec3::UnitZ(), 0.5).wall(Vec3(0.6, 0, -0.8), 0).wall(Vec3::UnitY(), 1);
    const auto solver = makePqp(3);
    const SolveResult result = solver->solve(contacts.problem(), paperSettings(1));
    REQUIRE(result.status == SolveStatus::IterationLimit);
    REQUIRE(result.iterations == 1);
    const double y0 = 0.001 * 1.5018 / 0.002, y1 = 0.001 * 0.0018 / 1.602, y2 = 0.001 * 0.001 / 1.002;
    const std::vector<double> y = forces(result, 3);
    REQUIRE(y[0] == Approx(y0).epsilon(1e-14));
    REQUIRE(y[1] == Approx(y1).epsilon(1e-14));
    REQUIRE(y[2] == Approx(y2).epsilon(1e-14));
    REQUIRE(result.x[0] == Approx(0.6 * y1).epsilon(1e-14));
    REQUIRE(result.x[1] == Approx(y2).epsilon(1e-14));
    REQUIRE(result.x[2] == Approx(-2 + y0 - 0.8 * y1).epsilon(1e-14));
}

TEST_CASE("pqp, paper form: r is the row sum of Q- where that exceeds the diagonal", "[qp][pqp]") {
    // Rows z, -z, -z: Q = [1 -1 -1; -1 1 1; -1 1 1], r = (2, 1, 1). h = 0, g = (-1, 0, 0): d = (1, 0, 0).
    //   row 0: (1 + 0.002 + 2 · 0.001) / (0 + 0.001 + 2 · 0.001), rows 1 and 2: (0.001 + 0.001) / (0.002 + 0.001)
    Contacts contacts(3);
    contacts.wall(Vec3::UnitZ(), -1).wall(-Vec3::UnitZ(), 0).wall(-Vec3::UnitZ(), 0);
    const auto solver = makePqp(3);
    const std::vector<double> y = forces(solver->solve(contacts.problem(), paperSettings(1)), 3);
    REQUIRE(y[0] == Approx(0.001 * 1.004 / 0.003).epsilon(1e-14));
    REQUIRE(y[1] == Approx(0.001 * 2.0 / 3).epsilon(1e-14));
    REQUIRE(y[2] == Approx(0.001 * 2.0 / 3).epsilon(1e-14));
}

TEST_CASE("pqp, paper form: stops at the first iteration that changes F by less than the tolerance", "[qp][pqp]") {
    std::mt19937_64 random(21);
    const Contacts contacts = randomContacts(random, ContactKind::Slide, 60);
    const QpProblem problem = contacts.problem();
    const auto solver = makePqp(60);
    SolverSettings settings = paperSettings(1'000'000);
    settings.tolerance = 0.01;
    const SolveResult stopped = solver->solve(problem, settings);
    REQUIRE(stopped.status == SolveStatus::Solved);
    const Vec6 x = stopped.x;
    const int n = stopped.iterations;
    REQUIRE(n > 1);

    // F of (16) from runs of fixed length: this also checks that F falls and that no run depends on the previous one.
    const auto F = [&](const SolveResult& result) {
        const Vec6 pull = problem.stiffness.cwiseProduct(result.x - problem.wanted);  // J'y
        double value = 0.5 * pull.dot(result.x - problem.wanted);
        for (const Multiplier& multiplier : result.multipliers) {
            const double d =
                -(problem.rows->gap()[multiplier.row] + problem.rows->row(multiplier.row).dot(problem.wanted));
            value -= multiplier.value * d;
        }
        return value;
    };
    double last = F(solver->solve(problem, paperSettings(0)));
    for (int i = 1; i <= n; ++i) {
        const SolveResult result = solver->solve(problem, paperSettings(i));
        const double value = F(result);
        REQUIRE(value <= last);
        REQUIRE((last - value < 0.01) == (i == n));
        last = value;
        if (i == n) REQUIRE(result.x == x);
    }
}

TEST_CASE("pqp, paper form: has no safeguard against a zero row, contradicting rows or more than 1,024 rows",
          "[qp][pqp]") {
    const auto solver = makePqp(1100);
    SolverSettings settings;
    settings.paperForm = true;

    Contacts zero(2);
    zero.wanted << 0, 0, -1, 0, 0, 0;
    zero.wall(Vec3::UnitZ(), 0).row(Vec6::Zero(), 0);
    SolveResult result = solver->solve(zero.problem(), settings);
    REQUIRE(result.status == SolveStatus::Invalid);  // 0/0
    REQUIRE(result.x == Vec6::Zero());

    Contacts narrow(2);
    narrow.wall(Vec3::UnitZ(), -0.5).wall(-Vec3::UnitZ(), -0.5);
    settings.workLimit = 4 * 1000;
    result = solver->solve(narrow.problem(), settings);
    REQUIRE(result.status == SolveStatus::IterationLimit);
    REQUIRE(result.iterations == 1000);  // rows² x iterations
    settings.workLimit = 4 * 2000;
    const double before = forces(result, 2)[0];
    REQUIRE(forces(solver->solve(narrow.problem(), settings), 2)[0] > 1.5 * before);  // grows without bound

    std::mt19937_64 random(2);
    settings = paperSettings(1);
    REQUIRE(solver->solve(randomContacts(random, ContactKind::Slide, 1024).problem(), settings).status ==
            SolveStatus::IterationLimit);
    REQUIRE(solver->solve(randomContacts(random, ContactKind::Slide, 1025).problem(), settings).status ==
            SolveStatus::Invalid);
}

TEST_CASE("pqp: Solved meets the tolerance, and a smaller tolerance gives a smaller error", "[qp][pqp]") {
    const auto pqp = makePqp(300);
    const auto exact = findSolver(kExactSolver)->make(300);
    double lastMean = 1e9;
    for (const double tolerance : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5}) {
        std::mt19937_64 random(31);
        double mean = 0;
        for (int i = 0; i < 60; ++i) {
            const Contacts contacts = randomContacts(random, kContactKinds[i % 3], 1 + int(random() % 300));
            const QpProblem problem = contacts.problem();
            SolverSettings settings;
            settings.tolerance = tolerance;
            pqp->reset();
            const SolveResult result = pqp->solve(problem, settings);
            CAPTURE(tolerance, i, result.iterations);
            REQUIRE(result.status == SolveStatus::Solved);
            const std::vector<double> y = forces(result, problem.rows->size());
            for (int row = 0; row < problem.rows->size(); ++row) {
                const Vec6 j = problem.rows->row(row);
                const double s = j.dot(result.x) + problem.rows->gap()[row];
                const double q = j.dot(j.cwiseQuotient(problem.stiffness));
                REQUIRE(std::abs(std::min(y[row], s / q)) < tolerance * (1 + 1e-9));
            }
            mean += (result.x - exact->solve(problem, settings).x).head<3>().norm() / 60;
        }
        CAPTURE(tolerance, mean, lastMean);
        REQUIRE(mean < 0.5 * lastMean);  // ten times the tolerance costs at least a factor of two
        lastMean = mean;
    }
    REQUIRE(lastMean < 1e-4);  // N at 1 N/mm
}

TEST_CASE("pqp: a warm start needs fewer iterations, and reset() clears it", "[qp][pqp]") {
    std::mt19937_64 random(41);
    const auto solver = makePqp(300);
    int cold = 0, warm = 0;
    for (int i = 0; i < 30; ++i) {
        Contacts contacts = randomContacts(random, kContactKinds[i % 3], 200);
        solver->reset();
        const int first = solver->solve(contacts.problem(), {}).iterations;
        cold += first;
        warm += solver->solve(contacts.problem(), {}).iterations;
        solver->reset();
        REQUIRE(solver->solve(contacts.problem(), {}).iterations == first);
    }
    REQUIRE(10 * warm < cold);
}

TEST_CASE("pqp: a contact that becomes loaded recovers although its force had decayed", "[qp][pqp]") {
    // The first ticks press on one wall only, so the force on the other decays to its lower bound. Then the device
    // presses on the other wall.
    Contacts contacts(2);
    contacts.wanted << -3, 0, 5, 0, 0, 0;
    contacts.wall(Vec3::UnitX(), 0).wall(Vec3::UnitZ(), 0);
    const auto solver = makePqp(2);
    for (int tick = 0; tick < 20; ++tick) solver->solve(contacts.problem(), {});
    contacts.wanted << 5, 0, -3, 0, 0, 0;
    const SolveResult result = solver->solve(contacts.problem(), {});
    REQUIRE(result.status == SolveStatus::Solved);
    REQUIRE(result.iterations < 200);
    REQUIRE(result.x[0] == Approx(5).margin(0.02));  // tolerance of 0.01 N in each force
    REQUIRE(result.x[2] == Approx(0).margin(0.02));
}

TEST_CASE("warm starts: rows in any order of identities give the same answer", "[qp]") {
    std::mt19937_64 random(51);
    for (const SolverInfo& info : solverTable()) {
        CAPTURE(info.name);
        for (int i = 0; i < 30; ++i) {
            const Contacts contacts = randomContacts(random, kContactKinds[i % 3], 100);
            Contacts shuffled(100);
            shuffled.wanted = contacts.wanted;
            std::vector<int> order(100);
            for (int k = 0; k < 100; ++k) order[k] = k;
            std::shuffle(order.begin(), order.end(), random);
            for (const int k : order)
                shuffled.rows.push(contacts.rows.row(k), contacts.rows.gap()[k], contacts.rows.id(k));

            const auto solver = info.make(100);
            SolverSettings settings;
            settings.tolerance = 1e-6;
            const Vec6 expected = solver->solve(contacts.problem(), settings).x;
            for (int again = 0; again < 2; ++again) {
                const SolveResult result = solver->solve(shuffled.problem(), settings);
                REQUIRE(result.status == SolveStatus::Solved);
                // Exact solvers: rounding. Others: a hundred times the tolerance, for nearly parallel rows.
                REQUIRE(distanceMm(contacts.problem(), result.x, expected) <= (info.exact ? 1e-9 : 2e-4));
            }
        }
    }
}

}  // namespace touchstone::qp_pqp_tests
