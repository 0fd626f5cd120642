#pragma once
// A program in the lab that drives an arm, as the device lab sees it. Only loopback addresses are used.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <optional>
#include <span>

#include "haptics/device/lab_datagram.hpp"

namespace touchstone::test {

class LabArm {
  public:
    explicit LabArm(std::uint16_t port, std::uint32_t session = 1)
        : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
        pose.session = session;
        there_.sin_family = AF_INET;
        there_.sin_port = htons(port);
        there_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    }
    ~LabArm() { close(socket_); }
    LabArm(const LabArm&) = delete;
    LabArm& operator=(const LabArm&) = delete;

    /// Sends the next pose.
    void send() {
        ++pose.sequence;
        pose.time += 1'000'000;
        sendBytes(labBytes(pose));
    }
    void send(const Vec3& p) {
        pose.X_DS.p = p;
        send();
    }
    void sendBytes(std::span<const std::uint8_t> bytes) const {
        REQUIRE(sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&there_),
                       sizeof there_) == static_cast<ssize_t>(bytes.size()));
    }
    /// The newest wrench that has arrived since the last call.
    std::optional<LabWrench> receive() const {
        std::optional<LabWrench> newest;
        std::array<std::uint8_t, 256> bytes;
        for (ssize_t size; (size = recv(socket_, bytes.data(), bytes.size(), 0)) >= 0;) {
            LabWrench wrench;
            LabRejected why{};
            REQUIRE(readLabWrench(bytes, static_cast<std::size_t>(size), wrench, why));
            newest = wrench;
        }
        return newest;
    }

    LabPose pose;

  private:
    const int socket_;
    sockaddr_in there_{};
};

}  // namespace touchstone::test
