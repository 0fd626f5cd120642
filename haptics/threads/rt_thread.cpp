#include "haptics/threads/rt_thread.hpp"

#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>
#if defined(__x86_64__)
#include <x86intrin.h>
#endif

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>

namespace touchstone {
namespace {

constexpr double kNanosecondsPerSecond = 1e9;
/// Time before a tick at which the thread stops sleeping and spins, ns. Wake-ups under SCHED_FIFO are late by up to
/// about 40 µs. A shorter time makes ticks begin late; a longer one costs processor time.
constexpr std::uint64_t kSpinNs = 60'000;

std::uint64_t nanoseconds(clockid_t clock) {
    timespec t{};
    clock_gettime(clock, &t);
    return static_cast<std::uint64_t>(t.tv_sec) * 1'000'000'000u + static_cast<std::uint64_t>(t.tv_nsec);
}

void sleepUntil(std::uint64_t ns) {
    const timespec t{.tv_sec = static_cast<time_t>(ns / 1'000'000'000u),
                     .tv_nsec = static_cast<long>(ns % 1'000'000'000u)};
    // With a valid time the only possible error is an interruption.
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) != 0) {
    }
}

void relax() {
#if defined(__x86_64__)
    _mm_pause();
#endif
}

std::atomic<bool> memoryLocked = false;

/// Locks each page when it is first used, so that large unused reservations (stacks, drivers) cost nothing.
bool lockPages() { return mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0; }

bool lockMemory() {
    // If the amount is limited, nothing is locked, since allocations of the whole program would fail at the limit.
    rlimit limit{};
    const bool unlimited =
        geteuid() == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
    // Locked pages between others in use cannot be returned to the system. Blocks from 1 MiB therefore get separate
    // pages; setting the threshold also keeps malloc from raising it when such blocks are freed.
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
    return memoryLocked = unlimited && lockPages();
}

/// Uses the stack once as deep as a tick does, so that no tick touches one of its pages for the first time.
[[gnu::noinline]] void touchStack() {
    constexpr std::size_t kBytes = 256 * 1024, kPage = 4096;
    volatile char stack[kBytes];
    for (std::size_t i = 0; i < kBytes; i += kPage) stack[i] = 0;
    stack[kBytes - 1] = stack[0];
}

std::string refusal(const RealTimeOptions& options, const RealTimeStatus& status) {
    std::string what, remedy;
    const auto add = [](std::string& list, const std::string& word) { list += (list.empty() ? "" : " and ") + word; };
    if (options.raise && !status.scheduled) {
        add(what, "real-time priority");
        add(remedy, "'rtprio " + std::to_string(options.priority) + "'");
    }
    if (options.raise && !status.locked) {
        add(what, "locked memory");
        add(remedy, "'memlock unlimited'");
    }
    std::string message;
    if (!what.empty())
        message = "The haptic thread runs without " + what + ", so ticks may be late: allow your user " + remedy +
                  " in /etc/security/limits.conf and log in again";
    if (options.cpu >= 0 && !status.pinned) {
        const std::string cpu = "processor " + std::to_string(options.cpu) + " cannot be used";
        message += message.empty() ? "The haptic thread runs on any processor: " + cpu : "; " + cpu;
    }
    return message.empty() ? message : message + ".";
}

/// Linux counts the time of real-time threads in periods of a second, and stops them for the rest of one in which they
/// have used up their share, 950 ms by default.
double realTimeShare() {
    double runtime = -1, period = 1;
    std::ifstream("/proc/sys/kernel/sched_rt_runtime_us") >> runtime;
    std::ifstream("/proc/sys/kernel/sched_rt_period_us") >> period;
    return runtime >= 0 && period > 0 ? std::min(1.0, runtime / period) : 1;
}

}  // namespace

std::string throttlingWords(const RealTimeStatus& status) {
    if (!status.scheduled || status.share >= 1) return {};
    char text[320];
    std::snprintf(text, sizeof text,
                  "The kernel stops a real-time thread that has used %.0f ms of a second for the remaining %.0f ms, so "
                  "ticks that fill their period end in such a pause. Lower the rate, or lift the limit as root: "
                  "sysctl -w kernel.sched_rt_runtime_us=-1",
                  1000 * status.share, 1000 * (1 - status.share));
    return text;
}

RealTimeStatus raiseThread(const RealTimeOptions& options) {
    RealTimeStatus status;
    // Without this the system prolongs sleeps of threads without SCHED_FIFO by up to 50 µs.
    prctl(PR_SET_TIMERSLACK, 1UL);
    if (options.cpu >= 0 && options.cpu < CPU_SETSIZE) {
        cpu_set_t set;
        CPU_ZERO(&set);
        CPU_SET(options.cpu, &set);
        status.pinned = pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0;
    }
    if (options.raise) {
        const sched_param parameter{.sched_priority = options.priority};
        status.scheduled = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter) == 0;
        status.locked = lockMemory();
        status.share = realTimeShare();
    }
    touchStack();
    status.message = refusal(options, status);
    return status;
}

void returnFreedMemory() {
    const bool locked = memoryLocked;
    if (locked) munlockall();  // malloc cannot return locked pages between others in use
    malloc_trim(0);
    if (locked) memoryLocked = lockPages();
}

TickSchedule::TickSchedule(double rateHz, std::uint64_t now)
    : period_(kNanosecondsPerSecond / rateHz), begin_(0), origin_(now) {}

std::uint64_t TickSchedule::endTick(std::uint64_t now) {
    const double end = static_cast<double>(now - origin_);
    begin_ += period_;
    if (end > begin_) {
        ++overruns_;
        begin_ = end;
    }
    return origin_ + static_cast<std::uint64_t>(std::llround(begin_));
}

void TickSchedule::setRate(double rateHz) { period_ = kNanosecondsPerSecond / rateHz; }

Pacer::Pacer(double rateHz, bool spin) : schedule_(rateHz, steadyNanoseconds()), spin_(spin) {}

void Pacer::wait() {
    const std::uint64_t begin = schedule_.endTick(steadyNanoseconds());
    const std::uint64_t margin = spin_ ? kSpinNs : 0;
    if (steadyNanoseconds() + margin < begin) sleepUntil(begin - margin);
    while (steadyNanoseconds() < begin) relax();
}

std::uint64_t steadyNanoseconds() { return nanoseconds(CLOCK_MONOTONIC); }

double threadCpuMicroseconds() { return 1e-3 * static_cast<double>(nanoseconds(CLOCK_THREAD_CPUTIME_ID)); }

std::uint64_t cycleCount() {
#if defined(__x86_64__)
    return __rdtsc();
#else
    return steadyNanoseconds();
#endif
}

StageClock stageClock() {
    static const double microsecondsPerCount = [] {
        constexpr std::uint64_t kMeasureNs = 10'000'000;
        const std::uint64_t start = steadyNanoseconds(), startCount = cycleCount();
        std::uint64_t now = start;
        while (now - start < kMeasureNs) now = steadyNanoseconds();
        return 1e-3 * static_cast<double>(now - start) / static_cast<double>(cycleCount() - startCount);
    }();
    return {.now = cycleCount, .microseconds = microsecondsPerCount};
}

}  // namespace touchstone
