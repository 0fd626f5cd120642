#pragma once
// Arrays that SIMD loads can read: aligned to a cache line.
#include <cstddef>
#include <new>
#include <vector>

namespace touchstone {

template <class T>
struct CacheLineAllocator {
    using value_type = T;
    static constexpr std::align_val_t kAlignment{64};

    CacheLineAllocator() = default;
    template <class U>
    CacheLineAllocator(const CacheLineAllocator<U>&) {}

    T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), kAlignment)); }
    void deallocate(T* p, std::size_t) { ::operator delete(p, kAlignment); }
    friend bool operator==(CacheLineAllocator, CacheLineAllocator) { return true; }
};

template <class T>
using AlignedVector = std::vector<T, CacheLineAllocator<T>>;

/// Rounds up to a multiple of eight, the length to which every SIMD array is padded.
constexpr int paddedToEight(int n) { return (n + 7) & ~7; }

}  // namespace touchstone
