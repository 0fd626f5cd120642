#pragma once
// The report of a run, headless or in a window.
#include <condition_variable>
#include <deque>
#include <exception>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "haptics/loop/distances.hpp"
#include "haptics/sandbox/measure/report.hpp"
#include "haptics/sandbox/panels/status_bar.hpp"
#include "haptics/sandbox/session/session.hpp"
#include "tools/touchstone/tick_table.hpp"

namespace touchstone::app {

/// Prints the report on the output stream: what a user asks first, in about three lines, and what is out of the
/// ordinary; `verbose`: all of it.
void printReport(const sandbox::Report& report, bool verbose);

/// Writes the report as JSON. Throws std::runtime_error when the file cannot be written.
void writeReport(const sandbox::Report& report, const std::filesystem::path& file);

/// Collects the ticks of a session in a window since its scene was opened or restarted. The table gets all ticks. A
/// thread of its own measures their penetration, which takes longer than a tick where parts fit closely.
class LiveReport {
  public:
    /// `table` may be null; it must outlive this, and is complete after finishTicks().
    explicit LiveReport(TickTable* table);
    ~LiveReport();
    void add(const TickRecord& record, const sandbox::LiveSession& session);
    /// Adds the cost of one frame of the window.
    void addFrame(const sandbox::FrameCost& cost);
    /// Waits until all ticks are measured, and says so if that takes long. Throws what writing the table threw.
    void finishTicks();
    /// Call after finishTicks().
    sandbox::Report finish(const sandbox::LiveSession& session) const;

  private:
    struct Start;
    struct Tick {
        TickRecord record;
        std::shared_ptr<const Start> start;  // null after the first tick of a run
        std::vector<Pose> X_WO;
        Geometry geometry;
        double rate;    // Hz
        bool measured;  // the record holds the penetration
    };
    void work(const std::stop_token& stop);
    void measure(const Tick& tick);

    TickTable* table_;
    // The thread uses these, and after finishTicks() the caller.
    sandbox::RunStatistics statistics_;
    std::unique_ptr<sandbox::OutcomeJudge> judge_;
    std::shared_ptr<const World> world_;  // the world that meter_ measures
    std::optional<PenetrationMeter> meter_;
    // The window uses these.
    std::uint64_t scene_ = 0, last_ = 0;
    bool began_ = false;
    std::vector<double> frameMs_, drawCalls_;

    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::deque<Tick> waiting_;  // the first one is being measured
    std::exception_ptr failure_;
    std::jthread worker_;
};

/// The load of a window: the cost of its frames and the times of the loop while it is open.
class WindowLoad {
  public:
    void add(const TickRecord& record);
    /// Call once per frame, on the window's thread.
    void frame(const sandbox::LiveSession& session, const sandbox::FrameCost& cost);
    /// Prints the frames and ticks since the scene started on the output stream.
    void print() const;

  private:
    std::vector<double> stepUs_, tickUs_, periodUs_, cpuMs_, drawingMs_, restMs_, frameMs_, drawCalls_;
    std::uint64_t clock_ = 0;  // ns, time of the last frame; 0 before a scene runs
    std::uint64_t overruns_ = 0, overrunsBefore_ = 0, dropped_ = 0;
};

}  // namespace touchstone::app
