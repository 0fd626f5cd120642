#pragma once
// The connection to a Haply Inverse3 through Haply's Inverse Service.
#include <array>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "haptics/device/arm_link.hpp"
#include "haptics/device/device_table.hpp"
#include "haptics/sandbox/devices/inverse_messages.hpp"
#include "haptics/sandbox/devices/web_sockets.hpp"

namespace touchstone::sandbox {

/// The options of --device inverse3[:OPTION[,OPTION]...].
struct InverseOptions {
    int port = 10001;            ///< port=PORT of the service; the default is $TOUCHSTONE_INVERSE, if it is set
    int eventsPort = 10020;      ///< events=PORT of its events
    std::string device;          ///< device=ID of the Inverse3; empty: the first
    std::string grip;            ///< grip=ID of the VerseGrip; empty: the first that is awake
    std::string command;         ///< force=vector or values: how set_cursor_force is written; empty: by the inventory
    double rate = 1000;          ///< rate=HZ of messages
    double staleMs = 20;         ///< stale=MS: older poses and forces are not used
    double peakForce = 5;        ///< peak=N
    double continuousForce = 2;  ///< continuous=N
};
/// Parses the options. Throws std::runtime_error with one sentence.
InverseOptions inverseOptions(const std::string& text);

/// Our messages are the loop: the service sends one state for each force that we send. A thread of our own does both
/// and paces them; the haptic thread exchanges with it as with any arm (ArmLink).
class InverseLink final : public ArmLink, public WebSocketListener {
  public:
    /// The connection for this option text. Throws std::runtime_error with what to do.
    static std::shared_ptr<InverseLink> connect(const std::string& text);
    /// Reports what works on this machine, for `doctor`, with zero force.
    static DeviceCheck examine();

    explicit InverseLink(InverseOptions options);
    ~InverseLink() override;  ///< sends zero force before it closes the connection

    /// Also sends a zero force at once, past the thread: that may be the one that the signal has interrupted.
    void disarm() noexcept override;
    DeviceStatus status() const override;

  private:
    static constexpr int kSimulation = 0, kEvents = 1;
    enum class Phase { Connecting, Waiting, Running, Failed };
    enum class Events { Connecting, Open, Refused, Ended };

    void open() override;
    void close() noexcept override;
    std::string faultText(std::uint32_t code) const override;
    void opened(int channel) override;
    void received(int channel, const std::string& message) override;
    void closed(int channel, const std::string& why) override;

    // For the thread.
    void run(const std::stop_token& stop);
    void takeInventory(const std::string& message);
    void takeState(const std::string& message);
    void takeEvent(const std::string& message);
    void sendForce();
    void sendNow(const Vec3& force);
    void watchSilence();
    void trip(InverseFault fault);
    void enter(Phase phase, const std::string& problem = {});
    void prepareZeroFrame();
    std::string described() const;

    const InverseOptions options_;
    std::unique_ptr<WebSockets> sockets_;

    mutable std::mutex phaseMutex_;  // guards the next three
    std::condition_variable phaseChanged_;
    Phase phase_ = Phase::Connecting;
    std::string problem_, note_;  // why opening failed; the newest event

    // Used by the thread, or by open() before it starts.
    InverseInventory inventory_;
    ForceMessage force_;
    InverseState state_;
    std::string gripId_;
    Quat q_DS_ = Quat::Identity();
    std::uint64_t nextSend_ = 0, lastSend_ = 0, lastReceived_ = 0;
    bool running_ = false;

    std::atomic<bool> hasGrip_ = false;
    std::atomic<Events> events_ = Events::Connecting;
    /// The frame of a zero force, as it goes over the wire, and its length, which is 0 while there is none.
    std::array<unsigned char, 512> zeroFrame_{};
    std::atomic<std::size_t> zeroFrameSize_ = 0;

    std::jthread thread_;  // last member, so that it ends before the members that it uses
};

}  // namespace touchstone::sandbox
