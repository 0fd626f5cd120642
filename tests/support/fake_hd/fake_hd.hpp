#pragma once
// How tests look into the fake libHD and make it fail.

extern "C" {

struct FakeHdState {
    double force[3], torque[3];  ///< that the motors get: zero when not enabled
    double position[3];          ///< of the stylus, mm
    unsigned long ticks;         ///< of its scheduler since the device was opened
    unsigned long misuses;       ///< calls in a wrong order or outside a frame
    unsigned long handles;       ///< devices opened and not closed
    double peakForce;            ///< greatest since the device was opened, N
};
FakeHdState fakeHdState();
/// Where the hand's spring pulls the stylus, mm, and how it turns it (rotation vector, rad).
void fakeHdHand(double x, double y, double z, double wx, double wy, double wz);
void fakeHdButtons(int pressed);
/// In place of what $FAKE_HD_FAULT said when the device was opened: names with @TICK, by commas. See fake_hd.cpp.
void fakeHdFault(const char* faults);
}
