// Connects DDS with touchstone's device lab: geometry_msgs/PoseStamped in, geometry_msgs/WrenchStamped out.
//   dds_bridge [--port 5005] [--domain 0] [--pose rt/touchstone/pose] [--wrench rt/touchstone/wrench]
// Poses are in m with ROS's axes (REP 103: x forward, y left, z up, the user looking forward); wrenches in N and N·m,
// about the origin of the pose. While there is no engaged wrench, zeros are published.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>

#include "dds_node.hpp"

namespace {

static_assert(std::endian::native == std::endian::little, "the datagrams are little endian");

// docs/devices.md has them as tables; the fields leave no gaps.
struct LabPose {
    char magic[4];
    std::uint16_t version, flags;
    std::uint32_t session, buttons;
    std::uint64_t sequence, time;
    double position[3], quaternion[4];
};
struct LabWrench {
    char magic[4];
    std::uint16_t version, state;
    std::uint32_t session, reserved;
    std::uint64_t sequence, time;
    double force[3], torque[3];
};
static_assert(sizeof(LabPose) == 88 && sizeof(LabWrench) == 80);

constexpr std::int64_t kSilenceNs = 20'000'000;
constexpr std::uint16_t kEngaged = 1;
volatile std::sig_atomic_t stop = 0;

std::int64_t steady() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

// ROS: forward, left, up. The device: right, up, toward the user. Both are right-handed.
std::array<double, 3> toLab(double x, double y, double z) { return {-y, z, -x}; }
geometry_msgs_msg_dds__Vector3_ toRos(const double (&v)[3]) { return {-v[2], -v[0], v[1]}; }

int run(int count, char** words) {
    int port = 5005;
    std::uint32_t domain = 0;
    std::string poseTopic = "rt/touchstone/pose", wrenchTopic = "rt/touchstone/wrench";
    if (count % 2 == 0) throw std::runtime_error("each option needs a value; the head of dds_bridge.cpp lists them");
    for (int i = 1; i + 1 < count; i += 2) {
        const std::string option = words[i], value = words[i + 1];
        if (option == "--port")
            port = std::atoi(value.c_str());
        else if (option == "--domain")
            domain = static_cast<std::uint32_t>(std::atoi(value.c_str()));
        else if (option == "--pose")
            poseTopic = value;
        else if (option == "--wrench")
            wrenchTopic = value;
        else
            throw std::runtime_error("unknown option " + option);
    }
    Node node(domain, &geometry_msgs_msg_dds__PoseStamped__desc, poseTopic, &geometry_msgs_msg_dds__WrenchStamped__desc,
              wrenchTopic);
    const int link = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    sockaddr_in lab{};
    lab.sin_family = AF_INET;
    lab.sin_port = htons(static_cast<std::uint16_t>(port));
    lab.sin_addr.s_addr = htonl(INADDR_LOOPBACK);

    LabPose pose{{'T', 'S', 'L', 'P'}, 1, 0, std::random_device()(), 0, 0, 0, {}, {}};
    std::string frame;
    std::int64_t newest = 0, answered = 0;
    unsigned long old = 0, poses = 0, wrenches = 0;
    bool zeroed = true;
    const auto publish = [&](const LabWrench& wrench) {
        WrenchStamped message{};
        message.header.stamp = now();
        message.header.frame_id = frame.data();
        message.wrench.force = toRos(wrench.force);
        message.wrench.torque = toRos(wrench.torque);
        for (double* torque : {&message.wrench.torque.x, &message.wrench.torque.y, &message.wrench.torque.z})
            *torque /= 1000;
        node.write(message);
    };
    while (!stop) {
        node.take<PoseStamped>([&](const PoseStamped& message) {
            const std::int64_t stamp = nanoseconds(message.header.stamp);
            if (stamp <= newest) {  // repeated, or overtaken by a newer one
                ++old;
                return;
            }
            newest = stamp;
            ++poses;
            if (message.header.frame_id) frame = message.header.frame_id;
            ++pose.sequence;
            pose.time = static_cast<std::uint64_t>(stamp);
            const auto& p = message.pose.position;
            const auto& q = message.pose.orientation;
            const auto position = toLab(1000 * p.x, 1000 * p.y, 1000 * p.z), axis = toLab(q.x, q.y, q.z);
            std::copy(position.begin(), position.end(), pose.position);
            std::copy(axis.begin(), axis.end(), pose.quaternion);
            pose.quaternion[3] = q.w;
            sendto(link, &pose, sizeof pose, 0, reinterpret_cast<const sockaddr*>(&lab), sizeof lab);
        });
        LabWrench wrench{};
        sockaddr_in from{};
        socklen_t length = sizeof from;
        while (recvfrom(link, &wrench, sizeof wrench, MSG_TRUNC, reinterpret_cast<sockaddr*>(&from), &length) ==
               sizeof wrench) {
            const bool ours = from.sin_addr.s_addr == lab.sin_addr.s_addr && from.sin_port == lab.sin_port &&
                              std::memcmp(wrench.magic, "TSLW", 4) == 0 && wrench.version == 1 &&
                              wrench.session == pose.session;
            if (!ours) continue;
            bool good = wrench.state == kEngaged;
            for (int i = 0; i < 3; ++i) good &= std::isfinite(wrench.force[i]) && std::isfinite(wrench.torque[i]);
            if (!good) wrench = {};
            publish(wrench);
            ++wrenches;
            answered = steady();
            zeroed = false;
        }
        if (!zeroed && steady() - answered > kSilenceNs) {
            publish({});
            zeroed = true;
        }
        pause(200);
    }
    publish({});
    close(link);
    std::printf("%lu poses, %lu wrenches, %lu old poses\n", poses, wrenches, old);
    return 0;
}

}  // namespace

int main(int count, char** words) {
    std::signal(SIGINT, [](int) { stop = 1; });
    std::signal(SIGTERM, [](int) { stop = 1; });
    try {
        return run(count, words);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "dds_bridge: %s\n", error.what());
        return 1;
    }
}
