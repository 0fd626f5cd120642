#pragma once
// The connection to a haptic arm through libHD: it opens, monitors, closes and reopens the device.
#include <atomic>
#include <functional>
#include <string>

#include "haptics/device/arm_link.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/device/hd_library.hpp"

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

/// The vendor's scheduler calls back about 1000 times a second. Each call is one frame: it publishes the pose, takes
/// the library's errors and sends the newest wrench (ArmLink).
class PhantomLink final : public ArmLink {
  public:
    /// The connection for this option text. Throws std::runtime_error with what was tried and what to do.
    static std::shared_ptr<PhantomLink> connect(const std::string& text);
    /// Reports what works on this machine, for `doctor`. Opens and closes the device without moving it.
    static DeviceCheck examine();

    explicit PhantomLink(PhantomOptions options);
    ~PhantomLink() override;  ///< sets zero force before it closes the device

    bool drive(double rate, const std::function<bool()>& tick) noexcept override;
    DeviceStatus status() const override;

  private:
    /// Hand-over of the tick between drive() and the vendor's thread: no offer, offered, running there, finished.
    enum Turn { kIdle, kOffered, kRunning, kDone };

    void open() override;
    void close() noexcept override;
    std::string faultText(std::uint32_t code) const override;
    std::string initialize();
    void calibrate();
    void readLimits(const std::string& opened);
    void startTicks();
    std::string takeErrors();
    bool checkErrors(hd::Error tolerated = hd::kSuccess) noexcept;
    std::uint32_t tick() noexcept;
    void readSample(std::uint64_t now) noexcept;
    void writeWrench() noexcept;
    Vec3 gimbalComponents(const Vec3& torque) const noexcept;

    const PhantomOptions options_;
    hd::Library hd_{};
    hd::Handle device_ = hd::kInvalidHandle;
    unsigned long callback_ = 0;
    bool scheduled_ = false, started_ = false;

    Quat q_DS_ = Quat::Identity();  // of the stylus; used only by the vendor's thread, like the gimbal's angles
    Vec3 gimbal_ = Vec3::Zero();

    std::atomic<double> temperature_ = -1;
    std::atomic<hd::Enum> torqueName_ = hd::kTorque;  // parameter name for torque; 0: no torque

    const std::function<bool()>* drivenTick_ = nullptr;  // the tick to call; turn_ says who may use it
    std::atomic<int> turn_ = kIdle;
};

}  // namespace touchstone
