#pragma once
// The report of a run, on paper and while a window is open.
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "haptics/sandbox/measure/report.hpp"
#include "haptics/sandbox/panels/status_bar.hpp"
#include "haptics/sandbox/session/session.hpp"
#include "tools/touchstone/tick_table.hpp"

namespace touchstone::app {

/// A page for people on the output stream.
void printReport(const sandbox::Report& report);

/// JSON. Throws std::runtime_error when the file cannot be written.
void writeReport(const sandbox::Report& report, const std::filesystem::path& file);

/// Collects the ticks of a window's session since its scene was opened or restarted, and writes all of them to a table.
class LiveReport {
  public:
    /// `table`: null for none.
    explicit LiveReport(TickTable* table) : table_(table) {}
    void add(const TickRecord& record, const sandbox::LiveSession& session);
    /// What a frame of the window cost.
    void addFrame(const sandbox::FrameCost& cost);
    sandbox::Report finish(const sandbox::LiveSession& session) const;

  private:
    TickTable* table_;
    sandbox::RunStatistics statistics_;
    std::unique_ptr<sandbox::OutcomeJudge> judge_;
    std::shared_ptr<const World> world_;  // that the meter is of
    std::optional<PenetrationMeter> meter_;
    std::uint64_t scene_ = 0, last_ = 0;
    std::vector<double> frameMs_, drawCalls_;
};

/// What a window costs, and what the loop does under it.
class WindowLoad {
  public:
    void add(const TickRecord& record);
    /// To be called once a frame, on the window's thread.
    void frame(const sandbox::LiveSession& session, const sandbox::FrameCost& cost);
    /// Frames and ticks since the scene ran, on the output stream.
    void print() const;

  private:
    std::vector<double> stepUs_, tickUs_, periodUs_, cpuMs_, drawingMs_, restMs_, frameMs_, drawCalls_;
    std::uint64_t clock_ = 0;  // ns, at the last frame; 0 before a scene ran
    std::uint64_t overruns_ = 0, overrunsBefore_ = 0, dropped_ = 0;
};

}  // namespace touchstone::app
