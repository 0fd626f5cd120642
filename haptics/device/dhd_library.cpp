#include "haptics/device/dhd_library.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <stdexcept>

#include "haptics/device/shared_library.hpp"

namespace touchstone::dhd {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInstall =
    "Install the vendor's SDK (its libraries in /usr/local/lib, then 'sudo ldconfig'), or name libdhd in "
    "TOUCHSTONE_LIBDHD";

/// The numbers of libdhd.so.3.17.6, so that 3.17 is newer than 3.9.
std::vector<int> versionOf(const fs::path& file) {
    std::vector<int> numbers;
    std::istringstream text(file.filename().string().substr(file.filename().string().find(".so") + 3));
    for (std::string part; std::getline(text, part, '.');)
        if (!part.empty()) numbers.push_back(std::atoi(part.c_str()));
    return numbers;
}

/// Names to try for libdhd or libdrd. The vendor's archive holds files with the full version only.
std::vector<std::string> namesOf(const std::string& stem) {
    std::vector<std::string> names{stem + ".so.3", stem + ".so"};
    const char* named = std::getenv("LD_LIBRARY_PATH");
    std::istringstream folders(std::string(named ? named : "") + ":/usr/local/lib:/usr/lib/x86_64-linux-gnu:/usr/lib");
    std::vector<fs::path> found;
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (folder.empty()) continue;
        std::error_code error;
        for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
            if (at->path().filename().string().starts_with(stem + ".so.3.")) found.push_back(at->path());
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const fs::path& a, const fs::path& b) { return versionOf(a) > versionOf(b); });
    for (const fs::path& file : found) names.push_back(file.string());
    return names;
}

/// libdrd beside a given libdhd; nothing if the name has no "dhd".
std::vector<std::string> robotBeside(const fs::path& file) {
    std::string name = file.filename().string();
    const std::size_t at = name.find("dhd");
    if (at == std::string::npos) return {};
    return {(file.parent_path() / name.replace(at, 3, "drd")).string()};
}

}  // namespace

const char* words(std::uint32_t failure) {
    switch (failure) {
        case kCommunication:
            return "the communication with the device failed: check cable and power";
        case kBusy:
            return "the device's controller is busy";
        case kNoDriver:
            return "the system lacks the driver or the right to use the device (the vendor's udev rules)";
        case kNoDevice:
            return "no device is connected";
        case 6:
            return "this device does not have the feature";
        case kTimeout:
            return "the device did not answer in time";
        case 8:
            return "the arm is where its geometry has no solution";
        case 9:
            return "the library's expert mode is off";
        case 10:
            return "the library does not implement the call";
        case 11:
            return "the library is out of memory";
        case kNotReady:
            return "the device is not ready";
        case 13:
            return "the library misses a file";
        case 14:
            return "the device's configuration is wrong";
        case 15:
            return "the library got an invalid index";
        case 16:
            return "the library no longer has the call";
        case 17:
            return "the library got no place for a result";
        case 18:
            return "redundant encoders disagree: switch the device off and have it checked";
        case 19:
            return "forces are not enabled";
        case kInUse:
            return "another program uses the device";
        case 21:
            return "the library got an invalid value";
        case kForcesOff:
            return "the device switched its forces off without giving a cause";
        case kForcesOff + 1:
            return "the force button switched the forces off";
        case kForcesOff + 2:
            return "the device switched its forces off, because it moved faster than its threshold";
        case kForcesOff + 3:
            return "the device's watchdog switched the forces off, because no commands arrived";
        case kForcesOff + 4:
            return "software switched the forces off";
        case kForcesOffUsb:
            return "the device switched its forces off, because its cable was unplugged";
        case kForcesOff + 6:
            return "the dead-man switch of the device was released";
        case kNoPower:
            return "the device has no power";
        case kControllerError:
            return "the device's controller reports an error";
        case kUncalibrated:
            return "the device is not initialized";
        case kTooSlow:
            return "the device is too slow for a stiff wall: close other programs and check the USB port";
        case kStalled:
            return "the library did not answer for more than 0.1 s";
        default:
            return failure > kForcesOff && failure < kNoPower
                       ? "the device switched its forces off for a cause that this program does not know"
                       : "unknown error";
    }
}

bool losesDevice(std::uint32_t failure) {
    switch (failure) {
        case kCommunication:
        case kNoDriver:
        case kNoDevice:
        case kTimeout:
        case kNotReady:
        case kInUse:
        case kForcesOffUsb:
        case kNoPower:
            return true;
        default:
            return false;
    }
}

Library load(const std::string& file) {
    const char* named = std::getenv("TOUCHSTONE_LIBDHD");
    const std::string given = !file.empty() ? file : named ? named : "";
    // DHD first: a DRD that needs it then finds the same one, whatever folder it is in.
    const SharedLibrary haptic(given.empty() ? namesOf("libdhd") : std::vector{given});
    const SharedLibrary robot(given.empty() ? namesOf("libdrd") : robotBeside(given));
    // Functions of DHD are taken through DRD, so that both certainly speak to the same open device.
    int (*open)() = nullptr;
    std::string missing;
    robot.find("dhdOpen", open, missing);
    if (!haptic && !open)
        throw std::runtime_error("Force Dimension's DHD cannot be loaded (" + haptic.errors() + "). " + kInstall);
    const SharedLibrary& both = open ? robot : haptic;

    Library dhd{};
    missing.clear();
    both.find("dhdOpen", dhd.open, missing);
    both.find("dhdClose", dhd.close, missing);
    both.find("dhdGetSystemType", dhd.getSystemType, missing);
    both.find("dhdEnableForce", dhd.enableForce, missing);
    both.find("dhdGetPositionAndOrientationFrame", dhd.getPose, missing);
    both.find("dhdSetForceAndTorqueAndGripperForce", dhd.setWrench, missing);
    both.find("dhdGetStatus", dhd.getStatus, missing);
    both.find("dhdErrorGetLast", dhd.errorGetLast, missing);
    both.find("dhdErrorGetStr", dhd.errorGetStr, missing);
    dhd.name = haptic ? haptic.name() : robot.name();
    if (!missing.empty())
        throw std::runtime_error("Force Dimension's DHD was loaded from " + dhd.name + ", but this file lacks " +
                                 missing + ". " + kInstall);
    std::string optional;
    both.find("dhdOpenSerial", dhd.openSerial, optional);
    both.find("dhdGetSystemName", dhd.getSystemName, optional);
    both.find("dhdGetButtonMask", dhd.getButtonMask, optional);
    both.find("dhdHasActiveWrist", dhd.hasActiveWrist, optional);
    both.find("dhdGetMaxForce", dhd.getMaxForce, optional);
    both.find("dhdGetMaxTorque", dhd.getMaxTorque, optional);

    robot.find("drdOpenID", dhd.robotOpen, missing);
    robot.find("drdClose", dhd.robotClose, missing);
    robot.find("drdIsSupported", dhd.robotIsSupported, missing);
    robot.find("drdIsInitialized", dhd.robotIsInitialized, missing);
    robot.find("drdAutoInit", dhd.robotAutoInit, missing);
    if (missing.empty()) {
        if (haptic) dhd.name += " and " + robot.name();
    } else {
        dhd.robotless = !robot ? "DRD cannot be loaded (" + (robot.errors().empty() ? "no name" : robot.errors()) + ")"
                               : robot.name() + " lacks " + missing;
        dhd.robotAutoInit = nullptr;
    }
    return dhd;
}

}  // namespace touchstone::dhd
