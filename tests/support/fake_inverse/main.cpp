// The stand-in service as a program, to try the device inverse3 by hand:
//   fake_inverse [PORT [EVENTS_PORT [X Y Z [FAULTS]]]]
// Its hand moves by X, Y, Z mm (40 to the left) and returns, every four seconds; it prints where the cursor is and what
// it feels, in device axes.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>

#include "tests/support/fake_inverse/fake_inverse.hpp"

int main(int count, char** words) {
    using namespace touchstone;
    try {
        const Vec3 push =
            count > 5 ? Vec3(std::atof(words[3]), std::atof(words[4]), std::atof(words[5])) : Vec3(-40, 0, 0);
        test::FakeInverse service(count > 6 ? words[6] : "", count > 1 ? std::atoi(words[1]) : 10001,
                                  count > 2 ? std::atoi(words[2]) : 10020);
        std::printf(
            "seconds,hand_x_mm,hand_y_mm,hand_z_mm,cursor_x_mm,cursor_y_mm,cursor_z_mm,force_x_N,force_y_N,force_z_N,"
            "commands,connections\n");
        for (int step = 0;; ++step) {
            const double seconds = 0.01 * step;
            const Vec3 p = 0.5 * (1 - std::cos(2 * M_PI * seconds / 4)) * push;
            service.hand(p);
            const test::FakeInverse::State s = service.state();
            if (step % 10 == 0)
                std::printf("%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%.2f,%.3f,%.3f,%.3f,%lu,%d\n", seconds, p.x(), p.y(), p.z(),
                            s.position.x(), s.position.y(), s.position.z(), s.force.x(), s.force.y(), s.force.z(),
                            s.commands, s.connections);
            std::fflush(stdout);
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
