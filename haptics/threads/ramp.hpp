#pragma once
// A value that changes gradually over a number of ticks.

namespace touchstone {

/// Moves to its target linearly and reaches it exactly. It counts ticks and not time, so that runs are
/// bit-reproducible.
class Ramp {
  public:
    explicit Ramp(double value = 0) : value_(value), target_(value) {}

    void jump(double value) { *this = Ramp(value); }
    /// Starts a ramp from the present value; it takes at least one tick.
    void to(double target, int ticks) {
        target_ = target;
        left_ = ticks > 1 ? ticks : 1;
    }
    /// Advances by one tick and returns the new value.
    double next() {
        if (left_ > 0) {
            value_ += (target_ - value_) / left_;
            if (--left_ == 0) value_ = target_;
        }
        return value_;
    }

    double value() const { return value_; }
    double target() const { return target_; }

  private:
    double value_;
    double target_;
    int left_ = 0;  ///< ticks until the target is reached
};

}  // namespace touchstone
