#pragma once
// Passes every value from one thread to another, in order.
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace touchstone {

/// Queue of fixed size between one producer and one consumer. If it is full, the newest value is dropped and counted,
/// so the producer never waits. Real time: wait-free on both sides; the constructor allocates and touches all memory.
template <class T>
class Ring {
  public:
    /// The capacity is rounded up to a power of two. `initial` is copied to every slot, so that memory that values own
    /// exists before the first push().
    explicit Ring(std::size_t capacity, const T& initial = T())
        : slots_(std::bit_ceil(capacity), initial), mask_(slots_.size() - 1) {}
    Ring(const Ring&) = delete;
    Ring& operator=(const Ring&) = delete;

    std::size_t capacity() const { return slots_.size(); }

    /// Producer: returns false if the value was dropped.
    bool push(const T& value) {
        const std::uint64_t end = end_.load(std::memory_order_relaxed);
        // Acquire: the consumer has finished reading the slot before it is overwritten.
        if (end - begin_.load(std::memory_order_acquire) == slots_.size()) {
            // Only the producer writes the counter, so a load and a store are enough.
            dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
            return false;
        }
        slots_[end & mask_] = value;
        end_.store(end + 1, std::memory_order_release);
        return true;
    }

    /// Consumer: takes the oldest value; returns false if the ring is empty.
    bool pop(T& value) {
        const std::uint64_t begin = begin_.load(std::memory_order_relaxed);
        if (begin == end_.load(std::memory_order_acquire)) return false;
        value = slots_[begin & mask_];
        begin_.store(begin + 1, std::memory_order_release);
        return true;
    }

    /// Number of values dropped so far; any thread may call it.
    std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

  private:
    std::vector<T> slots_;
    std::size_t mask_;
    // Each on its own cache line, since producer and consumer write one each.
    alignas(64) std::atomic<std::uint64_t> end_ = 0;    // number of pushed values; never wraps in practice
    alignas(64) std::atomic<std::uint64_t> begin_ = 0;  // number of popped values
    alignas(64) std::atomic<std::uint64_t> dropped_ = 0;
};

}  // namespace touchstone
