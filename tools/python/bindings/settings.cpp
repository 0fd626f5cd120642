// Settings as a mapping from keys to values.
#include "haptics/loop/settings.hpp"

#include <stdexcept>

#include "haptics/loop/setting_table.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tools/python/bindings/bindings.hpp"

namespace touchstone::python {
namespace {

const SettingInfo& infoOf(const std::string& key) {
    for (const SettingInfo& info : settingTable())
        if (info.key == settingKey(key)) return info;
    throw py::key_error("there is no setting '" + key + "'");
}

py::object valueOf(const Settings& settings, const SettingInfo& info) {
    const std::string text = getSetting(settings, info.key);
    if (!settingChoices(info.key).empty()) return py::str(text);
    if (text == "on" || text == "off") return py::bool_(text == "on");
    const bool whole = info.unit.empty() && text.find_first_not_of("-0123456789") == std::string::npos;
    return whole ? py::object(py::int_(std::stoll(text))) : py::object(py::float_(std::stod(text)));
}

void set(Settings& settings, const std::string& key, const py::object& value) {
    infoOf(key);
    std::string text = py::str(value).cast<std::string>();
    const std::string now = getSetting(settings, key);
    const bool isSwitch = now == "on" || now == "off";
    if (text == "True" || (isSwitch && text == "1")) text = "on";  // also of NumPy's types
    if (text == "False" || (isSwitch && text == "0")) text = "off";
    if (const std::string wrong = setSetting(settings, key, text); !wrong.empty()) throw std::invalid_argument(wrong);
}

Settings changed(Settings settings, const py::kwargs& changes) {
    for (const auto& [key, value] : changes) set(settings, key.cast<std::string>(), value.cast<py::object>());
    return settings;
}

std::string shown(const Settings& settings) {
    std::string text;
    for (const SettingInfo& info : settingTable())
        if (const std::string value = getSetting(settings, info.key); value != getSetting({}, info.key))
            text += (text.empty() ? "" : ", ") + std::string(info.key) + "=" + value;
    return "Settings(" + text + ")";
}

}  // namespace

Settings settingsFor(const SceneHandle& scene, const std::optional<Settings>& given) {
    const Settings settings = given.value_or(scene.scene().settings);
    if (const std::string wrong = checkSettings(settings); !wrong.empty()) throw std::invalid_argument(wrong);
    return settings;
}

void bindSettings(py::module_& module) {
    auto keys = [] {
        py::list all;
        for (const SettingInfo& info : settingTable()) all.append(std::string(info.key));
        return all;
    };
    py::class_<Settings>(module, "Settings",
                         R"(All settings of a tick, as a mapping from the keys of `touchstone run --set`.

Settings() has the defaults; scene.settings those of a scene. Numbers are in the unit that help(key) names. A value
out of its range raises ValueError, an unknown key KeyError.)")
        .def(py::init([](const py::kwargs& changes) { return changed({}, changes); }))
        .def("__getitem__", [](const Settings& s, const std::string& key) { return valueOf(s, infoOf(key)); })
        .def("__setitem__", set)
        .def("__contains__",
             [](const Settings&, const std::string& key) {
                 for (const SettingInfo& info : settingTable())
                     if (info.key == settingKey(key)) return true;
                 return false;
             })
        .def("__iter__", [keys](const Settings&) { return py::iter(keys()); })
        .def("__len__", [](const Settings&) { return settingTable().size(); })
        .def(
            "keys", [keys](const Settings&) { return keys(); }, "The keys, in the order of the program's help.")
        .def("with_", changed, "A copy with some values changed: settings.with_(stiffness=0.5, friction=False).")
        .def(
            "in_mode",
            [](const Settings& settings, const std::string& mode) {
                Settings chosen = settings;
                set(chosen, "mode", py::str(mode));
                return sandbox::withMode(settings, chosen.mode);
            },
            py::arg("mode"),
            "A copy for a mode (default, paper, penalty, god-object), with its solver, as `touchstone run --mode`.")
        .def_static(
            "help",
            [](const std::string& key) {
                const SettingInfo& info = infoOf(key);
                return std::string(info.unit.empty() ? "" : "[" + std::string(info.unit) + "] ") +
                       std::string(info.help);
            },
            py::arg("key"), "The unit of a setting, and what happens if it is larger or smaller.")
        .def(py::pickle(
            [](const Settings& settings) {
                py::dict values;
                for (const SettingInfo& info : settingTable())
                    values[py::str(std::string(info.key))] = getSetting(settings, info.key);
                return values;
            },
            [](const py::dict& values) {
                Settings settings;
                for (const auto& [key, value] : values)
                    set(settings, key.cast<std::string>(), value.cast<py::object>());
                return settings;
            }))
        .def("__copy__", [](const Settings& s) { return s; })
        .def("__deepcopy__", [](const Settings& s, const py::dict&) { return s; })
        .def("__eq__", [](const Settings& a, const Settings& b) { return a == b; })
        .def("__repr__", shown);
}

}  // namespace touchstone::python
