// Runs as the program makes them, and replays.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/ui/user_files.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tools/python/bindings/bindings.hpp"

namespace touchstone::python {
namespace {

struct RunResult {
    py::object report, ticks, replay;
};

py::object replayDict(const std::optional<sandbox::ReplayCheck>& check) {
    if (!check) return py::none();
    py::dict dict;
    dict["ticks"] = check->ticks;
    dict["same"] = check->same;
    dict["first_different"] = check->different;
    dict["differences"] = check->differences;
    dict["not_compared"] = check->notCompared;
    return dict;
}

RunResult run(const py::object& scene, const std::optional<std::string>& device, const std::optional<Settings>& given,
              std::optional<double> seconds, const std::filesystem::path& record, bool timing) {
    SceneHandle& handle = sceneOf(scene);
    if (seconds && !(*seconds > 0 && std::isfinite(*seconds))) throw std::invalid_argument("seconds must be above 0");
    sandbox::HeadlessOptions options;
    options.seconds = seconds;
    options.timing = timing;
    options.record = record;
    options.device = device.value_or(sandbox::defaultDevice(handle.scene(), false));
    options.configFolder = engine::configFolder();
    std::vector<std::string> said;
    options.say = [&](sandbox::Message::Kind, const std::string& text) { said.push_back(text); };
    const auto recording = sandbox::recordingOf(options.device);
    const Settings settings = settingsFor(handle, given);
    if (recording) {
        const sandbox::Recording recorded(*recording);
        handle.world(given ? settings : recorded.settings());
        if (sandbox::hadSpheres(recorded.scene())) handle.buildTrees();
        if (given) options.adjust = [settings](const Settings&) { return settings; };
    } else {
        handle.world(settings);
    }
    std::vector<RecordedTick> ticks;
    options.onRecord = [&](const RecordedTick& tick) {
        ticks.push_back(tick);
        if (ticks.size() % 1024 == 0 && !noInterrupt()) throw Interrupt{};
    };
    std::optional<sandbox::HeadlessRun> result;
    try {
        const py::gil_scoped_release free;
        result = sandbox::runHeadless(*handle.shared(), settings, options);
    } catch (const Interrupt&) {
        raiseInterrupt();
    }
    for (const std::string& text : said) py::module_::import("warnings").attr("warn")(text);
    if (!result->recordingFailure.empty()) raise(PyExc_OSError, result->recordingFailure);
    return {fromJson(sandbox::toJson(result->report).dump()), ticksArray(ticks), replayDict(result->replay)};
}

}  // namespace

void bindRuns(py::module_& module) {
    py::class_<RunResult>(module, "Run", "What run() returns.")
        .def_readonly("report", &RunResult::report, "The report of `touchstone run --report`, a dict.")
        .def_readonly("ticks", &RunResult::ticks, "All ticks, an array (n,) of `tick_type`.")
        .def_readonly("replay", &RunResult::replay,
                      "How a replay compares with its recording: a dict with ticks, same, first_different (row or "
                      "None), differences (sentences), not_compared. None for other devices.");
    module.def(
        "_recorded_scene",
        [](const std::filesystem::path& folder, const std::filesystem::path& named,
           const std::filesystem::path& bundled) {
            const sandbox::Recording recording(folder);
            try {
                return sandbox::findRecordedScene(recording.scene(), folder, named,
                                                  "put it beside the recording, or name it: Recording(folder, scene)",
                                                  bundled);
            } catch (const std::runtime_error& missing) {
                throw engine::SceneError(missing.what());
            }
        },
        py::arg("folder"), py::arg("named"), py::arg("bundled"), "Where the scene of a recording is now.");
    module.def(
        "run", run, py::arg("scene"), py::arg("device") = py::none(), py::arg("settings") = py::none(), py::kw_only(),
        py::arg("seconds") = py::none(), py::arg("record") = "", py::arg("timing") = false,
        R"(A run without a window, as `touchstone run --headless` makes it, with the same bits: device, tick and safety stage.

device: as --device, e.g. "demo:NAME", "insert:7", "replay:FOLDER"; by default the demonstration. seconds: of simulated
time, by default until the motion ends. record: a new folder for a recording. timing: also measure CPU times.)");
}

}  // namespace touchstone::python
