#include "haptics/device/arm_link.hpp"

#include <algorithm>
#include <chrono>

#include "haptics/math/numbers.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone {
namespace {

constexpr std::uint64_t kNsPerMs = 1'000'000;
// Time for which a fault is held, so that an error in every exchange counts as one fault.
constexpr std::uint64_t kFaultHoldNs = 100 * kNsPerMs;
// Longest mean period: an arm below 250 Hz cannot hold a stiff wall.
constexpr double kSlowestNs = 4e6;
// A longer period enters the mean as this: one long gap makes samples stale, but does not make the arm slow.
constexpr double kLongestNs = 20e6;
// Number of exchanges over which the period is averaged, and number of first exchanges that are not judged.
constexpr double kMeanExchanges = 100, kSettleExchanges = 25;

Vec3 clamped(const Vec3& v, double limit) {
    const double length = v.norm();
    return length > limit ? Vec3(v * (limit / length)) : v;
}

/// The device in its own axes, with wrenches about the origin of the hand-held part.
class ArmDevice final : public Device {
  public:
    explicit ArmDevice(std::shared_ptr<ArmLink> link) : link_(std::move(link)) {}
    DeviceReading read(double, double) noexcept override {
        ArmLink::Sample sample;
        const bool valid = link_->newest(sample);
        return {.X_WT_device = sample.X_DS, .valid = valid, .fault = link_->faulty(), .buttons = sample.buttons};
    }
    void write(const Wrench& wrench) noexcept override { link_->command(wrench); }
    void releaseForces() noexcept override { link_->disarm(); }
    void engage(const Pose&) noexcept override { link_->arm(); }
    DeviceLimits limits() const noexcept override { return link_->limits(); }
    bool drive(double rate, const std::function<bool()>& tick) noexcept override { return link_->drive(rate, tick); }
    std::shared_ptr<DeviceControl> control() const override { return link_; }

  private:
    const std::shared_ptr<ArmLink> link_;
};

}  // namespace

ArmLink::ArmLink(double staleMs) : staleNs_(static_cast<std::uint64_t>(staleMs * kNsPerMs)) {}
ArmLink::~ArmLink() = default;

// -- Opening and closing -------------------------------------------------------------------------------------------

void ArmLink::openOrClose() {
    try {
        open();
    } catch (...) {
        close();
        throw;
    }
}

void ArmLink::endReconnecting() {
    if (reconnecting_.joinable()) reconnecting_.join();
}

void ArmLink::begin() noexcept {
    armed_ = false;
    openedNs_ = steadyNanoseconds();  // set before lost_, so that samples of an earlier connection are rejected
    lost_ = false;
    exchanges_ = 0;
    period_ = 0;
    lastFault_ = kNoFault;
    faultEndNs_ = faultCount_ = lastExchange_ = 0;
}

bool ArmLink::waitForExchange(int ms) const {
    for (int i = 0; i < ms && lastExchange() == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return lastExchange() != 0;
}

void ArmLink::settle() noexcept {
    armed_ = false;
    const std::uint64_t seen = lastExchange();
    for (int i = 0; i < 50 && lastExchange() - seen < 2 * kNsPerMs; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

void ArmLink::reconnect() {
    {
        const std::lock_guard lock(mutex_);
        if (connecting_) return;
        connecting_ = true;
    }
    reconnecting_ = std::jthread([this] {
        close();
        try {
            openOrClose();
        } catch (const std::exception& e) {
            lastFault_ = kNoFault;  // the new error is in text_
            const std::lock_guard lock(mutex_);
            text_ = e.what();
        }
        const std::lock_guard lock(mutex_);
        connecting_ = false;
    });
}

// -- The window's thread -------------------------------------------------------------------------------------------

void ArmLink::describe(const std::string& text, const std::string& details) {
    const std::lock_guard lock(mutex_);
    text_ = text;
    details_ = details;
}

std::string ArmLink::details() const {
    const std::lock_guard lock(mutex_);
    return details_;
}

DeviceStatus ArmLink::status() const {
    DeviceStatus status;
    {
        const std::lock_guard lock(mutex_);
        status.text = text_;
        status.details = details_;
        if (connecting_) status.state = DeviceStatus::State::Connecting;
    }
    if (status.state == DeviceStatus::State::Connecting) return status;
    const bool lost = lost_.load(), fault = lost || faulty() || (!armed_.load() && faultCount_.load() > 0);
    status.state = lost ? DeviceStatus::State::Lost : fault ? DeviceStatus::State::Fault : DeviceStatus::State::Running;
    if (const std::uint32_t code = lastFault_.load(); code != kNoFault) {
        const std::string text = faultText(code);
        if (fault) status.text = text;
        status.details += "\nErrors so far: " + std::to_string(faultCount_.load()) + "; the last one: " + text;
    }
    if (!lost) status.rate = rate_.load();
    return status;
}

// -- The arm's thread ----------------------------------------------------------------------------------------------

void ArmLink::trip(std::uint32_t code, bool loses) noexcept {
    armed_.store(false, std::memory_order_relaxed);
    faultEndNs_.store(steadyNanoseconds() + kFaultHoldNs, std::memory_order_relaxed);
    lastFault_.store(code, std::memory_order_relaxed);
    faultCount_.fetch_add(1, std::memory_order_relaxed);
    if (loses) lost_.store(true, std::memory_order_relaxed);
}

void ArmLink::noteExchange(std::uint64_t now) noexcept {
    const std::uint64_t before = lastExchange_.exchange(now, std::memory_order_relaxed);
    if (before > 0) {
        const double period = std::min(static_cast<double>(now - before), kLongestNs);
        const auto count = static_cast<double>(exchanges_);
        period_ += (period - period_) / std::min(kMeanExchanges, count);
        rate_.store(1e9 / period_, std::memory_order_relaxed);
        if (count > kSettleExchanges && period_ > kSlowestNs) trip(kTooSlow, false);
    }
    ++exchanges_;
}

void ArmLink::publish(const Pose& X_DS, std::uint32_t buttons, std::uint64_t now) noexcept {
    samples_.write({X_DS, buttons, now});
}

Wrench ArmLink::permitted() noexcept {
    commands_.update();
    const Command& newest = commands_.get();
    if (!armed_.load(std::memory_order_relaxed) || !newest.wrench.isFinite()) return {};
    if (steadyNanoseconds() - newest.time >= staleNs_) return {};
    return {clamped(newest.wrench.force, limits_.peakForce), clamped(newest.wrench.torque, limits_.peakTorque)};
}

// -- The haptic thread ---------------------------------------------------------------------------------------------

bool ArmLink::newest(Sample& sample) noexcept {
    samples_.update();
    sample = samples_.get();
    return !lost_.load(std::memory_order_acquire) && sample.time > openedNs_.load(std::memory_order_relaxed) &&
           steadyNanoseconds() - sample.time < staleNs_ && sample.X_DS.isValid();
}

bool ArmLink::faulty() const noexcept {
    return lost_.load(std::memory_order_relaxed) || steadyNanoseconds() < faultEndNs_.load(std::memory_order_relaxed);
}

void ArmLink::command(const Wrench& wrench) noexcept { commands_.write({wrench, steadyNanoseconds()}); }

void ArmLink::arm() noexcept {
    if (!faulty()) armed_.store(true, std::memory_order_relaxed);
}

// -- Devices and options -------------------------------------------------------------------------------------------

std::unique_ptr<Device> makeArm(std::shared_ptr<ArmLink> link, const Pose& X_WT_start) {
    return makeMapped(std::make_unique<ArmDevice>(std::move(link)), X_WT_start);
}

void readArmOptions(const std::string& device, const std::string& text, const std::string& usage,
                    const std::function<bool(const std::string&, const std::string&)>& take) {
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const std::string part = text.substr(begin, end - begin);
        const std::size_t equals = part.find('=');
        if (!take(part.substr(0, equals), equals == std::string::npos ? "" : part.substr(equals + 1)))
            throw std::runtime_error(device + ": '" + part + "' is not an option: write " + usage);
        begin = end + 1;
    }
}

bool takeNumber(const std::string& text, double low, double high, double& to) {
    const auto read = readNumber(text, low, high);
    to = read.value_or(to);
    return read.has_value();
}

}  // namespace touchstone
