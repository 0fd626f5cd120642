// Runs a fuzz target without libFuzzer: on its corpus, then on COUNT mutations of it, the same in every run.
//   replay_<target> CORPUS COUNT
#include <algorithm>
#include <csignal>
#include <iterator>
#include <random>
#include <vector>

#include <fcntl.h>

#include "tests/fuzz/fuzz.hpp"

namespace {

using Input = std::vector<std::uint8_t>;

constexpr unsigned kTimeLimitS =
    60;  // s, many times the time of any input: longer is a hang, whose input is kept like that of a crash

Input current;  // the present input of the target

/// Keeps the input of a crash, as libFuzzer does.
void keepInput(int signal) {
    const int file = ::open("crash-input", O_CREAT | O_TRUNC | O_WRONLY, 0644);
    if (file >= 0 && ::write(file, current.data(), current.size()) == static_cast<ssize_t>(current.size()))
        std::fputs("input kept in crash-input\n", stderr);
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

Input mutated(const std::vector<Input>& corpus, std::mt19937& random) {
    Input input = corpus[random() % corpus.size()];
    for (auto n = 1 + random() % 6; n > 0; --n) {
        const std::size_t at = input.empty() ? 0 : random() % input.size();
        const auto place = input.begin() + static_cast<std::ptrdiff_t>(at);
        const auto byte = static_cast<std::uint8_t>(random());
        const auto run = static_cast<std::ptrdiff_t>(std::min<std::size_t>(1 + random() % 12, input.size() - at));
        switch (random() % 6) {
            case 0:
                input.insert(place, byte);
                break;
            case 1:
                input.erase(place, place + run);
                break;
            case 2:
                if (!input.empty()) *place = byte;
                break;
            case 3:
                if (!input.empty()) *place = static_cast<std::uint8_t>(*place ^ 1u << random() % 8);
                break;
            case 4: {
                const Input copy(place, place + run);
                input.insert(input.begin() + static_cast<std::ptrdiff_t>(random() % (input.size() + 1)), copy.begin(),
                             copy.end());
                break;
            }
            default: {
                const Input& other = corpus[random() % corpus.size()];
                const auto from = other.begin() + static_cast<std::ptrdiff_t>(random() % (other.size() + 1));
                input.erase(place, input.end());
                input.insert(input.end(), from, other.end());
            }
        }
    }
    return input;
}

void run(const Input& input) {
    current = input;
    ::alarm(kTimeLimitS);
    LLVMFuzzerTestOneInput(current.data(), current.size());
}

}  // namespace

int main(int count, char** words) {
    if (count != 3) {
        std::fprintf(stderr, "usage: %s CORPUS COUNT\n", words[0]);
        return 2;
    }
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(words[1])) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<Input> corpus;
    for (const auto& file : files) {
        std::ifstream in(file, std::ios::binary);
        corpus.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }
    if (corpus.empty()) {
        std::fprintf(stderr, "%s holds no file\n", words[1]);
        return 2;
    }
    for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS, SIGILL, SIGALRM}) std::signal(signal, keepInput);
    run({});
    for (const Input& input : corpus) run(input);
    constexpr unsigned kSeed = 1;
    std::mt19937 random(kSeed);
    const int mutations = std::atoi(words[2]);
    for (int i = 0; i < mutations; ++i) run(mutated(corpus, random));
    std::printf("%zu files and %d mutations of them, seed %u\n", corpus.size(), mutations, kSeed);
}
