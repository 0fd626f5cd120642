#pragma once
// From the hand's space into the scene and the wrench back.
#include <cstdint>
#include <string>

#include "haptics/device/device.hpp"

namespace touchstone {

/// How a device's space lies in the scene.
struct Workspace {
    double scale = 1;              ///< mm of the tool per mm of the hand
    Vec3 offset = Vec3::Zero();    ///< mm, scene axes: the tool glides so far away from where the hand took it
    Quat q_WD = Quat::Identity();  ///< the device's axes in the scene
    std::uint32_t clutch = 2;      ///< while this button is held the hand moves and the tool does not; 0: none
};
inline constexpr double kSmallestScale = 0.01, kLargestScale = 100;
inline bool operator==(const Workspace& a, const Workspace& b) {
    return a.scale == b.scale && a.offset == b.offset && a.q_WD.coeffs() == b.q_WD.coeffs() && a.clutch == b.clutch;
}
/// An empty string, or one sentence that says what is wrong and what is accepted.
std::string checkWorkspace(const Workspace& workspace);

/// Gains are what the hand feels, at any scale. A force F of the scene reaches the hand as F / scale and a torque T as
/// T / scale²: with that k_t is felt as it is set, k_r as k_r / scale², and the pair is the gradient of one energy, so
/// that the mapping itself cannot drive the hand. For k_r to be felt as set the tick must render k_r scale².
double torsionInScene(double torsion, double scale);
/// A device's limits in terms of the scene's wrenches.
DeviceLimits limitsInScene(DeviceLimits limits, double scale);

/// `raw` gives the pose of what the hand holds on its own axes and takes wrenches on them about its origin; the result
/// is a device of the scene. The tool is never set to the hand: where the hand is when a run begins, when it is
/// engaged, when the clutch is let go, when axes change and when a lost reading comes back stands for the pose the tool
/// has. While the clutch is held the force fades out over 50 ms, then in over 100 ms.
std::unique_ptr<Device> makeMapped(std::unique_ptr<Device> raw, const Pose& X_WT_start);

}  // namespace touchstone
