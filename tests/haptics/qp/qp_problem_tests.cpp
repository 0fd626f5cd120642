#include <catch2/catch.hpp>
#include <limits>

#include "tests/haptics/qp/qp_problems.hpp"

namespace touchstone::qp_problem_tests {

using namespace touchstone::test;

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
}

TEST_CASE("row set: pads to eight with rows that nothing violates, whatever they held before", "[qp]") {
    RowSet rows(20);
    REQUIRE(rows.capacity() == 20);
    REQUIRE(rows.size() == 0);
    for (int i = 0; i < 20; ++i) rows.push(Vec6::Constant(-1), -1, 100 + i);
    rows.clear();
    rows.push(Vec6::LinSpaced(1, 6), 0.5, 7);
    REQUIRE(rows.size() == 1);
    REQUIRE(rows.row(0) == Vec6::LinSpaced(1, 6));
    REQUIRE(rows.gap()[0] == 0.5);
    REQUIRE(rows.id(0) == 7);
    for (int i = 1; i < 8; ++i) {
        REQUIRE(rows.row(i) == Vec6::Zero());
        REQUIRE(rows.gap()[i] == kInfinity);
    }

    for (int k = 0; k < 6; ++k) std::fill_n(rows.column(k), 24, 3.0);
    std::fill_n(rows.gap(), 24, -3.0);
    rows.setSize(17);
    REQUIRE(rows.row(16) == Vec6::Constant(3));
    for (int i = 17; i < 24; ++i) {
        REQUIRE(rows.row(i) == Vec6::Zero());
        REQUIRE(rows.gap()[i] == kInfinity);
    }
    for (int k = 0; k < 7; ++k) REQUIRE(reinterpret_cast<std::uintptr_t>(rows.column(k)) % 64 == 0);
}

TEST_CASE("row set: finds every identity if they ascend, and never returns a wrong row", "[qp]") {
    for (const int m : {0, 1, 2, 7, 8, 100}) {
        RowSet rows(100);
        for (int i = 0; i < m; ++i) rows.push(Vec6::Zero(), 0, 3 * std::uint64_t(i) + 5);
        for (std::uint64_t id = 0; id < 3 * std::uint64_t(m) + 10; ++id) {
            const bool there = id >= 5 && (id - 5) % 3 == 0 && (id - 5) / 3 < std::uint64_t(m);
            REQUIRE(rows.find(id) == (there ? int(id - 5) / 3 : -1));
        }
    }
    RowSet unsorted(5);
    for (const int id : {9, 2, 7, 1, 8}) unsorted.push(Vec6::Zero(), 0, id);
    for (std::uint64_t id = 0; id < 12; ++id) {
        const int row = unsorted.find(id);
        REQUIRE((row == -1 || unsorted.id(row) == id));
    }
}

TEST_CASE("kkt residuals: each of the four follows its definition", "[qp]") {
    Contacts contacts(4);
    contacts.wanted << 0, 0, -2, 0, 0, 0;
    contacts.wall(Vec3::UnitZ(), 0.5, Vec3(10, 0, 0)).wall(Vec3::UnitX(), 1);
    const QpProblem problem = contacts.problem();

    // s = (-1.5, 1) at x = h; without forces only row 0 is violated.
    KktResiduals kkt = kktResiduals(problem, contacts.wanted, {});
    REQUIRE(kkt.primal_mm == 1.5);
    REQUIRE(kkt.dual_N == 0);
    REQUIRE(kkt.stationarity_N == 0);
    REQUIRE(kkt.complementarity_mJ == 0);

    // y = (2, -3): G(x-h) - J'y = (3, 0, -2, 0, 20, 0); its torque is divided by the lever √1000 mm.
    const Multiplier multipliers[] = {{0, 2}, {1, -3}};
    kkt = kktResiduals(problem, contacts.wanted, multipliers);
    REQUIRE(kkt.primal_mm == 1.5);
    REQUIRE(kkt.dual_N == 3);
    REQUIRE(kkt.stationarity_N == Approx(std::sqrt(9 + 4 + 400 / 1000.0)).epsilon(1e-14));
    REQUIRE(kkt.complementarity_mJ == 3);
    REQUIRE(kktResiduals(problem, contacts.wanted, multipliers, -0.25).primal_mm == 0.25);

    // Feasible everywhere: no residual, although padding and slack rows are far from zero.
    REQUIRE(kktResiduals(problem, Vec6::Zero(), {}).primal_mm == 0);
    REQUIRE(kktResiduals({}, Vec6::Zero(), {}).primal_mm == 0);
}

TEST_CASE("kkt residuals: detect a violation in any row", "[qp]") {
    for (int bad = 0; bad < 27; ++bad) {
        Contacts contacts(27);
        for (int i = 0; i < 27; ++i) contacts.wall(Vec3::UnitZ(), i == bad ? -0.25 : 1);
        REQUIRE(kktResiduals(contacts.problem(), Vec6::Zero(), {}).primal_mm == 0.25);
    }
}

TEST_CASE("solve status: every status has its own name", "[qp]") {
    REQUIRE(std::string(name(SolveStatus::Solved)) == "solved");
    REQUIRE(std::string(name(SolveStatus::Elastic)) == "elastic");
    REQUIRE(std::string(name(SolveStatus::IterationLimit)) == "iteration-limit");
    REQUIRE(std::string(name(SolveStatus::Invalid)) == "invalid");
}

TEST_CASE("row set: an erased row leaves the others in order, and the padding behind them", "[qp]") {
    RowSet rows(20);
    for (int i = 0; i < 17; ++i) rows.push(Vec6::Constant(i), 0.5 * i, std::uint64_t(2 * i));
    rows.erase(16);
    rows.erase(0);
    rows.erase(6);
    REQUIRE(rows.size() == 14);
    for (int i = 0; i < rows.size(); ++i) {
        const int was = i < 6 ? i + 1 : i + 2;
        CHECK(rows.row(i) == Vec6::Constant(was));
        CHECK(rows.gap()[i] == 0.5 * was);
        CHECK(rows.find(std::uint64_t(2 * was)) == i);
    }
    CHECK(rows.find(14) == -1);
    CHECK(rows.gap()[14] == kInfinity);
}

}  // namespace touchstone::qp_problem_tests
