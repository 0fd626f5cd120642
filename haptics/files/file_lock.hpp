#pragma once
// One process at a time.
#include <cstdint>
#include <filesystem>

namespace touchstone {

/// Lets one holder at a time, of all processes and threads, do what a file stands for. The system releases it when the
/// holder's process ends. Where the file cannot be made or locked, everyone holds it.
class FileLock {
  public:
    /// Makes `file`, which holds nothing and is removed after use, and the folders that it needs.
    explicit FileLock(std::filesystem::path file);
    ~FileLock();
    FileLock(const FileLock&) = delete;
    FileLock& operator=(const FileLock&) = delete;

    bool tryLock();  ///< false while another holds it

  private:
    std::filesystem::path file_;
    std::intptr_t handle_ = -1;
    bool held_ = false;
};

}  // namespace touchstone
