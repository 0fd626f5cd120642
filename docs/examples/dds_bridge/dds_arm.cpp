// An arm on DDS, to try the bridge with: a hand of 500 N/m that pushes along one of ROS's axes and returns.
//   dds_arm [SECONDS [X Y Z in m [DOMAIN]]]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "dds_node.hpp"

int main(int count, char** words) {
    const auto number = [&](int i, double otherwise) { return count > i ? std::atof(words[i]) : otherwise; };
    const double seconds = number(1, 8);
    const std::array<double, 3> push{number(2, 0), number(3, 0), number(4, -0.02)};
    try {
        Node node(static_cast<std::uint32_t>(number(5, 0)), &geometry_msgs_msg_dds__WrenchStamped__desc,
                  "rt/touchstone/wrench", &geometry_msgs_msg_dds__PoseStamped__desc, "rt/touchstone/pose");
        constexpr double kSpring = 500, kFollow = 0.05;  // N/m; share of the way to the balance in a period
        std::array<double, 3> p{}, force{}, strongest{};
        std::string frame = "arm";
        unsigned long wrenches = 0;
        const std::int64_t begin = nanoseconds(now());
        for (double t = 0; t < seconds; t = 1e-9 * static_cast<double>(nanoseconds(now()) - begin)) {
            node.take<WrenchStamped>([&](const WrenchStamped& message) {
                const auto& f = message.wrench.force;
                force = {f.x, f.y, f.z};
                ++wrenches;
                if (std::hypot(f.x, f.y, f.z) > std::hypot(strongest[0], strongest[1], strongest[2])) strongest = force;
            });
            const double share = 0.5 * (1 - std::cos(2 * M_PI * t / seconds));
            for (int i = 0; i < 3; ++i) p[i] += kFollow * (share * push[i] + force[i] / kSpring - p[i]);
            PoseStamped message{};
            message.header.stamp = now();
            message.header.frame_id = frame.data();
            message.pose.position = {p[0], p[1], p[2]};
            message.pose.orientation = {0, 0, 0, 1};
            node.write(message);
            pause(1000);
        }
        std::printf("%lu wrenches received, largest force %.3f %.3f %.3f N\n", wrenches, strongest[0], strongest[1],
                    strongest[2]);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "dds_arm: %s\n", error.what());
        return 1;
    }
}
