#pragma once
// The datagrams of the device lab: fixed sizes, little endian. docs/devices.md has them as tables.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "haptics/math/rigid.hpp"

namespace touchstone {

inline constexpr std::uint16_t kLabVersion = 1;
inline constexpr std::size_t kLabPoseBytes = 88, kLabWrenchBytes = 80;

/// From the arm. The pose is in the arm's own axes: mm and a quaternion that need not have unit length exactly.
struct LabPose {
    bool fault = false;          ///< the arm reports a failure of its own
    std::uint32_t session = 0;   ///< differs after each start of the arm's program
    std::uint32_t buttons = 0;   ///< the first button is bit 0
    std::uint64_t sequence = 0;  ///< grows with every datagram
    std::uint64_t time = 0;      ///< ns of any clock of the arm; only echoed
    Pose X_DS;
};

enum class LabState : std::uint16_t {
    Stopped = 0,  ///< not engaged yet: the wrench is zero
    Engaged = 1,
    Fault = 2,  ///< the connection failed; the wrench is zero until the user engages again
};

/// To the arm: N and mN·m on the hand about the origin of the pose, in the arm's axes.
struct LabWrench {
    LabState state = LabState::Stopped;
    std::uint32_t session = 0;  ///< session, sequence and time of the newest pose that was accepted
    std::uint64_t sequence = 0;
    std::uint64_t time = 0;
    Wrench wrench;
};

/// Why a datagram is not accepted. The first four concern its bytes, the others the connection.
enum class LabRejected : std::uint8_t { Size, Magic, Version, Pose, Foreign, Session, Old };
inline constexpr std::size_t kLabRejections = 7;
const char* words(LabRejected why);

/// Reads a datagram of `size` bytes, of which `bytes` may hold only the first ones. On success returns true and the
/// pose is valid with a quaternion of unit length; otherwise `why` is set. Real time.
bool readLabPose(std::span<const std::uint8_t> bytes, std::size_t size, LabPose& pose, LabRejected& why) noexcept;
bool readLabWrench(std::span<const std::uint8_t> bytes, std::size_t size, LabWrench& wrench, LabRejected& why) noexcept;
std::array<std::uint8_t, kLabPoseBytes> labBytes(const LabPose& pose) noexcept;
std::array<std::uint8_t, kLabWrenchBytes> labBytes(const LabWrench& wrench) noexcept;

}  // namespace touchstone
