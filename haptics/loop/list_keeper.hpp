#pragma once
// A second thread that walks the trees ahead of the tool, so that ticks need not.
#include <atomic>
#include <span>
#include <thread>
#include <vector>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/loop/triple_buffer.hpp"
#include "haptics/loop/world.hpp"

namespace touchstone {

/// Finds the pair entries of each obstacle for where the tool will be shortly. A tick takes them where they are
/// complete for its pose and margin and finds its own where they are not, so the thread changes times and no result.
/// All functions but the constructor and destructor are for the one thread that ticks; they are wait-free.
class ListKeeper {
  public:
    /// Starts the thread. `world` must outlive it. Throws std::system_error when no thread can be made.
    explicit ListKeeper(const World& world);
    ~ListKeeper();
    ListKeeper(const ListKeeper&) = delete;
    ListKeeper& operator=(const ListKeeper&) = delete;

    struct Request {
        Pose X_WT;         ///< the graphic tool after the tick
        Pose X_WT_before;  ///< and one tick earlier
        double tickMs = 1;
        double margin = -1;  ///< mm, that ticks ask for; negative: nothing is near, nothing is wanted
        double slack = 0;    ///< mm, of the settings
    };
    void request(const Request& request) noexcept { requests_.write(request); }

    /// The newest entries by obstacle, at first complete for nothing; valid until the next call.
    std::span<const PairEntries* const> newest() noexcept;
    /// Processor time of the thread since the last call, µs.
    double takeCpuUs() noexcept { return cpuUs_.exchange(0, std::memory_order_relaxed); }

  private:
    struct Part {
        Part(const SphereTree& tool, const Obstacle& obstacle)
            : X_OW(obstacle.X_WO.inverse()),
              center(tool.center()),
              reach(tool.reach()),
              finder(tool, *obstacle.tree),
              entries(PairEntries(tool, *obstacle.tree)) {}

        Pose X_OW;
        Vec3 center;
        double reach;
        PairFinder finder;                  // the keeper's thread's
        TripleBuffer<PairEntries> entries;  // from it to the tick
        Course course;                      // of what it published last
        double margin = -1;
        double findMs = 0;  ///< what finding them took
    };

    void run(const std::stop_token& stop);
    void serve(const Request& request);

    std::vector<std::unique_ptr<Part>> parts_;
    std::vector<const PairEntries*> newest_;
    TripleBuffer<Request> requests_;
    std::atomic<double> cpuUs_ = 0;
    std::jthread thread_;  // last: joined before anything it uses goes
};

}  // namespace touchstone
