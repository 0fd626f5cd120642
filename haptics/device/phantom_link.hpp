#pragma once
// The connection to a haptic arm through libHD: opened, watched, closed, opened again.
#include <array>
#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "haptics/device/control.hpp"
#include "haptics/device/hd_library.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {

/// What --device phantom[:NAME[,OPTION]...] says.
struct PhantomOptions {
    std::string name;           ///< of the vendor's configuration; empty: the default device
    std::string library;        ///< library=FILE
    bool deviceDrives = false;  ///< drive=device: the vendor's scheduler runs the tick, not our loop
    bool gimbalTorque = false;  ///< gimbal: torque on the gimbal's axes where CURRENT_TORQUE is refused; never tried
    double staleMs = 20;        ///< stale=MS: older poses and wrenches count for nothing
    double peakTorque = 0;      ///< torque=MNM: of this device, mN·m on each axis; 0: the default
    double rate = 0;            ///< rate=HZ: asked of the vendor's scheduler; 0: left as it is
};
/// Throws std::runtime_error with one sentence.
PhantomOptions phantomOptions(const std::string& text);

/// The vendor's scheduler calls it about 1000 times a second; each call is one frame: pose out to `newest()`, errors
/// drained and named, the newest wrench in. The force is zero while no one has armed it, while a fault lasts, when the
/// wrench is stale, and when it is not finite; and never above the limits. A fault disarms.
class PhantomLink : public DeviceControl {
  public:
    /// The connection for this text, shared by all who hold it: a device can be opened only once. Throws
    /// std::runtime_error with what was tried and what to do.
    static std::shared_ptr<PhantomLink> connect(const std::string& text);
    /// What works here, for `doctor`: opens the device if there is one, moves nothing, closes it.
    static DeviceCheck examine();

    explicit PhantomLink(PhantomOptions options);
    ~PhantomLink() override;  ///< zero force first

    struct Sample {
        Pose X_DS;  ///< of the stylus, device axes: x right, y up, z to the user
        std::uint32_t buttons = 0;
        std::uint64_t time = 0;  ///< ns, steady clock
    };
    // For the haptic thread; real time.
    /// The newest sample; false when it is stale, no pose (Pose::isValid) or the device is lost.
    bool newest(Sample& sample) noexcept;
    bool faulty() const noexcept;  ///< now, or within the last tenth of a second
    void command(const Wrench& wrench) noexcept;
    void arm() noexcept;
    void disarm() noexcept { armed_.store(false, std::memory_order_relaxed); }  ///< the next frame writes zero
    bool drive(double rate, const std::function<bool()>& tick) noexcept;

    // For the window's.
    const DeviceLimits& limits() const { return limits_; }
    DeviceStatus status() const override;
    void reconnect() override;

  private:
    struct Command {
        Wrench wrench;
        std::uint64_t time = 0;
    };
    enum Turn { kOurs, kOffered, kTicking, kDone };

    void open();
    void initialise();
    void calibrate();
    void readLimits();
    void startTicks();
    void close() noexcept;
    std::string drained();
    bool drain(hd::Error tolerated = hd::kSuccess) noexcept;
    void trip(hd::Error error) noexcept;
    std::uint32_t tick() noexcept;
    void readSample(std::uint64_t now) noexcept;
    void writeWrench(std::uint64_t now) noexcept;
    Vec3 onGimbalAxes(const Vec3& torque) const noexcept;

    const PhantomOptions options_;
    const std::uint64_t staleNs_;
    hd::Library hd_{};
    DeviceLimits limits_;

    mutable std::mutex mutex_;  // of what the window and the reconnecting thread share: the next three
    std::string text_, details_;
    bool connecting_ = false;

    hd::Handle device_ = hd::kInvalidHandle;
    unsigned long callback_ = 0;
    bool scheduled_ = false, started_ = false;

    TripleBuffer<Sample> samples_;
    TripleBuffer<Command> commands_;
    Sample sample_;  // the vendor's thread's
    Vec3 gimbal_ = Vec3::Zero();
    std::uint64_t ticks_ = 0;
    double period_ = 0;  // ns

    std::atomic<bool> armed_ = false, lost_ = true;
    std::atomic<hd::Error> error_ = hd::kSuccess;  // the last
    std::atomic<std::uint64_t> errors_ = 0, faultEnds_ = 0, called_ = 0, opened_ = 0;
    std::atomic<bool> slow_ = false;
    std::atomic<double> rate_ = 0, temperature_ = -1;
    std::atomic<hd::Enum> torqueName_ = hd::kTorque;  // 0: none

    const std::function<bool()>* driven_ = nullptr;  // handed over by turn_
    std::atomic<int> turn_ = kOurs;

    std::jthread reconnecting_;  // last: joined before what it uses goes
};

}  // namespace touchstone
