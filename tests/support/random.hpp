#pragma once
// Normally distributed vectors and poses from a seed.
#include <random>

#include "haptics/math/rigid.hpp"

namespace touchstone::test {

struct Random {
    explicit Random(unsigned seed) : engine(seed) {}
    std::mt19937 engine;
    std::normal_distribution<double> normal;
    Vec3 vector() { return {normal(engine), normal(engine), normal(engine)}; }
    Pose pose(double far, double turned) { return {far * vector(), expRotation(turned * vector())}; }
};

}  // namespace touchstone::test
