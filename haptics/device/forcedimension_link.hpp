#pragma once
// The connection to an arm of Force Dimension: it opens, initializes, monitors, closes and reopens the device.
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "haptics/device/arm_link.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/device/dhd_library.hpp"

namespace touchstone {

/// The options of --device forcedimension[:OPTION[,OPTION]...].
struct ForceDimensionOptions {
    std::string library;      ///< library=FILE of DHD
    double serial = 0;        ///< serial=N of the device; 0: the first that is found
    bool autoInit = false;    ///< init=auto: the arm may initialize itself, which moves it; else init=hand
    double rate = 1000;       ///< rate=HZ at which poses and wrenches are exchanged
    double staleMs = 20;      ///< stale=MS: older poses and wrenches are not used
    double peakForce = 12;    ///< force=N
    double peakTorque = 200;  ///< torque=MNM
};
/// Parses the options. Throws std::runtime_error with one sentence.
ForceDimensionOptions forceDimensionOptions(const std::string& text);

/// A thread exchanges poses and wrenches with the library, whose calls wait for the device (ArmLink). The motors are on
/// only while the arm is armed. The maker's thresholds of velocity and watchdog are not touched.
class ForceDimensionLink final : public ArmLink {
  public:
    /// The connection for this option text. Throws std::runtime_error with what was tried and what to do.
    static std::shared_ptr<ForceDimensionLink> connect(const std::string& text);
    /// Reports what works on this machine, for `doctor`. Opens and closes the device without moving it.
    static DeviceCheck examine();

    explicit ForceDimensionLink(ForceDimensionOptions options);
    ~ForceDimensionLink() override;  ///< switches the motors off before it closes the device

    DeviceStatus status() const override;
    void reconnect() override;
    void selfInitialize() override;
    bool ready() const noexcept { return ready_.load(std::memory_order_relaxed); }
    /// How the device can be initialized, in one sentence.
    std::string howToInitialize() const;

  private:
    void open() override;
    void close() noexcept override;
    std::string faultText(std::uint32_t code) const override { return dhd::words(code); }
    void startThread();
    void stopThread() noexcept;
    void initializeItself();
    bool isInitialized(const dhd::Status& status) const;
    std::string errorText();

    void run(const std::stop_token& stop) noexcept;
    void checkStatus(std::uint64_t now) noexcept;
    void readSample(std::uint64_t now) noexcept;
    void writeWrench(std::uint64_t now) noexcept;
    bool good(int result) noexcept;

    const ForceDimensionOptions options_;
    dhd::Library dhd_{};
    dhd::Id id_ = -1;
    bool open_ = false;
    bool robot_ = false;  // DRD also has the device

    bool motors_ = false;              // are on; used only by the exchanging thread, like the next one
    std::uint64_t motorsSince_ = 0;    // ns
    std::atomic<bool> ready_ = false;  // the device is initialized
    std::atomic<std::uint64_t> saturated_ = 0, invalid_ = 0;

    mutable std::mutex mutex_;  // guards the next two, which the window and the initializing thread share
    std::string trouble_;       // why the last initialization failed
    bool initializing_ = false;

    std::jthread thread_;       // exchanges
    std::jthread initializer_;  // last member, so that it is joined before the members that it uses are destroyed
};

}  // namespace touchstone
