#include "haptics/device/phantom_link.hpp"

#include <locale.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <stdexcept>

#include "haptics/math/numbers.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone {
namespace {

constexpr std::uint64_t kNsPerMs = 1'000'000;
// Time for which a fault is held, so that an error in every tick counts as one fault.
constexpr std::uint64_t kFaultHoldNs = 100 * kNsPerMs;
// Longest mean period: a scheduler below 250 Hz cannot hold a stiff wall.
constexpr double kSlowestNs = 4e6;
// A longer period enters the mean as this: one long gap makes samples stale, but does not make the scheduler slow.
constexpr double kLongestNs = 20e6;
// Number of ticks over which the period is averaged, and number of first ticks that are not judged.
constexpr double kMeanTicks = 100, kSettleTicks = 25;

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

Vec3 clamped(const Vec3& v, double limit) {
    const double length = v.norm();
    return length > limit ? Vec3(v * (limit / length)) : v;
}

std::string errorText(hd::Error code) {
    char number[16];
    std::snprintf(number, sizeof number, " (0x%04x)", code);
    return hd::words(code) + std::string(number);
}

}  // namespace

PhantomOptions phantomOptions(const std::string& text) {
    PhantomOptions options;
    std::size_t at = text.find(',');
    options.name = text.substr(0, at);
    while (at != std::string::npos) {
        const std::size_t begin = at + 1;
        at = text.find(',', begin);
        const std::string part = text.substr(begin, at == std::string::npos ? at : at - begin);
        const std::size_t equals = part.find('=');
        const std::string key = part.substr(0, equals),
                          value = equals == std::string::npos ? "" : part.substr(equals + 1);
        const auto number = [&](double& to, double low, double high) {
            const auto read = readNumber(value, low, high);
            to = read.value_or(to);
            return read.has_value();
        };
        const bool good = key == "library"  ? !(options.library = value).empty()
                          : key == "drive"  ? (options.deviceDrives = value == "device") || value == "loop"
                          : key == "gimbal" ? (options.gimbalTorque = value.empty())
                          : key == "stale"  ? number(options.staleMs, 1, 1000)
                          : key == "torque" ? number(options.peakTorque, 1, 1e4)
                          : key == "rate"   ? number(options.rate, 250, 10'000)
                                            : false;
        if (!good)
            throw std::runtime_error("phantom: '" + part +
                                     "' is not an option: write phantom[:NAME][,library=FILE][,drive=loop or device]"
                                     "[,rate=250 to 10000][,stale=1 to 1000 ms][,torque=1 to 10000 mN·m][,gimbal]");
    }
    return options;
}

std::shared_ptr<PhantomLink> PhantomLink::connect(const std::string& text) {
    static std::mutex mutex;
    static std::map<std::string, std::weak_ptr<PhantomLink>> links;
    const std::lock_guard lock(mutex);
    std::weak_ptr<PhantomLink>& known = links[text];
    if (const std::shared_ptr<PhantomLink> link = known.lock()) {
        if (!link->lost_.load()) return link;
        throw std::runtime_error("The device is lost: " + link->status().text + "; reconnect it");
    }
    const auto link = std::make_shared<PhantomLink>(phantomOptions(text));
    known = link;
    return link;
}

DeviceCheck PhantomLink::examine() {
    try {
        return {true, PhantomLink(PhantomOptions{}).status().text};
    } catch (const std::exception& e) {
        return {false, e.what()};
    }
}

PhantomLink::PhantomLink(PhantomOptions options)
    : options_(std::move(options)), staleNs_(static_cast<std::uint64_t>(options_.staleMs * kNsPerMs)) {
    hd_ = hd::load(options_.library);
    open();
}

PhantomLink::~PhantomLink() {
    if (reconnecting_.joinable()) reconnecting_.join();
    close();
}

// -- Opening and closing -------------------------------------------------------------------------------------------

void PhantomLink::open() {
    try {
        initialize();
        calibrate();
        readLimits();
        startTicks();
    } catch (...) {
        close();
        throw;
    }
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

void PhantomLink::initialize() {
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
            const std::lock_guard lock(mutex_);
            details_ = "Library " + hd_.name + "\nDevice " + called + (tried.empty() ? "" : ", after " + tried);
            return;
        }
        if (device_ != hd::kInvalidHandle) hd_.disableDevice(device_);
        device_ = hd::kInvalidHandle;
        tried += (tried.empty() ? "" : ", ") + called + ": " + (errors.empty() ? "no reason given" : errors);
    }
    throw std::runtime_error("OpenHaptics (" + hd_.name + ") opens no device; tried " + tried +
                             ". Connect and power the device, and run the vendor's setup and diagnostic programs");
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

void PhantomLink::readLimits() {
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
    const std::lock_guard lock(mutex_);
    char numbers[160];
    std::snprintf(numbers, sizeof numbers,
                  "Peak force %g N, continuous force %g N, peak torque %g mN·m, maximum stiffness %g N/mm",
                  limits_.peakForce, limits_.continuousForce, limits_.peakTorque, limits_.nominalStiffness);
    details_ += "\nModel " + model + ", serial number " + serial + ", driver " + driver + "\n" + numbers;
    text_ = model + " runs";
}

void PhantomLink::startTicks() {
    armed_ = false;
    openedNs_ = steadyNanoseconds();  // set before lost_, so that samples of an earlier connection are rejected
    lost_ = slow_ = false;
    ticks_ = 0;
    period_ = 0;
    lastError_ = hd::kSuccess;
    faultEndNs_ = errorCount_ = lastCall_ = 0;
    hd_.enable(hd::kForceOutput);
    callback_ = hd_.scheduleAsynchronous([](void* self) { return static_cast<PhantomLink*>(self)->tick(); }, this,
                                         hd::kDefaultPriority);
    scheduled_ = true;
    if (options_.rate > 0) hd_.setSchedulerRate(static_cast<hd::ULong>(options_.rate));
    if (const std::string errors = takeErrors(); !errors.empty())
        throw std::runtime_error("The vendor's scheduler does not start: " + errors);
    hd_.startScheduler();
    started_ = true;
    for (int i = 0; i < 2000 && lastCall_.load() == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (lastCall_.load() == 0)
        throw std::runtime_error("The vendor's scheduler never called back in two seconds: restart its driver");
}

void PhantomLink::close() noexcept {
    armed_ = false;
    if (started_) {
        // Let the scheduler run two frames with zero force before it stops. Wait at most 50 ms, in case it hangs.
        const std::uint64_t seen = lastCall_.load();
        for (int i = 0; i < 50 && lastCall_.load() - seen < 2 * kNsPerMs; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        hd_.stopScheduler();
    }
    if (scheduled_) hd_.unschedule(callback_);
    if (device_ != hd::kInvalidHandle) {
        hd_.disable(hd::kForceOutput);
        hd_.disableDevice(device_);
    }
    started_ = scheduled_ = false;
    device_ = hd::kInvalidHandle;
    lost_ = true;
}

void PhantomLink::reconnect() {
    {
        const std::lock_guard lock(mutex_);
        if (connecting_) return;
        connecting_ = true;
    }
    reconnecting_ = std::jthread([this] {
        close();
        try {
            open();
        } catch (const std::exception& e) {
            lastError_ = hd::kSuccess;  // the new error is in text_
            const std::lock_guard lock(mutex_);
            text_ = e.what();
        }
        const std::lock_guard lock(mutex_);
        connecting_ = false;
    });
}

DeviceStatus PhantomLink::status() const {
    DeviceStatus status;
    {
        const std::lock_guard lock(mutex_);
        status.text = text_;
        status.details = details_;
        if (connecting_) status.state = DeviceStatus::State::Connecting;
    }
    if (status.state == DeviceStatus::State::Connecting) return status;
    const bool lost = lost_.load(),
               fault = lost || faulty() || (!armed_.load() && errorCount_.load() + slow_.load() > 0);
    status.state = lost ? DeviceStatus::State::Lost : fault ? DeviceStatus::State::Fault : DeviceStatus::State::Running;
    const hd::Error error = lastError_.load();
    if (error != hd::kSuccess) {
        if (fault) status.text = errorText(error);
        status.details +=
            "\nErrors so far: " + std::to_string(errorCount_.load()) + "; the last one: " + errorText(error);
    } else if (fault && !lost) {
        status.text = "The vendor's scheduler is too slow for a stiff wall: close other programs";
    }
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
    if (!lost) {
        status.rate = rate_.load();
        status.temperature = temperature_.load();
    }
    return status;
}

// -- The vendor's thread -------------------------------------------------------------------------------------------

void PhantomLink::trip(hd::Error error) noexcept {
    armed_.store(false, std::memory_order_relaxed);
    faultEndNs_.store(steadyNanoseconds() + kFaultHoldNs, std::memory_order_relaxed);
    if (error == hd::kSuccess) return;
    lastError_.store(error, std::memory_order_relaxed);
    errorCount_.fetch_add(1, std::memory_order_relaxed);
    if (hd::losesDevice(error)) lost_.store(true, std::memory_order_relaxed);
}

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
            trip(code);
    }
    return seen;
}

std::uint32_t PhantomLink::tick() noexcept {
    const std::uint64_t now = steadyNanoseconds();
    const std::uint64_t before = lastCall_.exchange(now, std::memory_order_relaxed);
    if (before > 0) {
        const double period = std::min(static_cast<double>(now - before), kLongestNs);
        const auto ticks = static_cast<double>(ticks_);
        period_ += (period - period_) / std::min(kMeanTicks, ticks);
        rate_.store(1e9 / period_, std::memory_order_relaxed);
        if (ticks > kSettleTicks && period_ > kSlowestNs) {
            slow_.store(true, std::memory_order_relaxed);
            trip(hd::kSuccess);
        }
    }
    ++ticks_;
    hd_.beginFrame(device_);
    readSample(now);
    int turn = kOffered;
    if (turn_.compare_exchange_strong(turn, kRunning, std::memory_order_acq_rel))
        turn_.store((*drivenTick_)() ? kOffered : kDone, std::memory_order_release);
    writeWrench(steadyNanoseconds());
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
    sample_ = {{{m[12], m[13], m[14]}, Quat(R).normalized()}, static_cast<std::uint32_t>(buttons), now};
    samples_.write(sample_);
    if (torqueName_.load(std::memory_order_relaxed) == hd::kGimbalTorque) {
        hd_.getDoublev(hd::kGimbalAngles, gimbal_.data());
        checkErrors();
    }
    if (ticks_ % 128 != 1) return;
    std::array<double, 6> motors{};
    hd_.getDoublev(hd::kMotorTemperature, motors.data());
    if (!checkErrors(hd::kInvalidEnum)) temperature_.store(*std::max_element(motors.begin(), motors.end()));
}

void PhantomLink::writeWrench(std::uint64_t now) noexcept {
    commands_.update();
    Wrench wrench;
    const Command& newest = commands_.get();
    if (armed_.load(std::memory_order_relaxed) && now - newest.time < staleNs_ && newest.wrench.isFinite()) {
        wrench.force = clamped(newest.wrench.force, limits_.peakForce);
        wrench.torque = clamped(newest.wrench.torque, limits_.peakTorque);
    }
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
    const Quat& q = sample_.X_DS.q;
    return {torque.dot(q * (roll * (pitch * Vec3::UnitY()))), torque.dot(q * (roll * Vec3::UnitX())),
            torque.dot(q * Vec3::UnitZ())};
}

// -- The haptic thread ---------------------------------------------------------------------------------------------

bool PhantomLink::newest(Sample& sample) noexcept {
    samples_.update();
    sample = samples_.get();
    return !lost_.load(std::memory_order_acquire) && sample.time > openedNs_.load(std::memory_order_relaxed) &&
           steadyNanoseconds() - sample.time < staleNs_ && sample.X_DS.isValid();
}

bool PhantomLink::faulty() const noexcept {
    return lost_.load(std::memory_order_relaxed) || steadyNanoseconds() < faultEndNs_.load(std::memory_order_relaxed);
}

void PhantomLink::command(const Wrench& wrench) noexcept { commands_.write({wrench, steadyNanoseconds()}); }

void PhantomLink::arm() noexcept {
    if (!faulty()) armed_.store(true, std::memory_order_relaxed);
}

bool PhantomLink::drive(double rate, const std::function<bool()>& tick) noexcept {
    const auto stalled = [&] {
        return lost_.load(std::memory_order_relaxed) ||
               steadyNanoseconds() - lastCall_.load(std::memory_order_relaxed) > staleNs_;
    };
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
