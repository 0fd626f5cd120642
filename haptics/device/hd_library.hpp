#pragma once
// The device layer of OpenHaptics (libHD), loaded at run time. Prototypes and constants are declared here; the vendor's
// headers and library are not part of this project.
#include <cstdint>
#include <string>

namespace touchstone::hd {

using Handle = std::uint32_t;
using Enum = std::uint32_t;
using Error = std::uint32_t;
using Int = int;
using Boolean = std::uint8_t;
using UShort = std::uint16_t;
using ULong = unsigned long;
using Callback = std::uint32_t (*)(void*);

struct ErrorInfo {
    Error code;
    int internalCode;
    Handle device;
};

inline constexpr Handle kInvalidHandle = 0xFFFFFFFF;
inline constexpr std::uint32_t kCallbackDone = 0, kCallbackContinue = 1;
inline constexpr UShort kDefaultPriority = 32767;

enum Name : Enum {
    kButtons = 0x2000,
    kTransform = 0x2052,  ///< 16 doubles, column-major, mm
    kGimbalAngles = 0x2150,
    kModel = 0x2501,
    kDriverVersion = 0x2502,
    kSerial = 0x2504,
    kOutputDof = 0x2554,
    kCalibrationStyle = 0x2555,
    kMaxStiffness = 0x2602,
    kMaxForce = 0x2603,
    kContinuousForce = 0x2604,
    kMotorTemperature = 0x2605,
    kForce = 0x2700,         ///< N
    kTorque = 0x2701,        ///< mN·m
    kGimbalTorque = 0x2704,  ///< mN·m on the gimbal's axes
    kForceOutput = 0x4000,   ///< capability
    kCalibrationOk = 0x5000,
    kCalibrationNeedsUpdate = 0x5001,
};

enum ErrorCode : Error {
    kSuccess = 0,
    kInvalidEnum = 0x0100,
    kWarmMotors = 0x0200,
    kDeviceFault = 0x0300,
    kTimerError = 0x0304,
    kSchedulerError = 0x0500,
    kSchedulerFull = 0x0501,
    kInvalidLicense = 0x0600,
};

/// Describes an error code; never empty.
const char* words(Error code);
/// Whether the error means that the device itself is lost, not only its force, so that it must be reconnected.
bool losesDevice(Error code);

/// The functions of the library that are used. Either all of them are set or load() throws.
struct Library {
    Handle (*initDevice)(const char*);
    void (*disableDevice)(Handle);
    void (*makeCurrentDevice)(Handle);
    void (*beginFrame)(Handle);
    void (*endFrame)(Handle);
    ErrorInfo (*getError)();
    const char* (*getErrorString)(Error);
    void (*enable)(Enum);
    void (*disable)(Enum);
    void (*getIntegerv)(Enum, Int*);
    void (*getDoublev)(Enum, double*);
    void (*setDoublev)(Enum, const double*);
    const char* (*getString)(Enum);
    Enum (*checkCalibration)();
    void (*updateCalibration)(Enum);
    void (*startScheduler)();
    void (*stopScheduler)();
    void (*setSchedulerRate)(ULong);
    ULong (*scheduleAsynchronous)(Callback, void*, UShort);
    void (*unschedule)(ULong);

    std::string name;  ///< name of the loaded file
};

/// What to install when the library cannot be loaded, by the loader's messages: libHD 3.4 and 3.0 need different
/// drivers.
std::string remedy(const std::string& errors);

/// Loads `file`; if that is empty, the file in $TOUCHSTONE_LIBHD; otherwise the first of libHD.so, libHD.so.3.4,
/// libHD.so.3 and libHD.so.3.0. Throws std::runtime_error with the names tried, the loader's messages and what to
/// install.
Library load(const std::string& file = {});

}  // namespace touchstone::hd
