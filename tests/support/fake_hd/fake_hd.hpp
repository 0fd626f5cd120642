#pragma once
// Lets tests inspect the fake libHD and make it fail.

extern "C" {

struct FakeHdState {
    double force[3], torque[3];  ///< output of the motors: zero when not enabled
    double position[3];          ///< of the stylus, mm
    unsigned long ticks;         ///< of its scheduler since the device was opened
    unsigned long misuses;       ///< calls in a wrong order or outside a frame
    unsigned long handles;       ///< devices opened and not closed
    double peakForce;            ///< largest force since the device was opened, N
};
FakeHdState fakeHdState();
/// Sets the rest pose of the hand's spring on the stylus: mm, and a rotation vector in rad.
void fakeHdHand(double x, double y, double z, double wx, double wy, double wz);
void fakeHdButtons(int pressed);
/// Replaces the faults that $FAKE_HD_FAULT set when the device was opened: comma-separated NAME@TICK, see fake_hd.cpp.
void fakeHdFault(const char* faults);
}
