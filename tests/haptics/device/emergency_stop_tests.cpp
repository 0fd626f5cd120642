// Processes that die during a push: the last force that their device gets is zero.
#include "haptics/device/emergency_stop.hpp"

#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <new>
#include <stdexcept>
#include <thread>

#include "haptics/loop/haptic_loop.hpp"
#include "tests/support/ground_world.hpp"

namespace touchstone::emergency_stop_tests {

namespace {

/// Shared memory that outlives the process: the commands to its motors, and the action for its next reading.
struct Motors {
    std::atomic<double> force = 0;
    std::atomic<int> releaseForces = 0, disobeyed = 0;
    std::atomic<void (*)()> atNextReading = nullptr;
};

/// Without a command the hand presses deeper, down to 5 mm.
class SharedDevice final : public Device {
  public:
    explicit SharedDevice(Motors& motors) : motors_(motors) {}
    DeviceReading read(double, double) noexcept override {
        if (void (*act)() = motors_.atNextReading) act();
        if (z_ > 0) z_ -= 0.1;
        return {.X_WT_device = {{0, 0, z_}, Quat::Identity()}};
    }
    void write(const Wrench& wrench) noexcept override {
        motors_.force = wrench.force.norm();
        motors_.disobeyed += motors_.releaseForces > 0 && motors_.force > 0;
    }
    void releaseForces() noexcept override {
        motors_.force = 0;
        ++motors_.releaseForces;
    }

  private:
    Motors& motors_;
    double z_ = 8;
};

std::unique_ptr<HapticLoop> pressingLoop(Motors& motors) {
    auto loop = std::make_unique<HapticLoop>(test::groundBelow(Vec3::UnitZ()), Settings{},
                                             std::make_unique<SharedDevice>(motors),
                                             LoopOptions{.realTime = {.raise = false}, .shares = {}, .watchdogMs = 0});
    loop->engage();
    return loop;
}

/// Whether the condition becomes true; the time limit only detects a process that hangs.
bool waitFor(const std::function<bool()>& wanted) {
    for (int i = 0; i < 60'000; ++i) {
        if (wanted()) return true;
        usleep(1000);
    }
    return false;
}

/// Runs `live` in a child process until the force is 4 N and `kill` has ended it. Returns its status as from wait().
int deathOf(Motors& motors, const std::function<void()>& live, const std::function<void(pid_t)>& kill) {
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        const rlimit none{};
        setrlimit(RLIMIT_CORE, &none);
        installEmergencyStop();
        live();
        _exit(99);
    }
    const bool pressed = waitFor([&] { return motors.force > 4; });
    if (pressed) kill(child);
    int status = 0;
    const bool ended = waitFor([&] { return waitpid(child, &status, WNOHANG) == child; });
    if (!ended) {
        ::kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
    }
    REQUIRE(pressed);
    REQUIRE(ended);
    return status;
}

struct Shared {
    Motors& motors =
        *new (mmap(nullptr, sizeof(Motors), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Motors;
    ~Shared() { munmap(&motors, sizeof motors); }
    void press() {
        const auto loop = pressingLoop(motors);
        for (;;) pause();
    }
};

/// Overflows the stack.
[[gnu::noinline]] int overflow(int depth) {
    volatile char room[4096] = {};
    return depth == 0 ? room[0] : overflow(depth - 1) + room[depth % 4096];
}

}  // namespace

TEST_CASE("emergency stop: any signal that ends the process leaves zero force", "[safety][signal]") {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL}) {
        INFO(strsignal(signal));
        Shared shared;
        const int status = deathOf(
            shared.motors, [&] { shared.press(); }, [&](pid_t child) { kill(child, signal); });
        CHECK(shared.motors.force == 0);
        CHECK(shared.motors.releaseForces == 2);
        CHECK(shared.motors.disobeyed <= 1);  // a tick that had already computed its force
        REQUIRE(WIFSIGNALED(status));         // and the signal then takes its default action
        CHECK(WTERMSIG(status) == signal);
    }
}

TEST_CASE("emergency stop: a crash of the haptic thread leaves zero force", "[safety][signal]") {
    struct Case {
        void (*act)();
        int signal;
    };
    const Case cases[] = {
        // To a page without access, since the sanitizers end a process that writes to null before the signal does.
        {[] { *static_cast<volatile int*>(mmap(nullptr, 4096, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) = 1; },
         SIGSEGV},
        {[] { throw std::runtime_error("nobody catches this"); }, SIGABRT},  // leaves a noexcept function
        {[] { overflow(1 << 30); }, SIGSEGV},
    };
    for (const auto& [act, signal] : cases) {
        Shared shared;
        const int status = deathOf(
            shared.motors, [&] { shared.press(); }, [&, breaks = act](pid_t) { shared.motors.atNextReading = breaks; });
        CHECK(shared.motors.force == 0);
        CHECK(shared.motors.releaseForces == 2);
        REQUIRE(WIFSIGNALED(status));
        CHECK(WTERMSIG(status) == signal);
    }
}

TEST_CASE("emergency stop: an exception and exit() leave zero force", "[safety][signal]") {
    Shared shared;
    std::atomic<int>& releaseForces = shared.motors.releaseForces;
    const auto afterPressing = [&](auto act) {
        return [&shared, act] {
            const auto loop = pressingLoop(shared.motors);
            waitFor([&] { return shared.motors.force > 4; });
            usleep(100'000);
            act();
        };
    };
    SECTION("caught: the loop is destroyed in order") {
        const int status = deathOf(
            shared.motors,
            [&] {
                try {
                    afterPressing([] { throw std::runtime_error("somebody catches this"); })();
                } catch (const std::exception&) {
                }
            },
            [](pid_t) {});
        CHECK(WEXITSTATUS(status) == 99);
        CHECK(releaseForces == 0);
    }
    SECTION("exit() with a loop that is not destroyed") {
        const int status = deathOf(shared.motors, afterPressing([] { std::exit(3); }), [](pid_t) {});
        CHECK(WEXITSTATUS(status) == 3);
        CHECK(releaseForces == 2);
    }
    CHECK(shared.motors.force == 0);
}

TEST_CASE("emergency stop: with a clean shutdown, the first signal is noted and the force is zero",
          "[safety][signal]") {
    const auto live = [](Shared& shared) {
        return [&shared] {
            const StopRequest stop;
            const auto loop = pressingLoop(shared.motors);
            while (StopRequest::signal() == 0) usleep(1000);
            usleep(50'000);  // the loop continues to tick: its device stays without force
            _exit(shared.motors.force == 0 ? StopRequest::signal() : 1);
        };
    };
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        INFO(strsignal(signal));
        Shared shared;
        const int status = deathOf(shared.motors, live(shared), [&](pid_t child) { kill(child, signal); });
        REQUIRE(WIFEXITED(status));
        CHECK(WEXITSTATUS(status) == signal);
        CHECK(shared.motors.force == 0);
        CHECK(shared.motors.releaseForces == 2);
    }
    struct Case {
        const char* what;
        void (*kill)(pid_t);
        int signal;
    };
    const Case cases[] = {{"the second ends the process",
                           [](pid_t child) {
                               kill(child, SIGINT);
                               usleep(100'000);
                               kill(child, SIGTERM);
                           },
                           SIGTERM},
                          {"faults end it at once", [](pid_t child) { kill(child, SIGSEGV); }, SIGSEGV}};
    for (const auto& [what, kill, signal] : cases) {
        INFO(what);
        Shared shared;
        const int status = deathOf(
            shared.motors,
            [&] {
                const StopRequest stop;
                shared.press();
            },
            kill);
        REQUIRE(WIFSIGNALED(status));
        CHECK(WTERMSIG(status) == signal);
    }
}

}  // namespace touchstone::emergency_stop_tests
