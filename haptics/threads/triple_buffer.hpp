#pragma once
// Passes the newest value from one thread to another.
#include <atomic>
#include <cstdint>

namespace touchstone {

/// Newest-wins hand-off between one writer and one reader: values that the reader does not take in time are
/// overwritten, and no value is torn. There are three slots: the writer fills one, the reader holds one, and the third
/// is exchanged atomically. Real time: wait-free on both sides, no allocation if copying T makes none.
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
    /// Writer: the slot to fill in place before publish(); it holds an old value.
    T& back() { return slots_[back_].value; }
    void publish() {
        // Release publishes the slot; acquire ensures that the reader no longer uses the slot taken in exchange.
        back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & kIndex;
    }

    /// Reader: takes the newest value. Returns false if none was published since the last call.
    bool update() {
        if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
        front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
        return true;
    }
    /// Reader: the value that the last update() took, or the initial value.
    const T& get() const { return slots_[front_].value; }

  private:
    static constexpr std::uint8_t kIndex = 3;
    static constexpr std::uint8_t kFresh = 4;
    static constexpr std::size_t kLine = 64;

    // Each on its own cache line, so that writer and reader never wait for each other's lines.
    struct alignas(kLine) Slot {
        T value;
    };
    Slot slots_[3];
    alignas(kLine) std::uint8_t back_ = 0;                 // the writer's slot
    alignas(kLine) std::atomic<std::uint8_t> middle_ = 1;  // the slot in between: its index and the fresh bit
    alignas(kLine) std::uint8_t front_ = 2;                // the reader's slot
};

}  // namespace touchstone
