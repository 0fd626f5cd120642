// Runs before every other constructor of the program and says in a sentence that the processor is too old, where the
// first AVX instruction would end the program without one. It is compiled for any x86-64 processor and uses nothing
// that is not.
#include <unistd.h>

namespace {

// 101 is the first priority that is not reserved. The libraries that the program needs are older than its constructors,
// and compiled for any processor.
[[gnu::constructor(101)]] void checkProcessor() {
    __builtin_cpu_init();
    if (__builtin_cpu_supports(TOUCHSTONE_ARCH)) return;
    constexpr char kSentence[] =
        "touchstone: this processor cannot run Touchstone, which is built for " TOUCHSTONE_ARCH
        " and needs AVX2 and FMA: use a computer with an Intel Core processor of 2013 or later, or an AMD Ryzen\n";
    if (write(STDERR_FILENO, kSentence, sizeof kSentence - 1) < 0) _exit(2);
    _exit(1);
}

}  // namespace
