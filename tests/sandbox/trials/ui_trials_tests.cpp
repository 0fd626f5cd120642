// A study in the window: Start is pressed, the trial ends by itself or is aborted, and the next one opens.
#include <catch2/catch.hpp>
#include <map>
#include <nlohmann/json.hpp>

#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/trials/live_trials.hpp"
#include "tests/support/ui_scene.hpp"
#include "tests/support/ui_text.hpp"
#include "tests/support/ui_user.hpp"

namespace touchstone::ui_trials_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;
using nlohmann::ordered_json;

namespace {

/// Trials with the given device, and their window.
struct Study {
    TempFolder folder;
    std::filesystem::path file = folder.path() / "down.glb";
    Protocol protocol;
    std::map<int, ordered_json> rows;
    LiveTrials live;
    LiveSession* session = nullptr;
    bool felt = false;  // a force, in the trial that runs
    User user;

    explicit Study(const std::string& device, int trials = 2)
        : protocol(readProtocol(ordered_json{{"format", "touchstone trials"},
                                             {"participants", trials},
                                             {"device", device},
                                             {"conditions", {{{"scene", file.string()}, {"stiffness", 0.7}}}}},
                                "study")),
          live(protocol, {.queue = queue(),
                          .sceneFile = [](const std::string& name) { return std::filesystem::path(name); },
                          .folder = [this](const Trial& trial) { return recording(trial.number); },
                          .done = [this](const Trial& trial, const ordered_json& row) { rows[trial.number] = row; }}) {
        engine::writeGltf(downScene(4), file);  // long enough to abort it on a busy machine
    }
    std::deque<Trial> queue() const {
        const std::vector<Trial> trials = protocol.trials();
        return {trials.begin(), trials.end()};
    }
    std::filesystem::path recording(int trial) const { return folder.path() / std::to_string(trial); }

    WindowRunOptions window() {
        WindowRunOptions options = optionsFor(file);
        options.session.device = live.restingDevice();
        options.session.adjust = [this](const Settings& settings) { return live.settings(settings); };
        options.session.onTick = [this](const TickRecord& tick) {
            if (session) live.add(tick, *session);
            felt = felt || (live.running() && tick.wrench_C.force.norm() > 0.1);
        };
        options.panel = [this](LiveSession& shown, const glm::vec4& picture, engine::ItemRects& items) {
            live.draw(shown, picture, &items);
        };
        options.onFrame = [this](WindowFrame& frame) {
            session = &frame.session;
            live.update(frame.session);
        };
        return options;
    }
    void start() {
        user.until([this](WindowFrame& frame) { return live.ready(frame.session); });
        user.doing([this](WindowFrame&) { felt = false; }).click("trial start");
        user.until([this](WindowFrame&) { return live.running(); });
    }
    void end(std::size_t left) {
        user.until([this, left](WindowFrame&) { return live.left() == left; });
    }
};

}  // namespace

TEST_CASE("window: trials start, end, can be aborted, and are recorded", "[ui]") {
    if (!hasDisplay()) return;
    Study study("insert");
    CHECK(study.live.restingDevice() == "mouse");
    const auto isNext = [&](const char* step) {
        study.user.until([&, step](WindowFrame& frame) {
            return study.live.nextStep(frame.session).find(step) != std::string::npos &&
                   frame.items.count("trial next") + frame.items.count("trials done") > 0;
        });
    };
    const auto went = [&](const char* outcome) {
        study.user.doing([&, outcome](WindowFrame& frame) {
            CHECK_THAT(study.live.lastOutcome(), Catch::Contains(outcome));
            CHECK(frame.items.count("trial last") == (*outcome != '\0'));
            const TextFaults faults = textFaults("Trials");
            CHECK(faults.cut.empty());
            CHECK(faults.covered.empty());
        });
    };
    isNext("Press Start");
    went("");
    study.start();
    isNext("Watch");
    study.user.doing([](WindowFrame& frame) { CHECK(frame.session.settings().stiffness == 0.7); });
    study.end(1);
    isNext("Press Start");
    went("seated after ");
    study.start();
    study.user.until([&](WindowFrame&) { return study.felt; });
    study.user.click("trial abort");
    study.end(0);
    isNext("Close the window");
    went("Trial 2, participant 2, ");
    REQUIRE(study.user.use(study.window()));

    REQUIRE(study.rows.size() == 2);
    CHECK(study.rows[1].at("outcome") == "seated");
    CHECK(study.rows[2].at("outcome") == "abort");
    for (const auto& [number, row] : study.rows) {
        INFO(row);
        CHECK(row.at("force_peak_N").get<double>() > 0.1);
        CHECK_FALSE(row.at("deadline_misses").is_null());
        CHECK(isRecording(study.recording(number)));
    }
    CHECK(study.rows[1].size() == study.rows[2].size());
}

TEST_CASE("window: the panel of a study lists the trials to come, and counts those that it does not list", "[ui]") {
    if (!hasDisplay()) return;
    const int trials = GENERATE(4, 6);
    CAPTURE(trials);
    Study study("insert", trials);
    std::string text;
    study.user.until([&](WindowFrame& frame) { return study.live.ready(frame.session); });
    study.user.then([](WindowFrame&, int frames) { return frames > 2; });
    study.user.doing([&](WindowFrame&) { text = shownText("Trials"); });
    REQUIRE(study.user.use(study.window()));
    INFO(text);
    const std::string list = text.substr(std::min(text.find("Then:"), text.size()));
    std::size_t at = 0;
    for (const char* trial : {"2:", "3:", "4:"}) {
        at = list.find(trial, at);
        CHECK(at != std::string::npos);
    }
    CHECK(list.find("5:") == std::string::npos);
    CHECK((list.find("and2more") != std::string::npos) == (trials == 6));
}

TEST_CASE("window: Start returns a tool that was dragged away and holds it at the start", "[ui]") {
    if (!hasDisplay()) return;
    Study study("mouse");
    const auto onTool = [](WindowFrame& frame) { return frame.toolOnScreen; };
    const auto aside = [](WindowFrame& frame) { return (frame.session.record()->X_WT.p - Vec3(0, 15, 0)).norm(); };
    study.user.until([&](WindowFrame& frame) { return study.live.ready(frame.session); });
    study.user.hold(onTool).moveBy({150, 0}).release();
    study.user.until([&](WindowFrame& frame) { return aside(frame) > 10; });
    study.start();
    study.user.until(
        [&](WindowFrame& frame) { return frame.session.recording().recorder()->rows() > 0 && aside(frame) < 0.1; });
    study.user.hold(onTool).then([](WindowFrame&, int frames) { return frames > 20; });
    study.user.doing([&](WindowFrame& frame) { CHECK(aside(frame) < 1); });
    study.user.release().click("trial abort");
    study.end(1);
    CHECK(study.user.use(study.window()));
}

}  // namespace touchstone::ui_trials_tests
