#pragma once
// The report of a run, headless or in a window.
#include <filesystem>
#include <memory>
#include <optional>
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

/// Collects the ticks of a session in a window since its scene was opened or restarted. The table gets all ticks.
class LiveReport {
  public:
    /// `table` may be null.
    explicit LiveReport(TickTable* table) : table_(table) {}
    void add(const TickRecord& record, const sandbox::LiveSession& session);
    /// Adds the cost of one frame of the window.
    void addFrame(const sandbox::FrameCost& cost);
    sandbox::Report finish(const sandbox::LiveSession& session) const;

  private:
    TickTable* table_;
    sandbox::RunStatistics statistics_;
    std::unique_ptr<sandbox::OutcomeJudge> judge_;
    std::shared_ptr<const World> world_;  // the world that meter_ measures
    std::optional<PenetrationMeter> meter_;
    std::uint64_t scene_ = 0, last_ = 0;
    std::vector<double> frameMs_, drawCalls_;
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
