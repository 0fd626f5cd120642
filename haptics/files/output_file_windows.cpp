// OutputFile where there are no POSIX files: the core for Windows.
#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "haptics/files/output_file.hpp"

namespace touchstone {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBuffer = std::size_t{1} << 20;  // bytes that are collected before a system call

}  // namespace

OutputFile::OutputFile(fs::path file, std::string what)
    : file_(std::move(file)), target_(file_), what_(std::move(what)) {
    static std::atomic<unsigned> serial{0};
    std::error_code error;
    if (fs::is_symlink(file_, error)) target_ = fs::weakly_canonical(file_, error);
    int flags = _O_WRONLY | _O_BINARY | _O_NOINHERIT;
    if (!fs::exists(target_, error) || fs::is_regular_file(target_, error)) {
        part_ = target_;
        part_ += "." + std::to_string(_getpid()) + "." + std::to_string(serial++) + ".part";
        flags |= _O_CREAT | _O_EXCL;
    }
    handle_ = _wopen((part_.empty() ? target_ : part_).c_str(), flags, _S_IREAD | _S_IWRITE);
    if (handle_ < 0) fail();
}

OutputFile::~OutputFile() {
    if (handle_ >= 0) _close(handle_);
    std::error_code error;
    if (!part_.empty()) fs::remove(part_, error);
}

void OutputFile::fail() const {
    throw std::runtime_error("cannot write " + what_ + " to '" + file_.string() +
                             "': " + std::generic_category().message(errno) +
                             "; check the folder, its permissions and the free space");
}

void OutputFile::write(std::string_view bytes) {
    buffer_ += bytes;
    if (buffer_.size() >= kBuffer) flush();
}

void OutputFile::flush() {
    for (std::string_view left = buffer_; !left.empty();) {
        const int n = _write(handle_, left.data(), static_cast<unsigned>(std::min(left.size(), kBuffer)));
        if (n < 0) fail();
        left.remove_prefix(static_cast<std::size_t>(n));
    }
    buffer_.clear();
}

void OutputFile::close() {
    flush();
    if (_close(std::exchange(handle_, -1)) != 0) fail();
    if (part_.empty()) return;
    std::error_code error;
    fs::rename(part_, target_, error);  // which replaces an existing file
    if (error) {
        errno = error.default_error_condition().value();
        fail();
    }
    part_.clear();
}

void writeFile(const fs::path& file, const std::string& what, std::string_view bytes) {
    OutputFile out(file, what);
    out.write(bytes);
    out.close();
}

}  // namespace touchstone
