#pragma once
// A stand-in for Haply's Inverse Service, written from its public description: an Inverse3 that is a mass on the spring
// of a hand, a VerseGrip, the channel of events, and faults on demand. Only for tests; never installed.
//
// Faults, comma-separated:
//   the first message: hello  JSON, but no inventory   garbage  no JSON   nothing  none   no-device   uncalibrated
//     other-basis  axes XZY
//   every state: malformed  nan  infinity  no JSON numbers   null  missing  far  the position   unpowered
//     large  200 KiB, in fragments, well-formed   huge  2 MiB   unplugged  the device is not in the list
//     grip-gone  grip-asleep   slow  a reply takes 6 ms   silent  no reply   disconnect  ends the connection
//   old  a service 3.1: set_cursor_force takes "values", and there is no session   no-grip  from the start
#include <memory>
#include <string>

#include "haptics/math/rigid.hpp"

namespace touchstone::test {

class FakeInverse {
  public:
    struct State {
        Vec3 force = Vec3::Zero();     ///< of the motors, N, device axes: x right, y up, z toward the user
        Vec3 position = Vec3::Zero();  ///< of the cursor, mm, device axes
        double peakForce = 0;          ///< largest force since the start, N
        unsigned long commands = 0;    ///< messages with a force
        unsigned long misuses = 0;     ///< messages that the service does not understand
        int connections = 0;           ///< that are open now
        bool lastWasZero = false;      ///< the last command was a zero force
    };

    /// Serves at these ports; 0: free ones. Throws std::runtime_error if it cannot.
    explicit FakeInverse(const std::string& faults = {}, int port = 0, int eventsPort = 0);
    ~FakeInverse();

    int port() const;
    int eventsPort() const;
    /// The options of the device inverse3 for this service, as text.
    std::string options() const;

    State state() const;
    /// Sets the rest position of the hand's spring and the orientation of the grip: mm, and a rotation vector in rad.
    void hand(const Vec3& p, const Vec3& turn = Vec3::Zero());
    void buttons(int pressed);  ///< bits: a, b, c
    /// Replaces the faults.
    void fault(const std::string& faults);
    /// Sends an event about the device.
    void event(const std::string& name, const std::string& level, const std::string& safetyType = {},
               const std::string& device = "049D");
    void endEvents();  ///< closes the channel of events

  private:
    struct Service;
    const std::unique_ptr<Service> service_;
};

}  // namespace touchstone::test
