// The stand-in service as a program, to try the device inverse3 by hand:  fake_inverse [PORT [EVENTS_PORT [FAULTS]]]
// Its hand pushes down by 30 mm and returns, every four seconds; it prints where the cursor is and what it feels.
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
        test::FakeInverse service(count > 3 ? words[3] : "", count > 1 ? std::atoi(words[1]) : 10001,
                                  count > 2 ? std::atoi(words[2]) : 10020);
        std::printf("seconds,hand_y_mm,cursor_y_mm,force_x_N,force_y_N,force_z_N,commands,connections\n");
        for (int step = 0;; ++step) {
            const double seconds = 0.01 * step, y = -15 * (1 - std::cos(2 * M_PI * seconds / 4));
            service.hand({0, y, 0});
            const test::FakeInverse::State s = service.state();
            if (step % 10 == 0)
                std::printf("%.2f,%.2f,%.2f,%.3f,%.3f,%.3f,%lu,%d\n", seconds, y, s.position.y(), s.force.x(),
                            s.force.y(), s.force.z(), s.commands, s.connections);
            std::fflush(stdout);
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
