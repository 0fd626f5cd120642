#include "haptics/threads/rt_thread.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <memory>
#include <thread>
#include <vector>

namespace touchstone::rt_thread_tests {

double residentMegabytes() {
    std::ifstream in("/proc/self/statm");
    double size = 0, resident = 0;
    in >> size >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

TEST_CASE("tick schedule: ticks that meet their deadline begin one period apart, whenever they end", "[loop]") {
    TickSchedule schedule(1000, 5'000'000);
    CHECK(schedule.endTick(5'000'001) == 6'000'000);
    CHECK(schedule.endTick(6'999'999) == 7'000'000);
    CHECK(schedule.endTick(8'000'000) == 8'000'000);  // a tick that ends at the deadline is in time
    CHECK(schedule.overruns() == 0);
}

TEST_CASE("tick schedule: a late tick counts once, the next begins at once and no burst follows", "[loop]") {
    TickSchedule schedule(1000, 0);
    CHECK(schedule.endTick(7'300'000) == 7'300'000);  // seven deadlines passed, one tick was late
    CHECK(schedule.overruns() == 1);
    CHECK(schedule.endTick(7'400'000) == 8'300'000);  // a whole period after the late one
    CHECK(schedule.endTick(8'400'000) == 9'300'000);
    CHECK(schedule.overruns() == 1);
}

TEST_CASE("tick schedule: periods of fractional ns do not drift, and a new rate acts from the next tick", "[loop]") {
    TickSchedule schedule(3000, 0);  // 333,333.33 ns
    std::uint64_t begin = 0;
    for (int i = 0; i < 3'000'000; ++i) begin = schedule.endTick(begin);
    // After a thousand seconds, sums of doubles are accurate to 1e-4 ns each.
    CHECK(begin >= 999'999'999'000);
    CHECK(begin <= 1'000'000'001'000);
    CHECK(schedule.overruns() <= 3'000'000 / 2);  // rounding to whole ns may end a tick within 1 ns after its deadline
    schedule.setRate(250);
    CHECK(schedule.endTick(begin) - begin == 4'000'000);
}

TEST_CASE("pacer: waits for the start of each tick and counts late ticks", "[loop]") {
    for (const bool spin : {false, true}) {
        const std::uint64_t start = steadyNanoseconds();
        Pacer pacer(10'000, spin);
        for (int i = 0; i < 20; ++i) pacer.wait();
        // Never early; the operating system determines how late.
        CHECK(steadyNanoseconds() - start >= 2'000'000);
        CHECK(pacer.overruns() <= 20);
        const std::uint64_t before = pacer.overruns();
        const std::uint64_t from = steadyNanoseconds();
        while (steadyNanoseconds() - from < 500'000) {
        }
        pacer.wait();
        CHECK(pacer.overruns() == before + 1);
    }
}

TEST_CASE("clocks: all run forward and agree on the unit", "[loop]") {
    const StageClock clock = stageClock();
    const double cpu = threadCpuMicroseconds();
    const std::uint64_t count = clock.now(), steady = steadyNanoseconds();
    while (steadyNanoseconds() - steady < 5'000'000) {
    }
    const double microseconds = static_cast<double>(clock.now() - count) * clock.microseconds;
    const double spent = threadCpuMicroseconds() - cpu;
    // The count spans the steady interval and may be interrupted at its ends, so it is bounded from below only; 5 % is
    // for a measurement of the rate that was itself interrupted.
    CHECK(microseconds >= 0.95 * 5000);
    CHECK(spent > 0);
    CHECK(spent <= 1e-3 * static_cast<double>(steadyNanoseconds() - steady) + 1000);
}

TEST_CASE("real-time thread: one sentence reports what the system refuses, with a remedy", "[loop]") {
    std::thread([] {
        const RealTimeStatus status = raiseThread({.priority = 20});
        if (status.scheduled && status.locked)
            CHECK(status.message == "");
        else
            CHECK(status.message.find("limits.conf") != std::string::npos);
    }).join();
    std::thread([] {
        const RealTimeStatus status = raiseThread({.raise = false, .cpu = 100'000});
        CHECK_FALSE(status.scheduled);
        CHECK_FALSE(status.pinned);
        CHECK(status.message == "The haptic thread runs on any processor: processor 100000 cannot be used.");
    }).join();
    std::thread([] { CHECK(raiseThread({.raise = false}).message == ""); }).join();
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // their allocators keep what is freed
TEST_CASE("real-time thread: freed memory between blocks in use goes back to the system, also if it was locked",
          "[loop]") {
    std::thread([] { raiseThread({.priority = 20}); }).join();  // locks memory, where the system permits it
    constexpr std::size_t kBlock = 64 * 1024, kBlocks = 640, kKept = 16;
    std::vector<std::unique_ptr<char[]>> blocks;
    for (std::size_t i = 0; i < kBlocks; ++i) blocks.push_back(std::make_unique<char[]>(kBlock));
    const double full = residentMegabytes();
    for (std::size_t i = 0; i < kBlocks; ++i)
        if (i % kKept != 0) blocks[i].reset();
    returnFreedMemory();
    const double freed = 1e-6 * kBlock * kBlocks * (kKept - 1) / kKept;
    CHECK(full - residentMegabytes() >= 0.9 * freed);  // the pages at the ends of a block stay
}
#endif

}  // namespace touchstone::rt_thread_tests
