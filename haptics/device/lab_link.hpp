#pragma once
// The connection to an arm that another program drives: one UDP port (lab_datagram.hpp).
#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "haptics/device/control.hpp"
#include "haptics/device/lab_datagram.hpp"

namespace touchstone {

/// The options of --device lab[:PORT[,OPTION]...].
struct LabOptions {
    std::uint16_t port = 5005;
    std::string listen = "127.0.0.1";  ///< listen=ADDRESS of this machine, IPv4
    std::string peer;                  ///< peer=ADDRESS: the only one that is listened to; empty: any
    double staleMs = 20;               ///< stale=MS: older poses are not used
    DeviceLimits limits{.peakForce = 8, .peakTorque = 100};  ///< force=N, torque=MNM, continuous_force=, ..._torque=
};
/// Parses the options. Throws std::runtime_error with one sentence.
LabOptions labOptions(const std::string& text);

/// Listens on one port. The first valid datagram makes its sender the arm, and from then on only newer datagrams of
/// the same sender and session are accepted. After a silence of kLostNs, or of staleMs if that is longer, any sender
/// and session may begin; the wrench is then zero until the user engages again. Everything else is rejected and counted
/// by reason.
class LabLink final : public DeviceControl {
  public:
    static constexpr std::uint64_t kLostNs = 100'000'000;  ///< after which the safety stage also faults
    static constexpr int kMostPerRead = 64;                ///< datagrams taken in a tick: a flood must not delay it

    static std::shared_ptr<LabLink> connect(const std::string& text);
    explicit LabLink(LabOptions options);  ///< throws std::runtime_error
    ~LabLink() override;                   ///< sends zero force

    // For the haptic thread; real time. Neither waits.
    DeviceReading read() noexcept;
    void write(const Wrench& wrench) noexcept;
    void arm() noexcept;
    /// Sends zero force at once. Async-signal-safe.
    void disarm() noexcept;

    // For the window's thread.
    const DeviceLimits& limits() const { return options_.limits; }
    DeviceStatus status() const override;
    bool lost() const { return false; }  ///< the port stays open, and the arm may return at any time
    /// Forgets the arm, so that the next valid datagram of any sender begins a session.
    void reconnect() override { forget_.store(true, std::memory_order_relaxed); }

  private:
    void take(std::span<const std::uint8_t> bytes, std::size_t size, std::uint64_t from, std::uint64_t now) noexcept;
    void reject(LabRejected why) noexcept;
    void fail() noexcept;
    bool fresh(std::uint64_t now) const noexcept;
    void send(const Wrench& wrench, LabState state) noexcept;

    const LabOptions options_;
    const std::uint64_t staleNs_, lostNs_;
    std::uint32_t onlyPeer_ = 0;  // IPv4 address, network order; 0: any
    int socket_ = -1;

    // Written by the haptic thread; atomic because the window and a signal handler read them.
    std::atomic<std::uint64_t> peer_ = 0;  // address and port, network order; 0: none yet
    std::atomic<std::uint32_t> session_ = 0;
    std::atomic<std::uint64_t> sequence_ = 0, time_ = 0, arrived_ = 0, accepted_ = 0, restarts_ = 0;
    std::array<std::atomic<std::uint64_t>, kLabRejections> rejected_{};
    std::atomic<int> lastRejected_ = -1;
    std::atomic<double> rate_ = 0;
    std::atomic<bool> armed_ = false, forget_ = false;
    std::atomic<bool> fault_ = false;   // the arm reports one now
    std::atomic<bool> failed_ = false;  // since it was engaged

    LabPose pose_;            // used only by the haptic thread, like the next two
    double period_ = 0;       // mean period, ns
    bool restarted_ = false;  // since the last reading
};

}  // namespace touchstone
