#pragma once
// Zero force as the last act of a process that ends by exit(), an exception nobody caught, or a signal.
#include <atomic>

#include "haptics/device/device.hpp"

namespace touchstone {

/// Installs handlers of SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT (which is also
/// where an exception that nobody catches ends), and of exit(): begin the last act, let go of every guarded device,
/// wait until no tick that began before can still write, let go again, and do what the signal does by default, or, for
/// the signals that StopRequest notes, return. A signal that is ignored stays so. For the program to call once, on its
/// first thread.
void endWithZeroForce();

/// While one lives, the first SIGINT, SIGTERM or SIGHUP only takes the force away and is noted, so that the holder can
/// end its work cleanly; the next such signal ends the process. Needs endWithZeroForce().
class StopRequest {
  public:
    StopRequest() noexcept;
    ~StopRequest();
    StopRequest(const StopRequest&) = delete;
    StopRequest& operator=(const StopRequest&) = delete;

    /// Number of the signal that asked the process to stop; 0 before. Real time.
    static int signal() noexcept;
};

/// Gives the calling thread a stack for signals, so that its own may overflow. Does nothing where it has one.
void useSignalStack();

/// A device that is let go of when the process ends. At most 16 at once.
class EmergencyStop {
  public:
    EmergencyStop() = default;
    ~EmergencyStop();
    EmergencyStop(const EmergencyStop&) = delete;
    EmergencyStop& operator=(const EmergencyStop&) = delete;

    /// This device in place of the one before, if it has motors. Real time.
    void guard(Device& device, bool motors) noexcept;
    /// The process is ending: whoever writes to a device writes zero.
    static bool begun() noexcept;

  private:
    std::atomic<Device*>* slot_ = nullptr;
};

}  // namespace touchstone
