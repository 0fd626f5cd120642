#include "haptics/sandbox/scene/outcome.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/scene/fields.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

using Seen = OutcomeJudge::Seen;

/// How a key is checked: by a limit on a value of the run, or by code for this key alone (then `value` is null).
struct Row {
    OutcomeKey info;
    double (*value)(const Seen&);
    bool isMinimum = false;  ///< the value must reach the limit; else it must not exceed it
    bool atEnd = false;      ///< checked at the end of the demonstration; else in every tick
};

/// Greatest distance of the recent wrenches from their mean.
double noise(const Seen& seen, Vec3 Wrench::*part) {
    Vec3 mean = Vec3::Zero();
    for (const Wrench& wrench : seen.recent) mean += wrench.*part / double(seen.recent.size());
    double most = 0;
    for (const Wrench& wrench : seen.recent) most = std::max(most, (wrench.*part - mean).norm());
    return most;
}

constexpr Row kRows[] = {
    {{"max_penetration_mm", "mm", "deepest overlap: of the spheres' true gaps, or of the meshes"},
     [](const Seen& s) { return s.penetration; }},
    {{"max_hover_mm", "mm", "greatest true gap at a contact that carries force"},
     [](const Seen& s) { return s.hover; }},
    {{"max_hover_ms", "ms", "longest time that a loaded contact had a gap above 0.01 mm while no cap slowed the tool"},
     [](const Seen& s) { return s.longestHoverMs; }},
    {{"max_penetration_growth_mm", "mm", "increase of the overlap above its smallest earlier value"},
     [](const Seen& s) { return s.penetrationGrowth; }},
    {{"max_peak_force_N", "N", "greatest force"}, [](const Seen& s) { return s.force; }},
    {{"max_peak_torque_mNm", "mN·m", "greatest torque about the tool's reference point"},
     [](const Seen& s) { return s.torque; }},
    {{"max_dforce_N_per_ms", "N/ms", "greatest change of force between consecutive ticks"},
     [](const Seen& s) { return s.forceChange; }},
    {{"max_infeasible_ticks", "", "ticks whose contacts contradicted each other"},
     [](const Seen& s) { return s.infeasible; }},
    {{"tool_within_m", "m",
      "box {min, max} that the tool node's origin must not leave; the value is how far it left it"},
     nullptr},
    {{"min_peak_force_N", "N", "the greatest force reaches at least this"},
     [](const Seen& s) { return s.force; },
     true,
     true},
    {{"min_peak_torque_mNm", "mN·m", "the greatest torque about the tool's reference point reaches at least this"},
     [](const Seen& s) { return s.torque; },
     true,
     true},
    {{"min_contact_fraction", "", "the fraction of ticks in contact, 0 to 1, is at least this"},
     [](const Seen& s) { return s.ticks > 0 ? s.contact / s.ticks : 0; },
     true,
     true},
    {{"max_depth_mm", "mm", "deepest reading of the gauge"},
     [](const Seen& s) { return s.depth.deepest; },
     false,
     true},
    {{"min_depth_mm", "mm", "the deepest reading of the gauge is at least this"},
     [](const Seen& s) { return s.depth.deepest; },
     true,
     true},
    {{"max_final_lag_mm", "mm", "distance from tool pose to device pose at the end"},
     [](const Seen& s) { return s.finalLag; },
     false,
     true},
    {{"max_hold_noise_N", "N", "greatest distance of the force from its mean in the last 500 ms"},
     [](const Seen& s) { return noise(s, &Wrench::force); },
     false,
     true},
    {{"max_hold_noise_mNm", "mN·m", "greatest distance of the torque from its mean in the last 500 ms"},
     [](const Seen& s) { return noise(s, &Wrench::torque); },
     false,
     true},
    {{"final_position_m", "m", "position of the tool node's origin at the end, within final_tolerance_m"}, nullptr},
    {{"final_tolerance_m", "m", "tolerance of final_position_m; 0.0001 if not given"}, nullptr},
    {{"reached", "", "true: at some time the tool stayed in the goal region for the goal's hold_s"}, nullptr},
    {{"seated", "", "true: at the end the tool has stayed in the goal region for the goal's hold_s"}, nullptr},
};

constexpr auto kKeys = [] {
    std::array<OutcomeKey, std::size(kRows)> keys;
    std::transform(std::begin(kRows), std::end(kRows), keys.begin(), [](const Row& row) { return row.info; });
    return keys;
}();

ExpectedOutcome readFrom(const nlohmann::json& outcome, const engine::Scene& scene, const std::string& object,
                         const SceneRoles& roles, std::vector<std::string>& warnings) {
    ExpectedOutcome expected;
    engine::Fields fields(scene, object, "extras.touchstone.outcome", outcome);
    for (int row = 0; row < static_cast<int>(std::size(kRows)); ++row)
        if (kRows[row].value)
            if (const auto limit = fields.number(std::string(kRows[row].info.key), 0,
                                                 kRows[row].info.key == "min_contact_fraction" ? 1 : 1e9))
                expected.limits.push_back({row, *limit});
    expected.gauge = roles.gauge;
    for (const char* key : {"min_depth_mm", "max_depth_mm"})
        if (!roles.gauge && fields.find(key))
            fields.fail(key, "left out, or the scene given a node with the role gauge");

    if (auto box = fields.object("tool_within_m")) {
        const auto corner = [&](const char* key) -> std::optional<Vec3> {
            const auto meters = box->vector(key);
            return meters ? std::optional(toMm(*meters)) : std::nullopt;
        };
        expected.boxMin = corner("min");
        expected.boxMax = corner("max");
        if (!expected.boxMin) box->fail("min", "given as three numbers");
        if (!expected.boxMax) box->fail("max", "given as three numbers");
        if ((expected.boxMin->array() > expected.boxMax->array()).any())
            box->fail("min", "at most max on each axis: this box is empty");
        box->warnUnknown(warnings);
    }
    if (const auto meters = fields.vector("final_position_m")) expected.finalPosition = toMm(*meters);
    if (const auto meters = fields.number("final_tolerance_m", 0, 1e3)) expected.finalTolerance = *meters * kMmPerMeter;
    for (const auto& [key, region] : {std::pair{"seated", &expected.seated}, std::pair{"reached", &expected.reached}})
        if (fields.flag(key).value_or(false)) {
            if (!roles.goal) fields.fail(key, "left out, or the scene given a node with the role goal");
            *region = roles.goal;
        }
    fields.warnUnknown(warnings);
    return expected;
}

}  // namespace

std::span<const OutcomeKey> outcomeTable() { return kKeys; }

ExpectedOutcome readOutcome(const engine::Scene& scene, const SceneRoles& roles, std::vector<std::string>& warnings) {
    if (roles.outcome->is_null()) return {};
    return readFrom(*roles.outcome, scene, roles.tool ? nodeLabel(scene, roles.tool) : "scene", roles, warnings);
}

std::optional<ExpectedOutcome> readOutcome(const engine::Scene& scene, std::size_t animation, const SceneRoles& roles,
                                           std::vector<std::string>& warnings) {
    const engine::Animation& from = scene.animations[animation];
    if (!from.extras->is_object() || !from.extras->contains("touchstone")) return {};
    const std::string object = engine::objectLabel("animation", animation, from.name);
    engine::Fields fields(scene, object, "extras.touchstone", from.extras->at("touchstone"));
    std::optional<ExpectedOutcome> expected;
    if (fields.object("outcome"))
        expected = readFrom(from.extras->at("touchstone").at("outcome"), scene, object, roles, warnings);
    fields.warnUnknown(warnings);
    return expected;
}

void OutcomeJudge::add(const TickRecord& record, double penetration, double dt) {
    const double force = record.wrench_C.force.norm();
    seen_.penetration = std::max(seen_.penetration, penetration);
    seen_.penetrationGrowth = std::max(seen_.penetrationGrowth, penetration - seen_.leastPenetration);
    seen_.leastPenetration = std::min(seen_.leastPenetration, penetration);
    seen_.hover = std::max(seen_.hover, record.hover);
    seen_.hoverMs = record.hover > kHover && !(record.flags & kCapped) ? seen_.hoverMs + dt : 0;
    seen_.longestHoverMs = std::max(seen_.longestHoverMs, seen_.hoverMs);
    seen_.force = std::max(seen_.force, force);
    seen_.torque = std::max(seen_.torque, record.wrench_C.torque.norm());
    if (seen_.ticks > 0)
        seen_.forceChange = std::max(seen_.forceChange, (record.wrench_C.force - seen_.lastForce).norm() / dt);
    seen_.lastForce = record.wrench_C.force;
    // The wrenches of the last kHoldMs, for the noise at rest.
    if (double(seen_.recent.size()) < std::max(1.0, std::floor(kHoldMs / dt + 1e-9))) {
        seen_.recent.push_back(record.wrench_C);
    } else {
        seen_.recent[seen_.oldest] = record.wrench_C;
        seen_.oldest = (seen_.oldest + 1) % seen_.recent.size();
    }
    seen_.infeasible += (record.flags & kInfeasible) != 0;
    seen_.badInput += (record.flags & kBadInput) != 0;
    seen_.contact += force > kContactForce;
    seen_.ticks += 1;
    seen_.finalLag = (record.X_WT.p - record.X_WT_device.p).norm();
    seen_.X_WT = record.X_WT;
    // Box, gauge and goal, where the outcome has them.
    if (expected_.boxMin && expected_.boxMax) {
        const double outside =
            std::max((*expected_.boxMin - record.X_WT.p).maxCoeff(), (record.X_WT.p - *expected_.boxMax).maxCoeff());
        seen_.outside = std::max(seen_.outside, outside);
    }
    if (expected_.gauge) seen_.depth.add(expected_.gauge->depth(record.X_WT));
    if (const auto& region = expected_.seated ? expected_.seated : expected_.reached) {
        seen_.heldMs = region->contains(record.X_WT) ? seen_.heldMs + dt : 0;
        seen_.longestHeldMs = std::max(seen_.longestHeldMs, seen_.heldMs);
    }
}

std::vector<OutcomeCheck> OutcomeJudge::checks(bool ended) const {
    std::vector<OutcomeCheck> checks;
    const auto atMost = [&](std::string name, double limit, double value) {
        checks.push_back({std::move(name), limit, value, value <= limit});
    };
    // An invalid device pose holds the tool, and a tool that is held would meet every limit.
    if (!expected_.empty() && seen_.badInput > 0) atMost("ticks_with_invalid_pose", 0, seen_.badInput);
    for (const ExpectedOutcome::Limit& limit : expected_.limits) {
        const Row& row = kRows[limit.row];
        if (row.atEnd && !ended) continue;
        const double value = row.value(seen_);
        checks.push_back({std::string(row.info.key), limit.value, value,
                          row.isMinimum ? value >= limit.value : value <= limit.value});
    }
    if (expected_.boxMin) atMost("tool_within_m", 0, seen_.outside / kMmPerMeter);
    if (!ended) return checks;
    if (expected_.finalPosition)
        atMost("final_position_m", expected_.finalTolerance / kMmPerMeter,
               (seen_.X_WT.p - *expected_.finalPosition).norm() / kMmPerMeter);
    if (expected_.reached)
        checks.push_back({"reached_hold_s", expected_.reached->hold / 1000, seen_.longestHeldMs / 1000,
                          seen_.longestHeldMs > 0 && seen_.longestHeldMs >= expected_.reached->hold});
    if (expected_.seated) {
        const GoalRegion& goal = *expected_.seated;
        atMost("seated_distance_m", goal.tolerance / kMmPerMeter, goal.distance(seen_.X_WT) / kMmPerMeter);
        atMost("seated_angle_rad", goal.toleranceAngle, goal.angle(seen_.X_WT));
        checks.push_back({"seated_hold_s", goal.hold / 1000, seen_.heldMs / 1000, seen_.heldMs >= goal.hold});
    }
    return checks;
}

}  // namespace touchstone::sandbox
