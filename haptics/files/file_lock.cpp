#include "haptics/files/file_lock.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace touchstone {

FileLock::FileLock(std::filesystem::path file) : file_(std::move(file)) {
    std::error_code error;
    std::filesystem::create_directories(file_.parent_path(), error);
    handle_ = open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
}

FileLock::~FileLock() {
    if (handle_ < 0) return;
    std::error_code error;
    if (held_) std::filesystem::remove(file_, error);
    close(static_cast<int>(handle_));
}

bool FileLock::tryLock() {
    return held_ = handle_ < 0 || flock(static_cast<int>(handle_), LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

}  // namespace touchstone
