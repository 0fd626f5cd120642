#pragma once
// The JSON messages of Haply's Inverse Service, version 3.x, as its public documentation describes them.
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "haptics/math/rigid.hpp"

namespace touchstone::sandbox {

/// Why the force of an Inverse3 went off.
enum class InverseFault : std::uint32_t {
    None,
    NotJson,       ///< a message is no JSON
    NoPosition,    ///< a state lacks the position, or it is no finite number
    FarPosition,   ///< the position is further than 1 km
    NotReady,      ///< the device is not calibrated, not powered or not ready
    GripLost,      ///< the VerseGrip that gave the orientation is gone or asleep
    GripAppeared,  ///< a VerseGrip is there now
    Silent,        ///< the service does not reply
    SafetyEvent,   ///< an event with the name of a fault
    EventsLost,    ///< the channel of the events has ended
    Disconnected,  ///< the service has ended the connection
    MessageTooLong,
    Unplugged,  ///< the device is no longer in the list
};
/// Whether the device itself is lost, so that it must be reconnected.
bool losesDevice(InverseFault fault);

/// Device axes are x right, y up, z toward the user; Haply's are x right, y forward, z up.
Vec3 fromHaply(const Vec3& v);
Vec3 toHaply(const Vec3& v);
Quat fromHaply(const Quat& q);

/// A grip that gives an orientation now.
struct GripState {
    std::string id;
    Quat q_DS;                  ///< device axes
    std::uint32_t buttons = 0;  ///< as bits, in the order of their names
};

struct InverseState {
    Vec3 p_DS = Vec3::Zero();  ///< of the cursor, mm, device axes
    std::optional<GripState> grip;
    std::string notReady;  ///< what the device lacks: "calibration", "power supply" or "readiness"; empty: nothing
};

/// The first message: what the service has connected.
struct InverseInventory {
    std::string device;  ///< its identifier
    std::string model, handedness, firmware;
    bool vectorCommand = false;  ///< set_cursor_force takes "vector" (3.5), not "values" (3.1)
    bool inUse = false;          ///< another program uses the device, says the service
    InverseState state = {};
};

/// Reads the first message. `device` and `grip`: the identifiers to take; empty: the first ones. Throws
/// std::runtime_error with one sentence if the message is no inventory, or if the device is missing or not usable.
InverseInventory readInventory(const std::string& message, const std::string& device, const std::string& grip);
/// Reads a later message. If the result is not None, only the fields before the fault are set.
InverseFault readState(const std::string& message, const std::string& device, const std::string& grip,
                       InverseState& state);

/// A message of the channel of events.
struct InverseEvent {
    InverseFault fault = InverseFault::None;
    std::string text;  ///< one sentence with the event's name
};
/// Judges an event. Those of other devices are no fault; nothing if the message is no event.
std::optional<InverseEvent> readEvent(const std::string& message, const std::string& device);

/// The message that commands a force, with the fixed parts made once.
class ForceMessage {
  public:
    ForceMessage() = default;
    ForceMessage(const std::string& device, bool vectorCommand);
    /// Force in N, device axes. The text is valid until the next call.
    const std::string& text(const Vec3& force);

  private:
    std::string head_, tail_, text_;
};

}  // namespace touchstone::sandbox
