#include "haptics/sandbox/devices/inverse_messages.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace touchstone::sandbox {
namespace {

using nlohmann::json;

constexpr double kMmPerM = 1000;
constexpr std::size_t kLongestName = 64, kLongestText = 200;
// The lists in which the service names grips; wired, wireless and custom.
constexpr std::array kGripLists{"verse_grip", "wireless_verse_grip", "custom_verse_grip"};

/// The member of an object; null JSON if there is none.
const json& at(const json& object, const char* key) {
    static const json none;
    if (!object.is_object()) return none;
    const auto found = object.find(key);
    return found == object.end() ? none : *found;
}

/// A text of an object as one line, shortened to whole characters; empty if there is none.
std::string textAt(const json& object, const char* key) {
    const json& value = at(object, key);
    if (!value.is_string()) return {};
    std::string text = value.get<std::string>();
    std::size_t end = std::min(text.size(), kLongestText);
    while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    text.resize(end);
    for (char& c : text)
        if (static_cast<unsigned char>(c) < 0x20) c = ' ';
    return text;
}

bool isFalse(const json& value) { return value.is_boolean() && !value.get<bool>(); }

/// Reads finite numbers of an object into `to`.
template <std::size_t n>
bool numbersAt(const json& object, const std::array<const char*, n>& keys, std::array<double, n>& to) {
    for (std::size_t i = 0; i < n; ++i) {
        const json& value = at(object, keys[i]);
        if (!value.is_number()) return false;
        to[i] = value.get<double>();
        if (!std::isfinite(to[i])) return false;
    }
    return true;
}

/// The entry of a list with this identifier, or its first entry if that is empty; null JSON if there is none.
const json& entryOf(const json& list, const std::string& id) {
    static const json none;
    if (!list.is_array()) return none;
    for (const json& entry : list) {
        const std::string its = textAt(entry, "device_id");
        if (!its.empty() && (id.empty() || its == id)) return entry;
    }
    return none;
}

std::optional<GripState> gripIn(const json& entry) {
    const json &status = at(entry, "status"), &state = at(entry, "state");
    for (const char* needed : {"connected", "awake", "ready"})
        if (isFalse(at(status, needed))) return {};
    std::array<double, 4> q;
    if (!numbersAt(at(state, "orientation"), std::array{"w", "x", "y", "z"}, q)) return {};
    const Quat q_HS(q[0], q[1], q[2], q[3]);
    if (!(q_HS.norm() > 0.5 && q_HS.norm() < 2)) return {};
    GripState grip{.id = textAt(entry, "device_id"), .q_DS = fromHaply(q_HS.normalized())};
    if (const json& one = at(state, "button"); one.is_boolean() && one.get<bool>()) grip.buttons = 1;
    int bit = 0;  // a JSON object is sorted by its keys: a, b, c
    for (const auto& [key, pressed] : at(state, "buttons").items())
        if (pressed.is_boolean() && bit < 32) grip.buttons |= (pressed.get<bool>() ? 1u : 0u) << bit++;
    return grip;
}

std::optional<GripState> gripIn(const json& message, const std::string& id) {
    for (const char* list : kGripLists) {
        const json& entries = at(message, list);
        if (!entries.is_array()) continue;
        for (const json& entry : entries)
            if (id.empty() || textAt(entry, "device_id") == id)
                if (auto grip = gripIn(entry)) return grip;
    }
    return {};
}

InverseFault stateIn(const json& entry, InverseState& state) {
    const json& status = at(entry, "status");
    state.notReady = isFalse(at(status, "power_supply")) ? "power supply"
                     : isFalse(at(status, "calibrated")) ? "calibration"
                     : isFalse(at(status, "ready"))      ? "readiness"
                                                         : "";
    if (!state.notReady.empty()) return InverseFault::NotReady;
    std::array<double, 3> p;
    if (!numbersAt(at(at(entry, "state"), "cursor_position"), std::array{"x", "y", "z"}, p))
        return InverseFault::NoPosition;
    state.p_DS = fromHaply(Vec3(kMmPerM * Vec3(p[0], p[1], p[2])));
    return Pose{state.p_DS, Quat::Identity()}.isValid() ? InverseFault::None : InverseFault::FarPosition;
}

/// The service could give values in other axes or another scale, if an earlier client asked it to.
std::string frameProblem(const json& config) {
    const std::string basis = textAt(at(config, "basis"), "permutation");
    if (!basis.empty() && basis != "XYZ" && basis != "+X+Y+Z") return "axes '" + basis + "'";
    std::array<double, 3> scale;
    if (numbersAt(at(at(config, "mount"), "scale"), std::array{"x", "y", "z"}, scale) &&
        scale != std::array<double, 3>{1, 1, 1})
        return "a mount with a scale";
    return {};
}

}  // namespace

bool losesDevice(InverseFault fault) {
    return fault == InverseFault::Disconnected || fault == InverseFault::MessageTooLong ||
           fault == InverseFault::Unplugged;
}

Vec3 fromHaply(const Vec3& v) { return {v.x(), v.z(), -v.y()}; }
Vec3 toHaply(const Vec3& v) { return {v.x(), -v.z(), v.y()}; }
Quat fromHaply(const Quat& q) {
    const Vec3 axis = fromHaply(Vec3(q.vec()));
    return {q.w(), axis.x(), axis.y(), axis.z()};
}

InverseInventory readInventory(const std::string& message, const std::string& device, const std::string& grip) {
    const json all = json::parse(message, nullptr, false);
    if (!at(all, "inverse3").is_array())
        throw std::runtime_error(
            "the first message is no inventory of devices, so this is not Haply's Inverse Service "
            "3.x: name its port with port=PORT");
    const json& entry = entryOf(all["inverse3"], device);
    if (entry.is_null())
        throw std::runtime_error(device.empty() ? "the service has no Inverse3: connect and power it"
                                                : "the service has no Inverse3 '" + device + "': see Haply Hub");
    const json& config = at(entry, "config");
    InverseInventory inventory{.device = textAt(entry, "device_id"),
                               .model = textAt(config, "type"),
                               .handedness = textAt(config, "handedness"),
                               .firmware = textAt(config, "extended_firmware_version"),
                               .vectorCommand = at(all, "session_id").is_number(),
                               .inUse = at(at(entry, "status"), "in_use") == json(true)};
    if (inventory.device.size() > kLongestName)
        throw std::runtime_error("the identifier of the Inverse3 has more than 64 characters");
    if (const std::string problem = frameProblem(config); !problem.empty())
        throw std::runtime_error("the service gives positions with " + problem +
                                 ": reset the basis and the mount of the device in Haply Hub");
    const InverseFault fault = stateIn(entry, inventory.state);
    if (fault == InverseFault::NotReady)
        throw std::runtime_error("the Inverse3 lacks its " + inventory.state.notReady +
                                 ": power it, calibrate it on its inkwell, and choose the device again");
    if (fault != InverseFault::None) throw std::runtime_error("the inventory lacks a valid position of the Inverse3");
    inventory.state.grip = gripIn(all, grip);
    return inventory;
}

InverseFault readState(const std::string& message, const std::string& device, const std::string& grip,
                       InverseState& state) {
    const json all = json::parse(message, nullptr, false);
    if (!all.is_object()) return InverseFault::NotJson;
    const json& entry = entryOf(at(all, "inverse3"), device);
    if (entry.is_null()) return InverseFault::Unplugged;
    const InverseFault fault = stateIn(entry, state);
    if (fault == InverseFault::None) state.grip = gripIn(all, grip);
    return fault;
}

std::optional<InverseEvent> readEvent(const std::string& message, const std::string& device) {
    const json all = json::parse(message, nullptr, false);
    const std::string name = textAt(all, "name"), level = textAt(all, "level");
    if (name.empty()) return {};
    const json& data = at(all, "data");
    const std::string its = textAt(data, "device_id");
    std::string kind = textAt(data, "safety_type");
    if (kind.empty()) kind = textAt(data, "reason");
    InverseEvent event{.text = "The service reports '" + name + "'" + (kind.empty() ? "" : ", " + kind)};
    if (const std::string text = textAt(all, "message"); !text.empty()) event.text += ": " + text;
    if (!its.empty() && its != device) return event;
    const bool error = level == "error" || level == "critical" || level == "panic";
    if (name == "device-disconnected" && !its.empty())
        event.fault = InverseFault::Unplugged;
    else if (error || (name == "device-safety-triggered" && level == "warning") || name == "device-busy" ||
             name == "device-calibration-failed")
        event.fault = InverseFault::SafetyEvent;
    return event;
}

ForceMessage::ForceMessage(const std::string& device, bool vectorCommand)
    : head_(R"({"inverse3":[{"device_id":)" + json(device).dump() + R"(,"commands":{"set_cursor_force":{")" +
            (vectorCommand ? "vector" : "values") + R"(":{"x":)"),
      tail_("}}}}]}") {}

const std::string& ForceMessage::text(const Vec3& force) {
    const Vec3 its = toHaply(force);
    text_ = head_;
    for (int i = 0; i < 3; ++i) {
        if (i > 0) text_ += i == 1 ? ",\"y\":" : ",\"z\":";
        char number[32];  // to_chars knows no locale
        text_.append(number, std::to_chars(number, number + sizeof number, its[i] + 0.0).ptr);
    }
    return text_ += tail_;
}

}  // namespace touchstone::sandbox
