#pragma once
// Numbers that a broken driver or an edited file may give.
#include <cmath>
#include <iterator>
#include <limits>
#include <random>

#include "haptics/math/rigid.hpp"

namespace touchstone::test {

/// Numbers of every magnitude of a double, of both signs.
class AnyNumber {
  public:
    explicit AnyNumber(unsigned seed) : random_(seed) {}

    double number() {
        constexpr double kOdd[] = {0.0,
                                   -0.0,
                                   std::numeric_limits<double>::denorm_min(),
                                   std::numeric_limits<double>::min(),
                                   1e15,
                                   3e15,
                                   1e19,
                                   1.8e19,
                                   1e30,
                                   3.4e38,
                                   1e150,
                                   1.3e154,
                                   std::numeric_limits<double>::max()};
        const double sign = random_() % 2 ? 1 : -1;
        if (random_() % 3 == 0) return sign * kOdd[random_() % std::size(kOdd)];
        return sign * std::pow(10, std::uniform_real_distribution<double>(-20, 308)(random_));
    }
    double small() { return std::normal_distribution<double>(0, 60)(random_); }
    /// Some coordinates are large, some of the size of a body.
    Vec3 vector() {
        Vec3 v;
        for (double& x : v) x = random_() % 2 ? number() : small();
        return v;
    }
    Quat rotation() {
        std::normal_distribution<double> normal;
        return Quat(normal(random_), normal(random_), normal(random_), normal(random_)).normalized();
    }
    /// Not always of unit length or near it.
    Quat quaternion() {
        if (random_() % 2) return rotation();
        return Quat(number(), number(), number(), number());
    }
    unsigned next() { return unsigned(random_()); }

  private:
    std::mt19937 random_;
};

}  // namespace touchstone::test
