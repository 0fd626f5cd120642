#pragma once
// A phantom on the fake libHD.
#include <dlfcn.h>

#include <catch2/catch.hpp>
#include <cstdlib>

#include "haptics/device/device_table.hpp"
#include "haptics/device/phantom.hpp"
#include "tests/support/arm_matrix.hpp"
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

inline std::unique_ptr<Device> openPhantom(const std::string& text = {}, const Pose& X_WT_start = {}) {
    DeviceContext context;
    context.X_WT_start = X_WT_start;
    context.file = text;
    return makePhantom(context);
}

/// The phantom as the safety matrix sees it.
class PhantomStandIn final : public ArmStandIn {
  public:
    std::unique_ptr<Device> open(const std::string& options = {}) override {
        return openPhantom(options.empty() ? "" : "," + options);
    }
    Vec3 force() const override { return fake.force(); }
    Vec3 torque() const override { return fake.torque(); }
    void hand(const Vec3& p) override { fake.hand(p.x(), p.y(), p.z(), 0, 0, 0); }
    Vec3 position() const override { return fake.position(); }
    /// The codes of errors last 20 ticks; other faults last.
    void inject(const std::string& fault) override {
        const bool lasts = fault == "comm" || fault == "slow";
        fake.fault((lasts ? fault : fault + "@" + std::to_string(fake.state().ticks + 5)).c_str());
    }
    void clear() override {}

    FakeHd fake;
};

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
