#include "haptics/sandbox/measure/report.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "haptics/loop/setting_table.hpp"
#include "haptics/math/hash.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::ordered_json;

ordered_json number(const std::optional<double>& value) { return value ? ordered_json(*value) : ordered_json(); }

/// One percentile under its key in the report.
struct Column {
    const char* key;
    std::optional<double> Percentiles::*value;
};
constexpr Column kP50{"p50", &Percentiles::p50}, kP99{"p99", &Percentiles::p99}, kP999{"p999", &Percentiles::p999},
    kMax{"max", &Percentiles::max};

ordered_json object(const Percentiles& values, std::initializer_list<Column> columns) {
    ordered_json json = ordered_json::object();
    for (const Column& column : columns) json[column.key] = number(values.*column.value);
    return json;
}

ordered_json counts(const Percentiles& values) {
    ordered_json json = ordered_json::object();
    for (const Column& column : {kP50, kMax}) {
        const std::optional<double>& value = values.*column.value;
        json[column.key] = value ? ordered_json(static_cast<std::int64_t>(*value)) : ordered_json();
    }
    return json;
}

}  // namespace

bool Report::met() const {
    return std::all_of(checks.begin(), checks.end(), [](const OutcomeCheck& check) { return check.met; });
}

Report reportOf(std::string scene, std::string device, const Settings& settings) {
    Report report;
    report.scene = std::move(scene);
    report.mode = getSetting(settings, "mode");
    report.solver = getSetting(settings, "solver");
    report.shadow = getSetting(settings, "shadow");
    report.frictionSolver = getSetting(settings, "friction_solver");
    report.frictionShadow = settings.shadow == kNoSolver ? "none" : getSetting(settings, "friction_shadow");
    report.device = std::move(device);
    report.rate = settings.rate;
    for (const SettingInfo& info : settingTable())
        report.settings.emplace_back(info.key, getSetting(settings, info.key));
    return report;
}

ordered_json toJson(const Report& report) {
    const auto times = [](const Percentiles& values) { return object(values, {kP50, kP99, kP999, kMax}); };
    const auto most = [](double value) { return ordered_json{{"max", value}}; };
    ordered_json checks = ordered_json::array();
    for (const OutcomeCheck& check : report.checks)
        checks.push_back({{"name", check.name}, {"limit", check.limit}, {"value", check.value}, {"met", check.met}});
    ordered_json settings = ordered_json::object();
    for (const auto& [key, value] : report.settings) settings[key] = value;
    ordered_json json{
        {"scene", report.scene},
        {"mode", report.mode},
        {"solver", report.solver},
        {"shadow", report.shadow},
        {"device", report.device},
        {"rate_Hz", report.rate},
        {"ticks", report.ticks},
        {"step_us", times(report.stepUs)},
        {"collision_us", times(report.collisionUs)},
        {"solve_us", times(report.solveUs)},
        {"shadow_us", times(report.shadowUs)},
        {"list_worker_us", times(report.listWorkerUs)},
        {"pairs", counts(report.pairs)},
        {"rows", counts(report.rows)},
        {"iterations", counts(report.iterations)},
        {"rows_truncated", report.rowsTruncated},
        {"margin_used_mm", object(report.marginUsed, {kP50, kMax})},
        {"penetration_mm", object(report.penetration, {kP99, kMax})},
        {"hover_mm", object(report.hover, {kP99, kMax})},
        {"force_N", most(report.force)},
        {"torque_mNm", most(report.torque)},
        {"dforce_N_per_ms", object(report.forceChange, {kP99, kMax})},
        {"force_out_N", most(report.forceOut)},
        {"shadow_force_error_N", object(report.shadowForceError, {kP50, kP99, kMax})},
        {"kkt",
         {{"primal_mm", report.kkt.primal_mm},
          {"dual_N", report.kkt.dual_N},
          {"stationarity_N", report.kkt.stationarity_N},
          {"complementarity_mJ", report.kkt.complementarity_mJ}}},
        {"step_cpu_ms", report.stepCpuMs},
        {"unfinished", report.unfinished},
        {"longer_than_period", report.tooLong},
        {"infeasible", report.infeasible},
        {"by_processor", report.byProcessor},
        {"invalid_poses", report.badInput},
        {"overlapping", report.overlapping},
        {"by_spheres", report.bySpheres},
        {"repairs", report.repairs},
        {"stuck", report.stuck},
        {"overruns", report.overruns ? ordered_json(*report.overruns) : ordered_json()},
        {"dropped", report.dropped},
        {"safety_trips", report.safetyTrips},
        {"safety_fault", report.safetyFault},
        {"device_trouble", report.deviceTrouble},
        {"hash", hexadecimal(report.hash)},
        {"outcome", {{"met", report.met()}, {"checks", std::move(checks)}, {"checks_left", report.checksLeft}}},
        {"settings", std::move(settings)},
    };
    if (!report.gauge.empty() && report.ticks > 0)
        json["gauge"] = {{"name", report.gauge}, {"deepest_mm", report.depth.deepest}, {"last_mm", report.depth.last}};
    if (report.toolPose) {
        // Without a file of its own, the tool's node in the scene, whose unit is the meter.
        const FileFrame file = report.toolFile.value_or(FileFrame());
        json["tool_pose"] = {{"matrix", matrixInFile(file, *report.toolPose)},
                             {"unit_m", file.unit},
                             {"frame", report.toolFile ? "file" : "scene"}};
    }
    const Report::FrictionReport& friction = report.friction;
    if (friction.sticking + friction.sliding + friction.held > 0)
        json["friction"] = {{"solver", report.frictionSolver},
                            {"shadow", report.frictionShadow},
                            {"ticks_sticking", friction.sticking},
                            {"ticks_sliding", friction.sliding},
                            {"ticks_newton", friction.stages[0]},
                            {"ticks_rounds", friction.stages[1]},
                            {"ticks_path", friction.stages[2]},
                            {"ticks_soft", friction.soft},
                            {"ticks_held", friction.held},
                            {"ticks_replaced", friction.replaced},
                            {"slip_mm", most(friction.slip)},
                            {"force_N", most(friction.force)},
                            {"balance_N", friction.coulomb.balance_N},
                            {"overlap_mm", friction.coulomb.overlap_mm},
                            {"cone_N", friction.coulomb.cone_N},
                            {"complementarity_mJ", friction.coulomb.complementarity_mJ},
                            {"direction_mJ", friction.coulomb.direction_mJ},
                            {"dissipated_mJ", friction.coulomb.dissipation_mJ}};
    if (!report.ended.empty()) json["ended"] = report.ended;
    if (report.pastGoal > 0) json["fell_past_goal_mm"] = report.pastGoal;
    if (report.frameCpuMs.max) {
        json["frame_cpu_ms"] = object(report.frameCpuMs, {kP50, kP99, kMax});
        json["draw_calls"] = counts(report.drawCalls);
    }
    return json;
}

void RunStatistics::add(const TickRecord& record, double penetration, double dt) {
    const double force = record.wrench_C.force.norm();
    const bool first = pairs_.empty();
    hash_ = first ? hashTick(record) : hashTick(record, hash_);
    if (!first) forceChange_.push_back((record.wrench_C.force - lastForce_).norm() / dt);
    lastForce_ = record.wrench_C.force;
    // Values whose percentiles the report has.
    pairs_.push_back(record.pairs);
    rows_.push_back(record.rows);
    iterations_.push_back(record.iterations);
    margin_.push_back(record.marginUsed);
    penetration_.push_back(penetration);
    hover_.push_back(record.hover);
    shadowUs_.push_back(record.shadowUs);
    const bool feasible = !(record.flags & (kInfeasible | kNonFinite));
    if (record.shadowRows > 0 && record.shadowStatus != SolveStatus::Invalid && feasible && force > kContactForce)
        shadowError_.push_back(record.shadowForceError);

    // Extremes and counts.
    if (gauge_) depth_.add(gauge_->depth(record.X_WT));
    toolPose_ = record.X_WT;
    truncated_ += record.rowsTruncated;
    force_ = std::max(force_, force);
    torque_ = std::max(torque_, record.wrench_C.torque.norm());
    forceOut_ = std::max(forceOut_, record.wrench_out.force.norm());
    kkt_.primal_mm = std::max(kkt_.primal_mm, record.kkt.primal_mm);
    kkt_.dual_N = std::max(kkt_.dual_N, record.kkt.dual_N);
    kkt_.stationarity_N = std::max(kkt_.stationarity_N, record.kkt.stationarity_N);
    kkt_.complementarity_mJ = std::max(kkt_.complementarity_mJ, record.kkt.complementarity_mJ);
    unfinished_ += (record.flags & kUnfinished) != 0;
    infeasible_ += (record.flags & kInfeasible) != 0;
    byProcessor_ += (record.flags & kByProcessor) != 0;
    badInput_ += (record.flags & kBadInput) != 0;
    overlapping_ += (record.flags & kOverlapping) != 0;
    // Friction: ticks by what they took, extremes, and the sum of heat.
    friction_.sticking += record.sticking > 0;
    friction_.sliding += record.sliding > 0;
    if (record.frictionStage > 0) ++friction_.stages[std::size_t(record.frictionStage) - 1];
    friction_.soft += (record.flags & kFrictionSoft) != 0;
    friction_.held += (record.flags & kFrictionHeld) != 0;
    friction_.replaced += record.sticking + record.sliding > 0 && (record.flags & kIterationLimit) != 0;
    friction_.slip = std::max(friction_.slip, record.slip);
    friction_.force = std::max(friction_.force, record.frictionForce);
    const double heat = friction_.coulomb.dissipation_mJ + record.coulomb.dissipation_mJ;
    friction_.coulomb = worstOf(friction_.coulomb, record.coulomb);
    friction_.coulomb.dissipation_mJ = heat;
}

void RunStatistics::addTimes(const TickRecord& record) {
    stepUs_.push_back(record.totalUs - record.shadowUs);
    collisionUs_.push_back(record.collisionUs);
    solveUs_.push_back(record.solveUs);
    listWorkerUs_.push_back(record.listWorkerUs);
}

void RunStatistics::write(Report& report) const {
    report.ticks = pairs_.size();
    report.stepUs = percentiles(stepUs_);
    report.collisionUs = percentiles(collisionUs_);
    report.solveUs = percentiles(solveUs_);
    report.shadowUs = percentiles(shadowUs_);
    report.listWorkerUs = percentiles(listWorkerUs_);
    report.pairs = percentiles(pairs_);
    report.rows = percentiles(rows_);
    report.iterations = percentiles(iterations_);
    report.rowsTruncated = truncated_;
    report.marginUsed = percentiles(margin_);
    report.penetration = percentiles(penetration_);
    report.hover = percentiles(hover_);
    report.force = force_;
    report.torque = torque_;
    report.forceOut = forceOut_;
    report.forceChange = percentiles(forceChange_);
    report.shadowForceError = percentiles(shadowError_);
    report.kkt = kkt_;
    report.stepCpuMs = 1e-3 * std::accumulate(stepUs_.begin(), stepUs_.end(), 0.0);
    report.unfinished = unfinished_;
    report.tooLong =
        std::uint64_t(std::count_if(stepUs_.begin(), stepUs_.end(), [&](double us) { return us > 1e6 / report.rate; }));
    report.infeasible = infeasible_;
    report.byProcessor = byProcessor_;
    report.badInput = badInput_;
    report.overlapping = overlapping_;
    report.friction = friction_;
    report.hash = hash_;
    if (gauge_) report.gauge = gauge_->name;
    report.depth = depth_;
    report.toolPose = toolPose_;
}

}  // namespace touchstone::sandbox
