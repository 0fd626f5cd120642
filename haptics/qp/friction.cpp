#include "haptics/qp/friction.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace touchstone {

CoulombResiduals coulombResiduals(const FrictionProblem& problem, const Vec6& x, std::span<const Vec3> forces) {
    assert(forces.size() == problem.contacts.size());
    CoulombResiduals r;
    Vec6 balance = problem.stiffness.cwiseProduct(x - problem.wanted);
    for (std::size_t i = 0; i < forces.size(); ++i) {
        const FrictionContact& c = problem.contacts[i];
        const double normal = c.n.dot(forces[i]), s = c.distance(x);
        const Vec3 tangential = forces[i] - normal * c.n, u = c.slip(x);
        balance.head<3>() -= forces[i];
        balance.tail<3>() -= c.r.cross(forces[i]);
        r.overlap_mm = std::max(r.overlap_mm, -s);
        r.cone_N = std::max({r.cone_N, tangential.norm() - c.coefficient * normal, -normal});
        r.complementarity_mJ = std::max(r.complementarity_mJ, std::abs(normal * s));
        r.direction_mJ = std::max(r.direction_mJ, c.coefficient * normal * u.norm() + tangential.dot(u));
        r.dissipation_mJ -= tangential.dot(u);
    }
    const double lever2 = problem.stiffness.tail<3>().sum() / problem.stiffness.head<3>().sum();
    r.balance_N = std::sqrt(balance.head<3>().squaredNorm() + balance.tail<3>().squaredNorm() / lever2);
    return r;
}

double CoulombResiduals::worst() const {
    return std::max({balance_N, overlap_mm, cone_N, complementarity_mJ, direction_mJ});
}

CoulombResiduals worstOf(const CoulombResiduals& a, const CoulombResiduals& b) {
    return {std::max(a.balance_N, b.balance_N),
            std::max(a.overlap_mm, b.overlap_mm),
            std::max(a.cone_N, b.cone_N),
            std::max(a.complementarity_mJ, b.complementarity_mJ),
            std::max(a.direction_mJ, b.direction_mJ),
            b.dissipation_mJ};
}

}  // namespace touchstone
