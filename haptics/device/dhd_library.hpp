#pragma once
// Force Dimension's haptic library (DHD) and its robotics library (DRD), loaded at run time. Prototypes and constants
// are declared here; the vendor's headers and libraries are not part of this project.
#include <array>
#include <cstdint>
#include <string>

namespace touchstone::dhd {

/// In the vendor's headers every last argument of type char is the device's ID and has a default; here it is always
/// passed.
using Id = char;
using Status = std::array<int, 64>;  // the library writes 16 or 17 entries, depending on its version

inline constexpr unsigned char kOff = 0, kOn = 1;
inline constexpr int kSaturated = 2;  ///< result that is not an error: the motors cannot give the whole wrench

enum Entry : std::size_t {  ///< of Status
    kPower = 0,
    kConnected = 1,
    kReset = 3,  ///< 1: waits to be calibrated by hand
    kForce = 5,  ///< 1: the motors take forces
    kError = 9,
    kForceOffCause = 14,
};

/// Why a device gives no force. Codes of the library are kept as they are; others are added to them.
enum Failure : std::uint32_t {
    kNone = 0,
    kGeneral = 1,
    kCommunication = 2,
    kBusy = 3,
    kNoDriver = 4,
    kNoDevice = 5,
    kTimeout = 7,
    kNotReady = 12,
    kInUse = 20,
    kForcesOff = 100,  ///< plus the cause in the status: 1 button to 6 dead-man switch
    kForcesOffUsb = 105,
    kNoPower = 200,
    kControllerError,
    kUncalibrated,
    kStalled,
    kTooSlow = 0xFFFFFFFF,  ///< ArmLink::kTooSlow
};
/// Describes a failure; never empty.
const char* words(std::uint32_t failure);
/// Whether the device itself is lost, so that it must be reconnected.
bool losesDevice(std::uint32_t failure);

/// The functions of the libraries that are used. Those without a comment are all set or load() throws. A negative
/// result is an error; 1 (polled again too early) and 2 (motors saturated) are not.
struct Library {
    int (*open)();
    int (*close)(Id);
    int (*getSystemType)(Id);
    int (*enableForce)(unsigned char, Id);
    int (*getPose)(double* x, double* y, double* z, double (*frame)[3], Id);  ///< m; frame: 3 rows
    int (*setWrench)(double fx, double fy, double fz, double tx, double ty, double tz, double gripper, Id);  ///< N, N·m
    int (*getStatus)(int* status, Id);
    int (*errorGetLast)();  ///< of the calling thread
    const char* (*errorGetStr)(int);
    // Null where the library lacks them.
    int (*openSerial)(int);
    const char* (*getSystemName)(Id);
    unsigned (*getButtonMask)(Id);
    bool (*hasActiveWrist)(Id);
    double (*getMaxForce)(Id);   ///< N; negative: no limit
    double (*getMaxTorque)(Id);  ///< N·m
    // DRD's functions; either all or none.
    int (*robotOpen)(Id);
    int (*robotClose)(Id);
    bool (*robotIsSupported)(Id);
    bool (*robotIsInitialized)(Id);
    int (*robotAutoInit)(Id);  ///< moves the arm

    std::string name;       ///< names of the loaded files
    std::string robotless;  ///< why there is no DRD; empty if there is one
};

/// Loads `file`, if that is empty the file in $TOUCHSTONE_LIBDHD, otherwise libdhd.so.3, libdhd.so, or the newest
/// libdhd.so.3.* in the usual folders; and DRD in the same way, with a given file from the same folder. Throws
/// std::runtime_error with the names tried, the loader's messages and what to install.
Library load(const std::string& file = {});

}  // namespace touchstone::dhd
