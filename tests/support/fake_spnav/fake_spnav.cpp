// A stand-in for libspnav, written from its public description: a socket pair is the daemon. $FAKE_SPNAV=none: there is
// no daemon; held: its cap is pushed to the right and held still.
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

namespace {
int ends[2] = {-1, -1};
}

extern "C" {

void fakeSpnavSend(const int* words);

int spnav_open() {
    const char* how = std::getenv("FAKE_SPNAV");
    if (ends[0] >= 0) return -1;  // one connection at a time, as the library has it
    if ((how && !std::strcmp(how, "none")) || socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends) != 0) return -1;
    constexpr int kHeld[7]{1, 350};
    if (how && !std::strcmp(how, "held")) fakeSpnavSend(kHeld);
    return ends[0];
}
int spnav_close() {
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
