#pragma once
// Runs work in blocks on a few threads, with a heartbeat on the calling thread.
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace touchstone {

/// Called regularly by long loops, always on the thread that started the work. It may throw to end the work.
using Heartbeat = std::function<void()>;

/// Distributes blocks of work over threads. Each block writes to a separate place, so results depend on the blocks and
/// never on the number of threads.
class Workers {
  public:
    explicit Workers(int threads = 1, Heartbeat heartbeat = {})
        : threads_(std::max(1, threads)), heartbeat_(std::move(heartbeat)) {}

    void beat() const {
        if (heartbeat_) heartbeat_();
    }

    /// Calls work(block) for each block from 0 to `blocks` - 1, in any order, and returns when all are done. The first
    /// exception, from the work or the heartbeat, stops the remaining blocks and is rethrown here.
    template <class Work>
    void each(std::size_t blocks, Work&& work) const {
        std::atomic<std::size_t> next{0};
        std::exception_ptr failure;
        std::mutex failing;
        const auto run = [&](bool caller) {
            try {
                for (std::size_t block = next++; block < blocks; block = next++) {
                    if (caller) beat();
                    work(block);
                }
            } catch (...) {
                const std::lock_guard lock(failing);
                if (!failure) failure = std::current_exception();
                next = blocks;
            }
        };
        {
            std::vector<std::jthread> others;
            for (std::size_t t = 1; t < std::min<std::size_t>(std::size_t(threads_), blocks); ++t)
                others.emplace_back(run, false);
            run(true);
        }
        if (failure) std::rethrow_exception(failure);
    }

    /// Calls work(first, last) for consecutive ranges of at most `grain` items, like each().
    template <class Work>
    void eachRange(std::size_t count, std::size_t grain, Work&& work) const {
        each((count + grain - 1) / grain,
             [&](std::size_t block) { work(block * grain, std::min(count, (block + 1) * grain)); });
    }

  private:
    int threads_;
    Heartbeat heartbeat_;
};

}  // namespace touchstone
