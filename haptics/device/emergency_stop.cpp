#include "haptics/device/emergency_stop.hpp"

#include <poll.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <utility>

namespace touchstone {
namespace {

std::array<std::atomic<Device*>, 16> guarded{};
std::atomic<bool> ending = false;
std::atomic<int> stopRequests = 0;  // that live
std::atomic<int> stopSignal = 0;    // the first that was noted
static_assert(std::atomic<Device*>::is_always_lock_free && std::atomic<bool>::is_always_lock_free &&
                  std::atomic<int>::is_always_lock_free,
              "signal handlers use them");

/// Notes the signal where a StopRequest lives. False for the second signal, and for those that report a fault.
bool noted(int signal) {
    const bool asks = signal == SIGINT || signal == SIGTERM || signal == SIGHUP;
    int none = 0;
    return asks && stopRequests.load() > 0 && stopSignal.compare_exchange_strong(none, signal);
}

/// Async-signal-safe.
void releaseForces() {
    constexpr int kOutliveMs = 20;  // a write that was decided on before: two late ticks
    ending.store(true);             // guard
    for (int round = 0; round < 2; ++round) {
        bool any = false;
        for (const auto& slot : guarded) {
            if (Device* device = slot.load()) {
                device->releaseForces();  // guard
                any = true;
            }
        }
        if (!any) return;
        if (round == 0) poll(nullptr, 0, kOutliveMs);
    }
}

}  // namespace

void useSignalStack() {
    stack_t present{};
    if (sigaltstack(nullptr, &present) != 0 || !(present.ss_flags & SS_DISABLE)) return;
    alignas(16) static thread_local std::array<char, 64 * 1024> memory;
    const stack_t own{.ss_sp = memory.data(), .ss_flags = 0, .ss_size = memory.size()};
    sigaltstack(&own, nullptr);  // guard
}

void endWithZeroForce() {
    useSignalStack();
    struct sigaction act {};
    act.sa_handler = [](int signal) {
        const int before = errno;
        releaseForces();
        if (!noted(signal)) raise(signal);  // SA_RESETHAND has put the default back; it acts when this returns
        errno = before;
    };
    act.sa_flags = static_cast<int>(SA_RESETHAND | SA_ONSTACK | SA_RESTART);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
        struct sigaction before {};
        sigaction(signal, nullptr, &before);
        if (before.sa_handler != SIG_IGN) sigaction(signal, &act, nullptr);  // guard
    }
    std::atexit(releaseForces);  // guard
}

StopRequest::StopRequest() noexcept { ++stopRequests; }
StopRequest::~StopRequest() { --stopRequests; }
int StopRequest::signal() noexcept { return stopSignal.load(std::memory_order_relaxed); }

EmergencyStop::~EmergencyStop() {
    if (slot_) slot_->store(nullptr);
}

void EmergencyStop::guard(Device& device, bool motors) noexcept {
    if (slot_) std::exchange(slot_, nullptr)->store(nullptr);
    if (!motors) return;
    for (auto& slot : guarded) {
        Device* none = nullptr;
        if (!slot.compare_exchange_strong(none, &device)) continue;
        slot_ = &slot;
        return;
    }
}

bool EmergencyStop::begun() noexcept { return ending.load(std::memory_order_relaxed); }

}  // namespace touchstone
