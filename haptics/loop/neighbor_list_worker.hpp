#pragma once
// A second thread that walks the trees ahead of the tool, so that ticks need not.
#include <atomic>
#include <span>
#include <thread>
#include <vector>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {

/// Finds the pair entries of each obstacle for where the tool will be shortly. A tick takes them where they are
/// complete for its pose and margin and finds its own where they are not, so the thread changes times and no result.
/// All functions but the constructor and destructor are for the one thread that ticks; they are wait-free.
class NeighborListWorker {
  public:
    /// Starts the thread. `world` must outlive it. Throws std::system_error when no thread can be made.
    explicit NeighborListWorker(const World& world);
    ~NeighborListWorker();
    NeighborListWorker(const NeighborListWorker&) = delete;
    NeighborListWorker& operator=(const NeighborListWorker&) = delete;

    struct Request {
        double tickMs = 1;
        Within within;                ///< what the tick asked for; negative margin: nothing is near, nothing is wanted
        double trust = 0, slack = 0;  ///< mm, of the settings
    };
    /// To be called after every tick, with where the graphic tool and the obstacles are then.
    void request(const Request& request, const Pose& X_WT, std::span<const Pose> X_WO) noexcept;

    /// The newest entries by obstacle, at first complete for nothing; valid until the next call.
    std::span<const PairEntries* const> newest() noexcept;
    /// Processor time of the thread since the last call, µs.
    double takeCpuUs() noexcept { return cpuUs_.exchange(0, std::memory_order_relaxed); }

  private:
    struct Part {
        Part(const SphereTree& tool, const Obstacle& obstacle)
            : extent(tool), finder(tool, *obstacle.tree), entries(PairEntries(tool, *obstacle.tree)) {}

        LeafExtent extent;
        PairFinder finder;                  // the keeper's thread's
        TripleBuffer<PairEntries> entries;  // from it to the tick
        Coverage published;                 // of the last
        Pose behind;                        // follows the tool as if on a string as long as the slack
        double findMs = 0;                  // what finding them took
    };

    struct Message {
        Request asked;
        std::vector<Pose> X_OT, X_OT_before;  ///< by obstacle; before: one tick earlier
    };

    void run(const std::stop_token& stop);
    void serve(const Message& message);

    std::vector<std::unique_ptr<Part>> parts_;
    std::vector<const PairEntries*> newest_;
    std::vector<Pose> X_OT_;  // the last that was told
    TripleBuffer<Message> messages_;
    std::atomic<double> cpuUs_ = 0;
    std::jthread thread_;  // last: joined before anything it uses goes
};

}  // namespace touchstone
