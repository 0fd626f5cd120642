#include <catch2/catch.hpp>
#include <set>

#include "haptics/qp/row_screen.hpp"
#include "tests/haptics/qp/qp_problems.hpp"
#include "tests/support/alloc_count.hpp"

namespace touchstone::qp_screen_tests {

using namespace touchstone::test;

namespace {

constexpr double kReach = 50, kTrust = 0.5;

double ballLength(const Vec6& x) { return std::hypot(x.head<3>().norm(), kReach * x.tail<3>().norm()); }

/// Contacts within a millimeter, as the tick lists them.
Contacts nearContacts(std::mt19937_64& random, int m) {
    Contacts contacts = randomContacts(random, kContactKinds[random() % 3], m);
    contacts.wanted *= 0.3 / std::max(1e-9, ballLength(contacts.wanted));
    return contacts;
}

std::set<std::uint64_t> idsOf(const RowSet& rows) {
    std::set<std::uint64_t> ids;
    for (int i = 0; i < rows.size(); ++i) ids.insert(rows.id(i));
    return ids;
}

}  // namespace

TEST_CASE("row screen: drops rows that another row implies within the ball, by hand", "[qp]") {
    // Wall 0 has gap 0. Within 0.5 mm: the parallel walls 1 and 2 are implied; 3 is 0.1 rad off: |a - a0| t = 0.05, so
    // its gap of 0.04 is not enough and that of 4, 0.06, is; 5 faces it: |a - a0| t = 1.
    Contacts contacts(8);
    const Vec3 tilted(std::sin(0.1), 0, std::cos(0.1));
    contacts.wall(Vec3::UnitZ(), 0).wall(Vec3::UnitZ(), 0).wall(Vec3::UnitZ(), 3);
    contacts.wall(tilted, 0.04).wall(tilted, 0.06).wall(-Vec3::UnitZ(), 0.9);
    RowScreen screen(8);
    REQUIRE(idsOf(screen.run(contacts.rows, Screening::Screen, kReach, kTrust)) == std::set<std::uint64_t>{10, 40, 60});
    // cos 0.1 = 0.995: one cluster, whose least gap is kept.
    REQUIRE(idsOf(screen.run(contacts.rows, Screening::Cluster, kReach, kTrust)) == std::set<std::uint64_t>{10, 60});
    REQUIRE(&screen.run(contacts.rows, Screening::None, kReach, kTrust) == &contacts.rows);

    // A lever of 5 mm is a tenth of the reach: |a - a0| t = 0.05 again.
    Contacts levers(3);
    levers.wall(Vec3::UnitZ(), 0)
        .wall(Vec3::UnitZ(), 0.04, 5 * Vec3::UnitX())
        .wall(Vec3::UnitZ(), 0.06, 5 * Vec3::UnitY());
    REQUIRE(idsOf(screen.run(levers.rows, Screening::Screen, kReach, kTrust)) == std::set<std::uint64_t>{10, 20});
}

TEST_CASE("row screen: no point of the ball that satisfies the kept rows violates a dropped one", "[qp]") {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    RowScreen screen(300);
    int dropped = 0, inside = 0;
    for (int problem = 0; problem < 40; ++problem) {
        const Contacts contacts = nearContacts(random, 1 + int(random() % 300));
        const RowSet& left = screen.run(contacts.rows, Screening::Screen, kReach, kTrust);
        dropped += contacts.rows.size() - left.size();
        for (int sample = 0; sample < 200; ++sample) {
            Vec6 x;
            for (int k = 0; k < 6; ++k) x[k] = normal(random) / (k < 3 ? 1 : kReach);
            x *= kTrust / ballLength(x) * std::pow(std::uniform_real_distribution<double>(0, 1)(random), 1.0 / 6);
            if (kktResiduals({contacts.stiffness, x, &left}, x, {}).primal_mm > 0) continue;
            ++inside;
            REQUIRE(kktResiduals(contacts.problem(), x, {}).primal_mm <= 1e-12);
        }
    }
    REQUIRE(dropped > 2000);
    REQUIRE(inside > 500);
}

TEST_CASE("row screen: the answer is the same inside the ball, and an answer outside is reported", "[qp]") {
    std::mt19937_64 random(4);
    RowScreen screen(300);
    const auto full = findSolver(kExactSolver)->make(300), few = findSolver(kExactSolver)->make(300);
    int exact = 0, left = 0, all = 0, clustered = 0;
    double clusterError = 0;
    for (int i = 0; i < 300; ++i) {
        Contacts contacts = nearContacts(random, 300);
        if (i % 3 == 0) contacts.wanted *= 10;
        const QpProblem problem = contacts.problem();
        const RowSet& kept = screen.run(contacts.rows, Screening::Screen, kReach, kTrust);
        all += contacts.rows.size();
        left += kept.size();
        for (int row = 1; row < kept.size(); ++row) REQUIRE(kept.id(row - 1) < kept.id(row));
        full->reset();
        few->reset();
        const Vec6 expected = full->solve(problem, {}).x;
        const Vec6 x = few->solve({problem.stiffness, problem.wanted, &kept}, {}).x;
        if (RowScreen::isExact(Screening::Screen, x, kReach, kTrust)) {
            ++exact;
            REQUIRE(distanceMm(problem, x, expected) <= 1e-9);
        } else {
            REQUIRE(ballLength(x) > kTrust);
        }
        const RowSet& clusters = screen.run(contacts.rows, Screening::Cluster, kReach, kTrust);
        clustered += clusters.size();
        REQUIRE_FALSE(RowScreen::isExact(Screening::Cluster, x, kReach, kTrust));
        clusterError =
            std::max(clusterError,
                     distanceMm(problem, few->solve({problem.stiffness, problem.wanted, &clusters}, {}).x, expected));
    }
    CAPTURE(exact, left, all, clustered, clusterError);
    REQUIRE(exact > 150);
    REQUIRE(exact < 300);
    REQUIRE(2 * left < all);
    REQUIRE(4 * clustered < all);
    REQUIRE(clusterError > 0);
}

TEST_CASE("row screen: keeps the remaining rows when passes run out, and allocates nothing", "[qp]") {
    // Walls around a ball, all with the same gap: no wall implies another in a ball of 0.5 mm.
    Contacts contacts(1000);
    for (int i = 0; i < 1000; ++i) {
        const double z = 1 - 2 * i / 999.0, angle = 2.399963229728653 * i, radius = std::sqrt(1 - z * z);
        contacts.wall(Vec3(radius * std::cos(angle), radius * std::sin(angle), z), 1);
    }
    RowScreen screen(1000);
    const AllocationCounter counter;
    const int left = screen.run(contacts.rows, Screening::Screen, kReach, kTrust).size();
    REQUIRE(counter.count() == 0);
    REQUIRE(left == 1000);
    REQUIRE(screen.run(Contacts(8).rows, Screening::Screen, kReach, kTrust).size() == 0);
}

}  // namespace touchstone::qp_screen_tests
