#include "haptics/files/file_lock.hpp"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <optional>

#include "tests/support/temp_folder.hpp"

namespace touchstone::file_lock_tests {

TEST_CASE("file lock: one holds it, and its file is gone afterwards", "[files]") {
    const test::TempFolder folder;
    const auto file = folder.path() / "new" / "lock";
    std::optional<FileLock> first(file);
    FileLock second(file);
    CHECK(first->tryLock());
    CHECK_FALSE(second.tryLock());
    first.reset();
    CHECK(second.tryLock());
    CHECK(FileLock(folder.path() / "another").tryLock());
    CHECK_FALSE(std::filesystem::exists(file));
}

TEST_CASE("file lock: a process that is killed holds nothing any more", "[files]") {
    const test::TempFolder folder;
    int ready[2];
    REQUIRE(pipe(ready) == 0);
    const pid_t other = fork();
    if (other == 0) {
        FileLock lock(folder.path() / "lock");
        const char locked = lock.tryLock() ? 1 : 0;
        if (write(ready[1], &locked, 1) == 1) pause();
        _exit(1);
    }
    char locked = 0;
    CHECK(read(ready[0], &locked, 1) == 1);
    CHECK(locked == 1);
    FileLock lock(folder.path() / "lock");
    CHECK_FALSE(lock.tryLock());
    kill(other, SIGKILL);
    waitpid(other, nullptr, 0);
    CHECK(lock.tryLock());
    close(ready[0]);
    close(ready[1]);
}

TEST_CASE("file lock: where no file can be made, everyone holds it", "[files]") {
    CHECK(FileLock("/dev/null/lock").tryLock());
    CHECK(FileLock("/proc/lock").tryLock());
}

}  // namespace touchstone::file_lock_tests
