// Your own device: a program in the lab sends the pose of the stylus by UDP and receives the wrench.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "haptics/device/workspace.hpp"

namespace touchstone {
namespace {

class LabDevice final : public Device {
  public:
    explicit LabDevice(std::uint16_t port) : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
        sockaddr_in here{};
        here.sin_family = AF_INET;
        here.sin_port = htons(port);
        here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        if (bind(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0) {
            close(socket_);
            throw std::runtime_error("lab: port " + std::to_string(port) + " is taken: close the other program");
        }
    }
    ~LabDevice() override { close(socket_); }

    // In the device's own frame: mm and a unit quaternion. Neither call may wait, allocate, lock or throw.
    DeviceReading read(double, double dt) noexcept override {
        age_ += dt;
        std::array<double, 7> m;  // x, y, z, qw, qx, qy, qz
        socklen_t size = sizeof peer_;
        while (recvfrom(socket_, m.data(), sizeof m, 0, reinterpret_cast<sockaddr*>(&peer_), &size) == sizeof m) {
            X_DS_ = {{m[0], m[1], m[2]}, Quat(m[3], m[4], m[5], m[6]).normalized()};
            age_ = 0;
        }
        return {.X_WT_device = X_DS_, .valid = age_ < kStaleMs && X_DS_.isFinite()};
    }
    void write(const Wrench& wrench) noexcept override {
        std::array<double, 6> m;  // N and mN·m about the stylus's origin
        Eigen::Map<Vec6>(m.data()) << wrench.force, wrench.torque;
        if (age_ < kStaleMs) sendto(socket_, m.data(), sizeof m, 0, reinterpret_cast<sockaddr*>(&peer_), sizeof peer_);
    }
    DeviceLimits limits() const noexcept override { return {.peakForce = 8, .peakTorque = 100}; }

  private:
    static constexpr double kStaleMs = 20;
    int socket_;
    sockaddr_in peer_{};
    Pose X_DS_;
    double age_ = kStaleMs;
};

}  // namespace

// Its row in haptics/device/device_table.cpp: DeviceInfo{"lab", "our own arm, as lab:PORT", makeLab}
std::unique_ptr<Device> makeLab(const DeviceContext& context) {
    const int port = context.file.empty() ? 5005 : std::atoi(context.file.c_str());
    return makeMapped(std::make_unique<LabDevice>(static_cast<std::uint16_t>(port)), context.X_WT_start);
}

}  // namespace touchstone
