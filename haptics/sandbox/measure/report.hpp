#pragma once
// The report of a run: its times, forces, errors and checks in numbers.
#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "haptics/loop/settings.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/scene/outcome.hpp"
#include "haptics/sandbox/scene/role.hpp"

namespace touchstone::sandbox {

/// What --report writes. Times are thread CPU time in µs; force, torque and shadow error are those of step(), before
/// the safety stage. Residuals are the worst of the run. Percentiles without values are null in JSON.
struct Report {
    std::string scene, mode, solver, shadow;
    std::string frictionSolver, frictionShadow;  ///< of ticks with friction
    std::string device;
    double rate = 0;  ///< Hz
    std::uint64_t ticks = 0;
    Percentiles stepUs, collisionUs, solveUs, shadowUs, listWorkerUs;  ///< stepUs: without the shadow solver
    Percentiles pairs, rows, iterations;
    std::int64_t rowsTruncated = 0;              ///< sum over the run
    Percentiles penetration, hover, marginUsed;  ///< mm
    double force = 0, torque = 0, forceOut = 0;  ///< greatest: N, mN·m, N
    Percentiles forceChange;                     ///< N/ms
    Percentiles shadowForceError;                ///< N, over feasible ticks of more than kContactForce
    KktResiduals kkt;
    double stepCpuMs = 0;           ///< of all ticks together, processor time
    std::uint64_t unfinished = 0;   ///< ticks that left the tool short of its place, for the next one to go on
    std::uint64_t tooLong = 0;      ///< ticks whose step took longer than their period, in processor time
    std::uint64_t infeasible = 0;   ///< ticks
    std::uint64_t byProcessor = 0;  ///< ticks with kByProcessor
    /// Counts over ticks with friction; all 0 without.
    struct FrictionReport {
        std::uint64_t sticking = 0, sliding = 0;  ///< ticks in which a contact stuck, slid
        std::uint64_t soft = 0, held = 0;         ///< ticks with kFrictionSoft, kFrictionHeld
        std::array<std::uint64_t, 3> stages{};    ///< ticks by TickRecord::frictionStage, from 1
        std::uint64_t replaced = 0;               ///< ticks that the exact solver took over from a baseline
        double slip = 0, force = 0;               ///< greatest slip in a tick, mm, and friction force, N
        CoulombResiduals coulomb;                 ///< the worst; dissipation_mJ is the sum
    };
    FrictionReport friction;
    std::uint64_t overlapping = 0;          ///< ticks in which the tool passed through an obstacle that it began in
    std::uint64_t badInput = 0;             ///< ticks with an invalid device pose, which hold the tool
    std::optional<std::uint64_t> overruns;  ///< late ticks; absent if no clock paces the run
    Percentiles frameCpuMs, drawCalls;      ///< of the window's frames, on its thread; absent in headless runs
    std::uint64_t dropped = 0;
    std::uint64_t hash = 0;
    std::string ended;                   ///< why a headless run ended, see RunEnd; empty for a window
    double pastGoal = 0;                 ///< mm by which the tool fell past its goal without contact; 0: it did not
    std::string stuck;                   ///< stuckSentence() at the end of a headless run
    std::uint64_t safetyTrips = 0;       ///< how often a safety guard began to act, all guards together
    std::vector<std::string> bySpheres;  ///< one sentence for each part that is touched by its spheres, not its mesh
    std::vector<std::string> repairs;    ///< one sentence for each part whose mesh was repaired
    std::string safetyFault;             ///< the guard that switched the force off for good; empty if none did
    std::string deviceTrouble;           ///< troubleOf() the device at the end
    std::optional<Pose> toolPose;        ///< of its node at the end, mm
    std::optional<FileFrame> toolFile;   ///< of the tool, where its file is known
    std::string gauge;                   ///< name of the scene's gauge; empty without one
    GaugeReading depth;                  ///< readings of the gauge
    std::vector<OutcomeCheck> checks;    ///< of the expected outcome; without checks it is met
    std::size_t checksLeft = 0;          ///< of the end of the demonstration, which the run did not reach
    std::vector<std::pair<std::string, std::string>> settings;  ///< every key of settingTable() and its value

    bool met() const;
};

/// A report with everything that is known before the run.
Report reportOf(std::string scene, std::string device, const Settings& settings);

nlohmann::ordered_json toJson(const Report& report);

/// Collects what a report needs, tick by tick. Uses about 100 bytes of memory per tick.
class RunStatistics {
  public:
    explicit RunStatistics(std::optional<Gauge> gauge = {}) : gauge_(std::move(gauge)) {}
    /// `penetration`: of the true gaps at the tool pose, mm; `dt`: length of the tick, ms.
    void add(const TickRecord& record, double penetration, double dt);
    /// Adds the times of the same tick; the time of the shadow solver is subtracted from the total.
    void addTimes(const TickRecord& record);
    /// Fills in everything that was measured.
    void write(Report& report) const;
    std::uint64_t hash() const { return hash_; }

  private:
    std::vector<double> stepUs_, collisionUs_, solveUs_, shadowUs_, listWorkerUs_;
    std::vector<double> pairs_, rows_, iterations_, penetration_, hover_, margin_, forceChange_, shadowError_;
    std::optional<Gauge> gauge_;
    std::optional<Pose> toolPose_;
    GaugeReading depth_;
    std::int64_t truncated_ = 0;
    double force_ = 0, torque_ = 0, forceOut_ = 0;
    KktResiduals kkt_;
    std::uint64_t unfinished_ = 0, infeasible_ = 0, byProcessor_ = 0, badInput_ = 0, overlapping_ = 0;
    Report::FrictionReport friction_;
    std::uint64_t hash_ = 0;
    Vec3 lastForce_ = Vec3::Zero();
};

}  // namespace touchstone::sandbox
