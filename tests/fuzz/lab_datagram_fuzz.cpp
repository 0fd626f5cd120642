// Arbitrary bytes as datagrams of the device lab: what is accepted is valid and is written again as it was.
#include <cmath>

#include "haptics/device/lab_datagram.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::span<const std::uint8_t> bytes(data, size);
    LabRejected why{};
    LabPose pose;
    if (readLabPose(bytes, size, pose, why)) {
        require(size == kLabPoseBytes, "only poses of the right size are accepted");
        require(pose.X_DS.isValid() && std::abs(pose.X_DS.q.norm() - 1) < 1e-9, "an accepted pose is valid");
        LabPose again;
        const auto written = labBytes(pose);
        require(readLabPose(written, written.size(), again, why), "what was written is read");
        require(again.X_DS.p == pose.X_DS.p && again.sequence == pose.sequence && again.session == pose.session &&
                    again.time == pose.time && again.buttons == pose.buttons && again.fault == pose.fault,
                "what was written is the same");
    } else {
        require(!std::string(words(why)).empty(), "a rejection has a reason");
    }
    // A datagram that was larger than the buffer.
    require(!readLabPose(bytes, size + kLabPoseBytes, pose, why), "a truncated datagram is rejected");
    LabWrench wrench;
    if (readLabWrench(bytes, size, wrench, why)) {
        const auto written = labBytes(wrench);
        // All but the reserved bytes.
        require(std::memcmp(written.data(), data, 12) == 0 && std::memcmp(written.data() + 16, data + 16, 64) == 0,
                "a wrench is written as it was read");
    }
    return 0;
}
