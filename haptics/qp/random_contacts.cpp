#include "haptics/qp/random_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace touchstone {

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

Contacts randomContacts(std::mt19937_64& random, ContactKind kind, int m) {
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> normal;
    Contacts contacts(m + 8);
    const Vec3 facing = randomUnit(random);

    // A few patches. Each is a piece of a curved surface with its own mean normal.
    struct Patch {
        Vec3 n, r;
        double radius, curvature, gap;
    };
    std::vector<Patch> patches(1 + random() % 4);
    for (std::size_t i = 0; i < patches.size(); ++i) {
        Patch& patch = patches[i];
        Vec3 n = facing;
        if (kind == ContactKind::Slide) n = (facing + 0.3 * randomUnit(random)).normalized();
        if (kind == ContactKind::Wedge) n = (facing + 0.9 * randomUnit(random)).normalized();
        if (kind == ContactKind::Pinch) n = i % 2 ? (-facing + 0.05 * randomUnit(random)).normalized() : facing;
        if (kind == ContactKind::Scattered) n = randomUnit(random);
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
        if (kind == ContactKind::Pinch) gap += 0.02;
        if (kind == ContactKind::Scattered && unit(random) < 0.3) gap = -2 * unit(random);
        if (kind == ContactKind::Squeeze && i > 0 &&
            unit(random) < 0.2) {  // against an earlier wall, with too little room
            const int other = int(random() % i);
            contacts.row(-contacts.rows.row(other), -contacts.rows.gap()[other] - 0.3 * unit(random));
            continue;
        }
        if (kind == ContactKind::Degenerate && i > 0 && unit(random) < 0.7) {
            // Copies, sums of two rows and opposed copies, exact or perturbed by 1e-3 to 1e-9, make vertices where many
            // planes meet.
            const Vec6 other = contacts.rows.row(int(random() % i));
            const Vec6 another = contacts.rows.row(int(random() % i));
            const double which = unit(random);
            const bool opposed =
                which >= 0.5 && which < 0.6;  // a smaller perturbation is a slot of no width: ill posed
            const double off = unit(random) < 0.5 ? 0 : std::pow(10, -3 - (opposed ? 2 : 6) * unit(random));
            Vec6 j = which < 0.5 ? other
                     : opposed   ? Vec6(-other)
                                 : Vec6((other + another) / std::max(0.1, (other + another).head<3>().norm()));
            for (int k = 0; k < 6; ++k) j[k] += (k < 3 ? 1 : 30) * off * normal(random);
            contacts.row(j, 0);
            continue;
        }
        if (kind == ContactKind::Degenerate) gap = unit(random) < 0.5 ? 0 : gap;
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

}  // namespace touchstone
