#pragma once
// Every value from one thread to another, in order.
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace touchstone {

/// Queue of fixed size between one producer and one consumer. When it is full the newest value is dropped and counted,
/// so the producer never waits. Real time: wait-free on both sides; all memory is taken and touched in the constructor.
template <class T>
class Ring {
  public:
    /// Capacity is rounded up to a power of two. `initial` is in every slot: it brings the memory that values need.
    explicit Ring(std::size_t capacity, const T& initial = T())
        : slots_(std::bit_ceil(capacity), initial), mask_(slots_.size() - 1) {}
    Ring(const Ring&) = delete;
    Ring& operator=(const Ring&) = delete;

    std::size_t capacity() const { return slots_.size(); }

    /// Producer: false if the value was dropped.
    bool push(const T& value) {
        const std::uint64_t end = end_.load(std::memory_order_relaxed);
        // Acquire: the consumer has finished reading the slot before it is written over.
        if (end - begin_.load(std::memory_order_acquire) == slots_.size()) {
            // The producer alone writes the counter, so a load and a store do.
            dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
            return false;
        }
        slots_[end & mask_] = value;
        end_.store(end + 1, std::memory_order_release);
        return true;
    }

    /// Consumer: the oldest value, or false when empty.
    bool pop(T& value) {
        const std::uint64_t begin = begin_.load(std::memory_order_relaxed);
        if (begin == end_.load(std::memory_order_acquire)) return false;
        value = slots_[begin & mask_];
        begin_.store(begin + 1, std::memory_order_release);
        return true;
    }

    /// Values lost to a full ring so far; any thread.
    std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

  private:
    std::vector<T> slots_;
    std::size_t mask_;
    // On lines of their own: producer and consumer write one each.
    alignas(64) std::atomic<std::uint64_t> end_ = 0;    // counts pushed values; never wraps in practice
    alignas(64) std::atomic<std::uint64_t> begin_ = 0;  // counts popped values
    alignas(64) std::atomic<std::uint64_t> dropped_ = 0;
};

}  // namespace touchstone
