// Replaces the global allocation functions of this test program by counting ones.
#include "tests/support/alloc_count.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

namespace {

void* allocate(std::size_t size, std::size_t alignment = alignof(std::max_align_t)) noexcept {
    ++touchstone::test::allocationsOfThread;
#ifdef _WIN32
    return _aligned_malloc(std::max<std::size_t>(size, 1), alignment);
#else
    return std::aligned_alloc(alignment, (std::max<std::size_t>(size, 1) + alignment - 1) / alignment * alignment);
#endif
}

void release(void* p) noexcept {
#ifdef _WIN32
    _aligned_free(p);
#else
    std::free(p);
#endif
}

void* orThrow(void* p) {
    if (!p) throw std::bad_alloc();
    return p;
}

}  // namespace

// Every form, so that none pairs with another allocator. GCC inlines one half of a pair and then warns about the other.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
using std::align_val_t, std::nothrow_t, std::size_t;
void* operator new(size_t n) { return orThrow(allocate(n)); }
void* operator new[](size_t n) { return orThrow(allocate(n)); }
void* operator new(size_t n, align_val_t a) { return orThrow(allocate(n, size_t(a))); }
void* operator new[](size_t n, align_val_t a) { return orThrow(allocate(n, size_t(a))); }
void* operator new(size_t n, const nothrow_t&) noexcept { return allocate(n); }
void* operator new[](size_t n, const nothrow_t&) noexcept { return allocate(n); }
void* operator new(size_t n, align_val_t a, const nothrow_t&) noexcept { return allocate(n, size_t(a)); }
void* operator new[](size_t n, align_val_t a, const nothrow_t&) noexcept { return allocate(n, size_t(a)); }
void operator delete(void* p) noexcept { release(p); }
void operator delete[](void* p) noexcept { release(p); }
void operator delete(void* p, size_t) noexcept { release(p); }
void operator delete[](void* p, size_t) noexcept { release(p); }
void operator delete(void* p, align_val_t) noexcept { release(p); }
void operator delete[](void* p, align_val_t) noexcept { release(p); }
void operator delete(void* p, size_t, align_val_t) noexcept { release(p); }
void operator delete[](void* p, size_t, align_val_t) noexcept { release(p); }
void operator delete(void* p, const nothrow_t&) noexcept { release(p); }
void operator delete[](void* p, const nothrow_t&) noexcept { release(p); }
void operator delete(void* p, align_val_t, const nothrow_t&) noexcept { release(p); }
void operator delete[](void* p, align_val_t, const nothrow_t&) noexcept { release(p); }

TEST_CASE("allocation counter: counts plain, array and aligned allocations, and nothing else", "[support]") {
    struct alignas(64) Line {
        char bytes[64];
    };
    touchstone::test::AllocationCounter counter;
    int local = 3;
    REQUIRE(counter.count() == 0);
    const auto one = std::make_unique<int>(local);
    REQUIRE(counter.count() == 1);
    const auto many = std::make_unique<int[]>(10);
    REQUIRE(counter.count() == 2);
    const auto aligned = std::make_unique<Line>();
    REQUIRE(counter.count() == 3);
}
