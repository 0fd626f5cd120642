#include "tools/touchstone/console.hpp"

#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "engine/scene/folders.hpp"
#include "engine/scene/scene.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "haptics/sandbox/session/presets.hpp"

namespace touchstone::app {
namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// A line of a terminal that is overwritten, and cleared at the end, so that later output begins on an empty line.
class BarLine {
  public:
    BarLine() = default;
    ~BarLine() {
        if (percent_ >= 0) std::fputs("\r\033[K", stderr);
    }
    BarLine(const BarLine&) = delete;
    BarLine& operator=(const BarLine&) = delete;

    bool terminal() const { return terminal_; }
    void draw(double fraction, const std::string& text) {
        const int percent = static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0));
        if (text == text_ && percent == percent_) return;
        constexpr int kWidth = 30;
        const int filled = kWidth * percent / 100;
        std::fprintf(stderr, "\r\033[K[%s%s] %3d %%  %s", std::string(filled, '#').c_str(),
                     std::string(kWidth - filled, '.').c_str(), percent, text.c_str());
        text_ = text;
        percent_ = percent;
    }

  private:
    const bool terminal_ = isatty(STDERR_FILENO) != 0;
    std::string text_;
    int percent_ = -1;
};

class ProgressBar {
  public:
    explicit ProgressBar(std::string doing) : doing_(std::move(doing)) {}

    void show(const sandbox::SceneStatus& status) {
        if (secondsSince(start_) < 0.5) return;
        std::string text = doing_ + " " + status.part;
        if (status.of > 1) text += " (" + std::to_string(status.number) + " of " + std::to_string(status.of) + ")";
        if (!line_.terminal()) {
            if (text != text_) spdlog::info("{}", text);
            text_ = text;
            return;
        }
        if (const std::string left = sandbox::timeLeft(status.secondsLeft); !left.empty()) text += ", " + left;
        line_.draw(status.fraction, text);
    }

  private:
    const std::string doing_;
    const StopRequest stop_;
    const Clock::time_point start_ = Clock::now();
    BarLine line_;
    std::string text_;
};

/// The progress of a run. A terminal's line changes five times a second; elsewhere each line comes after twice the time
/// of the last.
class RunBar {
  public:
    void show(double done, const std::optional<double>& whole) {
        constexpr double kFirst = 2, kFirstLine = 3, kRedraw = 0.2;  // s
        const double elapsed = secondsSince(start_);
        if (next_ == 0) next_ = line_.terminal() ? kFirst : kFirstLine;
        if (elapsed < next_) return;
        next_ = line_.terminal() ? elapsed + kRedraw : 2 * elapsed;
        const double fraction = whole ? std::clamp(done / *whole, 0.0, 1.0) : 0;
        char text[80];
        if (whole)
            std::snprintf(text, sizeof text, "%.1f of %.1f s of the motion", done, *whole);
        else
            std::snprintf(text, sizeof text, "%.1f s of the motion", done);
        const double left = fraction > 0 ? elapsed * (1 - fraction) / fraction : -1;
        std::string line = text;
        if (const std::string words = sandbox::timeLeft(left); !words.empty()) line += ", " + words;
        if (line_.terminal())
            line_.draw(fraction, line);
        else if (!whole || left > kFirst)
            spdlog::info("{}", line);
    }

  private:
    const Clock::time_point start_ = Clock::now();
    double next_ = 0;  // s
    BarLine line_;
};

}  // namespace

sandbox::SceneProgress progressBar(const std::string& doing) {
    return [bar = std::make_shared<ProgressBar>(doing)](const sandbox::SceneStatus& status) {
        bar->show(status);
        return StopRequest::signal() == 0;
    };
}

std::function<void(double, const std::optional<double>&)> runProgress() {
    return
        [bar = std::make_shared<RunBar>()](double done, const std::optional<double>& whole) { bar->show(done, whole); };
}

void sayOnConsole(sandbox::Message::Kind kind, const std::string& text) {
    if (kind == sandbox::Message::Kind::Note)
        spdlog::info("{}", engine::escaped(text));
    else
        spdlog::warn("{}", engine::escaped(text));
}

std::string programAsTyped() {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::path program = engine::programFolder() / "touchstone";
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');)
        if (const fs::path found = fs::path(folder) / "touchstone"; fs::exists(found, error)) {
            if (fs::equivalent(found, program, error)) return "touchstone";
            break;  // the shell would start another program
        }
    const fs::path relative = fs::proximate(program, error);
    if (error || relative.empty() || *relative.begin() == "..") return sandbox::shellQuoted(program.string());
    return sandbox::shellQuoted((relative.has_parent_path() ? relative : "." / relative).string());
}

std::string wrapped(const std::string& text, std::size_t indent) {
    constexpr std::size_t kLeast = 40;  // characters: a narrower column is harder to read than a line that is cut
    winsize size{};
    std::size_t columns = 0;
    if (const char* given = std::getenv("COLUMNS"))
        columns = static_cast<std::size_t>(std::max(0, std::atoi(given)));
    else if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0)
        columns = size.ws_col;
    if (columns < indent + kLeast) return text;
    std::string out;
    std::size_t used = 0;
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        const auto length = static_cast<std::size_t>(
            std::count_if(word.begin(), word.end(), [](char c) { return (c & 0xC0) != 0x80; }));  // of UTF-8
        if (used > 0 && indent + used + 1 + length > columns) {
            out += '\n' + std::string(indent, ' ');
            used = 0;
        } else if (used > 0) {
            out += ' ';
            ++used;
        }
        out += word;
        used += length;
    }
    return out;
}

void requireDisplay() {
    const auto given = [](const char* variable) {
        const char* value = std::getenv(variable);
        return value && *value;
    };
    if (!given("DISPLAY") && !given("WAYLAND_DISPLAY"))
        throw std::runtime_error(
            "there is no display for a window: add --headless to run without one, or start the program on a desktop, "
            "over 'ssh -X' or under 'xvfb-run'");
}

void requireWritable(const std::filesystem::path& file, const std::string& what) {
    std::error_code error;
    // Only regular files are opened: opening a pipe would wait for its reader.
    if (std::filesystem::is_regular_file(file, error) || std::filesystem::is_directory(file, error) ||
        !std::filesystem::exists(file, error))
        const OutputFile written(file, what);
}

void makeFolder(const std::filesystem::path& folder, const std::string& what) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (!error && access(folder.c_str(), W_OK) != 0) error.assign(errno, std::generic_category());
    if (error) throw std::runtime_error("cannot write " + what + " to '" + folder.string() + "': " + error.message());
}

}  // namespace touchstone::app
