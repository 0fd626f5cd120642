#pragma once
// A phantom on the fake libHD, and waiting with a time limit.
#include <dlfcn.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <thread>

#include "haptics/device/control.hpp"
#include "haptics/device/phantom.hpp"
#include "tests/support/fake_hd/fake_hd.hpp"

namespace touchstone::test {

/// Makes the driver load the fake library, with the given faults from the start.
class FakeHd {
  public:
    explicit FakeHd(const std::string& faults = {}) {
        const std::string file = TOUCHSTONE_BINARY_DIR "/fakes/libfake_hd.so";
        setenv("TOUCHSTONE_LIBHD", file.c_str(), 1);
        setenv("FAKE_HD_FAULT", faults.c_str(), 1);
        void* const library = dlopen(file.c_str(), RTLD_NOW);
        REQUIRE(library);
        find(library, "fakeHdState", state);
        find(library, "fakeHdHand", hand);
        find(library, "fakeHdButtons", buttons);
        find(library, "fakeHdFault", fault);
    }
    ~FakeHd() {
        unsetenv("TOUCHSTONE_LIBHD");
        unsetenv("FAKE_HD_FAULT");
    }

    Vec3 force() const { return Vec3(state().force); }
    Vec3 torque() const { return Vec3(state().torque); }
    Vec3 position() const { return Vec3(state().position); }

    decltype(&fakeHdState) state;
    decltype(&fakeHdHand) hand;
    decltype(&fakeHdButtons) buttons;
    decltype(&fakeHdFault) fault;

  private:
    template <class F>
    static void find(void* library, const char* name, F& function) {
        function = reinterpret_cast<F>(dlsym(library, name));
        REQUIRE(function);
    }
};

/// Calls `step` every millisecond until it returns true; false after half a minute, which only a hang exceeds.
inline bool within(const std::function<bool()>& step) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (std::chrono::steady_clock::now() < end) {
        if (step()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

inline std::unique_ptr<Device> openPhantom(const std::string& text = {}, const Pose& X_WT_start = {}) {
    DeviceContext context;
    context.X_WT_start = X_WT_start;
    context.file = text;
    return makePhantom(context);
}

/// The error message of a failed opening.
inline std::string refusal(const std::string& text = {}) {
    try {
        openPhantom(text);
    } catch (const std::runtime_error& e) {
        return e.what();
    }
    return {};
}

}  // namespace touchstone::test
