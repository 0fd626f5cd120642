#pragma once
// Lets tests inspect the fake libdhd and make it fail. All vectors are in the library's own axes and units: x toward
// the user, y right, z up; m, N, N·m.

extern "C" {

struct FakeDhdState {
    double force[3], torque[3];  ///< output of the motors: zero while they are off
    double gripper;              ///< the last commanded gripper force
    double position[3];          ///< of the end effector
    unsigned long exchanges;     ///< poses read since the device was opened
    unsigned long misuses;       ///< calls with a wrong ID, or on a device that is not open
    unsigned long open;          ///< devices opened and not closed
    unsigned long moves;         ///< motions that the device made by itself, to be initialized
    int motors;                  ///< 1: on
    double peakForce;            ///< largest force since the device was opened
};
FakeDhdState fakeDhdState();
/// Sets the rest pose of the hand's spring on the end effector: m, and a rotation vector in rad.
void fakeDhdHand(double x, double y, double z, double wx, double wy, double wz);
void fakeDhdButtons(unsigned pressed);
/// Puts the calibration pole into the pit.
void fakeDhdCalibrate();
/// Replaces the faults that $FAKE_DHD_FAULT set when the device was opened: comma-separated names, see fake_dhd.cpp.
void fakeDhdFault(const char* faults);
}
