#include "haptics/sandbox/record/tick_fields.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <type_traits>

namespace touchstone::sandbox {
namespace {

static_assert(std::endian::native == std::endian::little);

using T = RecordedTick&;
using R = FieldRef;

constexpr const char* kInputPose = "device pose of the tool node, scene frame, as step() received it";
constexpr const char* kObstaclePose = "target pose of that obstacle, scene frame, as step() received it";
constexpr const char* kDevicePose =
    "device pose that the tick used: the last valid one, its quaternion normalized, with the sign of the tool's";
constexpr const char* kToolPose =
    "tool pose: the tool node as drawn (the graphic tool), scene frame; qw >= 0 at the start, and no sign jumps";
constexpr const char* kForce = "force on the hand as the tick computed it, world axes";
constexpr const char* kTorqueC = "torque on the hand about C, the tool's reference point, at the device pose";
constexpr const char* kTorqueO = "torque on the hand about the tool node's origin";
constexpr const char* kForceOut = "force that the safety stage sent to the device";
constexpr const char* kTorqueOut = "torque that the safety stage sent to the device, about the tool node's origin";

// Times, the output of the safety stage and what only an audit measures do not repeat. Nor do the last digits of the
// shadow solver's errors: an audit leaves the exact solver that measures them with another warm start.
constexpr TickField kFields[] = {
    {"input_x_mm", [](T t) -> R { return &t.input.X_WT_device.p.x(); }, true, kInputPose},
    {"input_y_mm", [](T t) -> R { return &t.input.X_WT_device.p.y(); }, true, kInputPose},
    {"input_z_mm", [](T t) -> R { return &t.input.X_WT_device.p.z(); }, true, kInputPose},
    {"input_qw", [](T t) -> R { return &t.input.X_WT_device.q.w(); }, true, kInputPose},
    {"input_qx", [](T t) -> R { return &t.input.X_WT_device.q.x(); }, true, kInputPose},
    {"input_qy", [](T t) -> R { return &t.input.X_WT_device.q.y(); }, true, kInputPose},
    {"input_qz", [](T t) -> R { return &t.input.X_WT_device.q.z(); }, true, kInputPose},
    {"input_stiffness_N_per_mm", [](T t) -> R { return &t.settings.stiffness; }, true,
     "translational stiffness that the ramp had reached"},
    {"input_torsion_mNm_per_rad", [](T t) -> R { return &t.settings.torsion; }, true,
     "rotational stiffness that the ramp had reached"},
    {"input_pause", [](T t) -> R { return &t.settings.pause; }, true, "1 if the tool was told to hold its pose"},
    {"obstacle", [](T t) -> R { return &t.input.move.obstacle; }, true,
     "index of the obstacle that moved in this tick; -1: none"},
    {"obstacle_to_x_mm", [](T t) -> R { return &t.input.move.X_WO.p.x(); }, true, kObstaclePose},
    {"obstacle_to_y_mm", [](T t) -> R { return &t.input.move.X_WO.p.y(); }, true, kObstaclePose},
    {"obstacle_to_z_mm", [](T t) -> R { return &t.input.move.X_WO.p.z(); }, true, kObstaclePose},
    {"obstacle_to_qw", [](T t) -> R { return &t.input.move.X_WO.q.w(); }, true, kObstaclePose},
    {"obstacle_to_qx", [](T t) -> R { return &t.input.move.X_WO.q.x(); }, true, kObstaclePose},
    {"obstacle_to_qy", [](T t) -> R { return &t.input.move.X_WO.q.y(); }, true, kObstaclePose},
    {"obstacle_to_qz", [](T t) -> R { return &t.input.move.X_WO.q.z(); }, true, kObstaclePose},
    {"tick", [](T t) -> R { return &t.record.tick; }, true,
     "number of the tick since the scene was opened or last restarted"},
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
    {"flags", [](T t) -> R { return &t.record.flags; }, true, "bits of TickFlag in haptics/loop/tick.hpp"},
    {"status", [](T t) -> R { return &t.record.status; }, true, "worst status of the rendering solver in the tick"},
    {"trips", [](T t) -> R { return &t.record.trips; }, false,
     "safety guards that acted, bits of Trip in haptics/device/safety.hpp"},
    {"pairs", [](T t) -> R { return &t.record.pairs; }, true,
     "pairs of leaves within the margin; between meshes the rows"},
    {"rows", [](T t) -> R { return &t.record.rows; }, true, "contact rows of the problem that was solved"},
    {"rows_truncated", [](T t) -> R { return &t.record.rowsTruncated; }, true, "pairs that got no row"},
    {"rows_screened", [](T t) -> R { return &t.record.rowsScreened; }, true, "rows that remained after screening"},
    {"screen_inexact", [](T t) -> R { return &t.record.screenInexact; }, true,
     "linearizations whose answer left the ball in which screening is exact"},
    {"iterations", [](T t) -> R { return &t.record.iterations; }, true, "iterations of the rendering solver"},
    {"linearizations", [](T t) -> R { return &t.record.linearizations; }, true, "linearizations in the tick"},
    {"margin_used_mm", [](T t) -> R { return &t.record.marginUsed; }, true, "margin of the problem that was solved"},
    {"projection_mm", [](T t) -> R { return &t.record.projection; }, true,
     "greatest correction that projects an approximate answer onto the constraints"},
    {"hover_mm", [](T t) -> R { return &t.record.hover; }, false, "greatest true gap over loaded contacts"},
    {"penetration_listed_mm", [](T t) -> R { return &t.record.penetration; }, false,
     "deepest overlap of the listed pairs"},
    {"kkt_primal_mm", [](T t) -> R { return &t.record.kkt.primal_mm; }, true,
     "KKT residual: greatest constraint violation"},
    {"kkt_dual_N", [](T t) -> R { return &t.record.kkt.dual_N; }, true, "KKT residual: most negative multiplier"},
    {"kkt_stationarity_N", [](T t) -> R { return &t.record.kkt.stationarity_N; }, true,
     "KKT residual: stationarity, the imbalance of forces"},
    {"kkt_complementarity_mJ", [](T t) -> R { return &t.record.kkt.complementarity_mJ; }, true,
     "KKT residual: complementarity, force times gap"},
    {"friction_stage", [](T t) -> R { return &t.record.frictionStage; }, true,
     "what the hardest solve with friction took: 1 Newton's steps, 2 rounds, 3 continuation; 0 without friction"},
    {"sticking", [](T t) -> R { return &t.record.sticking; }, true, "loaded contacts with friction that stick"},
    {"sliding", [](T t) -> R { return &t.record.sliding; }, true, "loaded contacts with friction that slide"},
    {"slip_mm", [](T t) -> R { return &t.record.slip; }, true, "greatest slip of a loaded contact in the tick"},
    {"friction_N", [](T t) -> R { return &t.record.frictionForce; }, true, "size of the sum of the friction forces"},
    {"coulomb_balance_N", [](T t) -> R { return &t.record.coulomb.balance_N; }, true,
     "distance from Coulomb's law: imbalance of springs and contact forces"},
    {"coulomb_overlap_mm", [](T t) -> R { return &t.record.coulomb.overlap_mm; }, true,
     "distance from Coulomb's law: greatest violation of a contact's constraint"},
    {"coulomb_cone_N", [](T t) -> R { return &t.record.coulomb.cone_N; }, true,
     "distance from Coulomb's law: greatest force outside a friction cone"},
    {"coulomb_complementarity_mJ", [](T t) -> R { return &t.record.coulomb.complementarity_mJ; }, true,
     "distance from Coulomb's law: normal force times gap"},
    {"coulomb_direction_mJ", [](T t) -> R { return &t.record.coulomb.direction_mJ; }, true,
     "distance from Coulomb's law: greatest possible dissipation of a contact less its own"},
    {"dissipation_mJ", [](T t) -> R { return &t.record.coulomb.dissipation_mJ; }, true,
     "heat that friction made in the tick, by the forces of its last linearization"},
    {"shadow_rows", [](T t) -> R { return &t.record.shadowRows; }, true,
     "rows, with friction contacts, that the shadow solver received"},
    {"shadow_rows_cut", [](T t) -> R { return &t.record.shadowRowsCut; }, true, "rows that were withheld from it"},
    {"shadow_iterations", [](T t) -> R { return &t.record.shadowIterations; }, true, "iterations of the shadow solver"},
    {"shadow_status", [](T t) -> R { return &t.record.shadowStatus; }, true, "status of the shadow solver"},
    {"shadow_force_error_N", [](T t) -> R { return &t.record.shadowForceError; }, false,
     "force error against the exact answer on the same rows"},
    {"shadow_torque_error_mNm", [](T t) -> R { return &t.record.shadowTorqueError; }, false,
     "torque error against the exact answer on the same rows"},
    {"collision_us", [](T t) -> R { return &t.record.collisionUs; }, false, "CPU time of the collision stage"},
    {"solve_us", [](T t) -> R { return &t.record.solveUs; }, false, "CPU time of the solver stage"},
    {"shadow_us", [](T t) -> R { return &t.record.shadowUs; }, false, "CPU time of the shadow solver"},
    {"total_us", [](T t) -> R { return &t.record.totalUs; }, false, "CPU time of the tick, shadow solver included"},
    {"list_worker_us", [](T t) -> R { return &t.record.listWorkerUs; }, false,
     "CPU time of the list worker, the thread that finds near pairs ahead"},
    {"period_us", [](T t) -> R { return &t.record.periodUs; }, false,
     "wall time since the previous tick began; 0 where no clock paces"},
    {"overruns", [](T t) -> R { return &t.record.overruns; }, false, "late ticks before this one"},
};

constexpr DerivedField kDerived[] = {
    {"t_ms", [](const TickSample& s) { return static_cast<double>(s.tick.record.tick) * 1000 / s.tick.settings.rate; },
     "simulated time: the tick's number over the rate"},
    {"penetration_mm", [](const TickSample& s) { return s.penetration; },
     "deepest overlap of tool and obstacles, from the true gaps at the tool pose"},
    {"step_us", [](const TickSample& s) { return s.tick.record.totalUs - s.tick.record.shadowUs; },
     "CPU time of the tick without the shadow solver"},
    {"late_before", [](const TickSample& s) { return double(s.tick.record.overruns > s.before.record.overruns); },
     "1 if the tick before was late"},
    {"force_N", [](const TickSample& s) { return s.tick.record.wrench_C.force.norm(); },
     "length of force_x_N, force_y_N, force_z_N"},
    {"force_out_N", [](const TickSample& s) { return s.tick.record.wrench_out.force.norm(); },
     "length of force_out_x_N, force_out_y_N, force_out_z_N"},
    {"torque_mNm", [](const TickSample& s) { return s.tick.record.wrench_C.torque.norm(); },
     "length of torque_x_mNm, torque_y_mNm, torque_z_mNm"},
    {"separation_mm", [](const TickSample& s) { return (s.tick.record.X_WT.p - s.tick.record.X_WT_device.p).norm(); },
     "distance from tool pose to device pose at the tool node's origin"},
};

/// Calls the visitor with the field's value.
auto visitValue(const TickField& field, const RecordedTick& tick, auto&& visitor) {
    return std::visit([&](auto* value) { return visitor(*value); }, field.of(const_cast<RecordedTick&>(tick)));
}

FieldRef anyRef(const TickField& field) {
    static RecordedTick tick;  // only the types of its members count
    return field.of(tick);
}

}  // namespace

std::span<const TickField> tickFields() { return kFields; }

std::span<const TickField> recordFields() {
    const auto first = std::find_if(std::begin(kFields), std::end(kFields),
                                    [](const TickField& field) { return std::string_view(field.name) == "tick"; });
    return {first, std::end(kFields)};
}

std::span<const DerivedField> derivedFields() { return kDerived; }

NumericField::NumericField(std::string_view name) {
    const auto find = [&](const auto& table) {
        const auto found =
            std::find_if(std::begin(table), std::end(table), [&](const auto& f) { return f.name == name; });
        return found == std::end(table) ? nullptr : &*found;
    };
    stored_ = find(kFields);
    derived_ = find(kDerived);
    if (!stored_ && !derived_) throw std::invalid_argument("no tick field is named '" + std::string(name) + "'");
}

double NumericField::of(const TickSample& sample) const {
    if (!stored_) return derived_->of(sample);
    return visitValue(*stored_, sample.tick, [](const auto& value) { return static_cast<double>(value); });
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
    std::string text = "| field | type | meaning |\n|---|---|---|\n";
    for (std::size_t i = 0; i < std::size(kFields);) {
        // Components of a vector or pose share a row.
        const TickField& first = kFields[i];
        text += "| `" + std::string(first.name) + "`";
        while (++i < std::size(kFields) && std::string_view(kFields[i].help) == first.help &&
               std::string_view(kFields[i].type()) == first.type())
            text += ", `" + std::string(kFields[i].name) + "`";
        text += std::string(" | ") + (first.type() + 1) + " | " + first.help + " |\n";
    }
    text += "\n| derived field | meaning |\n|---|---|\n";
    for (const DerivedField& field : kDerived) text += "| `" + std::string(field.name) + "` | " + field.help + " |\n";
    return text;
}

}  // namespace touchstone::sandbox
