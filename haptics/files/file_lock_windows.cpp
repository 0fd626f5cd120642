// FileLock where there are no POSIX files: the core for Windows.
#include <windows.h>

#include <system_error>
#include <utility>

#include "haptics/files/file_lock.hpp"

namespace touchstone {

FileLock::FileLock(std::filesystem::path file) : file_(std::move(file)) {
    std::error_code error;
    std::filesystem::create_directories(file_.parent_path(), error);
}

FileLock::~FileLock() {
    if (held_) CloseHandle(reinterpret_cast<HANDLE>(handle_));  // removes the file
}

bool FileLock::tryLock() {
    const HANDLE file = CreateFileW(file_.c_str(), GENERIC_WRITE, 0, nullptr, OPEN_ALWAYS,
                                    FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE, nullptr);
    held_ = file != INVALID_HANDLE_VALUE;
    handle_ = reinterpret_cast<std::intptr_t>(file);
    return held_ || GetLastError() != ERROR_SHARING_VIOLATION;
}

}  // namespace touchstone
