#pragma once
// How much the searches of a tick may do, in counts.
#include <algorithm>
#include <cstdint>
#include <limits>

namespace touchstone {

/// Counts the work of searches in tests, each of up to eight pairs at a time: of nodes of two trees, of leaves or of
/// features. A search that exceeds its part ends without an answer, and its caller makes the step shorter. Counts and
/// no clock, so that results are bit-reproducible.
class SearchBudget {
  public:
    struct Limits {
        static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max() / 4;
        std::int64_t tick = kNone;    ///< all searches of a tick, which ends with the step that exceeds it
        std::int64_t flight = kNone;  ///< of one search whether a motion is free or anything is near
        std::int64_t list = kNone;    ///< of one search for the pairs of a list
    };

    explicit SearchBudget(const Limits& limits) : limits_(limits) {}

    void beginTick() { *this = SearchBudget(limits_); }
    void beginFlight() { begin(std::min(limits_.flight, limits_.tick - spent_)); }
    /// Begins a search further than a step needs: nothing is left for it in a tick in which a search ended without an
    /// answer.
    void beginLookAhead() { begin(shortened_ ? 0 : std::min(limits_.list, limits_.tick - spent_)); }
    /// Begins a search without which a step cannot be made, whatever the tick has left.
    void beginList() { begin(limits_.list); }

    /// Counts tests of the search in progress. Returns whether it may go on.
    bool spend(std::int64_t tests) {
        spent_ += tests;
        shortened_ |= !fits();
        return fits();
    }
    /// Whether the search in progress is within its part.
    bool fits() const { return spent_ <= end_; }
    bool isTickSpent() const { return spent_ > limits_.tick; }
    std::int64_t spent() const { return spent_; }    ///< of this tick
    bool isShortened() const { return shortened_; }  ///< a search of this tick ended without an answer

  private:
    void begin(std::int64_t most) { end_ = spent_ + std::max<std::int64_t>(most, 0); }

    Limits limits_;
    std::int64_t spent_ = 0, end_ = 0;
    bool shortened_ = false;
};

}  // namespace touchstone
