#include "tools/touchstone/console.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <stdexcept>

#include "haptics/system/tree_words.hpp"

namespace touchstone::app {
namespace {

volatile std::sig_atomic_t interrupted = 0;

/// While it lives, the first Ctrl-C is noted; the next one acts as ever.
class Interrupt {
  public:
    Interrupt() {
        interrupted = 0;
        struct sigaction noting {};
        noting.sa_handler = [](int) { interrupted = 1; };
        noting.sa_flags = static_cast<int>(SA_RESETHAND);
        sigaction(SIGINT, &noting, &before_);
        // Whoever started the program with Ctrl-C ignored, as scripts do in the background, wants it so.
        if (before_.sa_handler == SIG_IGN) sigaction(SIGINT, &before_, nullptr);
    }
    ~Interrupt() { sigaction(SIGINT, &before_, nullptr); }
    Interrupt(const Interrupt&) = delete;
    Interrupt& operator=(const Interrupt&) = delete;

  private:
    struct sigaction before_ {};
};

/// Draws over its own line; whatever is printed next begins on a clean one.
class Bar {
  public:
    explicit Bar(std::string doing) : doing_(std::move(doing)) {}
    ~Bar() { clear(); }
    Bar(const Bar&) = delete;
    Bar& operator=(const Bar&) = delete;

    void show(const system::SceneStatus& status) {
        if (std::chrono::steady_clock::now() - start_ < std::chrono::milliseconds(500)) return;
        const int percent = static_cast<int>(100 * std::clamp(status.fraction, 0.0, 1.0));
        std::string text = doing_ + " " + status.part;
        if (status.of > 1) text += " (" + std::to_string(status.number) + " of " + std::to_string(status.of) + ")";
        if (!terminal_) {
            if (text != text_) spdlog::info("{}", text);
            text_ = text;
            return;
        }
        if (const std::string left = system::timeLeft(status.secondsLeft); !left.empty()) text += ", " + left;
        if (text == text_ && percent == percent_) return;
        constexpr int kWidth = 30;
        const int filled = kWidth * percent / 100;
        std::fprintf(stderr, "\r\033[K[%s%s] %3d %%  %s", std::string(filled, '#').c_str(),
                     std::string(kWidth - filled, '.').c_str(), percent, text.c_str());
        text_ = text;
        percent_ = percent;
    }

  private:
    void clear() const {
        if (terminal_ && percent_ >= 0) std::fputs("\r\033[K", stderr);
    }

    const std::string doing_;
    const Interrupt interrupt_;
    const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    const bool terminal_ = isatty(STDERR_FILENO) != 0;
    std::string text_;
    int percent_ = -1;
};

}  // namespace

system::SceneProgress progressBar(const std::string& doing) {
    return [bar = std::make_shared<Bar>(doing)](const system::SceneStatus& status) {
        bar->show(status);
        return interrupted == 0;
    };
}

void requireDisplay() {
    const auto given = [](const char* variable) {
        const char* value = std::getenv(variable);
        return value && *value;
    };
    if (!given("DISPLAY") && !given("WAYLAND_DISPLAY"))
        throw std::runtime_error(
            "there is no display for a window: add --headless for a run without one, or start it on a desktop, over "
            "'ssh -X' or under 'xvfb-run'");
}

void requireWritable(const std::filesystem::path& file, const std::string& what) {
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    std::error_code error;
    const bool there = std::filesystem::exists(file, error);
    if (std::filesystem::is_directory(file, error) || access((there ? file : folder).c_str(), W_OK) != 0)
        throw std::runtime_error("cannot write the " + what + " to '" + file.string() +
                                 "': check the folder and its permissions");
}

void makeFolder(const std::filesystem::path& folder, const std::string& what) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!std::filesystem::is_directory(folder, error) || access(folder.c_str(), W_OK) != 0)
        throw std::runtime_error("cannot write the " + what + " to '" + folder.string() +
                                 "': check the folder and its permissions");
}

void writeText(const std::filesystem::path& file, const std::string& what, const std::string& text) {
    std::ofstream out(file, std::ios::binary);
    out << text;
    out.close();
    if (!out)
        throw std::runtime_error("cannot write the " + what + " to '" + file.string() +
                                 "': check the folder, its permissions and free space");
}

void replaceText(const std::filesystem::path& file, const std::string& what, const std::string& text) {
    std::filesystem::path part = file;
    part += "." + std::to_string(getpid()) + ".part";
    writeText(part, what, text);
    std::error_code error;
    std::filesystem::rename(part, file, error);
    if (error) throw std::runtime_error("cannot write the " + what + " to '" + file.string() + "': " + error.message());
}

}  // namespace touchstone::app
