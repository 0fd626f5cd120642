#include "tests/haptics/qp/qp_problems.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone::test {

std::vector<KnownProblem> knownProblems() {
    std::vector<KnownProblem> problems;
    const auto add = [&](std::string name, const Vec6& h, const Vec6& x, auto&& fill,
                         SolveStatus status = SolveStatus::Solved) {
        Contacts contacts(4096);
        contacts.wanted = h;
        fill(contacts);
        problems.push_back({std::move(name), std::move(contacts), status, x, 1});
    };
    const auto at = [](double x, double y, double z, double rx = 0, double ry = 0, double rz = 0) -> Vec6 {
        return (Vec6() << x, y, z, rx, ry, rz).finished();
    };
    const Vec3 X = Vec3::UnitX(), Y = Vec3::UnitY(), Z = Vec3::UnitZ();
    const Vec6 zero = Vec6::Zero();

    add("no rows", at(1, -2, 3, 0.01, -0.02, 0.03), at(1, -2, 3, 0.01, -0.02, 0.03), [](Contacts&) {});
    add("h inside", at(1, 2, -0.5, 0.01), at(1, 2, -0.5, 0.01), [&](Contacts& c) { c.wall(Z, 1).wall(-X, 2); });
    add("h on the boundary", at(1, 2, -0.5), at(1, 2, -0.5), [&](Contacts& c) { c.wall(Z, 0.5); });
    add("one wall", at(1, 2, -3, 0.1), at(1, 2, -0.5, 0.1), [&](Contacts& c) { c.wall(Z, 0.5); });
    add("a wall that is violated at x = 0", at(0, 1, 0), at(0, 1, 0.25), [&](Contacts& c) { c.wall(Z, -0.25); });
    add("a corner of two walls", at(-2, 1, -1), at(0, 1, -0.25), [&](Contacts& c) { c.wall(X, 0).wall(Z, 0.25); });
    add("a corner of three walls", at(-1, -2, -3), at(-0.1, -0.2, -0.3),
        [&](Contacts& c) { c.wall(X, 0.1).wall(Y, 0.2).wall(Z, 0.3); });

    // J = (0,0,1, 0,-10,0): q = 1 + 100/1000 = 1.1, J h = -1.1, so y = 1 and x = h + G⁻¹J'.
    const auto lever = [&](Contacts& c) { c.wall(Z, 0, 10 * X); };
    add("a wall on a lever of 10 mm", at(0, 0, -1.1), at(0, 0, -0.1, 0, -0.01, 0), lever);
    add("the same with rows a thousand times as long", at(0, 0, -1.1), at(0, 0, -0.1, 0, -0.01, 0),
        [&](Contacts& c) { c.row(1000 * at(0, 0, 1, 0, -10, 0), 0).row(1000 * at(1, 0, 0), 2000); });
    problems.back().rowLength = 1000;
    add("the same with rows a thousandth as long", at(0, 0, -1.1), at(0, 0, -0.1, 0, -0.01, 0),
        [&](Contacts& c) { c.row(0.001 * at(0, 0, 1, 0, -10, 0), 0).row(0.001 * at(1, 0, 0), 0.002); });
    problems.back().rowLength = 0.001;
    // J = (0.6,0,0.8, 40,0,-30): q = 1 + 1.6 + 0.9 = 3.5, J h = -3.5, y = 1.
    add("an inclined wall on a lever of 50 mm", at(0, 0, -4.375), at(0.6, 0, -3.575, 0.04, 0, -0.03),
        [&](Contacts& c) { c.wall(Vec3(0.6, 0, 0.8), 0, 50 * Y); });
    // In meters: G = diag(1000, ..., 1), J = (0,0,1, 0,-0.01,0), q = 0.001 + 0.0001, J h = -0.0011, y = 1 N.
    add("a wall in meters and newtons", at(0, 0, -0.0011), at(0, 0, -0.0001, 0, -0.01, 0), [&](Contacts& c) {
        c.stiffness << 1000, 1000, 1000, 1, 1, 1;
        c.wall(Z, 0, 0.01 * X);
    });

    add("redundant and repeated rows", at(0, 0, -2), zero, [&](Contacts& c) {
        for (int i = 0; i < 3; ++i) c.wall(Z, 0);
        for (int i = 0; i < 20; ++i) c.wall(Z, 1 + i).wall(Vec3(0.6, 0, 0.8), 2 + i);
    });
    add("rows that differ by 1e-9", at(0, 0, -1), zero,
        [&](Contacts& c) { c.wall(Z, 0).row(at(1e-9, 0, 1), 0).row(at(0, 0, 1, 0, 1e-9, 0), 0); });
    add("a groove, both walls pushing", at(1, 0, -1), zero,
        [&](Contacts& c) { c.wall(Vec3(0.8, 0, 0.6), 0).wall(Vec3(-0.8, 0, 0.6), 0); });
    // One wall: n·h = -0.8, x = h + 0.8 n.
    add("a groove, one wall pushing", at(1, 0, 0), at(0.36, 0, 0.48),
        [&](Contacts& c) { c.wall(Vec3(0.8, 0, 0.6), 0).wall(Vec3(-0.8, 0, 0.6), 0); });
    add("a slot wide enough", at(1, 0, 3), at(1, 0, 0.1), [&](Contacts& c) { c.wall(Z, 0.1).wall(-Z, 0.1); });
    add("a slot without width", at(1, 0, 3), at(1, 0, 0.1), [&](Contacts& c) { c.wall(Z, -0.1).wall(-Z, 0.1); });
    // Together the rows need 0.1 more than the slot has: the smallest slack is 0.1 + |z|, and |h_z| < w 0.1 cannot
    // move z from 0.
    add(
        "a slot too narrow", at(1, 0, 0.2), at(1, 0, 0), [&](Contacts& c) { c.wall(Z, -0.1).wall(-Z, -0.1); },
        SolveStatus::Elastic);
    // Beyond that (z - h) + w (0.1 + z) = 0 with w = 1000: z = (200.1 - 100) / 1001 = 0.1.
    add(
        "a slot too narrow, pushed hard", at(1, 0, 200.1), at(1, 0, 0.1),
        [&](Contacts& c) { c.wall(Z, -0.1).wall(-Z, -0.1); }, SolveStatus::Elastic);
    add("zero rows without a demand", at(0, 0, -1), zero,
        [&](Contacts& c) { c.row(zero, 0).wall(Z, 0).row(zero, 3).row(zero, 0); });
    add(
        "a zero row that nothing can satisfy", at(0, 0, -1), zero, [&](Contacts& c) { c.row(zero, -1).wall(Z, 0); },
        SolveStatus::Elastic);
    // All planes touch the unit ball. h is beyond one of them, which touches the ball at the answer.
    add("four thousand planes around a ball", at(0, 0, -3), at(0, 0, -1), [&](Contacts& c) {
        for (int i = 0; i < 4000; ++i) {
            const double z = 1 - 2 * i / 3999.0, angle = 2.399963229728653 * i, radius = std::sqrt(1 - z * z);
            c.wall(Vec3(radius * std::cos(angle), radius * std::sin(angle), z), 1);
        }
    });
    return problems;
}

}  // namespace touchstone::test
