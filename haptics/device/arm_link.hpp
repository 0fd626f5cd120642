#pragma once
// The connection to a haptic arm that has its own thread: what this thread and the haptic thread exchange, and the
// rules that hold for every arm.
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "haptics/device/control.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {

/// The arm's thread calls noteExchange() and publish() about 1000 times a second, and sends permitted(). That wrench is
/// zero until the arm is armed, while a fault lasts, and if the newest command is stale or not finite; it never exceeds
/// the limits. A fault disarms the arm, and only the user arms it again (Device::engage).
class ArmLink : public DeviceControl {
  public:
    struct Sample {
        Pose X_DS;  ///< pose of the hand-held part in device axes: x right, y up, z toward the user
        std::uint32_t buttons = 0;
        std::uint64_t time = 0;  ///< ns, steady clock
    };
    // For the haptic thread; real time.
    /// Gets the newest sample. Returns false if it is stale or invalid (Pose::isValid), or if the arm is lost.
    bool newest(Sample& sample) noexcept;
    bool faulty() const noexcept;  ///< there is a fault, or there was one within the last 0.1 s
    void command(const Wrench& wrench) noexcept;
    void arm() noexcept;
    /// From the next exchange on the force is zero. Async-signal-safe.
    virtual void disarm() noexcept { armed_.store(false, std::memory_order_relaxed); }
    virtual bool drive(double /*rate*/, const std::function<bool()>& /*tick*/) noexcept { return false; }

    // For the window's thread.
    const DeviceLimits& limits() const { return limits_; }
    DeviceStatus status() const override;
    void reconnect() override;
    bool lost() const noexcept { return lost_.load(std::memory_order_acquire); }

  protected:
    /// The code of the fault that fewer than 250 exchanges a second are.
    static constexpr std::uint32_t kTooSlow = 0xFFFFFFFF;

    explicit ArmLink(double staleMs);
    ~ArmLink() override;

    /// Opens the arm and starts its thread. Throws std::runtime_error with one sentence; close() follows.
    virtual void open() = 0;
    /// Sends zero force and ends the thread. Also called for an arm that is not open.
    virtual void close() noexcept = 0;
    /// Describes the code of a fault in one sentence.
    virtual std::string faultText(std::uint32_t code) const = 0;

    // For the constructors and destructors of derived classes, and open().
    void openOrClose();      ///< open(); if that throws, close() and throw again
    void endReconnecting();  ///< waits for reconnect()
    void begin() noexcept;   ///< before the first exchange of a connection: forgets faults and earlier samples
    void markLost() noexcept { lost_.store(true); }
    /// Waits until the arm's thread has made an exchange; false after `ms`.
    bool waitForExchange(int ms) const;
    /// Disarms, and waits at most 50 ms until two ms of exchanges with zero force have passed.
    void settle() noexcept;
    void describe(const std::string& text, const std::string& details);  ///< of a running arm
    std::string details() const;

    // For the arm's thread; real time.
    void noteExchange(std::uint64_t now) noexcept;
    void publish(const Pose& X_DS, std::uint32_t buttons, std::uint64_t now) noexcept;
    Wrench permitted() noexcept;  ///< the wrench to send now
    /// A fault; kTooSlow is one. `loses`: the arm itself is lost, so that it must be reconnected.
    void trip(std::uint32_t code, bool loses) noexcept;
    bool armed() const noexcept { return armed_.load(std::memory_order_relaxed); }
    std::uint64_t exchanges() const noexcept { return exchanges_; }
    std::uint64_t lastExchange() const noexcept { return lastExchange_.load(std::memory_order_relaxed); }
    std::uint64_t staleNs() const noexcept { return staleNs_; }

    DeviceLimits limits_;  // written by open()

  private:
    struct Command {
        Wrench wrench;
        std::uint64_t time = 0;
    };
    static constexpr std::uint32_t kNoFault = 0;

    const std::uint64_t staleNs_;
    mutable std::mutex mutex_;  // guards the next three, which the window and the reconnecting thread share
    std::string text_, details_;
    bool connecting_ = false;

    TripleBuffer<Sample> samples_;
    TripleBuffer<Command> commands_;
    std::uint64_t exchanges_ = 0;  // used only by the arm's thread, like the mean period in ns
    double period_ = 0;

    std::atomic<bool> armed_ = false, lost_ = true;
    std::atomic<std::uint32_t> lastFault_ = kNoFault;
    std::atomic<std::uint64_t> faultCount_ = 0, faultEndNs_ = 0, lastExchange_ = 0, openedNs_ = 0;
    std::atomic<double> rate_ = 0;
    std::jthread reconnecting_;
};

/// The link for this option text, made by `make` if there is none. It is shared, because an arm can be opened only
/// once. Throws std::runtime_error if it is lost or cannot be opened.
template <class Link>
std::shared_ptr<Link> sharedLink(const std::string& text, const std::function<std::shared_ptr<Link>()>& make) {
    static std::mutex mutex;
    static std::map<std::string, std::weak_ptr<Link>> links;
    const std::lock_guard lock(mutex);
    std::weak_ptr<Link>& known = links[text];
    if (const std::shared_ptr<Link> link = known.lock()) {
        if (!link->lost()) return link;
        throw std::runtime_error("The device is lost: " + link->status().text + "; reconnect it");
    }
    const std::shared_ptr<Link> link = make();
    known = link;
    return link;
}

/// The device over a link. makeMapped() maps the hand's motion into the scene.
std::unique_ptr<Device> makeArm(std::shared_ptr<ArmLink> link, const Pose& X_WT_start);

/// Reads comma-separated options KEY=VALUE or KEY, and gives each to `take`. Throws std::runtime_error "DEVICE: 'PART'
/// is not an option: write USAGE" for the first that `take` refuses.
void readArmOptions(const std::string& device, const std::string& text, const std::string& usage,
                    const std::function<bool(const std::string& key, const std::string& value)>& take);
/// Reads a number from `low` to `high` into `to`; returns false, and keeps `to`, for any other text.
bool takeNumber(const std::string& text, double low, double high, double& to);

}  // namespace touchstone
