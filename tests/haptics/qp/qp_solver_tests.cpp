// Checks that hold for every solver of the table.
#include <catch2/catch.hpp>
#include <limits>
#include <set>

#include "tests/haptics/qp/qp_problems.hpp"
#include "tests/support/alloc_count.hpp"

namespace touchstone::qp_solver_tests {

using namespace touchstone::test;

namespace {

/// Approximate solvers stop by tolerance: at 1e-6 N a wall's force, and so the increment at 1 N/mm, is accurate to
/// about that; 1e-4 leaves room for vertices where rows are nearly parallel. Exact solvers get 1e-9 mm for rounding.
SolverSettings settingsFor(const SolverInfo& info) {
    SolverSettings settings;
    settings.tolerance = 1e-6;
    if (!info.exact) settings.workLimit = 20'000'000;
    return settings;
}
double allowedMm(const SolverInfo& info) { return info.exact ? 1e-9 : 1e-4; }

/// Contradicting rows have no dual optimum that an iteration on the dual, such as pqp, could reach: it may report the
/// limit instead.
bool mayReachLimit(const SolverInfo& info, const KnownProblem& known) {
    return !info.exact && known.status == SolveStatus::Elastic && known.name.find("slot") != std::string::npos;
}

/// The solver that renders by default promises more than the other exact ones.
bool isRenderer(const SolverInfo& info) { return info.name == kExactSolver; }

void requireFilled(const QpProblem& problem, const SolveResult& result, double scale) {
    const Residuals own = residualsOf(problem, result);
    REQUIRE(result.kkt.primal_mm == Approx(own.primal).margin(1e-12 * scale));
    REQUIRE(result.kkt.dual_N == Approx(own.dual).margin(1e-12 * scale));
    REQUIRE(result.kkt.stationarity_N == Approx(own.stationarity).margin(1e-11 * scale));
    REQUIRE(result.kkt.complementarity_mJ == Approx(own.complementarity).margin(1e-12 * scale));
}

}  // namespace

TEST_CASE("solver table: the first solver is exact, and names are unique and found", "[qp]") {
    const auto table = solverTable();
    REQUIRE(table[0].exact);
    REQUIRE(table[0].name == kExactSolver);
    std::set<std::string_view> names;
    for (std::size_t i = 0; i < table.size(); ++i) {
        REQUIRE(names.insert(table[i].name).second);
        REQUIRE(findSolver(table[i].name) == &table[i]);
        REQUIRE_FALSE(table[i].summary.empty());
    }
    REQUIRE(findSolver("") == nullptr);
    REQUIRE(findSolver("simplex") == nullptr);
}

TEST_CASE("every solver: reaches the optimum of each known problem, cold and warm", "[qp]") {
    for (const KnownProblem& known : knownProblems()) {
        const QpProblem problem = known.contacts.problem();
        for (const SolverInfo& info : solverTable()) {
            CAPTURE(known.name, info.name);
            const auto solver = info.make(4096);
            SolverSettings settings = settingsFor(info);
            settings.tolerance /= known.rowLength;  // a multiplier's unit is N per unit of length of its row
            for (int again = 0; again < 2; ++again) {
                const SolveResult result = solver->solve(problem, settings);
                if (mayReachLimit(info, known) && result.status == SolveStatus::IterationLimit) continue;
                REQUIRE(result.status == known.status);
                CAPTURE(result.x.transpose(), known.x.transpose());
                REQUIRE(distanceMm(problem, result.x, known.x) <= allowedMm(info));
                requireFilled(problem, result, 1 + known.contacts.wanted.norm());
                if (known.status == SolveStatus::Solved && info.exact) {
                    const Residuals own = residualsOf(problem, result);
                    // Rows may be up to a thousand times longer than unit length.
                    REQUIRE(own.primal <= 1e-8);
                    REQUIRE(own.dual == 0);
                    REQUIRE(own.stationarity <= 1e-11);
                    REQUIRE(own.complementarity <= 1e-8);
                    REQUIRE(result.slack == 0);
                }
            }
        }
    }
}

TEST_CASE("every exact solver: with h free the increment is h to the last bit and no row pushes", "[qp]") {
    for (const SolverInfo& info : solverTable()) {
        if (!info.exact) continue;  // an approximate solver may keep every force above zero, as pqp does
        for (const KnownProblem& known : knownProblems()) {
            if (known.name != "h inside" && known.name != "no rows") continue;
            const auto solver = info.make(4096);
            const SolveResult result = solver->solve(known.contacts.problem(), {});
            REQUIRE(result.x == known.contacts.wanted);
            REQUIRE(result.multipliers.empty());
        }
    }
}

TEST_CASE("every solver: the status says when the work limit was reached", "[qp]") {
    std::mt19937_64 random(11);
    const Contacts contacts = randomContacts(random, ContactKind::Wedge, 200);
    const QpProblem problem = contacts.problem();
    for (const SolverInfo& info : solverTable()) {
        CAPTURE(info.name);
        const auto solver = info.make(200);
        SolverSettings settings = settingsFor(info);
        settings.maxIterations = 1;
        SolveResult result = solver->solve(problem, settings);
        REQUIRE(result.status == SolveStatus::IterationLimit);
        REQUIRE(result.iterations <= 7);  // a dual pivot may drop up to six rows before it ends
        REQUIRE(result.x.allFinite());
        requireFilled(problem, result, 10);

        solver->reset();
        settings = settingsFor(info);
        settings.workLimit = 200;  // one iteration over 200 rows
        result = solver->solve(problem, settings);
        REQUIRE(result.status == SolveStatus::IterationLimit);
        solver->reset();
        REQUIRE(solver->solve(problem, settingsFor(info)).status == SolveStatus::Solved);
    }
}

TEST_CASE("every solver: NaN, infinity, bad stiffness or too many rows anywhere give Invalid and x = 0", "[qp]") {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    for (const SolverInfo& info : solverTable()) {
        const auto solver = info.make(32);
        for (const bool paper : {false, true}) {
            SolverSettings settings;
            settings.paperForm = paper;
            const auto requireInvalid = [&](const Contacts& contacts) {
                const SolveResult result = solver->solve(contacts.problem(), settings);
                REQUIRE(result.status == SolveStatus::Invalid);
                REQUIRE(result.x == Vec6::Zero());
                REQUIRE(result.multipliers.empty());
            };
            for (const int m : {1, 8, 19}) {
                std::mt19937_64 random(3);
                const Contacts good = randomContacts(random, ContactKind::Slide, m);
                for (const double bad : {nan, infinity, -infinity}) {
                    for (int k = 0; k < 6; ++k) {
                        CAPTURE(info.name, paper, m, bad, k);
                        Contacts contacts = good;
                        contacts.wanted[k] = bad;
                        requireInvalid(contacts);
                        contacts = good;
                        contacts.stiffness[k] = bad;
                        requireInvalid(contacts);
                    }
                    for (int row = 0; row < m; ++row) {
                        for (int k = 0; k < 7; ++k) {
                            CAPTURE(info.name, paper, m, bad, row, k);
                            Contacts contacts = good;
                            contacts.rows.column(k)[row] = bad;
                            requireInvalid(contacts);
                        }
                    }
                }
                for (const double bad : {0.0, -1.0}) {
                    Contacts contacts = good;
                    contacts.stiffness[4] = bad;
                    requireInvalid(contacts);
                }
                // Bad input has no effect on the next solve.
                settings.paperForm = false;
                const SolveResult result = solver->solve(good.problem(), settings);
                REQUIRE(result.status == SolveStatus::Solved);
                settings.paperForm = paper;
            }
            std::mt19937_64 random(3);
            requireInvalid(randomContacts(random, ContactKind::Slide, 33));
        }
    }
}

TEST_CASE("every solver: solve() and reset() allocate nothing", "[qp]") {
    std::mt19937_64 random(5);
    std::vector<Contacts> problems;
    for (const ContactKind kind : kContactKinds) {
        for (const int m : {1, 30, 300}) problems.push_back(randomContacts(random, kind, m));
    }
    for (const KnownProblem& known : knownProblems()) problems.push_back(known.contacts);
    for (const SolverInfo& info : solverTable()) {
        CAPTURE(info.name);
        const auto solver = info.make(4096);
        SolverSettings settings;
        settings.workLimit = 1'000'000;
        for (const bool paper : {false, true}) {
            settings.paperForm = paper;
            const AllocationCounter counter;
            for (const Contacts& contacts : problems) {
                solver->solve(contacts.problem(), settings);
                solver->solve(contacts.problem(), settings);
                solver->reset();
            }
            REQUIRE(counter.count() == 0);
        }
    }
}

TEST_CASE("every solver: the same calls give the same bits", "[qp]") {
    for (const SolverInfo& info : solverTable()) {
        CAPTURE(info.name);
        const auto first = info.make(300), second = info.make(300);
        std::mt19937_64 random(17);
        for (int i = 0; i < 40; ++i) {
            const Contacts contacts = randomContacts(random, kContactKinds[i % 3], 1 + int(random() % 300));
            const SolveResult a = first->solve(contacts.problem(), {}), b = second->solve(contacts.problem(), {});
            REQUIRE(a.status == b.status);
            REQUIRE(a.iterations == b.iterations);
            REQUIRE(a.x == b.x);
        }
    }
}

TEST_CASE("exact solvers: agree with 113-bit arithmetic on random contacts, cold and warm", "[qp]") {
    // If rows are violated by at most v, and x and forces balance, then |x - x*|² <= 2 v (sum of forces) in the metric
    // of G: add L(x*, y) <= f* and L(x, y*) <= f(x), both strongly convex in x. Where planes differ by 1e-9 the error
    // comes close to that bound; elsewhere it is about v times the forces, plus 1e-10 of rounding. A wrong active set
    // causes an error of micrometers.
    const auto allowed = [](const SolverInfo& info, ContactKind kind, const Reference& reference) {
        const double v = isRenderer(info) ? 1e-11 : 1e-9;  // 1e-12 and 1e-10, times 1 + depth
        return 1e-9 + (kind == ContactKind::Degenerate ? std::sqrt(2 * v * reference.force) : 1e-10 * reference.force);
    };
    constexpr double kLargest = 1e6;  // N: beyond it the last bits of the walls decide the answer
    for (const SolverInfo& info : solverTable()) {
        if (!info.exact) continue;
        int solved = 0, elastic = 0, limited = 0, skipped = 0;
        for (const ContactKind kind : kContactKinds) {
            const unsigned seed = 1000 + unsigned(kind);
            std::mt19937_64 random(seed);
            for (int i = 0; i < 250; ++i) {
                const int m = 1 + int(random() % (i % 4 ? 60 : 300));
                Contacts contacts = randomContacts(random, kind, m);
                const Vec6 moved = contacts.wanted + Vec6::Constant(0.02).cwiseQuotient(contacts.stiffness);
                const auto solver = info.make(300);
                SolveStatus warmStatus{};
                Vec6 warm;
                for (int tick = 0; tick < 2; ++tick) {
                    CAPTURE(info.name, seed, i, m, tick);
                    if (tick == 1) contacts.wanted = moved;
                    const QpProblem problem = contacts.problem();
                    const Reference reference = referenceAnswer(problem, SolverSettings().elasticWeight);
                    const SolveResult result = solver->solve(problem, {});
                    warmStatus = result.status;
                    warm = result.x;
                    REQUIRE(result.status != SolveStatus::Invalid);
                    if (!reference.certified || reference.force > kLargest) {
                        ++skipped;
                        continue;
                    }
                    if (result.status == SolveStatus::IterationLimit) {
                        ++limited;
                        continue;
                    }
                    const bool nearlyFeasible = !reference.feasible && reference.slack < 1e-6;
                    if (nearlyFeasible) {
                        ++skipped;  // either answer is within the tolerance of a contradiction
                        continue;
                    }
                    CAPTURE(reference.slack, result.kkt.primal_mm);
                    REQUIRE((result.status == SolveStatus::Solved) == reference.feasible);
                    (reference.feasible ? solved : elastic)++;
                    CAPTURE(reference.force, distanceMm(problem, result.x, reference.x));
                    REQUIRE(distanceMm(problem, result.x, reference.x) <= allowed(info, kind, reference));
                    REQUIRE(result.slack == Approx(reference.slack).margin(1e-9));

                    // Compare the residuals that the result reports with their definition.
                    const Residuals own = residualsOf(problem, result);
                    // Between planes 1e-9 apart, the split of a force is accurate only to 1e-16 / 1e-9.
                    const double scale = (kind == ContactKind::Degenerate ? 1e5 : 1) * (10 + reference.force);
                    REQUIRE(own.dual == 0);
                    REQUIRE(own.stationarity <= 1e-11 * scale);
                    requireFilled(problem, result, scale);
                    if (reference.feasible) REQUIRE(own.primal <= 1e-9);
                }
                if (warmStatus != SolveStatus::Solved) continue;
                solver->reset();
                const QpProblem problem = contacts.problem();
                const Reference reference = referenceAnswer(problem, SolverSettings().elasticWeight);
                const SolveResult cold = solver->solve(problem, {});
                if (cold.status != SolveStatus::Solved || reference.force > kLargest) continue;
                REQUIRE(distanceMm(problem, cold.x, warm) <= 2 * allowed(info, kind, reference));
            }
        }
        CAPTURE(info.name, solved, elastic, limited, skipped);
        REQUIRE(solved > 2200);
        REQUIRE(elastic > 400);
        REQUIRE(limited <= (isRenderer(info) ? 0 : 50));  // other methods may give up, but their answers must be right
        REQUIRE(skipped < 120);
    }
}

}  // namespace touchstone::qp_solver_tests
