// The exact solver against 113-bit arithmetic on problems made to break it.
#include <catch2/catch.hpp>

#include "tests/haptics/qp/qp_hard_problems.hpp"

namespace touchstone::qp_proof_tests {

using namespace touchstone::test;

namespace {

constexpr double kWeight = SolverSettings().elasticWeight;
constexpr double kWellConditioned = 1e6;

/// |v| in the metric of G.
double lengthOf(const QpProblem& problem, const Vec6& v) {
    return problem.stiffness.cwiseSqrt().cwiseProduct(v).norm();
}

struct Tally {
    int solved = 0, elastic = 0, invalid = 0, uncertain = 0, unneeded = 0;
};

/// Requires that the result is what it claims to be. `start`: the proof may begin at the result's rows.
void requireRight(const HardProblem& hard, const SolveResult& result, bool start, Tally& tally) {
    const QpProblem problem = hard.contacts.problem();
    if (hard.hardness & kNotFinite) {
        ++tally.invalid;
        REQUIRE(result.status == SolveStatus::Invalid);
        REQUIRE(result.x == Vec6::Zero());
        return;
    }
    const bool claimsSolved = result.status == SolveStatus::Solved;
    REQUIRE((claimsSolved || result.status == SolveStatus::Elastic));
    ++(claimsSolved ? tally.solved : tally.elastic);

    const double bound = 1e-9 * (1 + lengthOf(problem, problem.wanted));
    const double certificate = certificateOf(problem, result, kWeight);
    REQUIRE(certificate <= bound);

    const auto from = start ? result.multipliers : std::span<const Multiplier>();
    const Reference reference = referenceAnswer(problem, kWeight, from);
    CAPTURE(reference.condition, reference.force, reference.slack);
    if (!reference.certified) {
        ++tally.uncertain;
        return;
    }
    if (reference.feasible && !claimsSolved) {  // planes that meet far away, called contradicting: nothing is claimed
        tally.unneeded += reference.condition < kWellConditioned;
        return;
    }
    // Where rows contradict each other by less than the bound, either answer has its certificate.
    if ((result.slack > 0) != (reference.slack > 0) || reference.condition >= kWellConditioned) return;
    const Vec6 error = result.x - reference.x;
    // The last bits of x are no error.
    REQUIRE(lengthOf(problem, error) <= bound + 1e-15 * lengthOf(problem, reference.x));
    if (!claimsSolved) return;
    const Vec6 wrench = problem.stiffness.cwiseProduct(error);
    REQUIRE(error.head<3>().norm() <= 1e-6 * hard.mm);
    REQUIRE(wrench.head<3>().norm() <= 1e-6 * hard.N);
    REQUIRE(wrench.tail<3>().norm() <= 1e-4 * hard.N * hard.mm);
}

}  // namespace

TEST_CASE("exact solver: none of 100,000 hard problems is answered wrong", "[qp]") {
    constexpr int kProblems = 100'000, kFromNothing = 2000;
    std::mt19937_64 random(2025);
    const auto solver = solverTable()[kExactSolver].make(512);
    Tally tally;
    int capped = 0;
    for (int i = 0; i < kProblems; ++i) {
        const HardProblem hard = hardProblem(random);
        CAPTURE(i, hard.hardness, hard.mm, hard.N);
        solver->reset();
        const SolveResult result = solver->solve(hard.contacts.problem(), {});
        capped += result.iterations >= 400;
        requireRight(hard, result, i >= kFromNothing, tally);
    }
    CAPTURE(tally.solved, tally.elastic, tally.invalid, tally.uncertain, tally.unneeded, capped);
    REQUIRE(tally.solved > 60'000);
    REQUIRE(tally.elastic > 25'000);
    REQUIRE(tally.invalid > 5'000);
    REQUIRE(tally.uncertain < 3'500);  // slots without width whose rows are scaled: the last bit says whether they are
    REQUIRE(tally.unneeded <= 10);
    REQUIRE(capped <= 3);  // out of pivots, and softened
}

TEST_CASE("exact solver: planes that nearly coincide are not taken for contradicting ones", "[qp]") {
    // The nearest point of such planes is off by their condition times the last bit. Rows that only this error violates
    // must not be pivoted on: they would end in a contradiction that is not there.
    constexpr int kProblems = 50'000;
    constexpr double kLargest = 1e7;  // N: beyond it rows may be said to contradict each other
    std::mt19937_64 random(7);
    const auto solver = solverTable()[kExactSolver].make(80);
    int solved = 0, elastic = 0;
    for (int i = 0; i < kProblems; ++i) {
        const Contacts contacts = randomContacts(random, ContactKind::Degenerate, 1 + int(random() % 60));
        const QpProblem problem = contacts.problem();
        solver->reset();
        const SolveResult result = solver->solve(problem, {});
        CAPTURE(i, problem.rows->size(), result.slack, result.kkt.primal_mm);
        REQUIRE(certificateOf(problem, result, kWeight) <= 1e-9 * (1 + lengthOf(problem, problem.wanted)));
        if (result.status == SolveStatus::Solved) {
            ++solved;
            continue;
        }
        REQUIRE(result.status == SolveStatus::Elastic);
        ++elastic;
        const Reference reference = referenceAnswer(problem, kWeight);
        CAPTURE(reference.force, reference.condition);
        REQUIRE((!reference.certified || !reference.feasible || reference.force > kLargest));
    }
    CAPTURE(solved, elastic);
    REQUIRE(solved > 49'900);
}

}  // namespace touchstone::qp_proof_tests
