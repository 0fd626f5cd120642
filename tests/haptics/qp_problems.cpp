#include "qp_problems.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone::test {

Contacts& Contacts::row(const Vec6& j, double gap) {
    rows.push(j, gap, 10 * std::uint64_t(rows.size() + 1));
    return *this;
}

Contacts& Contacts::wall(const Vec3& n, double gap, const Vec3& r) {
    Vec6 j;
    j << n, r.cross(n);
    return row(j, gap);
}

namespace {

Vec3 randomUnit(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    Vec3 v;
    do {
        v = Vec3(normal(random), normal(random), normal(random));
    } while (v.norm() < 1e-3);
    return v.normalized();
}

}  // namespace

Contacts randomContacts(std::mt19937_64& random, Kind kind, int m) {
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> normal;
    Contacts contacts(m + 8);
    const Vec3 facing = randomUnit(random);

    // A few patches, each a piece of a curved surface with its own mean normal.
    struct Patch {
        Vec3 n, r;
        double radius, curvature, gap;
    };
    std::vector<Patch> patches(1 + random() % 4);
    for (std::size_t i = 0; i < patches.size(); ++i) {
        Patch& patch = patches[i];
        Vec3 n = facing;
        if (kind == Kind::Slide) n = (facing + 0.3 * randomUnit(random)).normalized();
        if (kind == Kind::Wedge) n = (facing + 0.9 * randomUnit(random)).normalized();
        if (kind == Kind::Pinch) n = i % 2 ? (-facing + 0.05 * randomUnit(random)).normalized() : facing;
        if (kind == Kind::Scattered) n = randomUnit(random);
        patch = {n, (20 + 30 * unit(random)) * randomUnit(random), 2 + 10 * unit(random), 1 / (5 + 50 * unit(random)),
                 0};
    }
    for (int i = 0; i < m; ++i) {
        const Patch& patch = patches[random() % patches.size()];
        Vec3 offset = patch.radius * Vec3(normal(random), normal(random), normal(random)) / 2;
        offset -= offset.dot(patch.n) * patch.n;
        const Vec3 n = (patch.n - patch.curvature * offset + 0.05 * randomUnit(random)).normalized();
        Vec3 r = patch.r + offset;
        if (r.norm() > 50) r *= 50 / r.norm();
        double gap = 0.5 * unit(random) * unit(random);
        if (kind == Kind::Pinch) gap += 0.02;
        if (kind == Kind::Scattered && unit(random) < 0.3) gap = -2 * unit(random);
        if (kind == Kind::Squeeze && i > 0 && unit(random) < 0.2) {  // against an earlier wall, with too little room
            const int other = int(random() % i);
            contacts.row(-contacts.rows.row(other), -contacts.rows.gap()[other] - 0.3 * unit(random));
            continue;
        }
        if (kind == Kind::Degenerate && i > 0 && unit(random) < 0.7) {
            // Copies, sums of two rows and opposed copies, exact or off by 1e-3 to 1e-9: vertices where many planes
            // meet.
            const Vec6 other = contacts.rows.row(int(random() % i));
            const Vec6 another = contacts.rows.row(int(random() % i));
            const double which = unit(random);
            const bool opposed = which >= 0.5 && which < 0.6;  // nearer to exact is a slot of no width: ill posed
            const double off = unit(random) < 0.5 ? 0 : std::pow(10, -3 - (opposed ? 2 : 6) * unit(random));
            Vec6 j = which < 0.5 ? other
                     : opposed   ? Vec6(-other)
                                 : Vec6((other + another) / std::max(0.1, (other + another).head<3>().norm()));
            for (int k = 0; k < 6; ++k) j[k] += (k < 3 ? 1 : 30) * off * normal(random);
            contacts.row(j, 0);
            continue;
        }
        if (kind == Kind::Degenerate) gap = unit(random) < 0.5 ? 0 : gap;
        contacts.wall(n, gap, r);
    }
    const double depth = 0.01 + 5 * unit(random) * unit(random);
    const Vec3 aside = randomUnit(random), axis = randomUnit(random);
    const double slant = 0.7 * unit(random), turn = 0.05 * unit(random);
    for (int k = 0; k < 3; ++k) {
        contacts.wanted[k] = -depth * (facing[k] + slant * aside[k]);
        contacts.wanted[k + 3] = turn * axis[k];
    }
    return contacts;
}

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
    // In metres: G = diag(1000, ..., 1), J = (0,0,1, 0,-0.01,0), q = 0.001 + 0.0001, J h = -0.0011, y = 1 N.
    add("a wall in metres and newtons", at(0, 0, -0.0011), at(0, 0, -0.0001, 0, -0.01, 0), [&](Contacts& c) {
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
    // Both rows ask for 0.1 more than there is: the least slack is 0.1 + |z|, and |h_z| < w 0.1 cannot move z from 0.
    add(
        "a slot too narrow", at(1, 0, 0.2), at(1, 0, 0), [&](Contacts& c) { c.wall(Z, -0.1).wall(-Z, -0.1); },
        SolveStatus::Elastic);
    // Beyond that (z - h) + w (0.1 + z) = 0 with w = 1000: z = (200.1 - 100) / 1001 = 0.1.
    add(
        "a slot too narrow, pushed hard", at(1, 0, 200.1), at(1, 0, 0.1),
        [&](Contacts& c) { c.wall(Z, -0.1).wall(-Z, -0.1); }, SolveStatus::Elastic);
    add("zero rows that ask for nothing", at(0, 0, -1), zero,
        [&](Contacts& c) { c.row(zero, 0).wall(Z, 0).row(zero, 3).row(zero, 0); });
    add(
        "a zero row that nothing can meet", at(0, 0, -1), zero, [&](Contacts& c) { c.row(zero, -1).wall(Z, 0); },
        SolveStatus::Elastic);
    // The planes touch the unit ball; the one that h lies behind touches it at the answer.
    add("four thousand planes around a ball", at(0, 0, -3), at(0, 0, -1), [&](Contacts& c) {
        for (int i = 0; i < 4000; ++i) {
            const double z = 1 - 2 * i / 3999.0, angle = 2.399963229728653 * i, radius = std::sqrt(1 - z * z);
            c.wall(Vec3(radius * std::cos(angle), radius * std::sin(angle), z), 1);
        }
    });
    return problems;
}

}  // namespace touchstone::test
