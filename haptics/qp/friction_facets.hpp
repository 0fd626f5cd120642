#pragma once
// The facets of a friction cone, for the solvers that replace the cone by a pyramid.
#include <cmath>
#include <numbers>

#include "haptics/math/rigid.hpp"

namespace touchstone {

/// Tangent directions to the edges of a friction pyramid: unit vectors at equal angles in the plane across n. A
/// friction force on the pyramid is at least cos(π/facets) of the force on the cone. Pre: n has unit length, and
/// `facets` is even, so that the directions come in opposite pairs. Real time: no allocation.
class Facets {
  public:
    Facets(const Vec3& n, int facets) : first_(n.unitOrthogonal()), second_(n.cross(first_)), facets_(facets) {}
    Vec3 direction(int k) const {
        const double angle = 2 * std::numbers::pi * k / facets_;
        return std::cos(angle) * first_ + std::sin(angle) * second_;
    }

  private:
    Vec3 first_, second_;
    int facets_;
};

}  // namespace touchstone
