#pragma once
// Maps the hand's motion into the scene, and the wrench back to the hand.
#include <cstdint>
#include <string>

#include "haptics/device/device.hpp"

namespace touchstone {

/// The mapping of a device's space into the scene.
struct Workspace {
    double scale = 1;              ///< mm of the tool per mm of the hand
    Vec3 offset = Vec3::Zero();    ///< mm, scene axes; the tool glides by this offset from its place
    Quat q_WD = Quat::Identity();  ///< orientation of the device's axes in the scene
    std::uint32_t clutch = 2;      ///< button mask; while it is held, the hand moves and the tool does not; 0: none
};
inline constexpr double kSmallestScale = 0.01, kLargestScale = 100;
inline bool operator==(const Workspace& a, const Workspace& b) {
    return a.scale == b.scale && a.offset == b.offset && a.q_WD.coeffs() == b.q_WD.coeffs() && a.clutch == b.clutch;
}
/// Checks a workspace. Returns an empty string, or one sentence that says what is wrong and what is accepted.
std::string checkWorkspace(const Workspace& workspace);

/// The gains are those that the hand feels, at any scale. A force F of the scene acts on the hand as F / scale and a
/// torque T as T / scale². The hand then feels k_t as it is set and k_r as k_r / scale², and the wrench is the gradient
/// of one energy, so that the mapping itself cannot drive the hand. For the hand to feel k_r as it is set, the tick
/// must render k_r scale². Returns that torsional stiffness.
double torsionInScene(double torsion, double scale);
/// The limits of a device, converted to wrenches in the scene.
DeviceLimits limitsInScene(DeviceLimits limits, double scale);

/// Maps `raw`, which gives the pose of the hand-held part in device axes and takes wrenches in these axes about its
/// origin, to a device of the scene. The tool never jumps to the hand: the hand's pose at the start of a run, on
/// engaging, on releasing the clutch, on a change of the axes and on the return of a lost reading corresponds to the
/// tool's pose at that time. When the clutch is pressed the force fades out over 50 ms; when it is released, the force
/// fades in over 100 ms.
std::unique_ptr<Device> makeMapped(std::unique_ptr<Device> raw, const Pose& X_WT_start);

}  // namespace touchstone
