#include "haptics/device/forcedimension_link.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "haptics/threads/rt_thread.hpp"

namespace touchstone {
namespace {

constexpr std::uint64_t kNsPerMs = 1'000'000;
constexpr std::uint64_t kStatusEvery = 8;                 // exchanges between two queries of the status
constexpr std::uint64_t kRobotEvery = 16 * kStatusEvery;  // the same of DRD, while all is well
constexpr std::uint64_t kSettleNs = 100 * kNsPerMs;       // after switching on, until the status must say so
constexpr std::uint64_t kStalledNs = 100 * kNsPerMs;      // longest exchange that is not a fault
constexpr double kNotRotation = 1e-3;                     // deviation of a frame from a rotation that makes it invalid
constexpr double kStiffness = 4, kTorsion = 1000;         // N/mm, mN·m/rad: the lowest published for these devices

/// The library's x points to the user, y right and z up; ours are right, up and to the user. A cyclic permutation is a
/// proper rotation.
Mat3 axes() {
    Mat3 R;
    R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
    return R;
}

}  // namespace

ForceDimensionOptions forceDimensionOptions(const std::string& text) {
    ForceDimensionOptions options;
    readArmOptions("forcedimension", text,
                   "forcedimension[:init=auto or hand][,library=FILE][,serial=N][,rate=250 to 8000][,stale=1 to 1000 "
                   "ms][,force=0.1 to 100 N][,torque=1 to 10000 mN·m]",
                   [&](const std::string& key, const std::string& value) {
                       return key == "library"  ? !(options.library = value).empty()
                              : key == "init"   ? (options.autoInit = value == "auto") || value == "hand"
                              : key == "serial" ? takeNumber(value, 1, 65535, options.serial)
                              : key == "rate"   ? takeNumber(value, 250, 8000, options.rate)
                              : key == "stale"  ? takeNumber(value, 1, 1000, options.staleMs)
                              : key == "force"  ? takeNumber(value, 0.1, 100, options.peakForce)
                              : key == "torque" ? takeNumber(value, 1, 1e4, options.peakTorque)
                                                : false;
                   });
    return options;
}

std::shared_ptr<ForceDimensionLink> ForceDimensionLink::connect(const std::string& text) {
    return sharedLink<ForceDimensionLink>(
        text, [&] { return std::make_shared<ForceDimensionLink>(forceDimensionOptions(text)); });
}

DeviceCheck ForceDimensionLink::examine() {
    try {
        const ForceDimensionLink link(ForceDimensionOptions{});
        return {link.ready(), link.ready() ? link.status().text : link.howToInitialize()};
    } catch (const std::exception& e) {
        return {false, e.what()};
    }
}

ForceDimensionLink::ForceDimensionLink(ForceDimensionOptions options)
    : ArmLink(options.staleMs), options_(std::move(options)) {
    dhd_ = dhd::load(options_.library);
    openOrClose();
}

ForceDimensionLink::~ForceDimensionLink() {
    endReconnecting();
    if (initializer_.joinable()) initializer_.join();
    close();
}

// -- Opening, initializing and closing -----------------------------------------------------------------------------

/// The last error of the calling thread in our words and the library's.
std::string ForceDimensionLink::errorText() {
    const int code = dhd_.errorGetLast();
    const char* text = dhd_.errorGetStr(code);
    return std::string(dhd::words(static_cast<std::uint32_t>(code))) + " (error " + std::to_string(code) +
           (text && *text ? ", '" + std::string(text) + "')" : ")");
}

void ForceDimensionLink::open() {
    if (options_.serial > 0 && !dhd_.openSerial)
        throw std::runtime_error("DHD (" + dhd_.name +
                                 ") cannot open a device by its serial number: leave out serial=");
    const int id = options_.serial > 0 ? dhd_.openSerial(static_cast<int>(options_.serial)) : dhd_.open();
    if (id < 0)
        throw std::runtime_error("DHD (" + dhd_.name + ") opens no device: " + errorText() +
                                 "; connect and power the device, and close other programs that use it");
    id_ = static_cast<dhd::Id>(id);
    open_ = true;
    const int type = dhd_.getSystemType(id_);
    const char* name = dhd_.getSystemName ? dhd_.getSystemName(id_) : nullptr;
    const std::string model = name && *name ? name : "device of type " + std::to_string(type);
    robot_ = dhd_.robotAutoInit && dhd_.robotOpen(id_) >= 0 && dhd_.robotIsSupported(id_);

    limits_ = {.peakForce = options_.peakForce,
               .peakTorque = options_.peakTorque,
               .torque = dhd_.hasActiveWrist && dhd_.hasActiveWrist(id_),
               .nominalStiffness = kStiffness,
               .nominalTorsion = kTorsion};
    // A limit that the user has set in the library also holds; a negative one means none.
    if (const double most = dhd_.getMaxForce ? dhd_.getMaxForce(id_) : -1; most > 0)
        limits_.peakForce = std::min(limits_.peakForce, most);
    if (const double most = dhd_.getMaxTorque ? dhd_.getMaxTorque(id_) : -1; most > 0)
        limits_.peakTorque = std::min(limits_.peakTorque, 1000 * most);
    limits_.continuousForce = limits_.peakForce;  // the maker rates these devices for continuous forces
    limits_.continuousTorque = limits_.peakTorque / 2;

    char numbers[120];
    std::snprintf(numbers, sizeof numbers, limits_.torque ? "Peak force %g N, peak torque %g mN·m" : "Peak force %g N",
                  limits_.peakForce, limits_.peakTorque);
    describe(model + " runs", "Library " + dhd_.name + "\nModel " + model + ", type " + std::to_string(type) + "\n" +
                                  numbers +
                                  (limits_.torque ? "" : "\nForce only: the rotations of this device have no motors") +
                                  (dhd_.robotless.empty() ? "" : "\nIt cannot initialize itself: " + dhd_.robotless));
    saturated_ = invalid_ = 0;
    startThread();
    if (options_.autoInit && !ready()) initializeItself();
}

bool ForceDimensionLink::isInitialized(const dhd::Status& status) const {
    return robot_ ? dhd_.robotIsInitialized(id_) : status[dhd::kReset] == 0;
}

void ForceDimensionLink::startThread() {
    motors_ = false;
    dhd_.enableForce(dhd::kOff, id_);
    dhd::Status status{};
    ready_ = dhd_.getStatus(status.data(), id_) >= 0 && isInitialized(status);
    begin();
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    if (!waitForExchange(2000))
        throw std::runtime_error("DHD does not exchange anything: switch the device off and on");
}

void ForceDimensionLink::stopThread() noexcept {
    settle();
    thread_ = {};  // asks it to stop, which switches the motors off, and waits for its end
}

/// Lets DRD initialize the device, which moves the arm. Nothing is exchanged meanwhile.
void ForceDimensionLink::initializeItself() {
    if (!robot_) throw std::runtime_error(howToInitialize());
    stopThread();
    const bool moved = dhd_.robotAutoInit(id_) >= 0;
    const std::string error = moved ? "" : errorText();
    startThread();
    if (!moved)
        throw std::runtime_error("The device did not initialize itself: " + error +
                                 "; switch it off and on, clear the arm's way, and try again");
    if (!ready())
        throw std::runtime_error("The device moved, but is still not initialized: switch it off and on, and try again");
}

std::string ForceDimensionLink::howToInitialize() const {
    const std::string byHand = "put its calibration pole into the pit by hand until the status light stops blinking";
    if (robot_)
        return "The device is not initialized: clear its way and let it move by itself (on the device page, or with "
               "forcedimension:init=auto), or " +
               byHand;
    return "The device is not initialized and cannot do it itself (" +
           (dhd_.robotless.empty() ? "DRD does not support it" : dhd_.robotless) + "): " + byHand;
}

void ForceDimensionLink::close() noexcept {
    if (thread_.joinable()) stopThread();
    if (open_) {
        if (robot_) dhd_.robotClose(id_);
        dhd_.close(id_);
    }
    open_ = robot_ = ready_ = false;
    markLost();
}

void ForceDimensionLink::reconnect() {
    {
        const std::lock_guard lock(mutex_);
        if (initializing_) return;
        trouble_.clear();
    }
    ArmLink::reconnect();
}

void ForceDimensionLink::selfInitialize() {
    if (status().consent.empty()) return;
    const std::lock_guard lock(mutex_);
    initializing_ = true;
    trouble_.clear();
    initializer_ = std::jthread([this] {
        std::string trouble;
        try {
            initializeItself();
        } catch (const std::exception& e) {
            trouble = e.what();
        }
        const std::lock_guard ending(mutex_);
        trouble_ = trouble;
        initializing_ = false;
    });
}

DeviceStatus ForceDimensionLink::status() const {
    using State = DeviceStatus::State;
    DeviceStatus status = ArmLink::status();
    if (status.state == State::Connecting) return status;
    std::string trouble;
    {
        const std::lock_guard lock(mutex_);
        trouble = trouble_;
        if (initializing_) {
            status.state = State::Connecting;
            status.text = "The arm initializes itself and moves: keep clear";
            return status;
        }
    }
    if (const std::uint64_t count = saturated_.load())
        status.details += "\nExchanges with saturated motors: " + std::to_string(count);
    if (const std::uint64_t count = invalid_.load()) status.details += "\nInvalid poses: " + std::to_string(count);

    const std::uint64_t last = lastExchange(), now = steadyNanoseconds();
    if (status.state == State::Lost) return status;
    if (now > last && now - last > kStalledNs) {
        status.state = State::Lost;
        status.text = "The library does not answer: only the device's own watchdog can switch the forces off";
    } else if (!ready()) {
        status.state = State::Fault;
        status.text = trouble.empty() ? howToInitialize() : trouble;
        if (robot_)
            status.consent =
                "To initialize itself, the arm moves on its own. Take your hand and everything else out of its way.";
    }
    return status;
}

// -- The exchanging thread -----------------------------------------------------------------------------------------

/// Whether a call succeeded; its error is a fault.
bool ForceDimensionLink::good(int result) noexcept {
    if (result >= 0) return true;
    const int last = dhd_.errorGetLast();
    const std::uint32_t code = last == 0 ? dhd::kGeneral : static_cast<std::uint32_t>(last);
    trip(code, dhd::losesDevice(code));
    return false;
}

void ForceDimensionLink::run(const std::stop_token& stop) noexcept {
    raiseThread({});
    Pacer pacer(options_.rate, false);
    while (!stop.stop_requested() && !lost()) {
        const std::uint64_t now = steadyNanoseconds(), before = lastExchange();
        noteExchange(now);
        if (before > 0 && now - before > kStalledNs) trip(dhd::kStalled, false);
        if (exchanges() % kStatusEvery == 1) checkStatus(now);
        readSample(now);
        writeWrench(now);
        pacer.wait();
    }
    if (!motors_) return;
    // Also after a loss, in case the device still listens.
    dhd_.setWrench(0, 0, 0, 0, 0, 0, 0, id_);
    dhd_.enableForce(dhd::kOff, id_);
    motors_ = false;
}

void ForceDimensionLink::checkStatus(std::uint64_t now) noexcept {
    dhd::Status status{};
    if (!good(dhd_.getStatus(status.data(), id_))) return;
    if (!status[dhd::kPower] || !status[dhd::kConnected]) return trip(dhd::kNoPower, true);
    if (status[dhd::kError]) trip(dhd::kControllerError, false);
    // DRD is asked less often while all is well, as what it does then is not documented.
    const bool initialized = robot_ && ready() && exchanges() % kRobotEvery != 1 ? true : isInitialized(status);
    // The arm must also be engaged again after it was initialized by hand.
    if (initialized != ready()) trip(dhd::kUncalibrated, false);
    ready_.store(initialized, std::memory_order_relaxed);
    if (motors_ && !status[dhd::kForce] && now - motorsSince_ > kSettleNs) {
        motors_ = false;
        const auto cause = static_cast<std::uint32_t>(std::clamp(status[dhd::kForceOffCause], 0, 99));
        trip(dhd::kForcesOff + cause, dhd::losesDevice(dhd::kForcesOff + cause));
    }
}

void ForceDimensionLink::readSample(std::uint64_t now) noexcept {
    double p[3]{}, frame[3][3]{};
    if (!good(dhd_.getPose(&p[0], &p[1], &p[2], frame, id_))) return;
    const std::uint32_t buttons = dhd_.getButtonMask ? dhd_.getButtonMask(id_) : 0;
    if (!ready()) return;  // the pose means nothing yet
    Mat3 R;
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) R(row, column) = frame[row][column];
    R = axes() * R * axes().transpose();
    Pose X_DS{1000 * (axes() * Vec3(p[0], p[1], p[2])), Quat(R).normalized()};
    const bool rotation =
        (R * R.transpose() - Mat3::Identity()).cwiseAbs().maxCoeff() < kNotRotation && R.determinant() > 0;
    if (!rotation) X_DS.q.coeffs().setZero();  // so that the pose is invalid
    if (!X_DS.isValid()) invalid_.fetch_add(1, std::memory_order_relaxed);
    publish(X_DS, buttons, now);
}

void ForceDimensionLink::writeWrench(std::uint64_t now) noexcept {
    const bool on = armed() && ready();
    if (on && !motors_) {
        if (!good(dhd_.enableForce(dhd::kOn, id_))) return;
        motors_ = true;
        motorsSince_ = now;
    }
    if (!motors_) return;
    Wrench wrench = on ? permitted() : Wrench{};
    if (!limits_.torque) wrench.torque.setZero();
    const Vec3 force = axes().transpose() * wrench.force, torque = 1e-3 * (axes().transpose() * wrench.torque);
    const int result = dhd_.setWrench(force.x(), force.y(), force.z(), torque.x(), torque.y(), torque.z(), 0, id_);
    if (result == dhd::kSaturated) saturated_.fetch_add(1, std::memory_order_relaxed);
    if (good(result) && on) return;
    dhd_.enableForce(dhd::kOff, id_);
    motors_ = false;
}

}  // namespace touchstone
