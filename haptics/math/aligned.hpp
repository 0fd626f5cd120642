#pragma once
// Arrays that SIMD loads can read: aligned to a cache line.
#include <cstddef>
#include <cstdint>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace touchstone {

/// While one exists, the AlignedVectors that its thread makes get their memory when it is first written: they
/// are zero as ever, but a state whose arrays are sized for the worst case takes a fraction of their bytes. Not for a
/// state that a haptic thread steps, which must not wait for the system's memory.
class PagesOnDemand {
  public:
    PagesOnDemand() { ++depth_; }
    ~PagesOnDemand() { --depth_; }
    PagesOnDemand(const PagesOnDemand&) = delete;
    PagesOnDemand& operator=(const PagesOnDemand&) = delete;
    static bool active() { return depth_ > 0; }

  private:
    static inline thread_local int depth_ = 0;
};

/// Memory aligned to a cache line. While PagesOnDemand is active it is zero, and large blocks come from the system
/// untouched. Throws std::bad_alloc.
void* allocateLines(std::size_t bytes);
void freeLines(void* lines);

template <class T>
struct CacheLineAllocator {
    using value_type = T;

    CacheLineAllocator() = default;
    template <class U>
    CacheLineAllocator(const CacheLineAllocator<U>&) {}

    T* allocate(std::size_t n) {
        if (n > PTRDIFF_MAX / sizeof(T)) throw std::bad_alloc();
        return static_cast<T*>(allocateLines(n * sizeof(T)));
    }
    void deallocate(T* p, std::size_t) { freeLines(p); }

    template <class U, class... Args>
    void construct(U* p, Args&&... args) {
        if constexpr (sizeof...(Args) == 0 && std::is_trivially_copyable_v<U>)
            if (PagesOnDemand::active()) return;  // zero already
        ::new (static_cast<void*>(p)) U(std::forward<Args>(args)...);
    }
    friend bool operator==(CacheLineAllocator, CacheLineAllocator) { return true; }
};

/// A vector of a type whose default value has no bit set.
template <class T>
using AlignedVector = std::vector<T, CacheLineAllocator<T>>;

/// Rounds up to a multiple of eight, the length to which every SIMD array is padded.
constexpr int paddedToEight(int n) { return (n + 7) & ~7; }

}  // namespace touchstone
