#pragma once
// A hand without a plan, for what holds whatever a hand does.
#include <functional>

#include "tests/support/random.hpp"

namespace touchstone::test {

/// Wanders at up to 1 m/s and 30 rad/s around a home, stops for 30 ticks of each 100, and leaps at each 150th tick. The
/// same seed gives the same poses.
class WanderingHand {
  public:
    /// `size`: of the leaps, mm. `home`: picks a new home before a leap; without it home is the origin.
    WanderingHand(unsigned seed, double size, std::function<Pose(std::mt19937&)> home = {})
        : random_(seed), size_(size), newHome_(std::move(home)) {}

    Pose next() {
        const int tick = tick_++;
        if (tick % 100 >= 70) return pose_;
        if (tick % 150 == 0) leap(tick);
        shift_ = 0.95 * shift_ + 0.05 * random_.vector() - 0.002 * (pose_.p - home_.p);
        turn_ = 0.95 * turn_ + 0.003 * random_.vector();
        pose_.p += shift_;
        pose_.q = (expRotation(turn_) * pose_.q).normalized();
        return pose_;
    }

  private:
    void leap(int tick) {
        if (newHome_) {
            home_ = newHome_(random_.engine);
            // Every other time close to the home, where the parts fit, and turned little against it.
            const bool close = tick % 300 == 0;
            pose_.p = home_.p + (close ? 1.0 : size_) * random_.vector();
            pose_.q = (expRotation((close ? 0.02 : 0.5) * random_.vector()) * home_.q).normalized();
        } else
            pose_.p = size_ * random_.vector();
    }

    Random random_;
    double size_;
    std::function<Pose(std::mt19937&)> newHome_;
    int tick_ = 0;
    Pose pose_, home_;
    Vec3 shift_ = Vec3::Zero(), turn_ = Vec3::Zero();
};

}  // namespace touchstone::test
