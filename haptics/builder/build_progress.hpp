#pragma once
// Progress of a build, reported to the caller.
#include <algorithm>
#include <chrono>

#include "haptics/builder/tree_builder.hpp"

namespace touchstone {

/// Reports the progress to the caller. Throws BuildCancelled when the caller cancels.
class Progress {
  public:
    explicit Progress(const BuildProgress& callback) : callback_(callback) {}

    /// Begins a stage that ends at the given fraction of the whole build.
    void enter(double end) {
        fraction_ = std::max(fraction_, end_);
        end_ = std::max(end, fraction_);
        report();
    }
    /// Reports inside a stage, at most every 20 ms. The length of a stage is not known in advance, so each report moves
    /// the fraction by 5 % of the rest toward the end of the stage.
    void beat() {
        const auto now = std::chrono::steady_clock::now();
        if (now - reported_ < std::chrono::milliseconds(20)) return;
        fraction_ += 0.05 * (end_ - fraction_);
        report();
    }
    void finish() {
        fraction_ = end_ = 1;
        report();
    }

  private:
    void report() {
        reported_ = std::chrono::steady_clock::now();
        const double spent = std::chrono::duration<double>(reported_ - began_).count();
        const double left = fraction_ < kTooEarly ? -1 : spent * (1 - fraction_) / fraction_;
        if (callback_ && !callback_({fraction_, left})) throw BuildCancelled{};
    }

    static constexpr double kTooEarly = 0.05;  // fraction below which no remaining time is estimated

    const BuildProgress& callback_;
    double fraction_ = 0, end_ = 0;
    std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now(), reported_ = began_;
};

}  // namespace touchstone
