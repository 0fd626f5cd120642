// Invalid poses in files: motions, recordings and scenes.
#include <catch2/catch.hpp>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_write.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::bad_pose_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

const double kFar[] = {1.0001e6, -1e30, 1e150, 1e308, -1e308, HUGE_VAL, NAN};

/// The press scene in a file, and a recording of its demonstration.
struct Press {
    TempFolder folder;
    fs::path file = folder.path() / "press.glb", recording = folder.path() / "push";
    sandbox::HapticScene scene = [this] {
        engine::writeGltf(pressScene(), file);
        return sandbox::openScene(file);
    }();

    sandbox::HeadlessRun run(const std::string& device, sandbox::HeadlessOptions options = {}) const {
        options.device = device;
        options.timing = false;
        return sandbox::runHeadless(scene, scene.settings, options);
    }
    /// Writes its demonstration as a motion, with poses changed by `edit`.
    std::string motion(const std::function<void(MotionKey&)>& edit) const {
        std::vector<MotionKey> keys;
        for (int t = 0; t <= 800; t += 2) {
            keys.push_back({double(t), scene.demonstration->at(t)});
            edit(keys.back());
        }
        writeMotion(folder.path() / "hand.csv", keys);
        return "replay:" + (folder.path() / "hand.csv").string();
    }
    void record() const {
        sandbox::HeadlessOptions options;
        options.record = recording;
        REQUIRE(run("demo", options).recordingFailure.empty());
    }
    /// Writes a number into a row of the recording; `column` counts x, y, z, qw, qx, qy, qz of its input.
    void edit(std::uint64_t row, int column, double value) const {
        const fs::path ticks = recording / "ticks.npy";
        const auto header = fs::file_size(ticks) - sandbox::TickFileReader(ticks).rows() * sandbox::tickRowBytes();
        std::fstream out(ticks, std::ios::binary | std::ios::in | std::ios::out);
        out.seekp(std::streamoff(header + row * sandbox::tickRowBytes() + 8 * std::uint64_t(column)));
        out.write(reinterpret_cast<const char*>(&value), sizeof value);
        REQUIRE(out.good());
    }
};

/// Requires that every number of a report is finite and within the size of the scene.
void requireFinite(const nlohmann::ordered_json& json, const std::string& path = "") {
    CAPTURE(path);
    if (json.is_number()) {
        REQUIRE(std::isfinite(json.get<double>()));
        REQUIRE(std::abs(json.get<double>()) < 1e6);
    }
    if (json.is_structured())
        for (const auto& [key, value] : json.items()) requireFinite(value, path + "/" + key);
}
void requireFinite(const sandbox::HeadlessRun& run) {
    requireFinite(sandbox::toJson(run.report));
    REQUIRE(run.report.penetration.max.value() <= 0.001);
    REQUIRE(run.last.X_WT.isValid());
}

}  // namespace

TEST_CASE("invalid poses: a motion that leaves the range is flagged, and its report stays finite", "[sandbox]") {
    const Press press;
    for (const double far : {1.0001e6, -1e30, 1e150, 1e308, -1e308}) {
        CAPTURE(far);
        const std::string device = press.motion([&](MotionKey& key) {
            if (key.t >= 400 && key.t < 410) key.X_WT.p.y() = far;
        });
        sandbox::HeadlessOptions options;
        int flagged = 0;
        Pose before;
        options.onTick = [&](const TickRecord& record, double penetration) {
            if (record.flags & kBadInput) {
                ++flagged;
                CHECK(record.X_WT == before);
                CHECK(record.wrench_C.force.isZero(0));
                CHECK(record.wrench_out.force.isZero(0));
            }
            CHECK(penetration <= 0.001);
            before = record.X_WT;
        };
        const sandbox::HeadlessRun run = press.run(device, options);
        requireFinite(run);
        CHECK(flagged >= 9);  // 400 to 408 ms, and the poses between a far key and a near one
        CHECK(flagged <= 11);
        CHECK(run.report.ticks == 801);
        CHECK(run.report.safetyFault == "invalid pose");
        CHECK(run.report.forceOut > 0);
    }
}

TEST_CASE("invalid poses: a recording of them replays with the same bits", "[sandbox][recording]") {
    const Press press;
    sandbox::HeadlessOptions options;
    options.record = press.recording;
    press.run(press.motion([](MotionKey& key) {
        if (key.t >= 400 && key.t < 404) key.X_WT.p.y() = -1e308;
    }),
              options);
    const sandbox::HeadlessRun again = press.run("replay:" + press.recording.string());
    requireFinite(again);
    CHECK(again.replay->ticks == 801);
    CHECK(again.replay->same == 801);
}

TEST_CASE("invalid poses: an edited recording with them replays and reports where it differs", "[sandbox][recording]") {
    const Press press;
    press.record();
    int row = 300;
    for (const double far : kFar)
        for (int column = 0; column < 7; ++column) press.edit(std::uint64_t(row++), column, far);
    for (int column = 3; column < 7; ++column) press.edit(std::uint64_t(row), column, 0);
    ++row;
    sandbox::HeadlessOptions options;
    int flagged = 0;
    options.onTick = [&](const TickRecord& record, double penetration) {
        flagged += (record.flags & kBadInput) != 0;
        CHECK(penetration <= 0.001);
    };
    const sandbox::HeadlessRun run = press.run("replay:" + press.recording.string(), options);
    requireFinite(run);
    CHECK(flagged == row - 300);
    REQUIRE(run.replay->different);
    CHECK(*run.replay->different == 300);
    CHECK(run.report.force > 1);

    // The window follows the remaining poses.
    const sandbox::RecordedHand hand = sandbox::recordedHand(press.recording);
    for (int t = 0; t <= 800; ++t) CHECK(hand.motion->at(t).isValid());
}

TEST_CASE("invalid poses: a recording that begins with them is refused in one sentence", "[sandbox][recording]") {
    const Press press;
    press.record();
    const fs::path file = press.recording / "recording.json";
    nlohmann::json notes;
    std::ifstream(file) >> notes;
    CHECK_NOTHROW(sandbox::Recording(press.recording));
    for (const char* path :
         {"/start/tool", "/start/device", "/start/obstacles/0", "/scene/tool/pose", "/scene/obstacles/0/pose"})
        for (const int number : {0, 2, 3, 6})
            for (const double far : {1.1e6, -1e30, 1e308}) {
                CAPTURE(path, number, far);
                nlohmann::json edited = notes;
                edited.at(nlohmann::json::json_pointer(path))[std::size_t(number)] = far;
                std::ofstream(file) << edited;
                CHECK_THROWS_WITH(sandbox::Recording(press.recording),
                                  Contains("recording.json") && Contains("within 1e6 mm"));
            }
}

TEST_CASE("invalid poses: a scene beyond a kilometer is refused in a sentence that names the node", "[sandbox]") {
    sandbox::SceneOptions options;
    options.buildWorld = false;
    const auto placed = [&](glm::dvec3 tool, glm::dvec3 obstacle, glm::vec3 size) {
        engine::Scene scene;
        addBox(scene, "cube", size, {{"role", "tool"}, {"leaves", 64}}, {.translation = tool});
        addBox(scene, "slab", glm::vec3(0.01f), {{"role", "obstacle"}, {"leaves", 64}}, {.translation = obstacle});
        updateWorldTransforms(scene);
        return scene;
    };
    CHECK_NOTHROW(sandbox::openScene(placed({999, -999, 999}, {-999, 0, 0}, glm::vec3(0.01f)), options));
    for (const double far : {1000.1, -1e6, 1e27}) {
        CHECK_THROWS_WITH(sandbox::openScene(placed({0, far, 0}, {}, glm::vec3(0.01f)), options),
                          Contains("\"cube\"") && Contains("starts more than 1 km from"));
        CHECK_THROWS_WITH(sandbox::openScene(placed({}, {0, 0, far}, glm::vec3(0.01f)), options),
                          Contains("\"slab\"") && Contains("is more than 1 km from"));
    }
    CHECK_THROWS_WITH(sandbox::openScene(placed({}, {}, glm::vec3(0.01f, 2100.0f, 0.01f)), options),
                      Contains("\"cube\"") && Contains("reaches more than 1 km"));
    engine::Scene animated = placed({}, {}, glm::vec3(0.01f));
    animated.animations.push_back(translation(animated.nodes[0], {0, 1}, {{2000, 0, 0, 0}, {0, 0, 0, 0}}));
    CHECK_THROWS_WITH(sandbox::openScene(std::move(animated), options), Contains("starts more than 1 km from"));
}

}  // namespace touchstone::bad_pose_tests
