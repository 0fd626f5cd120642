#pragma once
// What a run amounts to, in numbers.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/sandbox/scene/outcome.hpp"

namespace touchstone::sandbox {

/// Nearest rank: the least of the values that at least `percent` of them do not exceed; nothing of no values. O(n),
/// reorders `values`. Pre: 0 < percent <= 100; no NaN.
std::optional<double> percentile(std::vector<double>& values, double percent);

/// Absent without a single value, and null in JSON.
struct Percentiles {
    std::optional<double> p50, p99, p999, max;
};
Percentiles percentiles(std::vector<double> values);

/// What --report writes. Times are thread CPU time in µs; force, torque and shadow error are those of step(), before
/// the safety stage. Residuals are the worst of the run.
struct Report {
    std::string scene, mode, solver, shadow;
    std::string device;
    double rate = 0;  ///< Hz
    std::uint64_t ticks = 0;
    Percentiles stepUs, collisionUs, solveUs, shadowUs, helperUs;  ///< step without the shadow
    Percentiles pairs, rows, iterations;
    std::int64_t rowsTruncated = 0;              ///< sum over the run
    Percentiles penetration, hover, marginUsed;  ///< mm
    double force = 0, torque = 0, forceOut = 0;  ///< greatest: N, mN·m, N
    Percentiles forceChange;                     ///< N/ms
    Percentiles shadowForceError;                ///< N, over feasible ticks of more than kContactForce
    KktResiduals kkt;
    std::uint64_t infeasible = 0;           ///< ticks
    std::uint64_t badInput = 0;             ///< ticks with an invalid pose, in which the tool was held
    std::optional<std::uint64_t> overruns;  ///< null where no clock paces
    Percentiles frameCpuMs, drawCalls;      ///< of the window's frames, on its thread; absent when headless
    std::uint64_t dropped = 0;
    std::uint64_t hash = 0;
    std::string ended;                 ///< what ended a headless run, see RunEnd; empty for a window's
    double pastGoal = 0;               ///< mm that the tool fell past its goal without touching anything; 0: it did not
    std::uint64_t safetyTrips = 0;     ///< beginnings, of all guards
    std::string safetyFault;           ///< the trip that took the force away for good; empty without
    std::string gauge;                 ///< name of the scene's gauge; empty without one
    GaugeReading depth;                ///< what it showed
    std::vector<OutcomeCheck> checks;  ///< of the outcome; none: met
    nlohmann::ordered_json settings;   ///< every key of settingTable() with its value as text

    bool met() const;
};

/// A report with all that is known beforehand.
Report reportOf(std::string scene, std::string device, const Settings& settings);

nlohmann::ordered_json toJson(const Report& report);

/// Sixteen digits, as hashes are written.
std::string hexadecimal(std::uint64_t value);

/// Collects what a report needs, tick by tick. Memory grows by about 100 bytes a tick.
class RunStatistics {
  public:
    explicit RunStatistics(std::optional<Gauge> gauge = {}) : gauge_(std::move(gauge)) {}
    /// `penetration`: of the true gaps at the tool's pose, mm; `dt`: length of the tick, ms.
    void add(const TickRecord& record, double penetration, double dt);
    /// Times of the same tick; the shadow's is taken off the total.
    void addTimes(const TickRecord& record);
    /// Fills in all that was measured.
    void write(Report& report) const;
    std::uint64_t hash() const { return hash_; }

  private:
    std::vector<double> stepUs_, collisionUs_, solveUs_, shadowUs_, helperUs_;
    std::vector<double> pairs_, rows_, iterations_, penetration_, hover_, margin_, forceChange_, shadowError_;
    std::optional<Gauge> gauge_;
    GaugeReading depth_;
    std::int64_t truncated_ = 0;
    double force_ = 0, torque_ = 0, forceOut_ = 0;
    KktResiduals kkt_;
    std::uint64_t infeasible_ = 0, badInput_ = 0;
    std::uint64_t hash_ = 0;
    Vec3 lastForce_ = Vec3::Zero();
};

}  // namespace touchstone::sandbox
