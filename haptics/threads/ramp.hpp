#pragma once
// A value that changes over a count of ticks instead of at once.

namespace touchstone {

/// Moves to its target in a straight line and arrives exactly. Counts ticks, not time, so that runs repeat.
class Ramp {
  public:
    explicit Ramp(double value = 0) : value_(value), target_(value) {}

    void jump(double value) { *this = Ramp(value); }
    /// Starts from the present value; at least one tick.
    void to(double target, int ticks) {
        target_ = target;
        left_ = ticks > 1 ? ticks : 1;
    }
    /// One tick on: the new value.
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
    int left_ = 0;
};

}  // namespace touchstone
