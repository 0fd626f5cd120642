// A stand-in for the vendor's libdhd, written from its public description: a device that is a mass on the spring of a
// hand, with the force switch, watchdog and status of its controller, and faults on demand. Only for tests; never
// installed. Time passes by the clock, whenever a call is made.
//
// $FAKE_DHD_FAULT or fakeDhdFault(): comma-separated names, each active until it is replaced:
//   no-device  no-driver  in-use   dhdOpen fails with 5, 4, 20
//   omega6          no motors in the rotations (otherwise a sigma.7)
//   uncalibrated    waits for the calibration pole, or for drdAutoInit (fake_drd.cpp)
//   init-fails      drdAutoInit fails with 7          unsupported  drdIsSupported is false
//   init-in-vain    drdAutoInit succeeds, and the device is still not initialized
//   com  timeout  geometry  redundant   reading a pose fails with 2, 7, 8, 18
//   set-fails       a wrench is refused with 1        enable-fails  switching on is refused with 12
//   status-fails    dhdGetStatus fails with 2         no-power  controller-error  as entries of the status
//   timeguard       every pose returns 1              saturated  every wrench returns 2
//   button  velocity  watchdog  software  usb  deadman  unknown-cause   the motors switch off, once, for this cause
//   stall           a pose is not returned until the fault is replaced
//   no-watchdog     the controller's watchdog is off
//   slow            a pose takes 20 ms
//   nan  far  skewed  mirrored   the pose is NaN or 1e27 m away, or its frame is no rotation
//   max-force       the library limits the force to 3 N
// For programs: $FAKE_DHD_HAND="x y z" is where the hand goes 0.3 s after the motors are on, and $FAKE_DHD_LOG a file
// that gets the largest force, the opened device's own motions and its misuses when it is closed.
#include "tests/support/fake_dhd/fake_dhd.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>

namespace {

using Clock = std::chrono::steady_clock;

constexpr char kId = 3;
// The hand of fake_hd in m, N, s: 0.1 kg on 500 N/m, and the same in rotation. A step is 1 ms.
constexpr double kMass = 0.1, kSpring = 500, kDamping = 14;
constexpr double kInertia = 250e-6, kTorsion = 1.0125, kTwistDamping = 31.82e-3, kStep = 1e-3;
constexpr auto kWatchdog = std::chrono::milliseconds(80);
const char* const kCauses[] = {"", "button", "velocity", "watchdog", "software", "usb", "deadman", "unknown-cause"};

thread_local int lastError = 0;

struct Fake {
    std::mutex mutex;
    std::string faults;
    unsigned long exchanges = 0, misuses = 0, open = 0, moves = 0;
    bool motors = false, calibrated = true;
    int cause = 0;
    double p[3]{}, v[3]{}, w[3]{}, wv[3]{}, handP[3]{}, handW[3]{}, force[3]{}, torque[3]{}, gripper = 0, peakForce = 0;
    unsigned buttons = 0;
    double largest[3]{};
    Clock::time_point now = Clock::now(), lastWord = now, driven = Clock::time_point::max();  // driven: motors on

    bool has(const std::string& fault) const {
        return ("," + faults + ",").find("," + fault + ",") != std::string::npos;
    }
    int fail(int code) {
        lastError = code;
        return -1;
    }
    bool misused(char id) {
        if (open > 0 && id == kId) return false;
        ++misuses;
        return true;
    }

    void switchOff(int why) {
        motors = false;
        cause = why;
    }
    void pass() {
        const Clock::time_point until = Clock::now();
        for (int steps = 0; now + std::chrono::milliseconds(1) <= until; ++steps) {
            now += std::chrono::milliseconds(1);
            if (motors && now - lastWord > kWatchdog && !has("no-watchdog")) switchOff(3);
            if (steps < 1000) move();
        }
    }
    void move() {
        if (const char* hand = std::getenv("FAKE_DHD_HAND"); hand && now - driven > std::chrono::milliseconds(300))
            std::sscanf(hand, "%lf %lf %lf", &handP[0], &handP[1], &handP[2]);
        for (int i = 0; i < 3; ++i) {
            v[i] += kStep * (kSpring * (handP[i] - p[i]) - kDamping * v[i] + (motors ? force[i] : 0)) / kMass;
            p[i] += kStep * v[i];
            wv[i] +=
                kStep * (kTorsion * (handW[i] - w[i]) - kTwistDamping * wv[i] + (motors ? torque[i] : 0)) / kInertia;
            w[i] += kStep * wv[i];
        }
    }
};

Fake& fake() {
    static Fake* const one = new Fake;  // outlives every thread
    return *one;
}

#define LOCKED                            \
    Fake& f = fake();                     \
    const std::lock_guard guard(f.mutex); \
    f.pass()

}  // namespace

extern "C" {

FakeDhdState fakeDhdState() {
    LOCKED;
    FakeDhdState state{};
    for (int i = 0; i < 3; ++i) {
        state.force[i] = f.motors ? f.force[i] : 0;
        state.torque[i] = f.motors ? f.torque[i] : 0;
        state.position[i] = f.p[i];
    }
    state.gripper = f.gripper;
    state.exchanges = f.exchanges;
    state.misuses = f.misuses;
    state.open = f.open;
    state.moves = f.moves;
    state.motors = f.motors;
    state.peakForce = f.peakForce;
    return state;
}
void fakeDhdHand(double x, double y, double z, double wx, double wy, double wz) {
    LOCKED;
    const double p[]{x, y, z}, w[]{wx, wy, wz};
    std::memcpy(f.handP, p, sizeof p);
    std::memcpy(f.handW, w, sizeof w);
}
void fakeDhdButtons(unsigned pressed) {
    LOCKED;
    f.buttons = pressed;
}
void fakeDhdCalibrate() {
    LOCKED;
    f.calibrated = true;
}
void fakeDhdFault(const char* faults) {
    LOCKED;
    f.faults = faults;
    for (int cause = 1; cause < 8; ++cause)
        if (f.has(kCauses[cause])) f.switchOff(cause == 7 ? 42 : cause);
}

/// For fake_drd.cpp: moves the arm by itself. Returns the code of the failure; 0: success.
int fakeDhdInitialize(char id) {
    LOCKED;
    if (f.misused(id)) return 12;
    ++f.moves;
    if (f.has("init-fails")) return 7;
    f.calibrated = !f.has("init-in-vain");
    return 0;
}
bool fakeDhdIsCalibrated(char id) {
    LOCKED;
    return !f.misused(id) && f.calibrated;
}
bool fakeDhdHas(const char* fault) {
    LOCKED;
    return f.has(fault);
}
void fakeDhdSetError(int code) { lastError = code; }

int dhdOpen() {
    LOCKED;
    const char* faults = std::getenv("FAKE_DHD_FAULT");
    f.faults = faults ? faults : "";
    if (f.has("no-device")) return f.fail(5);
    if (f.has("no-driver")) return f.fail(4);
    if (f.has("in-use") || f.open > 0) return f.fail(20);
    f.open = 1;
    f.exchanges = f.misuses = f.moves = 0;
    f.peakForce = f.gripper = 0;
    f.motors = false;
    f.cause = 0;
    f.calibrated = !f.has("uncalibrated");
    for (double* zero : {f.p, f.v, f.w, f.wv, f.force, f.torque, f.handP, f.handW})
        std::memset(zero, 0, 3 * sizeof *zero);
    f.buttons = 0;
    f.now = f.lastWord = Clock::now();
    f.driven = Clock::time_point::max();
    return kId;
}
int dhdOpenSerial(int serial) { return serial == 1234 ? dhdOpen() : fake().fail(5); }
int dhdClose(char id) {
    LOCKED;
    if (f.misused(id)) return f.fail(12);
    f.open = 0;
    f.motors = false;
    if (const char* file = std::getenv("FAKE_DHD_LOG"))
        if (FILE* log = std::fopen(file, "w")) {
            std::fprintf(log, "%g %g %g %lu %lu\n", f.largest[0], f.largest[1], f.largest[2], f.moves, f.misuses);
            std::fclose(log);
        }
    return 0;
}
int dhdGetSystemType(char id) {
    LOCKED;
    return f.misused(id) ? f.fail(12) : f.has("omega6") ? 34 : 104;
}
const char* dhdGetSystemName(char id) {
    LOCKED;
    f.misused(id);
    return f.has("omega6") ? "fake omega.6" : "fake sigma.7";
}
bool dhdHasActiveWrist(char id) {
    LOCKED;
    return !f.misused(id) && !f.has("omega6");
}
double dhdGetMaxForce(char id) {
    LOCKED;
    return !f.misused(id) && f.has("max-force") ? 3 : -1;
}
double dhdGetMaxTorque(char id) {
    LOCKED;
    f.misused(id);
    return -1;
}
unsigned dhdGetButtonMask(char id) {
    LOCKED;
    return f.misused(id) ? 0 : f.buttons;
}
int dhdEnableForce(unsigned char on, char id) {
    LOCKED;
    if (f.misused(id)) return f.fail(12);
    f.lastWord = f.now;
    if (on && (!f.calibrated || f.has("enable-fails"))) return f.fail(12);
    for (double& force : f.force) force = 0;
    for (double& torque : f.torque) torque = 0;
    if (on) {
        f.motors = true;
        f.driven = std::min(f.driven, f.now);
    } else if (f.motors) {
        f.switchOff(4);
    }
    return 0;
}
int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double frame[3][3], char id) {
    for (bool first = true;; first = false) {
        {
            LOCKED;
            if (f.misused(id)) return f.fail(12);
            if (first && f.has("slow")) {
                // falls through to the sleep below, once
            } else if (!f.has("stall")) {
                ++f.exchanges;
                f.lastWord = f.now;
                if (f.has("com")) return f.fail(2);
                if (f.has("timeout")) return f.fail(7);
                if (f.has("geometry")) return f.fail(8);
                if (f.has("redundant")) return f.fail(18);
                *x = f.has("nan") ? NAN : f.has("far") ? 1e27 : f.p[0];
                *y = f.p[1];
                *z = f.p[2];
                const double angle = std::sqrt(f.w[0] * f.w[0] + f.w[1] * f.w[1] + f.w[2] * f.w[2]);
                const double a = angle > 0 ? f.w[0] / angle : 1, b = angle > 0 ? f.w[1] / angle : 0,
                             c = angle > 0 ? f.w[2] / angle : 0, cosine = std::cos(angle), sine = std::sin(angle),
                             d = 1 - cosine;
                const double rows[3][3]{{cosine + a * a * d, a * b * d - c * sine, a * c * d + b * sine},
                                        {a * b * d + c * sine, cosine + b * b * d, b * c * d - a * sine},
                                        {a * c * d - b * sine, b * c * d + a * sine, cosine + c * c * d}};
                std::memcpy(frame, rows, sizeof rows);
                if (f.has("skewed")) frame[0][1] += 0.1;
                if (f.has("mirrored"))
                    for (int i = 0; i < 3; ++i) frame[i][0] = -frame[i][0];
                return f.has("timeguard") ? 1 : 0;
            }
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(first ? 20 : 1));
    }
}
int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz, double tx, double ty, double tz, double fg,
                                        char id) {
    LOCKED;
    if (f.misused(id)) return f.fail(12);
    f.lastWord = f.now;
    if (f.has("set-fails")) return f.fail(1);
    const double force[]{fx, fy, fz}, torque[]{tx, ty, tz};
    std::memcpy(f.force, force, sizeof force);
    if (!f.has("omega6")) std::memcpy(f.torque, torque, sizeof torque);
    f.gripper = fg;
    if (f.motors && std::hypot(fx, fy, fz) > f.peakForce) {
        f.peakForce = std::hypot(fx, fy, fz);
        std::memcpy(f.largest, force, sizeof force);
    }
    return f.has("saturated") ? 2 : 0;
}
#ifndef FAKE_DHD_LACKS_STATUS
int dhdGetStatus(int* status, char id) {
    LOCKED;
    if (f.misused(id)) return f.fail(12);
    if (f.has("status-fails")) return f.fail(2);
    std::memset(status, 0, 17 * sizeof *status);  // today's library writes one entry more than older ones
    status[0] = !f.has("no-power");
    status[1] = status[2] = 1;
    status[3] = !f.calibrated;
    status[5] = f.motors;
    status[6] = !f.motors;
    status[9] = f.has("controller-error");
    status[14] = f.cause;
    return 0;
}
#endif
int dhdErrorGetLast() { return lastError; }
const char* dhdErrorGetStr(int code) {
    return code == 5 ? "no device found" : code == 7 ? "timeout occurred" : code == 2 ? "communication error" : "error";
}
}
