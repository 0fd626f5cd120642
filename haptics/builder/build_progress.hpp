#pragma once
// How far a build is, told to whoever asked for it.
#include <algorithm>
#include <chrono>

#include "haptics/builder/tree_builder.hpp"

namespace touchstone {

/// Passes the progress on, at most every 20 ms, and cancels by throwing BuildCancelled.
class Progress {
  public:
    explicit Progress(const BuildProgress& report) : report_(report) {}

    /// Enters a stage that ends at the given fraction of the whole.
    void enter(double end) {
        fraction_ = std::max(fraction_, end_);
        end_ = std::max(end, fraction_);
        tell();
    }
    /// A sign of life inside the stage: creeps toward its end.
    void beat() {
        const auto now = std::chrono::steady_clock::now();
        if (now - told_ < std::chrono::milliseconds(20)) return;
        fraction_ += 0.05 * (end_ - fraction_);
        tell();
    }
    void finish() {
        fraction_ = end_ = 1;
        tell();
    }

  private:
    void tell() {
        told_ = std::chrono::steady_clock::now();
        const double spent = std::chrono::duration<double>(told_ - began_).count();
        const double left = fraction_ < kTooEarly ? -1 : spent * (1 - fraction_) / fraction_;
        if (report_ && !report_({fraction_, left})) throw BuildCancelled{};
    }

    static constexpr double kTooEarly = 0.05;  // to judge the time left

    const BuildProgress& report_;
    double fraction_ = 0, end_ = 0;
    std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now(), told_ = began_;
};

}  // namespace touchstone
