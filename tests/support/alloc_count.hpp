#pragma once
// Counts allocations of this thread, to prove that the real-time path does not allocate. The program must replace the
// global operator new by one that increments the counter; tests/support/alloc_count.cpp does this.
#include <cstdint>

namespace touchstone::test {

/// Allocations of this thread since it began.
inline thread_local std::uint64_t allocationsOfThread = 0;

/// Counts since its construction.
class AllocationCounter {
  public:
    AllocationCounter() : start_(allocationsOfThread) {}
    std::uint64_t count() const { return allocationsOfThread - start_; }

  private:
    std::uint64_t start_;
};

}  // namespace touchstone::test
