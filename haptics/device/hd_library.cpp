#include "haptics/device/hd_library.hpp"

#include <cstdlib>
#include <stdexcept>

#include "haptics/device/shared_library.hpp"

namespace touchstone::hd {

const char* words(Error code) {
    switch (code) {
        case 0x0100:
            return "the library does not know this parameter";
        case 0x0101:
            return "a value is out of the library's range";
        case 0x0102:
            return "the call is not possible in this state";
        case 0x0103:
            return "a parameter has the wrong type";
        case 0x0104:
            return "the device's handle is not valid";
        case 0x0200:
            return "the motors are warm: let them cool down";
        case 0x0201:
            return "the maximum force was exceeded";
        case 0x0202:
            return "the force changed faster than the device allows";
        case 0x0203:
            return "the maximum velocity was exceeded";
        case 0x0204:
            return "forces and motor values were mixed";
        case 0x0300:
            return "the device reports a fault, or no device of that name is connected";
        case 0x0301:
            return "another program, or this one, already uses the device";
        case 0x0302:
            return "the connection to the device is lost: check cable and power";
        case 0x0303:
            return "the connection is configured wrongly: run the vendor's setup program";
        case 0x0304:
            return "the vendor's timer failed";
        case 0x0400:
            return "a frame was begun twice";
        case 0x0401:
            return "a frame was ended without being begun";
        case 0x0402:
            return "a value was read or set outside a frame";
        case 0x0500:
            return "the scheduler rejects the priority";
        case 0x0501:
            return "the scheduler accepts no more callbacks";
        case 0x0600:
            return "the vendor's license is not valid";
        default:
            return "unknown error";
    }
}

bool losesDevice(Error code) {
    return (code >= kDeviceFault && code <= kTimerError) || code == kSchedulerError || code == kSchedulerFull ||
           code == kInvalidLicense;
}

std::string remedy(const std::string& errors) {
    const auto lacks = [&](const char* library) {
        return errors.find(std::string(library) + ": cannot open") != std::string::npos;
    };
    if (lacks("libPhantomIOLib42.so"))
        return "libHD 3.4 is there, but not the driver that it needs: install the vendor's Touch Device Driver, which "
               "brings libPhantomIOLib42.so, and set GTDD_HOME as its setup says";
    if (lacks("libPHANToMIO.so.4"))
        return "libHD 3.0 is there, but not the driver that it needs: install the vendor's PHANTOM Device Drivers 4.3, "
               "which bring libPHANToMIO.so.4";
    if (lacks("libncurses.so.5") || lacks("libtinfo.so.5"))
        return "libHD is there, but not a library of the system that it needs: apt install libncurses5";
    return "Install the vendor's OpenHaptics and device driver (libHD 3.4 needs libPhantomIOLib42.so of the Touch "
           "Device Driver, libHD 3.0 needs libPHANToMIO.so.4 of the PHANTOM Device Drivers, both need "
           "libncurses.so.5), or name the library in TOUCHSTONE_LIBHD";
}

Library load(const std::string& file) {
    const char* named = std::getenv("TOUCHSTONE_LIBHD");
    std::vector<std::string> names{"libHD.so", "libHD.so.3.4", "libHD.so.3", "libHD.so.3.0"};
    if (!file.empty())
        names = {file};
    else if (named && *named)
        names = {named};

    const SharedLibrary found(names);
    if (!found)
        throw std::runtime_error("OpenHaptics cannot be loaded (" + found.errors() + "). " + remedy(found.errors()));

    Library hd{};
    hd.name = found.name();
    std::string missing;
    found.find("hdInitDevice", hd.initDevice, missing);
    found.find("hdDisableDevice", hd.disableDevice, missing);
    found.find("hdMakeCurrentDevice", hd.makeCurrentDevice, missing);
    found.find("hdBeginFrame", hd.beginFrame, missing);
    found.find("hdEndFrame", hd.endFrame, missing);
    found.find("hdGetError", hd.getError, missing);
    found.find("hdGetErrorString", hd.getErrorString, missing);
    found.find("hdEnable", hd.enable, missing);
    found.find("hdDisable", hd.disable, missing);
    found.find("hdGetIntegerv", hd.getIntegerv, missing);
    found.find("hdGetDoublev", hd.getDoublev, missing);
    found.find("hdSetDoublev", hd.setDoublev, missing);
    found.find("hdGetString", hd.getString, missing);
    found.find("hdCheckCalibration", hd.checkCalibration, missing);
    found.find("hdUpdateCalibration", hd.updateCalibration, missing);
    found.find("hdStartScheduler", hd.startScheduler, missing);
    found.find("hdStopScheduler", hd.stopScheduler, missing);
    found.find("hdSetSchedulerRate", hd.setSchedulerRate, missing);
    found.find("hdScheduleAsynchronous", hd.scheduleAsynchronous, missing);
    found.find("hdUnschedule", hd.unschedule, missing);
    if (!missing.empty())
        throw std::runtime_error("OpenHaptics was loaded from " + hd.name + ", but this file lacks " + missing + ". " +
                                 remedy({}));
    return hd;
}

}  // namespace touchstone::hd
