#include "haptics/sandbox/record/tick_fields.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <iterator>
#include <string_view>
#include <type_traits>

namespace touchstone::sandbox {
namespace {

static_assert(std::endian::native == std::endian::little);

using T = RecordedTick&;
using R = FieldRef;

constexpr const char* kInputPose = "where the device wants the tool node, scene frame, as step() received it";
constexpr const char* kObstaclePose = "where that one was to go, scene frame, as step() received it";
constexpr const char* kDevicePose = "the same as the tick took it: the last good one, of unit length";
constexpr const char* kToolPose = "tool node where it is (the graphic tool), scene frame";
constexpr const char* kForce = "on the hand, by the tick, world axes";
constexpr const char* kTorqueC = "on the hand about C, the tool's reference point, at the device's pose";
constexpr const char* kTorqueO = "the same about the tool node's origin";
constexpr const char* kForceOut = "what the safety stage let through to the device";
constexpr const char* kTorqueOut = "the same about the tool node's origin";

// Times, what the safety stage did, and what an audit measures do not repeat; nor, in the last digits, do the errors of
// the shadow, whose exact solver an audit leaves with another warm start.
constexpr TickField kFields[] = {
    {"input_x_mm", [](T t) -> R { return &t.input.X_WT_device.p.x(); }, true, kInputPose},
    {"input_y_mm", [](T t) -> R { return &t.input.X_WT_device.p.y(); }, true, kInputPose},
    {"input_z_mm", [](T t) -> R { return &t.input.X_WT_device.p.z(); }, true, kInputPose},
    {"input_qw", [](T t) -> R { return &t.input.X_WT_device.q.w(); }, true, kInputPose},
    {"input_qx", [](T t) -> R { return &t.input.X_WT_device.q.x(); }, true, kInputPose},
    {"input_qy", [](T t) -> R { return &t.input.X_WT_device.q.y(); }, true, kInputPose},
    {"input_qz", [](T t) -> R { return &t.input.X_WT_device.q.z(); }, true, kInputPose},
    {"input_stiffness_N_per_mm", [](T t) -> R { return &t.input.settings.stiffness; }, true,
     "where its ramp is in this tick"},
    {"input_torsion_mNm_per_rad", [](T t) -> R { return &t.input.settings.torsion; }, true,
     "where its ramp is in this tick"},
    {"input_pause", [](T t) -> R { return &t.input.settings.pause; }, true, "the tool was to hold"},
    {"obstacle", [](T t) -> R { return &t.input.obstacle; }, true, "its index, whose turn it was to move; -1: none"},
    {"obstacle_to_x_mm", [](T t) -> R { return &t.input.X_WO.p.x(); }, true, kObstaclePose},
    {"obstacle_to_y_mm", [](T t) -> R { return &t.input.X_WO.p.y(); }, true, kObstaclePose},
    {"obstacle_to_z_mm", [](T t) -> R { return &t.input.X_WO.p.z(); }, true, kObstaclePose},
    {"obstacle_to_qw", [](T t) -> R { return &t.input.X_WO.q.w(); }, true, kObstaclePose},
    {"obstacle_to_qx", [](T t) -> R { return &t.input.X_WO.q.x(); }, true, kObstaclePose},
    {"obstacle_to_qy", [](T t) -> R { return &t.input.X_WO.q.y(); }, true, kObstaclePose},
    {"obstacle_to_qz", [](T t) -> R { return &t.input.X_WO.q.z(); }, true, kObstaclePose},
    {"tick", [](T t) -> R { return &t.record.tick; }, true, "since the scene, or the last restart, began"},
    {"device_x_mm", [](T t) -> R { return &t.record.X_WT_device.p.x(); }, true, kDevicePose},
    {"device_y_mm", [](T t) -> R { return &t.record.X_WT_device.p.y(); }, true, kDevicePose},
    {"device_z_mm", [](T t) -> R { return &t.record.X_WT_device.p.z(); }, true, kDevicePose},
    {"device_qw", [](T t) -> R { return &t.record.X_WT_device.q.w(); }, true, kDevicePose},
    {"device_qx", [](T t) -> R { return &t.record.X_WT_device.q.x(); }, true, kDevicePose},
    {"device_qy", [](T t) -> R { return &t.record.X_WT_device.q.y(); }, true, kDevicePose},
    {"device_qz", [](T t) -> R { return &t.record.X_WT_device.q.z(); }, true, kDevicePose},
    {"tool_x_mm", [](T t) -> R { return &t.record.X_WT.p.x(); }, true, kToolPose},
    {"tool_y_mm", [](T t) -> R { return &t.record.X_WT.p.y(); }, true, kToolPose},
    {"tool_z_mm", [](T t) -> R { return &t.record.X_WT.p.z(); }, true, kToolPose},
    {"tool_qw", [](T t) -> R { return &t.record.X_WT.q.w(); }, true, kToolPose},
    {"tool_qx", [](T t) -> R { return &t.record.X_WT.q.x(); }, true, kToolPose},
    {"tool_qy", [](T t) -> R { return &t.record.X_WT.q.y(); }, true, kToolPose},
    {"tool_qz", [](T t) -> R { return &t.record.X_WT.q.z(); }, true, kToolPose},
    {"force_x_N", [](T t) -> R { return &t.record.wrench_C.force.x(); }, true, kForce},
    {"force_y_N", [](T t) -> R { return &t.record.wrench_C.force.y(); }, true, kForce},
    {"force_z_N", [](T t) -> R { return &t.record.wrench_C.force.z(); }, true, kForce},
    {"torque_x_mNm", [](T t) -> R { return &t.record.wrench_C.torque.x(); }, true, kTorqueC},
    {"torque_y_mNm", [](T t) -> R { return &t.record.wrench_C.torque.y(); }, true, kTorqueC},
    {"torque_z_mNm", [](T t) -> R { return &t.record.wrench_C.torque.z(); }, true, kTorqueC},
    {"force_o_x_N", [](T t) -> R { return &t.record.wrench_o.force.x(); }, true, kForce},
    {"force_o_y_N", [](T t) -> R { return &t.record.wrench_o.force.y(); }, true, kForce},
    {"force_o_z_N", [](T t) -> R { return &t.record.wrench_o.force.z(); }, true, kForce},
    {"torque_o_x_mNm", [](T t) -> R { return &t.record.wrench_o.torque.x(); }, true, kTorqueO},
    {"torque_o_y_mNm", [](T t) -> R { return &t.record.wrench_o.torque.y(); }, true, kTorqueO},
    {"torque_o_z_mNm", [](T t) -> R { return &t.record.wrench_o.torque.z(); }, true, kTorqueO},
    {"force_out_x_N", [](T t) -> R { return &t.record.wrench_out.force.x(); }, false, kForceOut},
    {"force_out_y_N", [](T t) -> R { return &t.record.wrench_out.force.y(); }, false, kForceOut},
    {"force_out_z_N", [](T t) -> R { return &t.record.wrench_out.force.z(); }, false, kForceOut},
    {"torque_out_x_mNm", [](T t) -> R { return &t.record.wrench_out.torque.x(); }, false, kTorqueOut},
    {"torque_out_y_mNm", [](T t) -> R { return &t.record.wrench_out.torque.y(); }, false, kTorqueOut},
    {"torque_out_z_mNm", [](T t) -> R { return &t.record.wrench_out.torque.z(); }, false, kTorqueOut},
    {"flags", [](T t) -> R { return &t.record.flags; }, true, "bits of TickFlag in haptics/loop/step.hpp"},
    {"status", [](T t) -> R { return &t.record.status; }, true, "of the rendering solver: its worst in the tick"},
    {"trips", [](T t) -> R { return &t.record.trips; }, false,
     "guards of the safety stage that acted, bits of Trip in haptics/device/safety.hpp"},
    {"pairs", [](T t) -> R { return &t.record.pairs; }, true, "of spheres within the margin"},
    {"rows", [](T t) -> R { return &t.record.rows; }, true, "of the problem solved"},
    {"rows_truncated", [](T t) -> R { return &t.record.rowsTruncated; }, true, "pairs for which there was no row"},
    {"rows_screened", [](T t) -> R { return &t.record.rowsScreened; }, true, "what screening left of rows"},
    {"screen_inexact", [](T t) -> R { return &t.record.screenInexact; }, true,
     "answers outside the ball in which screening is exact"},
    {"iterations", [](T t) -> R { return &t.record.iterations; }, true, "of the rendering solver"},
    {"linearisations", [](T t) -> R { return &t.record.linearisations; }, true, "in the tick"},
    {"margin_used_mm", [](T t) -> R { return &t.record.marginUsed; }, true, "margin of the problem solved"},
    {"projection_mm", [](T t) -> R { return &t.record.projection; }, true,
     "greatest correction of an approximate answer"},
    {"hover_mm", [](T t) -> R { return &t.record.hover; }, false, "greatest gap over loaded contacts"},
    {"penetration_listed_mm", [](T t) -> R { return &t.record.penetration; }, false,
     "deepest overlap of the listed pairs"},
    {"kkt_primal_mm", [](T t) -> R { return &t.record.kkt.primal_mm; }, true, "residual: deepest violated row"},
    {"kkt_dual_N", [](T t) -> R { return &t.record.kkt.dual_N; }, true, "residual: most negative multiplier"},
    {"kkt_stationarity_N", [](T t) -> R { return &t.record.kkt.stationarity_N; }, true,
     "residual: missing to the balance of forces"},
    {"kkt_complementarity_mJ", [](T t) -> R { return &t.record.kkt.complementarity_mJ; }, true,
     "residual: force times gap"},
    {"shadow_rows", [](T t) -> R { return &t.record.shadowRows; }, true, "that the shadow took"},
    {"shadow_rows_cut", [](T t) -> R { return &t.record.shadowRowsCut; }, true, "that it did not"},
    {"shadow_iterations", [](T t) -> R { return &t.record.shadowIterations; }, true, "of the shadow"},
    {"shadow_status", [](T t) -> R { return &t.record.shadowStatus; }, true, "of the shadow"},
    {"shadow_force_error_N", [](T t) -> R { return &t.record.shadowForceError; }, false,
     "against the exact answer on the same rows"},
    {"shadow_torque_error_mNm", [](T t) -> R { return &t.record.shadowTorqueError; }, false, "likewise"},
    {"collision_us", [](T t) -> R { return &t.record.collisionUs; }, false, "processor time of the stage"},
    {"solve_us", [](T t) -> R { return &t.record.solveUs; }, false, "processor time of the stage"},
    {"shadow_us", [](T t) -> R { return &t.record.shadowUs; }, false, "processor time of the shadow"},
    {"total_us", [](T t) -> R { return &t.record.totalUs; }, false, "processor time of the tick, shadow included"},
    {"helper_us", [](T t) -> R { return &t.record.helperUs; }, false, "of the thread that finds lists ahead"},
    {"period_us", [](T t) -> R { return &t.record.periodUs; }, false,
     "by the clock, since the tick before began; 0 without one"},
    {"overruns", [](T t) -> R { return &t.record.overruns; }, false, "deadlines missed before this tick"},
};

/// A field's value, not where it stands.
auto visitValue(const TickField& field, const RecordedTick& tick, auto&& visitor) {
    return std::visit([&](auto* value) { return visitor(*value); }, field.of(const_cast<RecordedTick&>(tick)));
}

FieldRef anyRef(const TickField& field) {
    static RecordedTick tick;  // for its types
    return field.of(tick);
}

}  // namespace

std::span<const TickField> tickFields() { return kFields; }

std::span<const TickField> recordFields() {
    const auto first = std::find_if(std::begin(kFields), std::end(kFields),
                                    [](const TickField& field) { return std::string_view(field.name) == "tick"; });
    return {first, std::end(kFields)};
}

const char* TickField::type() const {
    constexpr const char* kTypes[] = {"<f8", "<i4", "<u4", "<u8", "|b1", "|u1"};
    static_assert(std::size(kTypes) == std::variant_size_v<FieldRef>);
    return kTypes[anyRef(*this).index()];
}

std::size_t TickField::size() const {
    return std::visit([](auto* value) { return sizeof *value; }, anyRef(*this));
}

std::size_t tickRowBytes() {
    static const std::size_t bytes = [] {
        std::size_t sum = 0;
        for (const TickField& field : kFields) sum += field.size();
        return sum;
    }();
    return bytes;
}

void packTick(const RecordedTick& tick, char* row) {
    for (const TickField& field : kFields)
        visitValue(field, tick, [&](const auto& value) {
            std::memcpy(row, &value, sizeof value);
            row += sizeof value;
        });
}

bool sameBits(const RecordedTick& a, const RecordedTick& b) {
    return std::all_of(std::begin(kFields), std::end(kFields), [&](const TickField& field) {
        if (!field.repeats) return true;
        const FieldRef of_b = field.of(const_cast<RecordedTick&>(b));
        return visitValue(field, a, [&](const auto& value) {
            using Value = std::remove_cvref_t<decltype(value)>;
            return std::memcmp(&value, std::get<Value*>(of_b), sizeof value) == 0;
        });
    });
}

void appendField(std::string& line, const TickField& field, const RecordedTick& tick) {
    visitValue(field, tick, [&](const auto& value) {
        using Value = std::remove_cvref_t<decltype(value)>;
        if constexpr (std::is_same_v<Value, SolveStatus>) {
            line += name(value);
        } else {
            char buffer[32];
            if constexpr (std::is_same_v<Value, bool>)
                line += value ? '1' : '0';
            else
                line.append(buffer, std::to_chars(buffer, std::end(buffer), value).ptr);
        }
    });
}

std::string fieldsAsMarkdown() {
    std::string text = "| field | type | what |\n|---|---|---|\n";
    for (const TickField& field : kFields)
        text += "| `" + std::string(field.name) + "` | " + (field.type() + 1) + " | " + field.help + " |\n";
    return text;
}

}  // namespace touchstone::sandbox
