// Checks that hold for every friction solver of the table, with answers that follow from each solver's law.
#include <array>
#include <catch2/catch.hpp>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "haptics/qp/dual_active_set.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/qp/gauss_seidel_friction.hpp"
#include "haptics/qp/lemke_friction.hpp"
#include "tests/support/alloc_count.hpp"

namespace touchstone::friction_solver_tests {

using test::AllocationCounter;

namespace {

constexpr double kPi = std::numbers::pi;
const Vec6 kStiffness = (Vec6() << 1, 1, 1, 1000, 1000, 1000).finished();

/// Least friction force on a pyramid, over that on the cone.
double leastOf(const FrictionLaw& law) { return law.facets ? std::cos(kPi / law.facets) : 1; }

Vec6 wantedOf(const Vec3& translation) { return (Vec6() << translation, Vec3::Zero()).finished(); }
double springsOf(const Vec6& x, const Vec6& wanted, const Vec3& along) {
    return along.dot(kStiffness.head<3>().cwiseProduct(x.head<3>() - wanted.head<3>()));
}

/// Four feet of a block on a plane with the unit normal n through C, so that no pull at C turns the block.
std::vector<FrictionContact> feet(const Vec3& n, double mu) {
    std::vector<FrictionContact> contacts(4);
    const Vec3 t = n.unitOrthogonal(), b = n.cross(t);
    for (int i = 0; i < 4; ++i) {
        FrictionContact& c = contacts[std::size_t(i)];
        c.id = std::uint64_t(i);
        c.n = n;
        c.r = (i & 1 ? 5 : -5) * t + (i & 2 ? 5 : -5) * b;
        c.coefficient = mu;
    }
    return contacts;
}

struct RandomProblem {
    std::vector<FrictionContact> contacts;
    Vec6 wanted, stiffness;
    FrictionProblem problem() const { return {stiffness, wanted, contacts}; }
};

/// Contacts that face about one way, with gaps >= 0 and at rest, so that standing still is possible.
RandomProblem randomProblem(std::mt19937_64& random, int most) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> unit(0, 1);
    const auto direction = [&] { return Vec3(normal(random), normal(random), normal(random)).normalized(); };
    const Vec3 facing = direction();
    const double mu = std::array{0.2, 0.5, 0.9}[std::size_t(random() % 3)];
    RandomProblem made;
    made.contacts.resize(1 + random() % std::size_t(most));
    for (std::size_t i = 0; i < made.contacts.size(); ++i) {
        FrictionContact& c = made.contacts[i];
        c.id = i;
        c.n = (facing + 0.9 * unit(random) * direction()).normalized();
        c.r = (10 + 40 * unit(random)) * direction();
        c.gap = 0.05 * unit(random) * unit(random);
        c.coefficient = mu;
    }
    made.wanted << -(0.5 + 3 * unit(random)) * facing + 0.5 * direction(), 0.01 * direction();
    for (int k = 0; k < 6; ++k) made.stiffness[k] = kStiffness[k] * (0.5 + 3 * unit(random));
    return made;
}

}  // namespace

TEST_CASE("friction solver table: the first solver is exact, and names are unique and found", "[qp][friction]") {
    const auto table = frictionSolverTable();
    REQUIRE(table[0].exact);
    CHECK(table[0].name == kExactFrictionSolver);
    std::set<std::string_view> names;
    for (std::size_t i = 0; i < table.size(); ++i) {
        CHECK(names.insert(table[i].name).second);
        CHECK(findFrictionSolver(table[i].name) == &table[i]);
        CHECK_FALSE(table[i].summary.empty());
    }
    CHECK(findFrictionSolver("") == nullptr);
    CHECK(findFrictionSolver("simplex") == nullptr);
}

TEST_CASE("every friction solver: a block pulled in 64 directions slides with the force and direction of its law",
          "[qp][friction]") {
    const double mu = 0.3;
    const auto contacts = feet(Vec3::UnitZ(), mu);
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        const FrictionLaw& expected = info.law;
        const auto solver = info.make(4);
        double least = 2, most = 0, turned = 0;
        for (int k = 0; k < 64; ++k) {
            CAPTURE(k);
            const Vec3 along(std::cos(2 * kPi * k / 64), std::sin(2 * kPi * k / 64), 0);
            const FrictionProblem problem{kStiffness, wantedOf(3 * along - 2 * Vec3::UnitZ()), contacts};
            const FrictionResult result = solver->solve(problem, Vec6::Zero());
            REQUIRE(result.status == (info.exact ? FrictionStatus::Exact : FrictionStatus::Approximate));
            CHECK(result.x.tail<3>().norm() < expected.accuracy);  // rad
            Vec3 force = Vec3::Zero();
            for (const Vec3& f : result.forces) force += f;
            CHECK((force - kStiffness.head<3>().cwiseProduct((result.x - problem.wanted).head<3>())).norm() < 1e-9);
            const Vec3 friction(force.x(), force.y(), 0), slip(result.x.x(), result.x.y(), 0);
            const double ratio = friction.norm() / (mu * force.z());
            least = std::min(least, ratio), most = std::max(most, ratio);
            turned = std::max(turned, std::atan2(friction.cross(slip).norm(), -friction.dot(slip)));

            // The height: zero by Coulomb's law, µ max(-d·u) by the relaxation.
            const double height = result.x.z();
            if (expected.hovers) {
                CHECK(height <= mu * slip.norm() + expected.accuracy);
                CHECK(height >= mu * slip.norm() * leastOf(expected) - expected.accuracy);
            } else {
                CHECK(std::abs(height) < expected.accuracy);
                CHECK(force.z() == Approx(2).epsilon(expected.accuracy));
            }
        }
        // Pulls at the middle of two facets are among the 64, so the bounds are attained.
        CHECK(least == Approx(leastOf(expected)).epsilon(10 * expected.accuracy));
        CHECK(most == Approx(1).epsilon(10 * expected.accuracy));
        const double error = expected.facets ? kPi / expected.facets : 0;
        CHECK(turned <= error + 10 * expected.accuracy);
        CHECK(turned >= 0.7 * error);
    }
}

TEST_CASE("every friction solver: a block on a slope holds until tan(slope) = µ, then slides by what is not held",
          "[qp][friction]") {
    const double mu = 0.4;
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        const FrictionLaw& expected = info.law;
        const auto solver = info.make(4);
        for (const double part : {0.2, 0.9, 0.999, 1.001, 1.1, 2.0}) {
            CAPTURE(info.name, part);
            const double slope = std::atan(part * mu);
            // The facets of this normal begin along the slope, so pyramids hold as much as the cone.
            const Vec3 n(std::sin(slope), 0, std::cos(slope)), down(std::cos(slope), 0, -std::sin(slope));
            const auto contacts = feet(n, mu);
            const FrictionProblem problem{kStiffness, wantedOf({0, 0, -2}), contacts};
            const FrictionResult result = solver->solve(problem, Vec6::Zero());
            REQUIRE(result.status == (info.exact ? FrictionStatus::Exact : FrictionStatus::Approximate));
            const double pull = 2 * std::sin(slope), weight = 2 * std::cos(slope);
            double slip = std::max(0.0, pull - mu * weight), height = 0;
            if (expected.hovers) slip /= 1 + mu * mu, height = mu * slip;
            CHECK(down.dot(result.x.head<3>()) == Approx(slip).margin(10 * expected.accuracy));
            CHECK(n.dot(result.x.head<3>()) == Approx(height).margin(10 * expected.accuracy));
            CHECK((slip > 0) == (part > 1));
        }
    }
}

TEST_CASE("every friction solver: between two facets a block holds until µ F cos(π/facets)", "[qp][friction]") {
    const double mu = 0.4;
    const auto contacts = feet(Vec3::UnitZ(), mu);
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        const FrictionLaw& expected = info.law;
        const auto solver = info.make(4);
        const double angle = expected.facets ? kPi / expected.facets : 0.3;  // from a facet
        const Vec3 along(std::cos(angle), std::sin(angle), 0);
        for (const double part : {0.999, 1.001}) {
            CAPTURE(info.name, part);
            const double pull = part * mu * 2 * leastOf(expected);
            const FrictionProblem problem{kStiffness, wantedOf(pull * along - 2 * Vec3::UnitZ()), contacts};
            const double slip = along.dot(solver->solve(problem, Vec6::Zero()).x.head<3>());
            if (part < 1) CHECK(std::abs(slip) < 10 * expected.accuracy);
            if (part > 1) CHECK(slip > 3e-4);  // about 0.001 x 0.74 mm, less where the block hovers
        }
    }
}

TEST_CASE("friction solvers: the convex relaxation hovers at µ |u| while it slides, and the others do not",
          "[qp][friction]") {
    const double mu = 0.5, pull = 3, weight = 2;
    const auto contacts = feet(Vec3::UnitZ(), mu);
    const FrictionProblem problem{kStiffness, wantedOf({pull, 0, -weight}), contacts};
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        const FrictionLaw& expected = info.law;
        const FrictionResult result = info.make(4)->solve(problem, Vec6::Zero());
        const double slip = result.x.x(), height = result.x.z();
        // The relaxation's answer is h projected onto z = µ x: (pull - µ weight)/(1 + µ²) = 1.6 along x.
        CHECK(slip == Approx(expected.hovers ? 1.6 : 2.0).margin(expected.accuracy));
        CHECK(height == Approx(expected.hovers ? mu * slip : 0).margin(expected.accuracy));
        // Lifting the block makes it heavier, by 40 %: springs of 2.8 N instead of 2 N.
        CHECK(springsOf(result.x, problem.wanted, Vec3::UnitZ()) ==
              Approx(expected.hovers ? 2.8 : 2.0).margin(expected.accuracy));
    }
}

TEST_CASE("friction solvers: the relaxation is solved by two methods, which agree but not to the bit",
          "[qp][friction]") {
    const auto contacts = feet(Vec3::UnitZ(), 0.5);
    const FrictionProblem problem{kStiffness, wantedOf({3, 1, -2}), contacts};
    const auto answerOf = [&](std::string_view name) {
        return findFrictionSolver(name)->make(4)->solve(problem, Vec6::Zero()).x;
    };
    const Vec6 active = answerOf("convex"), pqp = answerOf("convex-pqp");
    CHECK((active - pqp).norm() < 1e-4);
    CHECK(active != pqp);
}

TEST_CASE("every friction solver: gaps and the slip since the tick began count", "[qp][friction]") {
    const double mu = 0.5;
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        const FrictionLaw& expected = info.law;
        const auto solver = info.make(4);
        auto contacts = feet(Vec3::UnitZ(), mu);
        for (FrictionContact& c : contacts) c.gap = 0.5, c.slipped = Vec3(0.1, 0, 7);  // along n there is no slip
        const FrictionProblem problem{kStiffness, wantedOf({0, 0, -2.5}), contacts};
        // 0.1 N of at most 1 N hold the contacts where they were when the tick began.
        CHECK((solver->solve(problem, Vec6::Zero()).x - wantedOf({-0.1, 0, -0.5})).norm() < 10 * expected.accuracy);
        for (FrictionContact& c : contacts) c.slipped = Vec3(3, 0, 0);
        const Vec6 x = solver->solve(problem, Vec6::Zero()).x;
        // 1 N pulls it back by 1 mm. The relaxation has x - h along (-µ, 1), with z = µ (x + 3) - 0.5.
        const double force = 2 + mu * 3 / (1 + mu * mu) - 2 * mu * mu / (1 + mu * mu);
        const Vec6 hovering = wantedOf({-mu * force, 0, force - 2.5});
        CHECK((x - (expected.hovers ? hovering : wantedOf({-1, 0, -0.5}))).norm() < 10 * expected.accuracy);
    }
}

TEST_CASE("every friction solver: without friction the answer is that of the exact QP solver", "[qp][friction]") {
    std::mt19937_64 random(3);
    const auto reference = makeDualActiveSet(18);
    int capped = 0, regularized = 0;
    std::map<std::string_view, int> compared;
    for (int trial = 0; trial < 100; ++trial) {
        RandomProblem made = randomProblem(random, 18);
        RowSet rows(18);
        for (FrictionContact& c : made.contacts) {
            c.coefficient = 0;
            rows.push((Vec6() << c.n, c.r.cross(c.n)).finished(), c.gap, c.id);
        }
        const SolveResult exact = reference->solve({made.stiffness, made.wanted, &rows}, {});
        REQUIRE(exact.status == SolveStatus::Solved);
        for (const FrictionSolverInfo& info : frictionSolverTable()) {
            CAPTURE(info.name, trial);
            const FrictionResult result = info.make(18)->solve(made.problem(), Vec6::Zero());
            // cone-newton says when contacts give way; measured: 1 of these 100, and 1 of 3,000.
            if (info.exact && result.status == FrictionStatus::Regularized) {
                ++regularized;
                CHECK((result.x - exact.x).norm() < 2e-3);
                continue;
            }
            REQUIRE(result.status == (info.exact ? FrictionStatus::Exact : FrictionStatus::Approximate));
            // A solver that sweeps may end at its cap where contacts share a load.
            if (info.law.sweeps > 0 && result.iterations == info.law.sweeps) {
                ++capped;
                continue;
            }
            ++compared[info.name];
            CHECK((result.x - exact.x).norm() < 100 * info.law.accuracy);
        }
    }
    CHECK(regularized <= 2);
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        CHECK(compared[info.name] >= (info.law.sweeps > 0 ? 1 : 98));
    }
    CHECK(capped > 0);
}

TEST_CASE("every friction solver: 1,000 random problems give finite answers that obey the solver's law",
          "[qp][friction]") {
    std::mt19937_64 random(5);
    std::vector<RandomProblem> problems;
    for (int i = 0; i < 1000; ++i) problems.push_back(randomProblem(random, i % 5 ? 8 : 18));  // PQP takes long on many
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        const FrictionLaw& expected = info.law;
        const auto solver = info.make(18);
        int answers = 0, capped = 0;
        for (std::size_t i = 0; i < problems.size(); ++i) {
            CAPTURE(i);
            const FrictionProblem problem = problems[i].problem();
            const FrictionResult result = solver->solve(problem, Vec6::Zero());
            REQUIRE(result.x.allFinite());
            REQUIRE(result.forces.size() == problem.contacts.size());
            for (const Vec3& f : result.forces) REQUIRE(f.allFinite());
            if (result.status != (info.exact ? FrictionStatus::Exact : FrictionStatus::Approximate)) continue;
            ++answers;
            const CoulombResiduals residuals = coulombResiduals(problem, result.x, result.forces);
            CHECK(residuals.balance_N < 1e-9);
            CHECK(residuals.cone_N < 1e-9);
            if (info.law.sweeps > 0 && result.iterations == info.law.sweeps) {
                ++capped;
                continue;
            }
            const double tolerance = 100 * expected.accuracy;
            CHECK(residuals.overlap_mm < tolerance);
            // Gaps are not negative and nothing else moves, so friction cannot drive the hand.
            CHECK(result.x.dot(problem.stiffness.cwiseProduct(result.x - problem.wanted)) <
                  (info.exact ? 1e-9 : tolerance));
            for (std::size_t k = 0; k < result.forces.size(); ++k) {
                const FrictionContact& c = problem.contacts[k];
                const Vec3& f = result.forces[k];
                const Vec3 u = c.slip(result.x);
                const double normal = c.n.dot(f), height = c.distance(result.x);
                const double heat = -(f - normal * c.n).dot(u), most = c.coefficient * normal * u.norm();
                // The relaxation keeps a loaded contact at its height over the slip, the others on the ground.
                if (expected.hovers)
                    CHECK(normal * (height - c.coefficient * u.norm()) < tolerance);
                else
                    CHECK(normal * height < tolerance);
                // Friction opposes the slip with all its force, that of the pyramid at least.
                CHECK(heat > most * leastOf(expected) - tolerance);
                CHECK(heat < most + tolerance);
            }
        }
        // Measured: cone-newton, from cold and with contacts at many angles, 997; Gauss-Seidel ends 184 at its cap.
        CHECK(answers >= (info.exact ? 980 : 1000));
        CHECK(capped < (info.name == "gauss-seidel" ? 250 : 1000));
    }
}

TEST_CASE("every friction solver: solve() allocates nothing, and an answer depends on its problem alone",
          "[qp][friction]") {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<RandomProblem> problems;
    for (int i = 0; i < 60; ++i) {
        problems.push_back(randomProblem(random, 22));
        if (i % 2 == 0) continue;
        for (FrictionContact& c : problems.back().contacts) {
            c.slipped = 0.1 * Vec3(unit(random), unit(random), unit(random));
            c.startForce = 0.1 * c.n;
        }
    }
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        const auto solver = info.make(22), other = info.make(64);
        for (int i = 0; i < 60; ++i) {
            CAPTURE(info.name, i);
            const FrictionProblem problem = problems[std::size_t(i)].problem();
            const AllocationCounter allocations;
            const FrictionResult result = solver->solve(problem, Vec6::Zero());
            REQUIRE(allocations.count() == 0);
            // The other solver comes from another problem.
            other->solve(problems[std::size_t(59 - i)].problem(), Vec6::Zero());
            const FrictionResult again = other->solve(problem, Vec6::Zero());
            REQUIRE(again.status == result.status);
            REQUIRE(again.iterations == result.iterations);
            REQUIRE(again.x == result.x);
            REQUIRE(std::equal(again.forces.begin(), again.forces.end(), result.forces.begin(), result.forces.end()));
        }
    }
}

TEST_CASE("friction solvers: a work limit ends what iterates, and a larger one changes nothing", "[qp][friction]") {
    std::mt19937_64 random(5);
    const RandomProblem made = randomProblem(random, 1);
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        const auto solver = info.make(64);
        RandomProblem many = made;
        many.wanted.head<3>() = -3 * made.contacts[0].n + made.contacts[0].n.unitOrthogonal();
        many.contacts = feet(made.contacts[0].n, 0.5);
        solver->limitWork(1'000'000'000);
        const FrictionResult whole = solver->solve(many.problem(), Vec6::Zero());
        const Vec6 x = whole.x;
        const int iterations = whole.iterations;
        CHECK(whole.status != FrictionStatus::None);
        solver->limitWork(64);
        const FrictionResult ended = solver->solve(many.problem(), Vec6::Zero());
        if (info.exact) {  // bounded without it
            CHECK(ended.iterations == iterations);
            CHECK(ended.x == x);
        } else {
            CHECK(ended.iterations < iterations);
            CHECK(ended.iterations <= 11);
            CHECK((ended.status == FrictionStatus::None) == (info.law.sweeps == 0));
        }
    }
}

TEST_CASE("every friction solver: without contacts the increment is the wanted one", "[qp][friction]") {
    const FrictionProblem problem{kStiffness, wantedOf({1, 2, 3}), {}};
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        const FrictionResult result = info.make(8)->solve(problem, Vec6::Zero());
        CHECK(result.status == (info.exact ? FrictionStatus::Exact : FrictionStatus::Approximate));
        CHECK((result.x - problem.wanted).norm() < 1e-12);
        CHECK(result.forces.empty());
    }
}

TEST_CASE("every friction solver: contacts that contradict each other have no answer, and the result says so",
          "[qp][friction]") {
    std::vector<FrictionContact> slot(2);  // 0.2 mm too narrow
    slot[0].n = Vec3::UnitX(), slot[1].n = -Vec3::UnitX();
    for (FrictionContact& c : slot) c.gap = -0.1, c.coefficient = 0.3;
    const FrictionProblem problem{kStiffness, wantedOf({0.5, 0, -1}), slot};
    const Vec6 start = wantedOf({0.01, 0, 0});
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        CAPTURE(info.name);
        const auto solver = info.make(2);  // owns the forces
        const FrictionResult result = solver->solve(problem, start);
        REQUIRE(result.x.allFinite());
        if (info.law.sweeps > 0) {
            CHECK(result.status == FrictionStatus::Approximate);
            CHECK(result.iterations == info.law.sweeps);
        } else if (info.exact) {
            CHECK(result.status != FrictionStatus::Exact);
            CHECK(result.iterations < 300);  // rounds and paths in which the forces grow
        } else {
            CHECK(result.status == FrictionStatus::None);
        }
        if (info.name.starts_with("lemke")) {
            CHECK(result.x == start);
            for (const Vec3& f : result.forces) CHECK(f.isZero(0));
        }
    }
}

TEST_CASE("Lemke's method: takes as many contacts as its tableau holds, and no more", "[qp][friction]") {
    for (const int facets : {4, 8}) {
        const int most = kMostLemkeUnknowns / (facets + 2);
        CHECK(most == (facets == 8 ? 24 : 40));
        const auto solver = makeLemkeFriction(100, facets);
        for (const int m : {most, most + 1}) {
            CAPTURE(facets, m);
            std::vector<FrictionContact> ring;
            for (int i = 0; i < m; ++i) {
                FrictionContact c;
                c.r = 8 * Vec3(std::cos(2 * kPi * i / m), std::sin(2 * kPi * i / m), 0);
                c.coefficient = 0.4;
                ring.push_back(c);
            }
            const Vec6 start = wantedOf({0, 0, 0.25});
            const FrictionResult result = solver->solve({kStiffness, wantedOf({3, 0, -2}), ring}, start);
            REQUIRE(result.forces.size() == std::size_t(m));
            Vec3 force = Vec3::Zero();
            for (const Vec3& f : result.forces) force += f;
            if (m == most) {
                CHECK(result.status == FrictionStatus::Approximate);
                CHECK((force - Vec3(-0.8, 0, 2)).norm() < 1e-9);
            } else {
                CHECK(result.status == FrictionStatus::None);
                CHECK(result.x == start);
                CHECK(force.isZero(0));
            }
        }
    }
}

TEST_CASE("Gauss-Seidel friction: the cap ends it with balanced forces, and a start at the answer saves sweeps",
          "[qp][friction]") {
    std::mt19937_64 random(11);
    int saved = 0;
    for (int trial = 0; trial < 50; ++trial) {
        RandomProblem made = randomProblem(random, 6);
        const auto capped = makeGaussSeidelFriction(6, {3, 1e-10}), solver = makeGaussSeidelFriction(6);
        const FrictionResult early = capped->solve(made.problem(), Vec6::Zero());
        CHECK(early.iterations <= 3);
        CHECK(early.status == FrictionStatus::Approximate);
        const CoulombResiduals residuals = coulombResiduals(made.problem(), early.x, early.forces);
        CHECK(residuals.worst_N() < 1e-12);
        const FrictionResult cold = solver->solve(made.problem(), Vec6::Zero());
        for (std::size_t i = 0; i < cold.forces.size(); ++i) made.contacts[i].startForce = cold.forces[i];
        const int sweeps = cold.iterations;
        const FrictionResult warm = solver->solve(made.problem(), Vec6::Zero());
        CHECK(warm.iterations <= sweeps);
        saved += warm.iterations <= 2 && sweeps > 2;
    }
    CHECK(saved >= 40);
}

}  // namespace touchstone::friction_solver_tests
