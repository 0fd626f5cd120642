#include "haptics/device/emergency_stop.hpp"

#include <poll.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <utility>

namespace touchstone {
namespace {

std::array<std::atomic<Device*>, 16> guardedDevices{};
std::atomic<bool> stopping = false;
std::atomic<int> stopRequests = 0;  // number of StopRequest objects
std::atomic<int> stopSignal = 0;    // the first signal that a StopRequest took; 0 before
static_assert(std::atomic<Device*>::is_always_lock_free && std::atomic<bool>::is_always_lock_free &&
                  std::atomic<int>::is_always_lock_free,
              "signal handlers may use only lock-free atomics");

/// Records a signal for an existing StopRequest. Returns false if there is none, for a second signal, and for
/// signals that report a fault.
bool takenByStopRequest(int signal) {
    const bool isStopSignal = signal == SIGINT || signal == SIGTERM || signal == SIGHUP;
    int expected = 0;
    return isStopSignal && stopRequests.load() > 0 && stopSignal.compare_exchange_strong(expected, signal);
}

/// Releases the forces of all guarded devices, twice: a write that began before the first time has ended by the
/// second. Async-signal-safe.
void releaseAllForces() {
    constexpr int kOutliveMs = 20;  // time in which a write in progress ends: two late ticks
    stopping.store(true);           // guard
    for (int round = 0; round < 2; ++round) {
        bool any = false;
        for (const auto& slot : guardedDevices) {
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
    const stack_t stack{.ss_sp = memory.data(), .ss_flags = 0, .ss_size = memory.size()};
    sigaltstack(&stack, nullptr);  // guard
}

void endWithZeroForce() {
    useSignalStack();
    struct sigaction action {};
    action.sa_handler = [](int signal) {
        const int before = errno;
        releaseAllForces();
        // SA_RESETHAND has restored the default action, which follows when this handler returns.
        if (!takenByStopRequest(signal)) raise(signal);
        errno = before;
    };
    action.sa_flags = static_cast<int>(SA_RESETHAND | SA_ONSTACK | SA_RESTART);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
        struct sigaction before {};
        sigaction(signal, nullptr, &before);
        if (before.sa_handler != SIG_IGN) sigaction(signal, &action, nullptr);  // guard
    }
    std::atexit(releaseAllForces);  // guard
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
    for (auto& slot : guardedDevices) {
        Device* expected = nullptr;
        if (!slot.compare_exchange_strong(expected, &device)) continue;
        slot_ = &slot;
        return;
    }
}

bool EmergencyStop::begun() noexcept { return stopping.load(std::memory_order_relaxed); }

}  // namespace touchstone
