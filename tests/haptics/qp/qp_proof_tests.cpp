// Compares the exact solver with 113-bit arithmetic on problems made to break it.
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

/// Requires that the result satisfies what its status claims. `start`: the proof may begin with the result's rows.
void requireCorrect(const HardProblem& hard, const SolveResult& result, bool start, Tally& tally) {
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
    if (reference.feasible &&
        !claimsSolved) {  // planes that meet far away count as contradicting: the status claims no more
        tally.unneeded += reference.condition < kWellConditioned;
        return;
    }
    // Where rows contradict each other by less than the bound, both answers have a certificate.
    if ((result.slack > 0) != (reference.slack > 0) || reference.condition >= kWellConditioned) return;
    const Vec6 error = result.x - reference.x;
    // Differences in the last bits of x are no error.
    REQUIRE(lengthOf(problem, error) <= bound + 1e-15 * lengthOf(problem, reference.x));
    if (!claimsSolved) return;
    const Vec6 wrench = problem.stiffness.cwiseProduct(error);
    REQUIRE(error.head<3>().norm() <= 1e-6 * hard.mm);
    REQUIRE(wrench.head<3>().norm() <= 1e-6 * hard.N);
    REQUIRE(wrench.tail<3>().norm() <= 1e-4 * hard.N * hard.mm);
}

}  // namespace

TEST_CASE("exact solver: no wrong answer in 100,000 hard problems", "[qp][long]") {
    constexpr int kProblems = 100'000, kColdStarts = 2000;
    std::mt19937_64 random(2025);
    const auto solver = findSolver(kExactSolver)->make(512);
    Tally tally;
    int capped = 0;
    for (int i = 0; i < kProblems; ++i) {
        const HardProblem hard = hardProblem(random);
        CAPTURE(i, hard.hardness, hard.mm, hard.N);
        solver->reset();
        const SolveResult result = solver->solve(hard.contacts.problem(), {});
        capped += result.iterations >= 400;
        requireCorrect(hard, result, i >= kColdStarts, tally);
    }
    CAPTURE(tally.solved, tally.elastic, tally.invalid, tally.uncertain, tally.unneeded, capped);
    REQUIRE(tally.solved > 60'000);
    REQUIRE(tally.elastic > 25'000);
    REQUIRE(tally.invalid > 5'000);
    REQUIRE(tally.uncertain <
            3'500);  // slots of zero width with scaled rows: the last bit decides whether they are feasible
    REQUIRE(tally.unneeded <= 10);
    REQUIRE(capped <= 3);  // reached the pivot limit and were softened
}

TEST_CASE("exact solver: planes that nearly coincide do not count as contradicting", "[qp][long]") {
    // Rounding moves the nearest point of such planes by their condition number times the last bit. The solver must not
    // pivot on rows that only this error violates: it would report a contradiction that does not exist.
    constexpr int kProblems = 50'000;
    constexpr double kLargest = 1e7;  // N: beyond it rows may count as contradicting
    std::mt19937_64 random(7);
    const auto solver = findSolver(kExactSolver)->make(80);
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
