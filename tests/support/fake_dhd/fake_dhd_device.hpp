#pragma once
// A device of Force Dimension on the fake libraries, in our axes and units.
#include <dlfcn.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <string>

#include "haptics/device/device_table.hpp"
#include "haptics/device/forcedimension.hpp"
#include "haptics/hands/mouse.hpp"
#include "tests/support/fake_dhd/fake_dhd.hpp"

namespace touchstone::test {

/// Makes the driver load the fake library, with the given faults from the start.
class FakeDhd {
  public:
    static constexpr const char* kBoth = TOUCHSTONE_BINARY_DIR "/fakes/dhd/libdhd.so.3";  ///< with libdrd beside it
    static constexpr const char* kAlone = TOUCHSTONE_BINARY_DIR "/fakes/dhd_alone/libdhd.so.3.17.6";
    static constexpr const char* kIncomplete = TOUCHSTONE_BINARY_DIR "/fakes/libdhd_incomplete.so";

    explicit FakeDhd(const std::string& faults = {}, const char* file = kBoth) {
        setenv("TOUCHSTONE_LIBDHD", file, 1);
        setenv("FAKE_DHD_FAULT", faults.c_str(), 1);
        void* const library = dlopen(file, RTLD_NOW);
        REQUIRE(library);
        find(library, "fakeDhdState", state);
        find(library, "fakeDhdHand", hand_);
        find(library, "fakeDhdButtons", buttons);
        find(library, "fakeDhdCalibrate", calibrate);
        find(library, "fakeDhdFault", fault);
    }
    ~FakeDhd() {
        unsetenv("TOUCHSTONE_LIBDHD");
        unsetenv("FAKE_DHD_FAULT");
    }

    Vec3 force() const { return ours(state().force); }
    Vec3 torque() const { return 1000 * ours(state().torque); }
    Vec3 position() const { return 1000 * ours(state().position); }
    void hand(const Vec3& p, const Vec3& w = Vec3::Zero()) const {
        hand_(p.z() / 1000, p.x() / 1000, p.y() / 1000, w.z(), w.x(), w.y());
    }
    bool released() const { return force().isZero() && torque().isZero(); }

    decltype(&fakeDhdState) state;
    decltype(&fakeDhdButtons) buttons;
    decltype(&fakeDhdCalibrate) calibrate;
    decltype(&fakeDhdFault) fault;

  private:
    /// The library's x points to the user, y right and z up.
    static Vec3 ours(const double (&v)[3]) { return {v[1], v[2], v[0]}; }
    template <class F>
    static void find(void* library, const char* name, F& function) {
        function = reinterpret_cast<F>(dlsym(library, name));
        REQUIRE(function);
    }

    decltype(&fakeDhdHand) hand_;
};

/// `window`: somebody can agree to a motion of the arm.
inline std::unique_ptr<Device> openForceDimension(const std::string& text = {}, const Pose& X_WT_start = {},
                                                  bool window = false) {
    DeviceContext context;
    context.X_WT_start = X_WT_start;
    context.file = text;
    if (window) context.mouse = std::make_shared<MouseTarget>();
    return makeForceDimension(context);
}

}  // namespace touchstone::test
