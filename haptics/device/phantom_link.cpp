#include "haptics/device/phantom_link.hpp"

#include <locale.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "haptics/threads/rt_thread.hpp"

namespace touchstone {
namespace {

/// Sets the C locale for numbers while it exists. The vendor's library reads its configuration with the C library,
/// which takes the decimal point from the locale.
class ScopedCLocale {
  public:
    ScopedCLocale() : plain_(newlocale(LC_NUMERIC_MASK, "C", nullptr)), before_(uselocale(plain_)) {}
    ~ScopedCLocale() {
        uselocale(before_);
        freelocale(plain_);
    }

  private:
    locale_t plain_, before_;
};

std::string errorText(hd::Error code) {
    char number[16];
    std::snprintf(number, sizeof number, " (0x%04x)", code);
    return hd::words(code) + std::string(number);
}

}  // namespace

PhantomOptions phantomOptions(const std::string& text) {
    PhantomOptions options;
    const std::size_t comma = std::min(text.find(','), text.size());
    options.name = text.substr(0, comma);
    readArmOptions("phantom", text.substr(std::min(comma + 1, text.size())),
                   "phantom[:NAME][,library=FILE][,drive=loop or device][,rate=250 to 10000][,stale=1 to 1000 ms]"
                   "[,torque=1 to 10000 mN·m][,gimbal]",
                   [&](const std::string& key, const std::string& value) {
                       return key == "library"  ? !(options.library = value).empty()
                              : key == "drive"  ? (options.deviceDrives = value == "device") || value == "loop"
                              : key == "gimbal" ? (options.gimbalTorque = value.empty())
                              : key == "stale"  ? takeNumber(value, 1, 1000, options.staleMs)
                              : key == "torque" ? takeNumber(value, 1, 1e4, options.peakTorque)
                              : key == "rate"   ? takeNumber(value, 250, 10'000, options.rate)
                                                : false;
                   });
    return options;
}

std::shared_ptr<PhantomLink> PhantomLink::connect(const std::string& text) {
    return sharedLink<PhantomLink>(text, [&] { return std::make_shared<PhantomLink>(phantomOptions(text)); });
}

DeviceCheck PhantomLink::examine() {
    try {
        return {true, PhantomLink(PhantomOptions{}).status().text};
    } catch (const std::exception& e) {
        return {false, e.what()};
    }
}

PhantomLink::PhantomLink(PhantomOptions options) : ArmLink(options.staleMs), options_(std::move(options)) {
    hd_ = hd::load(options_.library);
    openOrClose();
}

PhantomLink::~PhantomLink() {
    endReconnecting();
    close();
}

// -- Opening and closing -------------------------------------------------------------------------------------------

void PhantomLink::open() {
    const std::string opened = initialize();
    calibrate();
    readLimits(opened);
    startTicks();
}

/// Takes all errors from the library's stack. Returns their descriptions, ours and the library's; empty if there are
/// none.
std::string PhantomLink::takeErrors() {
    std::string all;
    for (int i = 0; i < 64; ++i) {
        const hd::Error code = hd_.getError().code;
        if (code == hd::kSuccess) break;
        const char* text = hd_.getErrorString(code);
        all += (all.empty() ? "" : "; ") + errorText(code) + (text && *text ? std::string(", '") + text + "'" : "");
    }
    return all;
}

/// Opens the device. Returns which library and name it was opened with.
std::string PhantomLink::initialize() {
    const ScopedCLocale locale;
    const char* const names[]{options_.name.c_str(), nullptr, "Default Device", "Default PHANToM"};
    std::string tried;
    takeErrors();
    for (const char* const name : names) {
        if (name && !*name) continue;
        device_ = hd_.initDevice(name);
        const std::string errors = takeErrors();
        const std::string called = name ? "'" + std::string(name) + "'" : "the default";
        if (device_ != hd::kInvalidHandle && errors.empty()) {
            hd_.makeCurrentDevice(device_);
            return "Library " + hd_.name + "\nDevice " + called + (tried.empty() ? "" : ", after " + tried);
        }
        if (device_ != hd::kInvalidHandle) hd_.disableDevice(device_);
        device_ = hd::kInvalidHandle;
        tried += (tried.empty() ? "" : ", ") + called + ": " + (errors.empty() ? "no reason given" : errors);
    }
    throw std::runtime_error("OpenHaptics (" + hd_.name + ") opens no device; tried " + tried +
                             ". Connect and power the device, and run the vendor's setup and diagnostic programs" +
                             (std::getenv("GTDD_HOME") ? "" : "; with libHD 3.4, set GTDD_HOME as their setup says"));
}

void PhantomLink::calibrate() {
    hd::Enum state = hd_.checkCalibration();
    hd::Int style = 0;
    hd_.beginFrame(device_);
    hd_.getIntegerv(hd::kCalibrationStyle, &style);
    hd_.endFrame(device_);
    // Forces are not enabled yet, because calibrating with a force would jerk the arm.
    if (state != hd::kCalibrationOk && (style & 7)) {
        hd_.updateCalibration(style & 1 ? 1 : style & 2 ? 2 : 4);  // encoder reset, automatic, inkwell
        state = hd_.checkCalibration();
    }
    const std::string errors = takeErrors();
    if (state == hd::kCalibrationOk) return;
    throw std::runtime_error(
        std::string("The device is not calibrated") + (errors.empty() ? "" : " (" + errors + ")") +
        (style & 4 ? ": put the stylus into the inkwell" : ": hold the arm in its reset position") +
        " and choose the device again");
}

void PhantomLink::readLimits(const std::string& opened) {
    limits_ = {.nominalStiffness = 1, .nominalTorsion = 300};
    if (options_.peakTorque > 0) {
        limits_.peakTorque = options_.peakTorque;
        limits_.continuousTorque = std::min(limits_.continuousTorque, options_.peakTorque);
    }
    const auto read = [&](hd::Enum name, double& to) {
        double value = 0;
        hd_.getDoublev(name, &value);
        if (takeErrors().empty() && std::isfinite(value) && value > 0) to = value;
    };
    hd_.beginFrame(device_);
    read(hd::kMaxForce, limits_.peakForce);
    read(hd::kContinuousForce, limits_.continuousForce);
    read(hd::kMaxStiffness, limits_.nominalStiffness);
    limits_.continuousForce = std::min(limits_.continuousForce, limits_.peakForce);
    hd::Int outputs = 6;
    hd_.getIntegerv(hd::kOutputDof, &outputs);
    if (!takeErrors().empty()) outputs = 6;  // unknown: the first frame will show it
    torqueName_ = outputs >= 6 ? hd::kTorque : 0u;
    const auto text = [&](hd::Enum name) {
        const char* value = hd_.getString(name);
        takeErrors();
        return std::string(value && *value ? value : "unknown");
    };
    const std::string model = text(hd::kModel), serial = text(hd::kSerial), driver = text(hd::kDriverVersion);
    hd_.endFrame(device_);
    takeErrors();
    char numbers[160];
    std::snprintf(numbers, sizeof numbers,
                  "Peak force %g N, continuous force %g N, peak torque %g mN·m, maximum stiffness %g N/mm",
                  limits_.peakForce, limits_.continuousForce, limits_.peakTorque, limits_.nominalStiffness);
    describe(model + " runs",
             opened + "\nModel " + model + ", serial number " + serial + ", driver " + driver + "\n" + numbers);
}

void PhantomLink::startTicks() {
    begin();
    hd_.enable(hd::kForceOutput);
    callback_ = hd_.scheduleAsynchronous([](void* self) { return static_cast<PhantomLink*>(self)->tick(); }, this,
                                         hd::kDefaultPriority);
    scheduled_ = true;
    if (options_.rate > 0) hd_.setSchedulerRate(static_cast<hd::ULong>(options_.rate));
    if (const std::string errors = takeErrors(); !errors.empty())
        throw std::runtime_error("The vendor's scheduler does not start: " + errors);
    hd_.startScheduler();
    started_ = true;
    if (!waitForExchange(2000))
        throw std::runtime_error("The vendor's scheduler never called back in two seconds: restart its driver");
}

void PhantomLink::close() noexcept {
    if (started_) {
        settle();
        hd_.stopScheduler();
    }
    if (scheduled_) hd_.unschedule(callback_);
    if (device_ != hd::kInvalidHandle) {
        hd_.disable(hd::kForceOutput);
        hd_.disableDevice(device_);
    }
    started_ = scheduled_ = false;
    device_ = hd::kInvalidHandle;
    markLost();
}

std::string PhantomLink::faultText(std::uint32_t code) const {
    return code == kTooSlow ? "The vendor's scheduler is too slow for a stiff wall: close other programs"
                            : errorText(code);
}

DeviceStatus PhantomLink::status() const {
    DeviceStatus status = ArmLink::status();
    if (status.state == DeviceStatus::State::Connecting) return status;
    switch (torqueName_.load()) {
        case hd::kTorque:
            break;
        case hd::kGimbalTorque:
            status.details += "\nTorque on the gimbal's axes, as requested; this was never tried on hardware";
            break;
        default:
            status.details +=
                "\nForces only: the library rejects CURRENT_TORQUE; phantom:NAME,gimbal tries the gimbal's axes";
    }
    if (!lost()) status.temperature = temperature_.load();
    return status;
}

// -- The vendor's thread -------------------------------------------------------------------------------------------

/// Takes all errors from the library's stack. Each is a fault, except the tolerated one. Returns whether that one
/// occurred.
bool PhantomLink::checkErrors(hd::Error tolerated) noexcept {
    bool seen = false;
    for (int i = 0; i < 64; ++i) {
        const hd::Error code = hd_.getError().code;
        if (code == hd::kSuccess) break;
        if (code == tolerated)
            seen = true;
        else
            trip(code, hd::losesDevice(code));
    }
    return seen;
}

std::uint32_t PhantomLink::tick() noexcept {
    const std::uint64_t now = steadyNanoseconds();
    noteExchange(now);
    hd_.beginFrame(device_);
    readSample(now);
    int turn = kOffered;
    if (turn_.compare_exchange_strong(turn, kRunning, std::memory_order_acq_rel))
        turn_.store((*drivenTick_)() ? kOffered : kDone, std::memory_order_release);
    writeWrench();
    hd_.endFrame(device_);
    checkErrors();
    return hd::kCallbackContinue;
}

void PhantomLink::readSample(std::uint64_t now) noexcept {
    std::array<double, 16> m{};  // column-major
    hd::Int buttons = 0;
    hd_.getDoublev(hd::kTransform, m.data());
    hd_.getIntegerv(hd::kButtons, &buttons);
    checkErrors();
    Mat3 R;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) R(row, column) = m[static_cast<std::size_t>(4 * column + row)];
    q_DS_ = Quat(R).normalized();
    publish({{m[12], m[13], m[14]}, q_DS_}, static_cast<std::uint32_t>(buttons), now);
    if (torqueName_.load(std::memory_order_relaxed) == hd::kGimbalTorque) {
        hd_.getDoublev(hd::kGimbalAngles, gimbal_.data());
        checkErrors();
    }
    if (exchanges() % 128 != 1) return;
    std::array<double, 6> motors{};
    hd_.getDoublev(hd::kMotorTemperature, motors.data());
    if (!checkErrors(hd::kInvalidEnum)) temperature_.store(*std::max_element(motors.begin(), motors.end()));
}

void PhantomLink::writeWrench() noexcept {
    const Wrench wrench = permitted();
    hd_.setDoublev(hd::kForce, wrench.force.data());
    checkErrors();
    const hd::Enum name = torqueName_.load(std::memory_order_relaxed);
    if (name == 0) return;
    const Vec3 torque = name == hd::kGimbalTorque ? gimbalComponents(wrench.torque) : wrench.torque;
    hd_.setDoublev(name, torque.data());
    if (checkErrors(hd::kInvalidEnum))
        torqueName_.store(name == hd::kTorque && options_.gimbalTorque ? hd::kGimbalTorque : 0u);
}

/// Components of a torque on the three gimbal joints. The joints are assumed to be a yaw about y, a pitch about x and a
/// roll about z, in this order from the arm to the stylus. No hardware has confirmed this.
Vec3 PhantomLink::gimbalComponents(const Vec3& torque) const noexcept {
    const Quat roll(Eigen::AngleAxisd(-gimbal_.z(), Vec3::UnitZ())),
        pitch(Eigen::AngleAxisd(-gimbal_.y(), Vec3::UnitX()));
    const Quat& q = q_DS_;
    return {torque.dot(q * (roll * (pitch * Vec3::UnitY()))), torque.dot(q * (roll * Vec3::UnitX())),
            torque.dot(q * Vec3::UnitZ())};
}

// -- The haptic thread ---------------------------------------------------------------------------------------------

bool PhantomLink::drive(double rate, const std::function<bool()>& tick) noexcept {
    const auto stalled = [&] { return lost() || steadyNanoseconds() - lastExchange() > staleNs(); };
    const double deviceRate = options_.rate > 0 ? options_.rate : 1000;
    if (!options_.deviceDrives || std::abs(rate - deviceRate) > 0.01 * deviceRate || stalled()) return false;
    drivenTick_ = &tick;
    turn_.store(kOffered, std::memory_order_release);
    while (turn_.load(std::memory_order_acquire) != kDone) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        int turn = kOffered;
        if (stalled() && turn_.compare_exchange_strong(turn, kIdle, std::memory_order_acq_rel)) return false;
    }
    turn_.store(kIdle, std::memory_order_relaxed);
    return true;
}

}  // namespace touchstone
