#include "haptics/device/lab_link.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "haptics/device/arm_link.hpp"
#include "haptics/math/numbers.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone {
namespace {

constexpr double kMeanPeriods = 100;  // over which the rate is averaged

std::uint64_t packed(const sockaddr_in& address) {
    return std::uint64_t{address.sin_addr.s_addr} << 16 | address.sin_port;
}

sockaddr_in unpacked(std::uint64_t address) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = static_cast<in_addr_t>(address >> 16);
    to.sin_port = static_cast<in_port_t>(address);
    return to;
}

std::string addressText(std::uint64_t address) {
    const sockaddr_in from = unpacked(address);
    char text[INET_ADDRSTRLEN]{};
    inet_ntop(AF_INET, &from.sin_addr, text, sizeof text);
    return std::string(text) + ":" + std::to_string(ntohs(from.sin_port));
}

Vec3 clamped(const Vec3& v, double limit) {
    const double length = v.norm();
    return length > limit ? Vec3(v * (limit / length)) : v;
}

}  // namespace

LabOptions labOptions(const std::string& text) {
    LabOptions options;
    constexpr const char* kUsage =
        "lab[:PORT][,listen=ADDRESS][,peer=ADDRESS][,stale=1 to 1000 ms][,force=N][,torque=MNM][,continuous_force=N]"
        "[,continuous_torque=MNM]";
    const std::size_t comma = std::min(text.find(','), text.size());
    if (const std::string first = text.substr(0, comma); !first.empty()) {
        const auto port = readNumber(first, 1, 65535);
        if (!port || *port != std::floor(*port))
            throw std::runtime_error("lab: '" + first + "' is not a port: write " + kUsage);
        options.port = static_cast<std::uint16_t>(*port);
    }
    DeviceLimits& limits = options.limits;
    readArmOptions("lab", text.substr(std::min(comma + 1, text.size())), kUsage,
                   [&](const std::string& key, const std::string& value) {
                       const auto address = [&](std::string& to) {
                           in_addr parsed{};
                           to = value;
                           return inet_pton(AF_INET, to.c_str(), &parsed) == 1;
                       };
                       return key == "listen"              ? address(options.listen)
                              : key == "peer"              ? address(options.peer)
                              : key == "stale"             ? takeNumber(value, 1, 1000, options.staleMs)
                              : key == "force"             ? takeNumber(value, 0.1, 1000, limits.peakForce)
                              : key == "torque"            ? takeNumber(value, 1, 1e5, limits.peakTorque)
                              : key == "continuous_force"  ? takeNumber(value, 0.1, 1000, limits.continuousForce)
                              : key == "continuous_torque" ? takeNumber(value, 1, 1e5, limits.continuousTorque)
                                                           : false;
                   });
    limits.continuousForce = std::min(limits.continuousForce, limits.peakForce);
    limits.continuousTorque = std::min(limits.continuousTorque, limits.peakTorque);
    return options;
}

std::shared_ptr<LabLink> LabLink::connect(const std::string& text) {
    return sharedLink<LabLink>(text, [&] { return std::make_shared<LabLink>(labOptions(text)); });
}

LabLink::LabLink(LabOptions options)
    : options_(std::move(options)),
      staleNs_(static_cast<std::uint64_t>(1e6 * options_.staleMs)),
      lostNs_(std::max(kLostNs, staleNs_)) {
    if (!options_.peer.empty()) {
        in_addr address{};
        inet_pton(AF_INET, options_.peer.c_str(), &address);
        onlyPeer_ = address.s_addr;
    }
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_port = htons(options_.port);
    inet_pton(AF_INET, options_.listen.c_str(), &here.sin_addr);
    socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket_ >= 0 && bind(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) == 0) return;
    const int reason = errno;
    if (socket_ >= 0) close(socket_);
    throw std::runtime_error("lab: port " + std::to_string(options_.port) + " of " + options_.listen +
                             (reason == EADDRINUSE ? " is taken: close the other program or choose another port"
                              : reason == EADDRNOTAVAIL
                                  ? " cannot be opened: this machine has no such address; choose another with listen="
                                  : std::string(" cannot be opened: ") + std::strerror(reason)));
}

LabLink::~LabLink() {
    disarm();
    close(socket_);
}

// -- The haptic thread ---------------------------------------------------------------------------------------------

void LabLink::reject(LabRejected why) noexcept {
    rejected_[static_cast<std::size_t>(why)].fetch_add(1, std::memory_order_relaxed);
    lastRejected_.store(static_cast<int>(why), std::memory_order_relaxed);
}

void LabLink::fail() noexcept {
    armed_.store(false, std::memory_order_relaxed);
    failed_.store(true, std::memory_order_relaxed);
}

bool LabLink::fresh(std::uint64_t now) const noexcept {
    return peer_.load(std::memory_order_relaxed) != 0 && now - arrived_.load(std::memory_order_relaxed) < staleNs_;
}

void LabLink::take(std::span<const std::uint8_t> bytes, std::size_t size, std::uint64_t from,
                   std::uint64_t now) noexcept {
    if (onlyPeer_ != 0 && static_cast<std::uint32_t>(from >> 16) != onlyPeer_) return reject(LabRejected::Foreign);
    LabPose pose;
    LabRejected why{};
    if (!readLabPose(bytes, size, pose, why)) return reject(why);

    const std::uint64_t peer = peer_.load(std::memory_order_relaxed), before = arrived_.load(std::memory_order_relaxed);
    if (peer != 0 && now - before <= lostNs_) {
        if (from != peer) return reject(LabRejected::Foreign);
        if (pose.session != pose_.session) return reject(LabRejected::Session);
        if (pose.sequence <= pose_.sequence) return reject(LabRejected::Old);
        const auto count = static_cast<double>(accepted_.load(std::memory_order_relaxed));
        period_ += (static_cast<double>(now - before) - period_) / std::min(kMeanPeriods, count);
        rate_.store(1e9 / std::max(1.0, period_), std::memory_order_relaxed);
    } else {
        // The first arm may begin at once. Where the hand is after a silence, and whose hand it is, nobody knows.
        if (before != 0) {
            fail();
            restarts_.fetch_add(1, std::memory_order_relaxed);
            restarted_ = true;
        }
        peer_.store(from, std::memory_order_relaxed);
        accepted_.store(0, std::memory_order_relaxed);
        period_ = 0;
    }
    pose_ = pose;
    session_.store(pose.session, std::memory_order_relaxed);
    sequence_.store(pose.sequence, std::memory_order_relaxed);
    time_.store(pose.time, std::memory_order_relaxed);
    fault_.store(pose.fault, std::memory_order_relaxed);
    if (pose.fault) fail();
    accepted_.fetch_add(1, std::memory_order_relaxed);
    arrived_.store(now, std::memory_order_relaxed);
}

DeviceReading LabLink::read() noexcept {
    const std::uint64_t now = steadyNanoseconds();
    if (forget_.exchange(false, std::memory_order_relaxed)) peer_.store(0, std::memory_order_relaxed);
    std::array<std::uint8_t, kLabPoseBytes> bytes;
    for (int i = 0; i < kMostPerRead; ++i) {
        sockaddr_in from{};
        socklen_t length = sizeof from;
        // With MSG_TRUNC the result is the size of the datagram, not of what fits into the buffer.
        const ssize_t size = recvfrom(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_TRUNC,
                                      reinterpret_cast<sockaddr*>(&from), &length);
        if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) break;
        if (size < 0) continue;  // that an arm refused an earlier wrench is reported here; its silence says the same
        const auto whole = static_cast<std::size_t>(size);
        take(std::span(bytes).first(std::min(whole, bytes.size())), whole, packed(from), now);
    }
    DeviceReading reading{.X_WT_device = pose_.X_DS, .valid = fresh(now), .buttons = pose_.buttons};
    reading.fault = restarted_ || (reading.valid && pose_.fault);
    restarted_ = false;
    return reading;
}

void LabLink::send(const Wrench& wrench, LabState state) noexcept {
    const std::uint64_t peer = peer_.load(std::memory_order_relaxed);
    if (peer == 0) return;
    const auto bytes =
        labBytes(LabWrench{state, session_.load(std::memory_order_relaxed), sequence_.load(std::memory_order_relaxed),
                           time_.load(std::memory_order_relaxed), wrench});
    const sockaddr_in to = unpacked(peer);
    // A datagram that the system does not take is lost like one in the network: the next tick sends the next.
    [[maybe_unused]] const ssize_t sent = sendto(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                                 reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

void LabLink::write(const Wrench& wrench) noexcept {
    const bool armed = armed_.load(std::memory_order_relaxed);
    Wrench out;
    if (armed && wrench.isFinite() && fresh(steadyNanoseconds()))
        out = {clamped(wrench.force, options_.limits.peakForce), clamped(wrench.torque, options_.limits.peakTorque)};
    send(out, armed                                     ? LabState::Engaged
              : failed_.load(std::memory_order_relaxed) ? LabState::Fault
                                                        : LabState::Stopped);
}

void LabLink::arm() noexcept {
    if (fault_.load(std::memory_order_relaxed)) return;
    failed_.store(false, std::memory_order_relaxed);
    armed_.store(true, std::memory_order_relaxed);
}

void LabLink::disarm() noexcept {
    armed_.store(false, std::memory_order_relaxed);
    send({}, LabState::Stopped);
}

// -- The window's thread -------------------------------------------------------------------------------------------

DeviceStatus LabLink::status() const {
    DeviceStatus status;
    const std::uint64_t now = steadyNanoseconds(), arrived = arrived_.load(), peer = peer_.load();
    const std::string here = options_.listen + ":" + std::to_string(options_.port), from = addressText(peer);
    const int last = lastRejected_.load();
    const std::string rejection =
        last < 0 ? "" : std::string("; the last datagram rejected: ") + words(static_cast<LabRejected>(last));
    using State = DeviceStatus::State;
    if (peer == 0) {
        status.state = State::Connecting;
        status.text = "Waiting for the arm's first datagram at " + here + rejection;
    } else if (now > arrived && now - arrived > lostNs_) {
        status.state = State::Lost;
        status.text = "The arm at " + from + " sends no poses: start its program again and engage" + rejection;
    } else if (fault_.load()) {
        status.state = State::Fault;
        status.text = "The arm at " + from + " reports a fault: see its program";
    } else if (failed_.load()) {
        status.state = State::Fault;
        status.text = "The arm reported a fault, was silent, or its program was started again: engage it";
    } else {
        status.text = "The arm at " + from + " runs";
        status.rate = rate_.load();
    }
    status.details = "Listening at " + here + (peer ? "\nArm at " + from : "") +
                     "\nPoses accepted since it began: " + std::to_string(accepted_.load()) +
                     "\nTimes that it began again: " + std::to_string(restarts_.load());
    for (std::size_t i = 0; i < kLabRejections; ++i)
        if (const std::uint64_t count = rejected_[i].load())
            status.details += "\nDatagrams rejected, " + std::string(words(static_cast<LabRejected>(i))) + ": " +
                              std::to_string(count);
    return status;
}

}  // namespace touchstone
