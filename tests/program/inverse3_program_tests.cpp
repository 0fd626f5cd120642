// The program with an Inverse3, against the fake of Haply's service: what the hand feels, and what remains when the
// program ends.
#include <dirent.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstring>
#include <thread>

#include "engine/scene/gltf_write.hpp"
#include "tests/program/program.hpp"
#include "tests/support/arm_matrix.hpp"
#include "tests/support/fake_inverse/fake_inverse.hpp"

namespace touchstone::inverse3_program_tests {

using namespace touchstone::test;
using Catch::Contains;
using nlohmann::json;

namespace {

std::string pressFile(const Program& touchstone) {
    engine::writeGltf(pressScene(), touchstone.file("press.glb"));
    return touchstone.file("press.glb");
}

/// Starts `touchstone run SCENE --device inverse3 --headless` for a minute.
pid_t start(const Program& touchstone, const FakeInverse& fake) {
    const std::string scene = pressFile(touchstone), cache = touchstone.file("cache"),
                      device = "inverse3:stale=500," + fake.options();
    fflush(nullptr);  // the child must not print what waits here
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child != 0) return child;
    setenv("TOUCHSTONE_CACHE", cache.c_str(), 1);
    if (!freopen("/dev/null", "w", stdout) || !freopen("/dev/null", "w", stderr)) _exit(98);
    signal(SIGINT, SIG_DFL);
    execl(TOUCHSTONE_BINARY_DIR "/touchstone", "touchstone", "run", scene.c_str(), "--device", device.c_str(),
          "--headless", "--seconds", "60", static_cast<char*>(nullptr));
    _exit(99);
}

/// The thread of this name in a process; 0 if there is none.
pid_t threadOf(pid_t process, const std::string& name) {
    const std::string tasks = "/proc/" + std::to_string(process) + "/task";
    pid_t found = 0;
    if (DIR* const folder = opendir(tasks.c_str())) {
        while (const dirent* entry = readdir(folder))
            if (textOf(tasks + "/" + entry->d_name + "/comm") == name + "\n") found = std::atoi(entry->d_name);
        closedir(folder);
    }
    return found;
}

/// Lowers the hand by 20 µm for each command until it feels a force, and says whether it does. Where the hand is when
/// the first tick takes the tool up is not known: the service gets commands before.
bool lower(FakeInverse& fake, unsigned long begun) {
    const FakeInverse::State state = fake.state();
    const bool feels = state.force.y() > 1;
    if (!feels) fake.hand({0, -0.02 * static_cast<double>(state.commands - begun), 0});
    return feels;
}

}  // namespace

TEST_CASE("inverse3 program: however the program ends, the service has no force", "[program][device]") {
    struct End {
        int signal;
        bool own;  // the thread that speaks with the service gets the signal
    };
    const End end = GENERATE(End{SIGINT, false}, End{SIGTERM, false}, End{SIGABRT, false}, End{SIGSEGV, false},
                             End{SIGSEGV, true}, End{SIGKILL, false});
    INFO(strsignal(end.signal) << (end.own ? " in the driver's thread" : ""));
    const Program touchstone;
    FakeInverse fake;
    pid_t child = 0;
    int status = 0;
    const auto ended = [&] { return waitpid(child, &status, WNOHANG) == child; };
    // Where other programs take the processor for long, the device is lost, and nobody engages it again: start again.
    const bool pressed = within([&] {
        fake.hand({0, 0, 0});
        child = start(touchstone, fake);
        const unsigned long before = fake.state().commands;
        for (int ms = 0; ms < 5000; ++ms) {
            if (lower(fake, before)) return true;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
        kill(child, SIGKILL);
        within(ended);
        return false;
    });
    REQUIRE(pressed);
    if (end.own)
        syscall(SYS_tgkill, child, threadOf(child, "inverse3"), end.signal);
    else
        kill(child, end.signal);
    REQUIRE(within(ended));
    CHECK(within([&] { return fake.state().connections == 0; }));
    CHECK(fake.state().force.isZero(0));
    // Only a killed program cannot send it; then the service ends the session.
    if (end.signal != SIGKILL) CHECK(fake.state().lastWasZero);
    CHECK(fake.state().misuses == 0);
}

TEST_CASE("inverse3 program: a headless run is paced, pushes the hand out of the part, and reports faults",
          "[program][device]") {
    const Program touchstone;
    FakeInverse fake;
    std::atomic<bool> over = false, pushed = false;
    std::atomic<unsigned long> begun = 0;  // commands before the run
    std::thread hand([&] {
        while (!over) {
            if (lower(fake, begun) && std::abs(fake.state().force.x()) < 0.1) pushed = true;
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    });
    const std::string run = "run " + pressFile(touchstone) + " --device inverse3:stale=500," + fake.options() +
                            " --headless --seconds 1 --report " + touchstone.file("report.json");
    Answer answer;
    within([&] {
        begun = fake.state().commands;
        fake.hand({0, 0, 0});
        answer = touchstone(run);
        return pushed.load();
    });
    over = true;
    hand.join();
    CHECK(pushed);
    INFO(answer.out << answer.err);
    CHECK(answer.code == 0);
    const json report = json::parse(textOf(touchstone.file("report.json")));
    CHECK(report.at("ticks") == 1000);
    CHECK(report.at("overruns").is_number());
    CHECK(fake.state().lastWasZero);
    CHECK(fake.state().misuses == 0);

    fake.fault("no-device");
    const Answer refused = touchstone(run);
    CHECK(refused.code != 0);
    CHECK(isOneSentence(refused.err));
    CHECK_THAT(refused.err, Contains("no Inverse3: connect and power it"));
}

TEST_CASE("inverse3 program: doctor and the help name the device and what it lacks", "[program][device]") {
    const Program touchstone;
    CHECK_THAT(touchstone("run --help").out, Contains("inverse3"));
    const FakeInverse fake;
    CHECK_THAT(touchstone("doctor", "TOUCHSTONE_INVERSE=" + std::to_string(fake.port())).out,
               Contains("inverse3: a Haply Inverse3") && Contains("force only") && Contains("Inverse3 049D runs"));
    CHECK_THAT(touchstone("doctor", "TOUCHSTONE_INVERSE=1").out,
               Contains("no device at port 1 of this machine") && Contains("haply-inverse-service"));
}

}  // namespace touchstone::inverse3_program_tests
