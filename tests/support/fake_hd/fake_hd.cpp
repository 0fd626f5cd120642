// A stand-in for the vendor's libHD, written from its public description: a device that is a mass on the spring of a
// hand, its own scheduler at 1 kHz, and faults on demand. Only for tests; never installed.
//
// $FAKE_HD_FAULT or fakeHdFault(): comma-separated names, each active from the beginning or as NAME@TICK:
//   no-device       no name can be opened
//   only-phantom    only "Default PHANToM" can be opened
//   no-calibration  never calibrated      update-calibration  calibrated by one encoder reset
//   inkwell         calibrated by its inkwell, unless out-of-well
//   comm            0302 in every frame   warm  0200  max-force  0201  impulse  0202  max-velocity  0203, for 20 ticks
//   no-torque       CURRENT_TORQUE is an invalid enum       no-limits  so are the nominal limits
//   slow            30 Hz   lazy  400 Hz  dead  the scheduler makes no call
//   nan             the transform is NaN
//   far             the transform is 1e30 mm away
#include "tests/support/fake_hd/fake_hd.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace {

struct ErrorInfo {
    std::uint32_t code;
    int internalCode;
    std::uint32_t device;
};
using Callback = std::uint32_t (*)(void*);

constexpr std::uint32_t kInvalid = 0xFFFFFFFF, kDevice = 7;
// A hand of 0.1 kg that reaches its target within a few hundredths of a second, in mm, N, ms; a tick is 1 ms.
constexpr double kMass = 100, kSpring = 0.5, kDamping = 14;
constexpr double kInertia = 250e3, kTorsion = 1012.5, kTwistDamping = 31820;

/// One state behind one lock: the vendor's calls come from several threads.
struct Fake {
    std::recursive_mutex mutex;
    std::string faults;
    std::vector<std::uint32_t> errors;  // newest last
    unsigned long handles = 0, ticks = 0, misuses = 0;
    bool inFrame = false, forces = false, calibrated = false;
    double p[3]{}, v[3]{}, w[3]{}, wv[3]{}, handP[3]{}, handW[3]{}, force[3]{}, torque[3]{}, peakForce = 0;
    int buttons = 0;
    double rate = 1000;

    Callback callback = nullptr;
    void* data = nullptr;
    std::atomic<bool> running = false;
    std::thread thread;

    bool has(const std::string& fault, unsigned long ticksLong = 0) const {
        for (std::size_t at = 0; at < faults.size();) {
            const std::size_t end = std::min(faults.find(',', at), faults.size());
            const std::string part = faults.substr(at, end - at);
            const std::size_t sign = part.find('@');
            if (part.substr(0, sign) == fault) {
                const unsigned long from = sign == std::string::npos ? 0 : std::stoul(part.substr(sign + 1));
                if (ticks >= from && (ticksLong == 0 || ticks < from + ticksLong)) return true;
            }
            at = end + 1;
        }
        return false;
    }
    void push(std::uint32_t code) { errors.push_back(code); }
    bool wrongly(bool misused, std::uint32_t code) {
        if (!misused) return false;
        ++misuses;
        push(code);
        return true;
    }

    void move() {
        for (int i = 0; i < 3; ++i) {
            v[i] += (kSpring * (handP[i] - p[i]) - kDamping * v[i] + (forces ? force[i] : 0)) / kMass;
            p[i] += v[i];
            wv[i] += (kTorsion * (handW[i] - w[i]) - kTwistDamping * wv[i] + (forces ? torque[i] : 0)) / kInertia;
            w[i] += wv[i];
        }
    }

    void run() {
        auto next = std::chrono::steady_clock::now();
        while (running) {
            Callback call = nullptr;
            {
                const std::lock_guard lock(mutex);
                ++ticks;
                move();
                if (!has("dead")) call = callback;
                next += std::chrono::microseconds(has("slow")   ? 33'000
                                                  : has("lazy") ? 2'500
                                                                : static_cast<long>(1e6 / rate));
            }
            if (call && call(data) == 0) {
                const std::lock_guard lock(mutex);
                callback = nullptr;
            }
            std::this_thread::sleep_until(next);
            next = std::max(next, std::chrono::steady_clock::now() - std::chrono::milliseconds(2));
        }
    }
};

Fake& fake() {
    static Fake* const one = new Fake;  // outlives every thread
    return *one;
}

#define LOCKED        \
    Fake& f = fake(); \
    const std::lock_guard lock(f.mutex)

}  // namespace

extern "C" {

FakeHdState fakeHdState() {
    LOCKED;
    FakeHdState state{};
    for (int i = 0; i < 3; ++i) {
        state.force[i] = f.forces ? f.force[i] : 0;
        state.torque[i] = f.forces ? f.torque[i] : 0;
        state.position[i] = f.p[i];
    }
    state.ticks = f.ticks;
    state.misuses = f.misuses;
    state.handles = f.handles;
    state.peakForce = f.peakForce;
    return state;
}
void fakeHdHand(double x, double y, double z, double wx, double wy, double wz) {
    LOCKED;
    const double p[]{x, y, z}, w[]{wx, wy, wz};
    std::memcpy(f.handP, p, sizeof p);
    std::memcpy(f.handW, w, sizeof w);
}
void fakeHdButtons(int pressed) {
    LOCKED;
    f.buttons = pressed;
}
void fakeHdFault(const char* faults) {
    LOCKED;
    f.faults = faults;
}

std::uint32_t hdInitDevice(const char* name) {
    LOCKED;
    if (f.handles > 0) {
        f.push(0x0301);
        return kInvalid;
    }
    const char* faults = std::getenv("FAKE_HD_FAULT");
    f.ticks = 0;
    f.faults = faults ? faults : "";
    if (f.has("no-device") || (f.has("only-phantom") && !(name && std::string(name) == "Default PHANToM"))) {
        f.push(0x0300);
        return kInvalid;
    }
    // Like the vendor's library, it reads numbers by the locale.
    if (std::strtod("1.5", nullptr) != 1.5) f.push(0x0303);
    f.handles = 1;
    f.misuses = 0;
    f.peakForce = 0;
    f.forces = f.inFrame = false;
    f.calibrated = !f.has("no-calibration") && !f.has("update-calibration") && !f.has("inkwell");
    for (double* zero : {f.p, f.v, f.w, f.wv, f.force, f.torque, f.handP, f.handW})
        std::memset(zero, 0, 3 * sizeof *zero);
    f.buttons = 0;
    return kDevice;
}
void hdDisableDevice(std::uint32_t device) {
    LOCKED;
    if (f.wrongly(f.running || f.callback || device != kDevice, 0x0102)) return;  // stop, unschedule, then disable
    f.handles = 0;
    f.forces = false;
}
void hdMakeCurrentDevice(std::uint32_t device) {
    LOCKED;
    f.wrongly(device != kDevice || f.handles == 0, 0x0104);
}
void hdBeginFrame(std::uint32_t device) {
    LOCKED;
    if (f.wrongly(f.inFrame, 0x0400) || f.wrongly(device != kDevice, 0x0104)) return;
    f.inFrame = true;
    if (f.has("comm")) f.push(0x0302);
    if (f.has("warm", 20)) f.push(0x0200);
    if (f.has("max-force", 20)) f.push(0x0201);
    if (f.has("impulse", 20)) f.push(0x0202);
    if (f.has("max-velocity", 20)) f.push(0x0203);
}
void hdEndFrame(std::uint32_t) {
    LOCKED;
    f.wrongly(!f.inFrame, 0x0401);
    f.inFrame = false;
}
ErrorInfo hdGetError() {
    LOCKED;
    if (f.errors.empty()) return {0, 0, kInvalid};
    const std::uint32_t code = f.errors.back();
    f.errors.pop_back();
    return {code, -1, kDevice};
}
const char* hdGetErrorString(std::uint32_t code) { return code == 0x0300 ? "HD_DEVICE_FAULT" : "HD_ERROR"; }

void hdEnable(std::uint32_t what) {
    LOCKED;
    if (f.wrongly(!f.calibrated, 0x0102)) return;
    if (what == 0x4000) f.forces = true;
}
void hdDisable(std::uint32_t what) {
    LOCKED;
    if (what == 0x4000) f.forces = false;
}
void hdGetIntegerv(std::uint32_t what, int* to) {
    LOCKED;
    if (f.wrongly(!f.inFrame, 0x0402)) return;
    if (what == 0x2000)
        *to = f.buttons;
    else if (what == 0x2554)
        *to = 6;
    else if (what == 0x2555)
        *to = f.has("inkwell") ? 4 : 1;
    else
        f.push(0x0100);
}
void hdGetDoublev(std::uint32_t what, double* to) {
    LOCKED;
    if (f.wrongly(!f.inFrame, 0x0402)) return;
    const bool limits = !f.has("no-limits");
    if (what == 0x2052) {
        const double angle = std::sqrt(f.w[0] * f.w[0] + f.w[1] * f.w[1] + f.w[2] * f.w[2]);
        const double x = angle > 0 ? f.w[0] / angle : 1, y = angle > 0 ? f.w[1] / angle : 0,
                     z = angle > 0 ? f.w[2] / angle : 0, c = std::cos(angle), s = std::sin(angle), d = 1 - c;
        const double m[16]{c + x * x * d,
                           y * x * d + z * s,
                           z * x * d - y * s,
                           0,  // first column
                           x * y * d - z * s,
                           c + y * y * d,
                           z * y * d + x * s,
                           0,  // second
                           x * z * d + y * s,
                           y * z * d - x * s,
                           c + z * z * d,
                           0,  // third
                           f.p[0],
                           f.p[1],
                           f.p[2],
                           1};
        std::memcpy(to, m, sizeof m);
        if (f.has("nan")) to[12] = NAN;
        if (f.has("far")) to[13] = 1e30;
    } else if (what == 0x2605) {
        for (int i = 0; i < 6; ++i) to[i] = 0.1 + 0.05 * i;
    } else if (what == 0x2150) {
        std::memset(to, 0, 3 * sizeof *to);
    } else if (what == 0x2602 && limits) {
        *to = 0.8;
    } else if (what == 0x2603 && limits) {
        *to = 8;
    } else if (what == 0x2604 && limits) {
        *to = 2;
    } else {
        f.push(0x0100);
    }
}
void hdSetDoublev(std::uint32_t what, const double* from) {
    LOCKED;
    if (f.wrongly(!f.inFrame, 0x0402)) return;
    if (what == 0x2700) {
        std::memcpy(f.force, from, sizeof f.force);
        f.peakForce = std::max(f.peakForce, std::hypot(from[0], from[1], from[2]));
    } else if ((what == 0x2701 && !f.has("no-torque")) || what == 0x2704) {
        std::memcpy(f.torque, from, sizeof f.torque);
    } else {
        f.push(0x0100);
    }
}
const char* hdGetString(std::uint32_t what) {
    LOCKED;
    f.wrongly(!f.inFrame, 0x0402);
    return what == 0x2501 ? "Fake Premium 6DOF" : "F-1";
}
std::uint32_t hdCheckCalibration() {
    LOCKED;
    return f.calibrated ? 0x5000 : 0x5001;
}
void hdUpdateCalibration(std::uint32_t style) {
    LOCKED;
    f.wrongly(f.forces, 0x0102);  // not allowed with forces on
    if (style == 1 && f.has("update-calibration")) f.calibrated = true;
    if (style == 4 && f.has("inkwell") && !f.has("out-of-well")) f.calibrated = true;
}
void hdSetSchedulerRate(unsigned long rate) {
    LOCKED;
    f.rate = static_cast<double>(rate);
}
unsigned long hdScheduleAsynchronous(Callback callback, void* data, unsigned short) {
    LOCKED;
    f.wrongly(f.running, 0x0501);
    f.callback = callback;
    f.data = data;
    return 1;
}
void hdStartScheduler() {
    LOCKED;
    if (f.wrongly(f.running || !f.callback, 0x0501)) return;
    f.running = true;
    f.thread = std::thread([&f] { f.run(); });
}
void hdStopScheduler() {
    fake().running = false;
    if (fake().thread.joinable()) fake().thread.join();
}
#ifndef FAKE_HD_LACKS_UNSCHEDULE
void hdUnschedule(unsigned long) {
    LOCKED;
    f.wrongly(f.running, 0x0102);
    f.callback = nullptr;
}
#endif
}
