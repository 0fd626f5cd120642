#include "tools/touchstone/console.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <stdexcept>

namespace touchstone::app {
namespace {

/// Draws over its own line; whatever is printed next begins on a clean one.
class Bar {
  public:
    ~Bar() { clear(); }

    void show(const std::string& part, double fraction) {
        if (std::chrono::steady_clock::now() - start_ < std::chrono::milliseconds(500)) return;
        const int percent = static_cast<int>(100 * std::clamp(fraction, 0.0, 1.0));
        if (!terminal_) {
            if (part != part_) spdlog::info("building the sphere tree of {}", part);
        } else if (part != part_ || percent != percent_) {
            constexpr int kWidth = 30;
            const int filled = kWidth * percent / 100;
            std::fprintf(stderr, "\r\033[Ksphere trees [%s%s] %3d %%  %s", std::string(filled, '#').c_str(),
                         std::string(kWidth - filled, '.').c_str(), percent, part.c_str());
        }
        part_ = part;
        percent_ = percent;
    }

  private:
    void clear() const {
        if (terminal_ && percent_ >= 0) std::fputs("\r\033[K", stderr);
    }

    const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
    const bool terminal_ = isatty(STDERR_FILENO) != 0;
    std::string part_;
    int percent_ = -1;
};

}  // namespace

system::SceneProgress progressBar() {
    return [bar = std::make_shared<Bar>()](const std::string& part, double fraction) {
        bar->show(part, fraction);
        return true;
    };
}

void requireWritable(const std::filesystem::path& file, const std::string& what) {
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    std::error_code error;
    const bool there = std::filesystem::exists(file, error);
    if (std::filesystem::is_directory(file, error) || access((there ? file : folder).c_str(), W_OK) != 0)
        throw std::runtime_error("cannot write the " + what + " to '" + file.string() +
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

}  // namespace touchstone::app
