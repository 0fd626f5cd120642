#include "haptics/sandbox/trials/trial.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "haptics/device/device_table.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/tick_driver.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/sandbox/measure/fit_check.hpp"
#include "haptics/sandbox/record/recorder.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/threads/tick_period.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::ordered_json;

/// Bits of all trips that limit the wrench.
std::uint32_t saturation() {
    std::uint32_t bits = 0;
    for (int i = 0; i < kTripCount; ++i)
        if (info(static_cast<Trip>(i)).follows == Follows::Limit) bits |= bit(static_cast<Trip>(i));
    return bits;
}

std::string numberText(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

/// Between the tool and any obstacle, at rest.
double greatestFriction(const World& world, const Settings& settings) {
    double greatest = 0;
    for (std::size_t k = 0; settings.mode == Mode::Default && k < world.obstacles.size(); ++k)
        greatest = std::max(greatest, world.friction(k, settings).atRest);
    return greatest;
}

}  // namespace

void TrialMeasures::add(const TickRecord& tick, double dt) {
    static const std::uint32_t kSaturation = saturation();
    phases_.add(tick, dt);
    const double force = tick.wrench_C.force.norm(), torque = tick.wrench_C.torque.norm();
    force_ = std::max(force_, force);
    torque_ = std::max(torque_, torque);
    impulse_ += force * dt / 1000;
    if (force > kContactForce) {
        ++contactTicks_;
        forceSquares_ += force * force;
        torqueSquares_ += torque * torque;
        rows_ += tick.rows;
        mostRows_ = std::max(mostRows_, tick.rows);
    }
    if (!before_) overrunsBefore_ = tick.overruns;
    if (before_) {
        const Vec6 way = incrementBetween(before_->X_WT, tick.X_WT);
        path_ += way.head<3>().norm();
        rotation_ += way.tail<3>().norm();
    }
    ++ticks_;
    inexactTicks_ += (tick.flags & (kFrictionSoft | kFrictionHeld)) != 0;
    trips_ += static_cast<std::uint64_t>(std::popcount(tick.trips & ~(before_ ? before_->trips : 0)));
    saturatedTicks_ += (tick.trips & kSaturation) != 0;
    lateTicks_ += tick.totalUs > 1000 * dt;
    cpuUs_ += tick.totalUs;
    mostCpuUs_ = std::max(mostCpuUs_, tick.totalUs);
    hash_ = before_ ? hashTick(tick, hash_) : hashTick(tick);
    before_ = tick;
}

void TrialMeasures::write(ordered_json& row, TrialEnd end) const {
    row["outcome"] = name(end);
    row["time_s"] = phases_.elapsed() / 1000;
    for (int phase = 0; phase < kPhaseCount; ++phase)
        row[std::string(name(static_cast<Phase>(phase))) + "_s"] =
            phases_.milliseconds(static_cast<Phase>(phase)) / 1000;
    row["first_contact_s"] =
        phases_.firstContact() ? ordered_json(*phases_.firstContact() / 1000) : ordered_json(nullptr);
    const double contact = std::max<double>(1, static_cast<double>(contactTicks_));
    row["force_peak_N"] = force_;
    row["force_rms_N"] = std::sqrt(forceSquares_ / contact);
    row["torque_peak_mNm"] = torque_;
    row["torque_rms_mNm"] = std::sqrt(torqueSquares_ / contact);
    row["impulse_Ns"] = impulse_;
    row["path_mm"] = path_;
    row["rotation_rad"] = rotation_;
    row["contacts_mean"] = rows_ / contact;
    row["contacts_peak"] = mostRows_;
    row["jams"] = phases_.jams();
    row["saturated_ticks"] = saturatedTicks_;
    row["friction_inexact_ticks"] = inexactTicks_;
    row["ticks"] = ticks_;
    row["hash"] = hexadecimal(hash_);
    row["cpu_mean_us"] = cpuUs_ / std::max<double>(1, static_cast<double>(ticks_));
    row["cpu_max_us"] = mostCpuUs_;
    row["cpu_overrun_ticks"] = lateTicks_;
    // Without a real-time clock there is no deadline.
    row["deadline_misses"] =
        before_ && before_->periodUs > 0 ? ordered_json(before_->overruns - overrunsBefore_) : ordered_json(nullptr);
}

bool isMeasuredTime(const std::string& column) { return column.starts_with("cpu_") || column == "deadline_misses"; }

std::string deviceOf(const Condition& condition, const Trial& trial) {
    const bool seeds = traitsOf(condition.device).takesSeed && condition.device.find(':') == std::string::npos;
    return seeds ? condition.device + ":" + std::to_string(trial.seed) : condition.device;
}

bool movesByItself(const std::string& device) { return moverOf(device) == Mover::Program; }

std::optional<TrialEnd> endOf(const PhaseWatch& phases, const Condition& condition) {
    if (phases.end()) return phases.end();
    if (phases.elapsed() < 1000 * condition.timeLimit) return std::nullopt;
    return phases.jammed() ? TrialEnd::Jam : TrialEnd::TimeLimit;
}

ordered_json trialColumns(const Protocol& protocol, const Trial& trial) {
    return {{"trial", trial.number},
            {"participant", protocol.participants[static_cast<std::size_t>(trial.participant)].name},
            {"order", trial.order},
            {"condition", protocol.conditions[static_cast<std::size_t>(trial.condition)].name},
            {"repetition", trial.repetition},
            {"seed", trial.seed}};
}

ordered_json trialRow(const HapticScene& scene, const Protocol& protocol, const Trial& trial, const Settings& settings,
                      const TrialMeasures& measures, TrialEnd end, const TickRecord& last,
                      const std::filesystem::path& folder) {
    const Condition& condition = protocol.conditions[static_cast<std::size_t>(trial.condition)];
    const bool approximate = settings.mode != Mode::Penalty && !findSolver(settings.solver)->exact;
    ordered_json row = trialColumns(protocol, trial);
    row["scene"] = sceneName(scene);
    row["scene_hash"] = hashOf(scene.scene.file);
    row["device"] = condition.device;
    row["mode"] = getSetting(settings, "mode");
    row["solver"] = settings.mode == Mode::Penalty ? "" : getSetting(settings, "solver");
    row["tolerance"] = approximate ? ordered_json(settings.tolerance) : ordered_json(nullptr);
    row["stiffness_N_per_mm"] = settings.stiffness;
    row["friction_coefficient"] = greatestFriction(*scene.world, settings);
    measures.write(row, end);
    row["residual_penetration_mm"] = PenetrationMeter(*scene.world).depth(last.X_WT, {}, geometryOf(settings));
    row["safety_trips"] = measures.trips();
    row["stuck"] = end == TrialEnd::Seated ? "" : stuckSentence(scene, last, settings, false);
    row["recording"] = folder.filename().string();
    for (ordered_json& value : row)  // six significant digits exceed the accuracy of every column
        if (value.is_number_float()) value = std::stod(numberText(value.get<double>()));
    return row;
}

std::optional<ordered_json> runTrial(const HapticScene& scene, const Protocol& protocol, const Trial& trial,
                                     const std::filesystem::path& folder, const std::filesystem::path& configFolder,
                                     const Say& say) {
    const Condition& condition = protocol.conditions[static_cast<std::size_t>(trial.condition)];
    if (!scene.roles.goal)
        throw std::runtime_error("condition '" + condition.name + "': the scene '" + condition.scene +
                                 "' has no goal, so trials in it cannot end: give a node the role goal");
    const std::string device = deviceOf(condition, trial);
    PlacedDevice placed = startPlaced(scene, device, condition.settings(scene.settings), configFolder, say);
    const Settings settings = placed.settings;
    TickDriver driver(std::make_unique<Session>(scene.world, settings, std::move(placed.device)));
    driver.engage();  // there is no user who could engage
    std::optional<Pacer> pacer;
    TickPeriod period;
    if (moverOf(device) == Mover::Person) pacer.emplace(settings.rate, false);
    Recorder recorder(folder);
    recorder.announce(driver.session().number, recordedScene(scene.scene.file, *scene.world), device);

    TickClocks clocks{.stage = stageClock(), .cpuMicroseconds = threadCpuMicroseconds};
    const double dt = 1000 / settings.rate;
    TrialMeasures measures(*scene.roles.goal, protocol.limits);
    std::optional<TrialEnd> end;
    TickRecord tick;
    while (!end && StopRequest::signal() == 0) {
        if (pacer) clocks.periodMs = period.begin();
        tick = driver.tick(clocks);
        if (pacer) tick.overruns = pacer->overruns();
        recorder.add(recordedTick(driver.session().state, tick, driver.session().number));
        measures.add(tick, dt);
        end = endOf(measures.phases(), condition);
        if (pacer) pacer->wait();
        if (!end && (driver.finished() || driver.session().safety.engagement() == Engagement::Faulted))
            end = TrialEnd::Abort;
    }
    recorder.flush();
    if (!recorder.failure().empty()) throw std::runtime_error(recorder.failure());
    if (!end) return std::nullopt;
    return trialRow(scene, protocol, trial, settings, measures, *end, tick, folder);
}

}  // namespace touchstone::sandbox
