// Recordings: writing, bit-reproducible replay, recovery, export.
#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/scene/gltf_write.hpp"
#include "haptics/sandbox/record/recorder.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/program/program.hpp"
#include "tests/support/file_size_limit.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::recording_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;

namespace {

/// The press scene in a file, opened from there.
struct Press {
    TempFolder folder;
    fs::path file = folder.path() / "press.glb";
    sandbox::HapticScene scene = [this] {
        engine::writeGltf(pressScene(), file);
        return sandbox::openScene(file, {.treeCache = {}, .progress = {}, .allTrees = true});
    }();
};
Press& press() {
    static Press made;
    return made;
}

/// Repeats the demonstration; some readings are non-finite, and some have no fresh pose.
class UnsteadyDevice final : public Device {
  public:
    DeviceReading read(double t, double) noexcept override {
        const int tick = tick_++;
        DeviceReading reading{.X_WT_device = press().scene.demonstration->at(std::fmod(t, 800))};
        if (tick % 97 == 50) reading.X_WT_device.p.x() = std::numeric_limits<double>::quiet_NaN();
        if (tick % 89 == 40) reading.X_WT_device.q.coeffs() *= 1.5;
        reading.valid = tick % 101 != 60;
        return reading;
    }
    void write(const Wrench&) noexcept override {}

  private:
    int tick_ = 0;
};

std::unique_ptr<Session> session(std::shared_ptr<const World> world, const Settings& settings, std::uint64_t number) {
    return std::make_unique<Session>(std::move(world), settings, std::make_unique<UnsteadyDevice>(), number);
}

/// A run with every kind of change, recorded from its middle on, with the tool in contact.
std::uint64_t recordEverything(const fs::path& folder, Geometry geometry) {
    const Settings given = sandbox::withGeometry(press().scene.settings, geometry);
    Settings settings = given;
    TickDriver driver(session(press().scene.world, settings, 0));
    sandbox::Recorder recorder(folder);
    recorder.announce(0, sandbox::recordedScene(press().file, *press().scene.world), "unsteady");
    TickRecord last;
    bool recording = false;
    const auto run = [&](int ticks) {
        for (int i = 0; i < ticks; ++i) {
            last = driver.tick();
            const TickState& state = driver.session().state;
            if (recording) recorder.add(recordedTick(state, last, driver.session().number), obstaclesAtStart(state));
            driver.takeRetired();
        }
    };
    const auto change = [&](const char* key, const char* value) {
        REQUIRE(setSetting(settings, key, value).empty());
        driver.request(settings);
    };
    const auto lift = [&](double y) {
        Pose X_WO = press().scene.world->obstacles[0].X_WO;
        X_WO.p.y() += y;
        driver.moveObstacles(std::span(&X_WO, 1));
    };
    lift(0.6);
    run(330);
    recording = true;
    lift(0.3);
    run(1);
    CHECK(recorder.rows() == 0);  // no start has been recorded yet
    CHECK(last.wrench_C.force.norm() > 0.5);
    driver.resume(last);
    run(20);
    change("stiffness", "2.5");  // ramps
    run(10);
    lift(0.8);
    run(80);
    change("geometry", geometry == Geometry::Mesh ? "spheres" : "mesh");  // fades
    run(200);
    CHECK(last.wrench_C.force.norm() > 0.5);
    change("solver", "pqp");  // fades
    run(150);
    change("linearizations", "3");
    driver.restart();
    lift(0);
    run(400);
    lift(0.5);
    change("rate", "2000");
    run(300);
    change("pause", "on");
    run(150);
    change("pause", "off");
    change("mode", "paper");
    run(300);
    World moved = *press().scene.world;
    moved.obstacles[0].X_WO.p.y() += 0.5;
    const auto other = std::make_shared<const World>(moved);
    recorder.announce(1, sandbox::recordedScene(press().file, *other), "unsteady");
    settings = given;
    driver.open(session(other, settings, 1));
    run(600);
    recorder.flush();
    CHECK(recorder.failure().empty());
    return recorder.rows();
}

sandbox::HeadlessRun replay(const fs::path& folder, sandbox::HeadlessOptions options = {}) {
    options.device = "replay:" + folder.string();
    options.timing = false;
    return sandbox::runHeadless(press().scene, press().scene.settings, options);
}

/// A complete recording of the demonstration.
fs::path pressRecording(const TempFolder& folder) {
    sandbox::HeadlessOptions options;
    options.timing = false;
    options.record = folder.path() / "press";
    const sandbox::HeadlessRun run = sandbox::runHeadless(press().scene, press().scene.settings, options);
    REQUIRE(run.recordingFailure.empty());
    return options.record;
}

std::string bytesOf(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}
void writeBytes(const fs::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

std::uint64_t rowsIn(const fs::path& folder) { return sandbox::TickFileReader(folder / "ticks.npy").rows(); }

}  // namespace

TEST_CASE("recording: a run with changes, restarts, pauses, bad input and another world is bit-reproducible",
          "[sandbox][recording]") {
    const TempFolder folder;
    const std::uint64_t rows = recordEverything(folder.path() / "run", GENERATE(Geometry::Spheres, Geometry::Mesh));
    CHECK(rows == 20 + 90 + 200 + 150 + 400 + 300 + 150 + 300 + 600);

    sandbox::HeadlessOptions again;
    again.record = folder.path() / "again";
    const sandbox::HeadlessRun run = replay(folder.path() / "run", again);
    CHECK(run.replay->ticks == rows);
    CHECK(run.replay->same == rows);
    CHECK_FALSE(run.replay->different);
    CHECK(run.replay->differences.empty());

    // A recording of the replay equals the original.
    const sandbox::HeadlessRun third = replay(folder.path() / "again");
    CHECK(third.replay->same == rows);
    CHECK(third.report.hash == run.report.hash);
    std::set<std::string> kinds;
    const sandbox::Recording second(folder.path() / "again");
    for (const auto& change : second.header()["changes"]) kinds.insert(change["kind"].get<std::string>());
    CHECK(kinds == std::set<std::string>{"settings", "start", "scene"});
}

TEST_CASE("recording: one without obstacle columns is read as a run with fixed obstacles", "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path recording = pressRecording(folder);
    // As written by a program without these columns.
    std::string ticks = bytesOf(recording / "ticks.npy"), notes = bytesOf(recording / "recording.json");
    for (std::size_t at; (at = ticks.find("'obstacle")) != std::string::npos;) ticks[at + 1] = '-';
    writeBytes(recording / "ticks.npy", ticks);
    const auto begin = notes.find("\"obstacles\"", notes.find("\"loaded_before\""));
    REQUIRE(begin != std::string::npos);
    notes.replace(begin, 11, "\"unknown__\"");
    writeBytes(recording / "recording.json", notes);
    CHECK(sandbox::Recording(recording).obstacles().empty());
    CHECK(replay(recording).replay->same == 801);
}

TEST_CASE("recording: a replay reports changed input, settings, scene or program, and gaps", "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path recording = pressRecording(folder);
    CHECK(replay(recording).replay->same == 801);

    SECTION("a bit of the input") {
        std::string bytes = bytesOf(recording / "ticks.npy");
        const std::size_t header = bytes.size() - 801 * sandbox::tickRowBytes();
        bytes[header + 400 * sandbox::tickRowBytes() + 8 + 3] ^= 1;  // in input_y_mm, in contact
        writeBytes(recording / "ticks.npy", bytes);
        const sandbox::ReplayCheck check = *replay(recording).replay;
        REQUIRE(check.different);
        CHECK(*check.different == 400);
        CHECK(check.differences.empty());
    }
    SECTION("other settings") {
        sandbox::HeadlessOptions options;
        options.adjust = [](Settings settings) {
            settings.stiffness = 0.7;
            return settings;
        };
        const sandbox::HeadlessRun run = replay(recording, options);
        CHECK(run.replay->same == 0);
        REQUIRE(run.replay->differences.size() == 1);
        CHECK_THAT(run.replay->differences[0], Contains("settings"));
        CHECK(run.settings.stiffness == 0.7);
    }
    SECTION("another scene") {
        engine::Scene made = pressScene();
        setExtras(made, made.nodes[0], {{"touchstone", {{"role", "tool"}, {"leaves", 32}}}});
        engine::writeGltf(made, folder.path() / "other.glb");
        const sandbox::HapticScene other =
            sandbox::openScene(folder.path() / "other.glb", {.treeCache = {}, .progress = {}, .allTrees = true});
        sandbox::HeadlessOptions options;
        options.device = "replay:" + recording.string();
        options.timing = false;
        const sandbox::ReplayCheck check = *sandbox::runHeadless(other, other.settings, options).replay;
        REQUIRE(check.differences.size() == 2);
        CHECK_THAT(check.differences[0], Contains("content hash"));
        CHECK_THAT(check.differences[1], Contains("the sphere tree of the tool differs"));
    }
    SECTION("another program") {
        std::string text = bytesOf(recording / "recording.json");
        const auto at = text.find("\"compiler\": \"");
        text.replace(at + 13, 3, "XYZ");
        writeBytes(recording / "recording.json", text);
        const sandbox::ReplayCheck check = *replay(recording).replay;
        REQUIRE(check.differences.size() == 1);
        CHECK_THAT(check.differences[0], Contains("compiler was XYZ"));
    }
    SECTION("a gap") {
        sandbox::Recording whole(recording);
        {
            sandbox::Recorder recorder(folder.path() / "gap");
            recorder.announce(0, whole.scene(), "demo");
            RecordedTick tick;
            for (int row = 0; whole.next(tick); ++row)
                if (row < 400 || row >= 410) recorder.add(tick);
            CHECK(recorder.lost() == 10);
        }
        const sandbox::ReplayCheck check = *replay(folder.path() / "gap").replay;
        CHECK(check.ticks == 791);
        CHECK(check.same == 400);
        CHECK(check.notCompared == 391);
        CHECK_FALSE(check.different);
    }
}

TEST_CASE("recording: an interrupted one is readable up to the last flush, and recover finds the other rows",
          "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path recording = pressRecording(folder);
    sandbox::Recording source(recording);
    const fs::path cut = folder.path() / "cut";
    sandbox::Recorder recorder(cut);
    recorder.announce(0, source.scene(), "demo");
    RecordedTick tick;
    for (int row = 0; row < 300 && source.next(tick); ++row) {
        if (row == 200) tick.settings.linearizations = 5;  // a change
        recorder.add(tick);
        if (row == 249) recorder.flush();
        if (row >= 249) tick.settings.linearizations = 5;
    }
    // The state that a crash now would leave.
    const fs::path left = folder.path() / "left";
    fs::copy(cut, left, fs::copy_options::recursive);
    CHECK(rowsIn(left) >= 250);
    CHECK(rowsIn(left) <= 300);
    CHECK_NOTHROW(sandbox::Recording(left));

    recorder.flush();
    const std::string whole = bytesOf(cut / "ticks.npy"), notes = bytesOf(cut / "recording.json");
    SECTION("rows that the header does not count, the last one incomplete") {
        // The header as before the last flush.
        std::string bytes = bytesOf(left / "ticks.npy").substr(0, whole.size() - 300 * sandbox::tickRowBytes()) +
                            whole.substr(whole.size() - 300 * sandbox::tickRowBytes()) + "torn";
        writeBytes(left / "ticks.npy", bytes);
        CHECK_THAT(sandbox::recoverRecording(left), Contains("300 ticks") && Contains("torn"));
        CHECK(bytesOf(left / "ticks.npy") == whole);
    }
    SECTION("a header that counts more rows than the file has") {
        writeBytes(cut / "ticks.npy", whole.substr(0, whole.size() - 5));
        CHECK_THROWS_WITH(rowsIn(cut), Contains("touchstone recover"));
        sandbox::recoverRecording(cut);
        CHECK(rowsIn(cut) == 299);
    }
    SECTION("a header of zeros") {
        std::string bytes = whole;
        bytes.replace(0, 64, 64, '\0');
        writeBytes(cut / "ticks.npy", bytes);
        CHECK_THROWS_WITH(rowsIn(cut), Contains("no NumPy file"));
        sandbox::recoverRecording(cut);
        CHECK(bytesOf(cut / "ticks.npy") == whole);
    }
    SECTION("a header of which a part was written") {
        std::string bytes = whole;
        bytes.replace(40, 900, 900, '\0');
        writeBytes(cut / "ticks.npy", bytes);
        sandbox::recoverRecording(cut);
        CHECK(bytesOf(cut / "ticks.npy") == whole);
        writeBytes(cut / "ticks.npy", whole.substr(0, 100));
        CHECK_THAT(sandbox::recoverRecording(cut), Contains("0 ticks"));
        CHECK(rowsIn(cut) == 0);
    }
    SECTION("another file of that name") {
        std::string text = "my notes on these ticks: keep them.\n", array = whole;
        array.replace(array.find("'<f8'"), 5, "'<c8'");
        for (const std::string& foreign : {text, std::string(5000, 'x'), array, "\x93NUMPY\x02" + whole.substr(7)}) {
            writeBytes(cut / "ticks.npy", foreign);
            CHECK_THROWS_WITH(sandbox::recoverRecording(cut), Contains("ticks.npy") && Contains("move it away"));
            CHECK(bytesOf(cut / "ticks.npy") == foreign);
            CHECK(bytesOf(cut / "recording.json") == notes);
        }
    }
    SECTION("truncated notes") {
        for (const std::size_t missing : {1, 5, 8, 20}) {
            writeBytes(cut / "recording.json", notes.substr(0, notes.size() - missing));
            sandbox::recoverRecording(cut);
            CHECK_NOTHROW(sandbox::Recording(cut));
        }
    }
    SECTION("a change at a missing tick is removed") {
        std::string bytes = notes;
        bytes.insert(bytes.rfind("\n ]\n}"), ",\n  {\"row\":5000,\"tick\":5000,\"kind\":\"settings\",\"settings\":{}}");
        writeBytes(cut / "recording.json", bytes);
        sandbox::recoverRecording(cut);
        CHECK(bytesOf(cut / "recording.json") == notes);
    }
    SECTION("empty notes") {
        writeBytes(cut / "recording.json", "{\n \"format\": \"touch");
        CHECK_THROWS_WITH(sandbox::recoverRecording(cut), Contains("recording.json") && Contains("export"));
    }
    SECTION("a complete recording is unchanged") {
        sandbox::recoverRecording(cut);
        CHECK(bytesOf(cut / "ticks.npy") == whole);
        CHECK(bytesOf(cut / "recording.json") == notes);
    }
}

TEST_CASE("recording: a full disk stops the recording but not the run", "[sandbox][recording]") {
    const TempFolder folder;
    sandbox::HeadlessOptions options;
    options.timing = false;
    options.record = folder.path() / "full";
    options.device = "demo";
    int ticks = 0;
    options.onTick = [&](const TickRecord&, double) { ++ticks; };
    sandbox::HeadlessRun run;
    {
        const FileSizeLimit limit(200'000);
        run = sandbox::runHeadless(press().scene, press().scene.settings, options);
    }
    CHECK(ticks == 801);
    CHECK_THAT(run.recordingFailure, Contains("stopped after") && Contains("ticks.npy") && Contains("File too large"));
    CHECK(std::count(run.recordingFailure.begin(), run.recordingFailure.end(), '\n') == 0);
    // The written rows are complete, and the message counts them.
    CHECK(rowsIn(options.record) > 250);
    CHECK_THAT(run.recordingFailure, Contains("stopped after " + std::to_string(rowsIn(options.record)) + " ticks"));
    CHECK(replay(options.record).replay->same == rowsIn(options.record));
}

TEST_CASE("recording: a folder holds only one recording", "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path recording = pressRecording(folder);
    CHECK_THROWS_WITH(sandbox::Recorder(recording), Contains("holds a recording already"));
    CHECK_THROWS_WITH(sandbox::Recorder(folder.path() / "press" / "ticks.npy" / "x"),
                      Contains("cannot make the folder"));
}

TEST_CASE("recording: CSV has every field, and its numbers read back to the same bits", "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path recording = pressRecording(folder);
    sandbox::exportCsv(recording, folder.path() / "ticks.csv");
    std::ifstream csv(folder.path() / "ticks.csv");
    std::string line, header;
    std::getline(csv, line);
    for (const sandbox::TickField& field : sandbox::tickFields())
        header += (header.empty() ? "" : ",") + std::string(field.name);
    CHECK(line == header);
    sandbox::Recording source(recording);
    RecordedTick tick;
    while (std::getline(csv, line)) {
        REQUIRE(source.next(tick));
        const std::size_t first = line.find(',');
        CHECK(std::stod(line.substr(0, first)) == tick.input.X_WT_device.p.x());
        CHECK(std::stod(line.substr(first + 1)) == tick.input.X_WT_device.p.y());
    }
    CHECK_FALSE(source.next(tick));
}

TEST_CASE("recording: the table has every field of a tick once, and the docs list it", "[sandbox][recording]") {
    std::set<std::string> names;
    for (const sandbox::TickField& field : sandbox::tickFields()) names.insert(field.name);
    CHECK(names.size() == sandbox::tickFields().size());
    for (const sandbox::DerivedField& field : sandbox::derivedFields()) names.insert(field.name);
    CHECK(names.size() == sandbox::tickFields().size() + sandbox::derivedFields().size());
    CHECK_THROWS_WITH(sandbox::NumericField("froce_N"), Contains("'froce_N'"));
    // This does not compile if a field is added or removed: it needs a row in haptics/sandbox/record/tick_fields.cpp.
    // Only `touching` has none; the start of a recording holds it.
    [[maybe_unused]] const auto& [tick, device, tool, wrenchC, wrenchO, wrenchOut, flags, trips, status, pairs, rows,
                                  truncated, screened, inexact, iterations, linearizations, margin, projection, hover,
                                  penetration, kkt, touching, sticking, sliding, slip, friction, coulomb, stage,
                                  shadowRows, shadowCut, shadowIterations, shadowStatus, forceError, torqueError,
                                  collision, solve, shadow, total, listWorker, period, overruns] = TickRecord{};
    constexpr std::size_t kMembers = 41, kPoses = 2, kWrenches = 3;
    CHECK(sandbox::recordFields().size() == kMembers - 1 + kPoses * (7 - 1) + kWrenches * (6 - 1) + (4 - 1) + (6 - 1));
    CHECK_THAT(bytesOf(TOUCHSTONE_SOURCE_DIR "/docs/recording.md"), Contains(sandbox::fieldsAsMarkdown()));
}

TEST_CASE("recording: columns with the names of an earlier version are read", "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path file = pressRecording(folder) / "ticks.npy";
    std::string ticks = bytesOf(file);
    for (const auto& [now, earlier] : {std::pair<std::string, std::string>{"'linearizations'", "'linearisations'"},
                                       {"'list_worker_us'", "'helper_us'     "}}) {
        const std::size_t at = ticks.find(now);
        REQUIRE(at != std::string::npos);
        ticks.replace(at, now.size(), earlier);
    }
    writeBytes(file, ticks);
    CHECK(sandbox::TickFileReader(file).fields().size() == sandbox::tickFields().size());
}

TEST_CASE("recording: a setting that only an earlier version had is passed over", "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path notes = pressRecording(folder) / "recording.json";
    std::string text = bytesOf(notes);
    const std::string known = "\"stiffness\"";
    REQUIRE(text.find(known) != std::string::npos);
    text.replace(text.find(known), known.size(), "\"loop\": \"classic\", " + known);
    writeBytes(notes, text);
    sandbox::Recording source(notes.parent_path());
    RecordedTick tick;
    CHECK(source.next(tick));
}

TEST_CASE("recording: a broken file is refused in one sentence that names it", "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path recording = pressRecording(folder);
    const std::string ticks = bytesOf(recording / "ticks.npy"), notes = bytesOf(recording / "recording.json");
    const auto readAll = [&] {
        sandbox::Recording source(recording);
        RecordedTick tick;
        while (source.next(tick)) {
        }
    };
    const auto replaced = [](std::string text, const std::string& what, const std::string& with) {
        const auto at = text.find(what);
        REQUIRE(at != std::string::npos);
        return text.replace(at, what.size(), with);
    };
    const auto refuses = [&](const std::string& file, const std::string& bytes, const std::string& says) {
        writeBytes(recording / file, bytes);
        try {
            readAll();
            FAIL_CHECK("was read: " << says);
        } catch (const std::runtime_error& error) {
            const std::string sentence = error.what();
            CHECK_THAT(sentence, Contains(file) && Contains(says));
            CHECK(std::count(sentence.begin(), sentence.end(), '\n') == 0);
        }
        writeBytes(recording / "ticks.npy", ticks);
        writeBytes(recording / "recording.json", notes);
    };
    readAll();
    refuses("ticks.npy", "", "no NumPy file");
    refuses("ticks.npy", ticks.substr(0, 9), "no NumPy file");
    refuses("ticks.npy", ticks.substr(0, 300), "header is cut off");
    refuses("ticks.npy", replaced(ticks, "\x01", "\x02"), "version 1");
    refuses("ticks.npy", ticks.substr(0, ticks.size() - 1), "touchstone recover");
    refuses("ticks.npy", replaced(ticks, "(801,)", "(999999999999999999,)"), "touchstone recover");
    refuses("ticks.npy", replaced(ticks, "(801,)", "(-1,)"), "no number of rows");
    refuses("ticks.npy", replaced(ticks, "'input_qw'", "'inpit_qw'"), "lacks the column input_qw");
    refuses("ticks.npy", replaced(ticks, "'input_qw', '<f8'", "'input_qw', '<f4'"), "another type");
    refuses("ticks.npy", replaced(ticks, "'tick', '<u8'", "'tick', '|O9'"), "type that recordings do not have");
    refuses("ticks.npy", replaced(ticks, "False", "True"), "one after another");
    refuses("ticks.npy", replaced(ticks, "'descr'", "'desc'"), "unknown key");
    refuses("ticks.npy", replaced(ticks, "), (", "), ["), "broken");
    std::string bad = ticks;
    const std::size_t row = ticks.size() - 3 * sandbox::tickRowBytes();
    bad[row + 9 * sizeof(double)] = 7;  // input_pause
    refuses("ticks.npy", bad, "row 798 has no valid value in input_pause");
    bad = ticks;
    bad.replace(row + 7 * sizeof(double), 8, 8, '\xff');  // input_stiffness: NaN
    refuses("ticks.npy", bad, "row 798: stiffness must be");

    refuses("recording.json", "", "touchstone recover");
    refuses("recording.json", notes.substr(0, notes.size() / 2), "touchstone recover");
    refuses("recording.json", "[]", "format is missing");
    refuses("recording.json", replaced(notes, "touchstone recording", "something else"), "format must be");
    refuses("recording.json", replaced(notes, "\"version\": 1", "\"version\": 99"), "version must be 1");
    refuses("recording.json", replaced(notes, "\"version\": 1", "\"version\": -1"), "version must be a whole number");
    refuses("recording.json", replaced(notes, "\"hash\": \"", "\"cash\": \""), "hash is missing");
    refuses("recording.json", replaced(notes, "\"pose\": [", "\"pose\": [1,"), "pose must be seven numbers");
    refuses("recording.json", replaced(notes, "\"stiffness\": \"", "\"stiffness\": \"-"), "stiffness must be");
    refuses("recording.json", replaced(notes, "\"stiffness\"", "\"stifness\""), "did you mean");
    refuses("recording.json", replaced(notes, "\"loaded_before\": false", "\"loaded_before\": 0"), "loaded_before");
    const auto touching = [&](const std::string& pairs) {
        return replaced(notes, "\"loaded_before\": false", "\"loaded_before\": false, \"touching\": " + pairs);
    };
    refuses("recording.json", touching("3"), "touching must be a list");
    refuses("recording.json", touching("[-1]"), "each of touching must be a whole number");
    refuses("recording.json", replaced(notes, "\"changes\": [", "\"changes\": [ {\"row\":1}"), "kind is missing");
    refuses("recording.json", replaced(notes, "\"changes\": [", "\"changes\": [ {\"row\":-1}"), "row must be");
    refuses("recording.json",
            replaced(notes, "\"changes\": [", "\"changes\": [ {\"row\":9,\"kind\":\"x\"},{\"row\":3,\"kind\":\"x\"}"),
            "order");
    fs::remove(recording / "recording.json");
    CHECK_THROWS_WITH(readAll(), Contains("recording.json"));
    writeBytes(recording / "recording.json", notes);
    readAll();
}

TEST_CASE("recording: a live loop follows a recording from its start pose, with its settings", "[sandbox][recording]") {
    const TempFolder folder;
    recordEverything(folder.path() / "run", Geometry::Mesh);
    const sandbox::RecordedHand hand = sandbox::recordedHand(folder.path() / "run");
    sandbox::Recording source(folder.path() / "run");
    RecordedTick first;
    REQUIRE(source.next(first));
    REQUIRE(first.start);
    CHECK(first.start->loadedBefore);
    CHECK(hand.motion->at(0).p == first.start->X_WT.p);
    CHECK(hand.motion->at(1).p == first.input.X_WT_device.p);
    CHECK(hand.changes.front().settings == first.settings);
    CHECK(hand.changes.back().settings.mode == Mode::Paper);
}

TEST_CASE("program: records, replays, exports, and reports failures in one sentence", "[sandbox][recording]") {
    const Program touchstone;
    const std::string recording = touchstone.file("run"), run = "run hello --headless ";
    REQUIRE(touchstone(run + "--record " + recording).code == 0);
    Answer answer = touchstone(run + "--device replay:" + recording);
    CHECK(answer.code == 0);
    CHECK_THAT(answer.out, Contains("replay: all of 2401 ticks have the recorded bits"));
    answer = touchstone(run + "--device replay:" + recording + " --solver pqp");
    CHECK(answer.code == 0);
    CHECK_THAT(answer.err, Contains("the settings are not those recorded"));

    answer = touchstone(run + "--record " + recording);
    CHECK(answer.code == 1);
    CHECK(isOneSentence(answer.err));
    CHECK(touchstone("recover " + recording).code == 0);
    CHECK(touchstone("export " + recording).code == 0);
    CHECK(fs::file_size(recording + ".csv") > 100'000);

    // A changed bit of the input without a reason is a failure.
    const std::string ticks = recording + "/ticks.npy";
    std::string bytes = bytesOf(ticks);
    bytes[bytes.size() - 1000 * sandbox::tickRowBytes() + 8 + 3] ^= 1;
    writeBytes(ticks, bytes);
    CHECK(touchstone(run + "--device replay:" + recording).code == 1);
    writeBytes(ticks, bytes.substr(0, 200));
    for (const std::string& command : {run + "--device replay:" + recording, "export " + recording}) {
        answer = touchstone(command);
        CHECK(answer.code == 1);
        CHECK(isOneSentence(answer.err));
        CHECK_THAT(answer.err, Contains("ticks.npy"));
    }
    CHECK(touchstone("export").code == 2);
    CHECK(touchstone(run + "--paced --device replay:" + recording).code == 2);
}

TEST_CASE("recording: unreadable files are closed again", "[sandbox][recording]") {
    const TempFolder folder;
    const fs::path recording = pressRecording(folder);
    const std::string ticks = bytesOf(recording / "ticks.npy");
    writeBytes(recording / "ticks.npy", ticks.substr(0, 200));
    const auto open = [] { return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()); };
    const auto before = open();
    for (int i = 0; i < 5; ++i) {
        CHECK_THROWS(sandbox::Recording(recording));
        CHECK_THROWS(sandbox::exportCsv(recording, folder.path() / "ticks.csv"));
    }
    CHECK(open() == before);
}

}  // namespace touchstone::recording_tests
