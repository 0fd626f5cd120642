#pragma once
// The emergency stop: zero force when the process ends by exit(), by an uncaught exception or by a signal.
#include <atomic>

#include "haptics/device/device.hpp"

namespace touchstone {

/// Installs handlers for SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGSEGV, SIGBUS, SIGFPE, SIGILL and SIGABRT (which an
/// uncaught exception also raises), and for exit(). A handler begins the emergency stop, releases the forces of every
/// guarded device, waits until no tick that began before can still write, and releases the forces again. Then the
/// default action of the signal follows; for a signal that a StopRequest takes, the handler returns instead. Signals
/// that were ignored stay ignored. The program calls this once, on its first thread.
void endWithZeroForce();

/// While such an object exists, the first SIGINT, SIGTERM or SIGHUP only releases the forces and is recorded, so that
/// the owner can end its work cleanly. The next such signal ends the process. Needs endWithZeroForce().
class StopRequest {
  public:
    StopRequest() noexcept;
    ~StopRequest();
    StopRequest(const StopRequest&) = delete;
    StopRequest& operator=(const StopRequest&) = delete;

    /// Number of the signal that requested the stop; 0 before. Real time.
    static int signal() noexcept;
};

/// Gives the calling thread a separate signal stack, so that a stack overflow can be handled. Does nothing if it has
/// one.
void useSignalStack();

/// Guards a device whose forces are released when the process ends. At most 16 at a time.
class EmergencyStop {
  public:
    EmergencyStop() = default;
    ~EmergencyStop();
    EmergencyStop(const EmergencyStop&) = delete;
    EmergencyStop& operator=(const EmergencyStop&) = delete;

    /// Guards this device in place of the previous one, if it has motors. Real time.
    void guard(Device& device, bool motors) noexcept;
    /// Whether the emergency stop has begun: from then on only zero wrenches may be written to a device.
    static bool begun() noexcept;

  private:
    std::atomic<Device*>* slot_ = nullptr;
};

}  // namespace touchstone
