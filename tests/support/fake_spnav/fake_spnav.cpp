// A stand-in for libspnav, written from its public description: a socket pair is the daemon. $FAKE_SPNAV=none: there is
// no daemon; held: its cap is pushed to the right and held still; held:MS: until it is released after that time;
// dies:MS: until the daemon ends.
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>

namespace {
int ends[2] = {-1, -1};
std::jthread daemonThread;
}  // namespace

extern "C" {

void fakeSpnavSend(const int* words);
void fakeSpnavDie();

int spnav_open() {
    const char* how = std::getenv("FAKE_SPNAV");
    if (ends[0] >= 0) return -1;  // one connection at a time, as the library has it
    if ((how && !std::strcmp(how, "none")) || socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends) != 0) return -1;
    constexpr int kHeld[7]{1, 350};
    if (how && (!std::strncmp(how, "held", 4) || !std::strncmp(how, "dies", 4))) fakeSpnavSend(kHeld);
    if (how && std::strchr(how, ':'))
        daemonThread = std::jthread(
            [dies = how[0] == 'd', ms = std::atoi(std::strchr(how, ':') + 1)](const std::stop_token& stop) {
                std::mutex mutex;
                std::unique_lock lock(mutex);
                std::condition_variable_any never;
                never.wait_for(lock, stop, std::chrono::milliseconds(ms), [] { return false; });
                if (stop.stop_requested()) return;
                constexpr int kReleased[7]{1};
                dies ? fakeSpnavDie() : fakeSpnavSend(kReleased);
            });
    return ends[0];
}
int spnav_close() {
    daemonThread = {};
    for (int& end : ends) {
        if (end >= 0) close(end);
        end = -1;
    }
    return 0;
}
int spnav_fd() { return ends[0]; }
int spnav_poll_event(int* event) {
    int words[7];
    if (read(ends[0], words, sizeof words) != sizeof words) return 0;
    std::memcpy(event, words, sizeof words);
    return words[0];
}

/// Sends a type (1: motion, 2: button, 3: device) and six numbers, as the daemon would.
void fakeSpnavSend(const int* words) {
    if (write(ends[1], words, 7 * sizeof *words) < 0) std::abort();
}
void fakeSpnavDie() {
    close(ends[1]);
    ends[1] = -1;
}
}
