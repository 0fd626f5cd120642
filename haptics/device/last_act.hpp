#pragma once
// Zero force as the last act of a process that ends by exit(), an exception nobody caught, or a signal.
#include <atomic>

#include "haptics/device/device.hpp"

namespace touchstone {

/// Installs handlers of SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT (which is also
/// where an exception that nobody catches ends), and of exit(): begin the last act, let go of every guarded device,
/// wait until no tick that began before can still write, let go again, and do what the signal does by default. A signal
/// that is ignored stays so. For the program to call once, on its first thread.
void endWithZeroForce();

/// Gives the calling thread a stack for signals, so that its own may overflow. Does nothing where it has one.
void useSignalStack();

/// A device that is let go of when the process ends. At most 16 at once.
class LastAct {
  public:
    LastAct() = default;
    ~LastAct();
    LastAct(const LastAct&) = delete;
    LastAct& operator=(const LastAct&) = delete;

    /// This device in place of the one before, if it has motors. Real time.
    void guard(Device& device, bool motors) noexcept;
    /// The process is ending: whoever writes to a device writes zero.
    static bool begun() noexcept;

  private:
    std::atomic<Device*>* slot_ = nullptr;
};

}  // namespace touchstone
