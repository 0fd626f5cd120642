#include "haptics/files/output_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

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
    struct stat status {};
    const bool exists = ::stat(target_.c_str(), &status) == 0;
    int flags = O_WRONLY | O_CLOEXEC;
    if (!exists || S_ISREG(status.st_mode)) {
        part_ = target_;
        part_ += "." + std::to_string(::getpid()) + "." + std::to_string(serial++) + ".part";
        flags |= O_CREAT | O_EXCL;
    }
    handle_ = ::open((part_.empty() ? target_ : part_).c_str(), flags, 0666);
    if (handle_ < 0) fail();
    if (exists && !part_.empty() && ::fchmod(handle_, status.st_mode & 07777) != 0) {
        // Some file systems have no modes. The file is still usable, so this is not an error.
    }
}

OutputFile::~OutputFile() {
    if (handle_ >= 0) ::close(handle_);
    if (!part_.empty()) ::unlink(part_.c_str());
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
        const ssize_t n = ::write(handle_, left.data(), left.size());
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) fail();
        left.remove_prefix(static_cast<std::size_t>(n));
    }
    buffer_.clear();
}

void OutputFile::close() {
    flush();
    if (::close(std::exchange(handle_, -1)) != 0) fail();
    if (part_.empty()) return;
    if (::rename(part_.c_str(), target_.c_str()) != 0) fail();
    part_.clear();
}

void writeFile(const fs::path& file, const std::string& what, std::string_view bytes) {
    OutputFile out(file, what);
    out.write(bytes);
    out.close();
}

}  // namespace touchstone
