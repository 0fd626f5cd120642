#pragma once
// The connection to a haptic arm through libHD: it opens, monitors, closes and reopens the device.
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

/// The options of --device phantom[:NAME[,OPTION]...].
struct PhantomOptions {
    std::string name;           ///< device name in the vendor's configuration; empty: the default device
    std::string library;        ///< library=FILE
    bool deviceDrives = false;  ///< drive=device: the vendor's scheduler runs the tick, not our loop
    bool gimbalTorque = false;  ///< gimbal: torque on the gimbal's axes if CURRENT_TORQUE is rejected; never tried
    double staleMs = 20;        ///< stale=MS: older poses and wrenches are not used
    double peakTorque = 0;      ///< torque=MNM: peak torque of this device, mN·m on each axis; 0: the default
    double rate = 0;            ///< rate=HZ: requested from the vendor's scheduler; 0: the rate is not changed
};
/// Parses the options. Throws std::runtime_error with one sentence.
PhantomOptions phantomOptions(const std::string& text);

/// The vendor's scheduler calls back about 1000 times a second. Each call is one frame: it publishes the pose for
/// newest(), takes the library's errors and sends the newest wrench. The force is zero until the device is armed, while
/// a fault lasts, and if the wrench is stale or not finite. It never exceeds the limits. A fault disarms the device.
class PhantomLink : public DeviceControl {
  public:
    /// The connection for this option text. It is shared, because a device can be opened only once. Throws
    /// std::runtime_error with what was tried and what to do.
    static std::shared_ptr<PhantomLink> connect(const std::string& text);
    /// Reports what works on this machine, for `doctor`. Opens and closes the device without moving it.
    static DeviceCheck examine();

    explicit PhantomLink(PhantomOptions options);
    ~PhantomLink() override;  ///< sets zero force before it closes the device

    struct Sample {
        Pose X_DS;  ///< pose of the stylus in device axes: x right, y up, z toward the user
        std::uint32_t buttons = 0;
        std::uint64_t time = 0;  ///< ns, steady clock
    };
    // For the haptic thread; real time.
    /// Gets the newest sample. Returns false if it is stale or invalid (Pose::isValid), or if the device is lost.
    bool newest(Sample& sample) noexcept;
    bool faulty() const noexcept;  ///< there is a fault, or there was one within the last 0.1 s
    void command(const Wrench& wrench) noexcept;
    void arm() noexcept;
    void disarm() noexcept { armed_.store(false, std::memory_order_relaxed); }  ///< the next frame writes zero
    bool drive(double rate, const std::function<bool()>& tick) noexcept;

    // For the window's thread.
    const DeviceLimits& limits() const { return limits_; }
    DeviceStatus status() const override;
    void reconnect() override;

  private:
    struct Command {
        Wrench wrench;
        std::uint64_t time = 0;
    };
    /// Hand-over of the tick between drive() and the vendor's thread: no offer, offered, running there, finished.
    enum Turn { kIdle, kOffered, kRunning, kDone };

    void open();
    void initialize();
    void calibrate();
    void readLimits();
    void startTicks();
    void close() noexcept;
    std::string takeErrors();
    bool checkErrors(hd::Error tolerated = hd::kSuccess) noexcept;
    void trip(hd::Error error) noexcept;
    std::uint32_t tick() noexcept;
    void readSample(std::uint64_t now) noexcept;
    void writeWrench(std::uint64_t now) noexcept;
    Vec3 gimbalComponents(const Vec3& torque) const noexcept;

    const PhantomOptions options_;
    const std::uint64_t staleNs_;
    hd::Library hd_{};
    DeviceLimits limits_;

    mutable std::mutex mutex_;  // guards the next three, which the window and the reconnecting thread share
    std::string text_, details_;
    bool connecting_ = false;

    hd::Handle device_ = hd::kInvalidHandle;
    unsigned long callback_ = 0;
    bool scheduled_ = false, started_ = false;

    TripleBuffer<Sample> samples_;
    TripleBuffer<Command> commands_;
    Sample sample_;  // used only by the vendor's thread, like the next three
    Vec3 gimbal_ = Vec3::Zero();
    std::uint64_t ticks_ = 0;
    double period_ = 0;  // mean period, ns

    std::atomic<bool> armed_ = false, lost_ = true;
    std::atomic<hd::Error> lastError_ = hd::kSuccess;
    std::atomic<std::uint64_t> errorCount_ = 0, faultEndNs_ = 0, lastCall_ = 0, openedNs_ = 0;
    std::atomic<bool> slow_ = false;
    std::atomic<double> rate_ = 0, temperature_ = -1;
    std::atomic<hd::Enum> torqueName_ = hd::kTorque;  // parameter name for torque; 0: no torque

    const std::function<bool()>* drivenTick_ = nullptr;  // the tick to call; turn_ says who may use it
    std::atomic<int> turn_ = kIdle;

    std::jthread reconnecting_;  // last member, so that it is joined before the members that it uses are destroyed
};

}  // namespace touchstone
