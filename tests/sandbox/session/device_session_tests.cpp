// A session with the fake device: messages, state and saved data while it connects, disconnects and reconnects.
#include <fstream>

#include "haptics/sandbox/session/session.hpp"
#include "tests/program/program.hpp"
#include "tests/support/fake_hd/fake_hd_device.hpp"
#include "tests/support/ui_scene.hpp"

namespace touchstone::device_session_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;
using Catch::Contains;

namespace {

constexpr const char* kPhantom = "phantom:,stale=500";  // a busy machine delays threads

struct Running {
    TempFolder folder;
    FakeHd fake;
    LiveSession session;

    Running() : session(options()) {
        session.open({holdFile(folder)});
        REQUIRE(until([&] { return session.running(); }));
        session.chooseDevice(kPhantom);
        REQUIRE(until([&] { return session.device().choice == kPhantom && settled(); }));
    }
    SessionOptions options() const {
        SessionOptions its;
        its.treeCache.clear();
        its.configFolder = folder.path() / "config";
        its.loop.realTime.raise = false;
        its.loop.watchdogMs = 0;
        return its;
    }
    bool until(const std::function<bool()>& done) {
        return waitUntil([&] {
            session.update();
            return done();
        });
    }
    /// Whether the loop has taken the next device and read it.
    bool settled() {
        const LoopSnapshot* s = session.snapshot();
        if (s->session <= last_ || s->record.tick <= 3 || s->record.trips) return false;
        session.engage();
        if (!isEngaged(s->engagement)) return false;
        last_ = s->session;
        return true;
    }
    std::string told() const {
        std::string all;
        for (const Message& message : session.log().messages()) all += message.text + "\n";
        return all;
    }
    const DeviceStatus& status() { return *session.device().facts.status; }

  private:
    std::uint64_t last_ = 0;
};

}  // namespace

TEST_CASE("device session: the phantom takes over the tool where it is, with its nominal gains", "[session]") {
    Running running;
    CHECK(running.session.settings().stiffness == 0.8);
    CHECK(running.session.settings().torsion == 300);
    CHECK_THAT(running.told(), Contains("stiffness of 0.8 N/mm, so 1 is lowered to that") &&
                                   Contains("torsion of 300 mN·m/rad, so 1000 is lowered to that"));
    const Pose before = running.session.record()->X_WT_device;
    running.fake.hand(0, 30, 0, 0, 0, 0);  // up, in free space
    CHECK(running.until([&] {
        const Vec3 moved = running.session.record()->X_WT_device.p - before.p;
        return (moved - Vec3(0, 30, 0)).norm() < 0.5;
    }));
    REQUIRE(running.session.device().control.get());
    CHECK(running.session.device().control.get()->maps() == DeviceControl::Maps::All);
}

TEST_CASE("device session: reports an unplugged device while the scene runs, and continues after reconnecting",
          "[session]") {
    Running running;
    running.fake.fault("comm");
    REQUIRE(running.until([&] { return running.status().state == DeviceStatus::State::Lost; }));
    CHECK_THAT(running.told(), Contains("Device lost: the connection to the device is lost"));
    const std::uint64_t ticks = running.session.snapshot()->ticks;
    CHECK(running.until([&] { return running.session.snapshot()->ticks > ticks + 50; }));
    CHECK(running.fake.force().isZero());

    running.session.reconnectDevice();
    CHECK(running.until([&] { return running.status().state == DeviceStatus::State::Running; }));
    CHECK_THAT(running.told(), Contains("Device running: Fake Premium 6DOF runs"));
    running.session.chooseDevice("demo");
    CHECK(running.until([&] { return running.fake.state().handles == 0; }));
    CHECK_FALSE(running.session.device().control.get());
}

TEST_CASE("device session: reports in full why a device cannot start, and keeps the previous one", "[session]") {
    Running running;
    running.session.chooseDevice("phantom:,library=/no/such/libHD.so");
    CHECK_THAT(running.session.device().trouble, Contains("/no/such/libHD.so") && Contains("Install"));
    CHECK(running.session.device().choice == kPhantom);
    running.session.chooseDevice("demo");
    CHECK(running.session.device().trouble.empty());
}

TEST_CASE("device session: the workspace is saved for each pair of device and scene", "[session]") {
    Running running;
    Workspace workspace;
    workspace.scale = 2;
    workspace.offset = {1, 2, 3};
    workspace.q_WD = expRotation(Vec3(0, 1, 0));
    workspace.clutch = 4;
    const Vec3 before = running.session.record()->X_WT.p;
    running.session.setWorkspace(workspace);
    REQUIRE(running.until([&] { return running.session.device().facts.scale == 2 && running.settled(); }));
    CHECK((running.session.record()->X_WT.p - before).norm() < 15);  // mapped where it is; it then glides by the offset
    CHECK(running.until([&] { return running.session.snapshot()->settings.torsion == 1200; }));  // felt as 300
    CHECK(running.session.settings().torsion == 300);

    const std::filesystem::path folder = running.folder.path() / "config", scene = running.session.request().file;
    const Workspace saved = WorkspaceFile(folder).load(scene, kPhantom);
    CHECK(saved == workspace);
    CHECK(WorkspaceFile(folder).load(scene, "phantom:,drive=device") == workspace);
    CHECK(WorkspaceFile(folder).load(scene, "phantom:left") == Workspace{});
    CHECK(WorkspaceFile(folder).load(scene, "inverse3") == Workspace{});
    WorkspaceFile(folder).save(scene, "inverse3:port=7,peak=3", workspace);
    CHECK(WorkspaceFile(folder).load(scene, "inverse3") == workspace);
    CHECK(WorkspaceFile(folder).load(scene, "inverse3:peak=4") == workspace);
    CHECK(WorkspaceFile(folder).load(scene.parent_path() / "other.glb", kPhantom) == Workspace{});
}

TEST_CASE("workspace file: errors name file and field", "[session]") {
    const TempFolder folder;
    const std::filesystem::path file = folder.path() / "workspaces.json";
    const auto trouble = [&](const std::string& text) -> std::string {
        std::ofstream(file) << text;
        try {
            WorkspaceFile(folder.path()).load("/a.glb", "phantom");
        } catch (const std::runtime_error& e) {
            return e.what();
        }
        return {};
    };
    const auto entry = [](const std::string& text) { return R"({"phantom in /a.glb": {)" + text + "}}"; };
    CHECK_THAT(trouble("no json"), Contains(file.string() + ": is not a JSON object; correct it or delete the file"));
    CHECK_THAT(trouble(entry(R"("scale": "big")")), Contains(file.string()) && Contains(".scale must be a number"));
    CHECK_THAT(trouble(entry(R"("scale": -1)")), Contains("scale must be a number from 0.01 to 100"));
    CHECK_THAT(trouble(entry(R"("offset_mm": [1, 2])")), Contains(".offset_mm must be a list of 3 numbers"));
    CHECK_THAT(trouble(entry(R"("axes_xyzw": [0, 0, 0, 0])")), Contains("axes must be a quaternion of unit length"));
    CHECK_THAT(trouble(entry(R"("clutch_button": 99)")), Contains(".clutch_button must be 0 for none to 32"));
    CHECK(trouble(entry(R"("scale": 3)")).empty());
}

TEST_CASE("doctor: reports for each device what works, what was tried and what to install", "[program]") {
    const Program touchstone;
    setenv("TOUCHSTONE_LIBHD", "/no/such/libHD.so", 1);
    CHECK_THAT(touchstone("doctor").out, Contains("phantom") &&
                                             Contains("/no/such/libHD.so: cannot open shared object") &&
                                             Contains("Install the vendor's OpenHaptics"));
    const FakeHd fake;
    CHECK_THAT(touchstone("doctor").out, Contains("Fake Premium 6DOF runs"));
}

}  // namespace touchstone::device_session_tests
