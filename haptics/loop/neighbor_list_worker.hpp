#pragma once
// The list worker: a thread that finds near pairs along the predicted motion, which saves the ticks this work.
#include <atomic>
#include <span>
#include <thread>
#include <vector>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {

/// Finds the pair entries of each obstacle for the poses that the tool will reach soon. A tick uses them if they are
/// complete for its pose and margin and searches itself otherwise, so the thread changes times and never a result. All
/// functions except constructor and destructor are for the thread of the ticks; they are wait-free.
class NeighborListWorker {
  public:
    /// Starts the thread. `world` must outlive it. Throws std::system_error if no thread can be created.
    explicit NeighborListWorker(const World& world);
    ~NeighborListWorker();
    NeighborListWorker(const NeighborListWorker&) = delete;
    NeighborListWorker& operator=(const NeighborListWorker&) = delete;

    struct Request {
        double tickMs = 1;            ///< tick period
        Within within;                ///< the pairs that the tick asked for; a negative margin: none, so none are found
        double trust = 0, slack = 0;  ///< mm, of the settings
        Geometry geometry = Geometry::Spheres;
    };
    /// Call it after every tick with the poses of the graphic tool and the obstacles.
    void request(const Request& request, const Pose& X_WT, std::span<const Pose> X_WO) noexcept;

    /// The newest entries by obstacle, at first complete for no coverage; valid until the next call.
    std::span<const PairEntries* const> newest() noexcept;
    /// Processor time of the thread since the last call, µs.
    double takeCpuUs() noexcept { return cpuUs_.exchange(0, std::memory_order_relaxed); }

  private:
    struct Part {
        Part(std::unique_ptr<PairFinder> leaves_, std::unique_ptr<PairFinder> features_)
            : leaves(std::move(leaves_)), features(std::move(features_)), entries(memory()) {}
        PairEntries memory() const;

        std::unique_ptr<PairFinder> leaves, features;  // used by the worker's thread; null: the parts have none
        TripleBuffer<PairEntries> entries;             // from that thread to the tick
        Coverage published;                            // of the newest entries
        int found = 0;                                 // their number
        double slack = 0;                              // by which they exceed what was asked, mm
        PairFinder* publisher = nullptr;               // their finder
        Pose trailing;      // follows the tool at a distance of the slack, as if pulled by a string
        double findMs = 0;  // duration of the last search
    };

    struct Message {
        Request request;
        std::vector<Pose> X_OT, X_OT_before;  ///< by obstacle; before: one tick earlier
    };

    void run(const std::stop_token& stop);
    void serve(const Message& message);

    const World& world_;
    std::vector<std::unique_ptr<Part>> parts_;
    std::vector<const PairEntries*> newest_;
    std::vector<Pose> X_OT_;  // of the last request
    TripleBuffer<Message> messages_;
    std::atomic<double> cpuUs_ = 0;
    std::jthread thread_;  // last member: it is joined before what it uses is destroyed
};

}  // namespace touchstone
