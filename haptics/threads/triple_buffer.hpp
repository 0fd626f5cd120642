#pragma once
// The newest value from one thread to another.
#include <atomic>
#include <cstdint>

namespace touchstone {

/// Newest-wins hand-off between one writer and one reader: values the reader was too slow for are overwritten, never
/// torn. Three slots: the writer fills one, the reader holds one, and the third changes hands by an atomic exchange.
/// Real time: wait-free on both sides, no allocation if copying T makes none.
template <class T>
class TripleBuffer {
  public:
    explicit TripleBuffer(const T& initial = T()) : slots_{{initial}, {initial}, {initial}} {}
    TripleBuffer(const TripleBuffer&) = delete;
    TripleBuffer& operator=(const TripleBuffer&) = delete;

    /// Writer: makes `value` the newest.
    void write(const T& value) {
        back() = value;
        publish();
    }
    /// Writer: a value of its own, with an old content, to be filled in place and published.
    T& back() { return slots_[back_].value; }
    void publish() {
        // Release publishes the slot; acquire makes sure the reader has left the one taken over.
        back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex;
    }

    /// Reader: takes the newest value, if one came since the last call. Returns whether one did.
    bool update() {
        if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
        front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
        return true;
    }
    /// Reader: what the last update() took; the initial value before.
    const T& get() const { return slots_[front_].value; }

  private:
    static constexpr std::uint8_t kIndex = 3;
    static constexpr std::uint8_t kFresh = 4;
    static constexpr std::size_t kLine = 64;

    // On lines of their own: writer and reader never wait for each other's cache lines.
    struct alignas(kLine) Slot {
        T value;
    };
    Slot slots_[3];
    alignas(kLine) std::uint8_t back_ = 0;                 // the writer's
    alignas(kLine) std::atomic<std::uint8_t> middle_ = 1;  // nobody's: index and fresh bit
    alignas(kLine) std::uint8_t front_ = 2;                // the reader's
};

}  // namespace touchstone
