// A study in a live session, without a window: a row agrees with its trial, or there is no row.
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "haptics/math/hash.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/trials/live_trials.hpp"
#include "tests/program/program.hpp"
#include "tests/support/fake_hd/fake_hd_device.hpp"
#include "tests/support/ui_scene.hpp"

namespace touchstone::live_trials_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;
using Catch::Contains;
using nlohmann::ordered_json;

namespace {

/// One trial with the given device, with a time limit of 0.5 s.
struct Study {
    TempFolder folder;
    std::filesystem::path file = folder.path() / "down.glb";
    std::map<int, ordered_json> rows;
    LiveTrials live;
    LiveSession session;

    explicit Study(const std::string& device, double seconds = 0.5, std::size_t ringCapacity = 1 << 14)
        : live(protocol(device, seconds),
               {.queue = {Trial{.number = 1, .repetition = 1, .order = 1, .seed = 4}},
                .sceneFile = [](const std::string& name) { return std::filesystem::path(name); },
                .folder =
                    [this](const Trial&) {
                        std::filesystem::remove_all(recording());
                        return recording();
                    },
                .done = [this](const Trial& trial, const ordered_json& row) { rows[trial.number] = row; }}),
          session(options(ringCapacity)) {
        engine::writeGltf(downScene(), file);
        REQUIRE(until([&] { return live.ready(session); }));
    }
    Protocol protocol(const std::string& device, double seconds) const {
        return readProtocol(ordered_json{{"format", "touchstone trials"},
                                         {"participants", 1},
                                         {"device", device},
                                         {"time_limit_s", seconds},
                                         {"conditions", {{{"scene", file.string()}, {"stiffness", 0.7}}}}},
                            "study");
    }
    SessionOptions options(std::size_t ringCapacity) {
        SessionOptions its;
        its.device = live.restingDevice();
        its.adjust = [this](const Settings& settings) { return live.settings(settings); };
        its.onTick = [this](const TickRecord& tick) { live.add(tick, session); };
        its.treeCache.clear();
        its.loop.realTime.raise = false;
        its.loop.ringCapacity = ringCapacity;
        its.loop.watchdogMs = 0;
        return its;
    }
    std::filesystem::path recording() const { return folder.path() / "trial"; }

    bool until(const std::function<bool()>& done) {
        return waitUntil([&] {
            live.update(session);
            session.update();
            return done();
        });
    }
    /// Whether the clock of the trial runs.
    bool started() {
        live.start(session);
        return until([&] {
            return live.running() && session.recording().recorder() && session.recording().recorder()->rows() > 20;
        });
    }
    bool told(const std::string& text) const {
        return std::any_of(session.log().messages().begin(), session.log().messages().end(),
                           [&](const Message& message) { return message.text.find(text) != std::string::npos; });
    }
};

const Vec3 kStart(0, 15, 0);

}  // namespace

TEST_CASE("live trials: a row covers all ticks of its recording", "[session]") {
    // The hand seats the cube; with the mouse the trial reaches its time limit.
    const auto [device, outcome] = GENERATE(std::pair<std::string, std::string>("insert", "seated"),
                                            std::pair<std::string, std::string>("mouse", "time limit"));
    INFO(device);
    Study study(device, device == "insert" ? 20 : 0.5);
    REQUIRE(study.started());
    REQUIRE(study.until([&] { return study.live.left() == 0; }));
    const ordered_json& row = study.rows.at(1);
    INFO(row);
    CHECK(row.at("outcome") == outcome);
    CHECK(row.at("stiffness_N_per_mm") == 0.7);

    Recording recording(study.recording());
    std::uint64_t ticks = 0, hash = 0, trips = 0;
    std::uint32_t acting = 0;
    for (RecordedTick tick; recording.next(tick); ++ticks) {
        hash = ticks == 0 ? hashTick(tick.record) : hashTick(tick.record, hash);
        trips += static_cast<std::uint64_t>(std::popcount(tick.record.trips & ~acting));
        acting = tick.record.trips;
    }
    CHECK(row.at("ticks") == ticks);
    CHECK(row.at("hash") == hexadecimal(hash));
    CHECK(row.at("safety_trips") == trips);
}

TEST_CASE("live trials: a trial begins at the start with its settings, after any earlier changes", "[session]") {
    const std::string device = GENERATE("mouse", "insert");
    INFO(device);
    Study study(device, 0.2);
    study.session.device().mouse.get()->grab({{10, 5, 0}, Quat::Identity()});  // held against the slab
    Settings soft = study.session.settings();
    soft.stiffness = 0.3;
    study.session.setSettings(soft);
    REQUIRE(study.until(
        [&] { return study.session.record()->X_WT.p.x() > 9 && study.session.record()->wrench_C.force.norm() > 0.5; }));
    REQUIRE(study.started());
    REQUIRE(study.until([&] { return study.live.left() == 0; }));
    CHECK(study.rows.at(1).at("stiffness_N_per_mm") == 0.7);

    Recording recording(study.recording());
    RecordedTick tick;
    REQUIRE(recording.next(tick));
    CHECK(tick.record.tick == 0);
    CHECK((tick.record.X_WT.p - kStart).norm() <
          (device == "mouse" ? 1e-6 : 8));  // the hand has errors of 2 mm per axis
    CHECK(tick.settings.stiffness == 0.7);
    CHECK(recording.device() == (device == "mouse" ? device : "insert:4"));
}

TEST_CASE("live trials: a change during a trial gives no row, and the trial is repeated", "[session]") {
    Study study("mouse", 20);
    REQUIRE(study.started());
    LiveSession& session = study.session;
    std::string why = "its scene, its device or a setting was changed";
    SECTION("a file without roles is opened") {
        engine::Scene bare;
        addBox(bare, "box", glm::vec3(0.01f));
        updateWorldTransforms(bare);
        engine::writeGltf(bare, study.folder.path() / "bare.glb");
        session.open({study.folder.path() / "bare.glb"});
        REQUIRE(waitUntil([&] {  // the scene is shown between two frames
            session.update();
            study.live.abort();
            return session.request().file == study.folder.path() / "bare.glb";
        }));
    }
    SECTION("another scene is opened") {
        engine::writeGltf(holdScene(), study.folder.path() / "hold.glb");
        session.open({study.folder.path() / "hold.glb"});
    }
    SECTION("the goal is removed") { session.mark({GiveRole{2, std::nullopt}}); }
    SECTION("an obstacle is moved") {
        const engine::LocalTransform from;
        engine::LocalTransform to;
        to.translation.x = 0.001;
        session.edit({engine::PlaceNode{1, from, to}});
    }
    SECTION("another device is chosen") { session.chooseDevice("demo"); }
    SECTION("a setting") {
        Settings other = session.settings();
        other.stiffness = 0.5;
        session.setSettings(other);
    }
    SECTION("the tool is reset") {
        session.restart();
        why = "ticks were lost, or it was reset";
    }
    SECTION("the recording is stopped") {
        session.recording().stop();
        why = "its recording is incomplete";
    }
    REQUIRE(study.until([&] { return !study.live.running() && study.live.ready(session); }));
    CHECK(study.rows.empty());
    CHECK(study.live.left() == 1);
    CHECK(study.told("The trial must be repeated: " + why));
    CHECK(session.request().file == study.file);
    CHECK(session.request().edits.empty());
    CHECK(session.device().choice == "mouse");
    CHECK(session.settings().stiffness == 0.7);
    REQUIRE(study.started());
    study.live.abort();
    CHECK(study.until([&] { return study.live.left() == 0; }));
    CHECK(study.rows.at(1).at("outcome") == "abort");
}

TEST_CASE("live trials: a scene that is changed before the start is reopened", "[session]") {
    Study study("mouse");
    LiveSession& session = study.session;
    SECTION("another scene") {
        engine::writeGltf(holdScene(), study.folder.path() / "hold.glb");
        session.open({study.folder.path() / "hold.glb"});
    }
    SECTION("the goal's role") { session.mark({GiveRole{2, std::nullopt}}); }
    SECTION("while it is opened") {
        session.reload();
        engine::writeGltf(holdScene(), study.folder.path() / "hold.glb");
        session.open({study.folder.path() / "hold.glb"});
    }
    CHECK_FALSE(study.live.ready(session));
    study.live.start(session);
    CHECK_FALSE(study.live.running());
    REQUIRE(study.until([&] { return study.live.ready(session); }));
    CHECK(session.request().file == study.file);
    REQUIRE(session.scene()->roles.goal);
    CHECK(study.started());
}

TEST_CASE("live trials: no trial starts with a device that cannot start", "[session]") {
    Study study("phantom:,library=/no/such/libHD.so");
    CHECK(study.session.device().choice == "mouse");
    study.live.start(study.session);
    CHECK_FALSE(study.live.running());
    CHECK(study.until([&] { return study.live.ready(study.session); }));
    CHECK(study.rows.empty());
}

TEST_CASE("live trials: with motors the clock waits at the start until they are engaged", "[session]") {
    FakeHd fake;
    Study study("phantom:,stale=500", 0.5);
    LiveSession& session = study.session;
    session.engage();  // then moved before Start
    fake.hand(0, 30, 0, 0, 0, 0);
    REQUIRE(study.until([&] { return session.record()->X_WT.p.y() > kStart.y() + 25; }));
    study.live.start(session);
    const std::uint64_t from = session.snapshot()->session;
    REQUIRE(study.until([&] { return session.snapshot()->session > from && session.record()->tick > 200; }));
    CHECK_FALSE(study.live.running());
    SECTION("engaged") {
        session.engage();
        REQUIRE(study.until([&] { return study.live.running(); }));
        REQUIRE(study.until([&] { return study.live.left() == 0; }));
        CHECK(study.rows.at(1).at("outcome") == "time limit");
        Recording recording(study.recording());
        RecordedTick tick;
        REQUIRE(recording.next(tick));
        CHECK((tick.record.X_WT.p - kStart).norm() < 1);
        CHECK_FALSE(tick.record.flags & kPaused);
    }
    SECTION("faulted") {
        fake.fault("comm");
        REQUIRE(study.until([&] { return session.snapshot()->engagement == Engagement::Faulted; }));
        for (int frame = 0; frame < 20; ++frame) {
            study.live.update(session);
            session.update();
        }
        CHECK_FALSE(study.live.running());
        CHECK(study.rows.empty());
    }
}

TEST_CASE("live trials: a trial that lost ticks is repeated", "[session]") {
    Study study("mouse", 20, 64);
    study.live.start(study.session);
    REQUIRE(study.until([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(200));  // the ring holds 64 ms
        return study.told("The trial must be repeated: ticks were lost");
    }));
    CHECK_FALSE(study.live.running());
    CHECK(study.rows.empty());
}

}  // namespace touchstone::live_trials_tests
