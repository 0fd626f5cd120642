#pragma once
// The cone of Coulomb friction: the projection onto it, which is the law.
#include <cmath>
#include <cstdint>

#include "haptics/math/rigid.hpp"

namespace touchstone {

/// The mode of a contact: open, sticking by the force w itself, or sliding by one at the edge of its cone.
enum class ContactMode : std::uint8_t { Open, Stick, Slide };

/// A force f on the cone and its derivative, df/dw = share 1 + (rise - share) nn' + lean an' - fall aa'.
struct ConeForce {
    ContactMode mode = ContactMode::Open;
    Vec3 force = Vec3::Zero();
    Vec3 along = Vec3::Zero();  ///< a: direction of w_t
    double rise = 0, share = 0, lean = 0, fall = 0;

    Vec3 derivative(const Vec3& n, const Vec3& dw) const {
        const double dn = n.dot(dw);
        return share * dw + (rise - share) * dn * n + (lean * dn - fall * along.dot(dw)) * along;
    }
};

/// f = P(w): the law. f_n = max(0, w_n), and f_t = w_t or the nearest to it of size µ f_n. A contact with the force f,
/// the distance s and the slip u obeys Coulomb's law if f = P(f - ρ (s, u)) for any ρ > 0 (Alart and Curnier 1991).
/// choose(mode, along): the mode to use instead, beyond its bounds if necessary; `along` is the direction of w_t.
template <class Choose>
ConeForce projectOntoCone(const Vec3& w, const Vec3& n, double mu, Choose&& choose) {
    ConeForce to;
    const double normal = n.dot(w);
    const Vec3 tangential = w - normal * n;
    const double size = tangential.norm(), limit = mu * normal;
    if (size > 0) to.along = tangential * (1 / size);
    to.mode = choose(!(normal > 0)   ? ContactMode::Open
                     : size <= limit ? ContactMode::Stick
                                     : ContactMode::Slide,
                     to.along);
    if (to.mode == ContactMode::Open) return to;
    to.rise = to.share = 1;
    to.force = w;
    if (to.mode == ContactMode::Stick) return to;
    to.force = normal * n + limit * to.along;
    to.share = to.fall = size > 0 ? limit / size : 0;
    to.lean = mu;
    return to;
}
inline ConeForce projectOntoCone(const Vec3& w, const Vec3& n, double mu) {
    return projectOntoCone(w, n, mu, [](ContactMode mode, const Vec3&) { return mode; });
}

/// The same with corners rounded by parabolas, up to `rounding` N from where a contact opens and µ times as far from
/// where it begins to slide: smooth, inside the cone, and the law where rounding is 0. Pre: rounding > 0.
ConeForce projectRounded(const Vec3& w, const Vec3& n, double mu, double rounding, Vec3& widened);

}  // namespace touchstone
