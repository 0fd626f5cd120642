// Sessions without a window: scenes and devices change while the loop runs, and failures are reported.
#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "haptics/loop/distances.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "haptics/sandbox/session/session.hpp"
#include "tests/support/ui_scene.hpp"

namespace touchstone::ui_session_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

SessionOptions uncached() {
    SessionOptions options;
    options.treeCache.clear();
    options.loop.realTime.raise = false;  // tests run at normal priority
    return options;
}

bool waitUntilRunning(LiveSession& session) {
    return waitUntil([&] {
        session.update();
        return session.running();
    });
}

std::string errors(const LiveSession& session) {
    std::string all;
    for (const Message& message : session.log().messages())
        if (message.kind == Message::Kind::Error) all += message.text + "\n";
    return all;
}

}  // namespace

TEST_CASE("session: a scene runs with its demonstration, and settings arrive in the loop", "[session]") {
    const TempFolder folder;
    std::uint64_t ticks = 0;
    SessionOptions options = uncached();
    options.onTick = [&](const TickRecord&) { ++ticks; };
    options.adjust = [](Settings settings) {
        settings.stiffness = 2;
        return settings;
    };
    LiveSession session(options);
    CHECK_FALSE(session.running());
    session.open({holdFile(folder)});
    CHECK(session.opening().has_value());
    REQUIRE(waitUntilRunning(session));
    CHECK(session.device().choice == "demo");
    CHECK(session.sceneNumber() == 1);
    CHECK(session.settings().stiffness == 2);

    Settings settings = session.settings();
    settings.stiffness = 3;
    session.setSettings(settings);
    CHECK(waitUntil([&] {
        session.update();
        return session.snapshot()->settings.stiffness == 3 && session.snapshot()->finished;
    }));
    CHECK(ticks > 0);
    CHECK(session.history().size() > 0);

    settings.trust = 2 * settings.margin;  // trust must not exceed the margin
    session.setSettings(settings);
    CHECK(errors(session).find("trust") != std::string::npos);
    CHECK(session.settings().trust <= session.settings().margin);
}

TEST_CASE("session: a device without motors runs at once, stop removes the force, engage restores it", "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    CHECK_FALSE(session.engaged());
    session.stop();  // no loop runs yet
    session.open({holdFile(folder)});
    REQUIRE(waitUntilRunning(session));
    const auto force = [&](auto wanted) {
        return waitUntil([&] {
            session.update();
            return wanted(session.record()->wrench_out.force.norm());
        });
    };
    REQUIRE(force([](double f) { return f > 1.5; }));
    CHECK(session.engaged());
    session.stop();
    REQUIRE(force([](double f) { return f == 0; }));
    CHECK(session.snapshot()->engagement == Engagement::Stopped);
    session.engage();
    CHECK(force([](double f) { return f > 1.5; }));
    CHECK(session.engaged());
}

TEST_CASE("session: reports a broken file in one sentence and keeps the running scene", "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    REQUIRE(waitUntilRunning(session));

    const auto broken = folder.path() / "broken.glb";
    std::ofstream(broken) << "no scene";
    for (const auto& file : {broken, folder.path() / "missing.gltf"}) {
        session.open({file});
        REQUIRE(waitUntil([&] {
            session.update();
            return !session.opening();
        }));
        CHECK(errors(session).find(file.filename().string()) != std::string::npos);
        CHECK(session.running());
        CHECK(session.sceneNumber() == 1);
    }
    const auto before = session.snapshot()->ticks;
    CHECK(waitUntil([&] {
        session.update();
        return session.snapshot()->ticks > before + 10;
    }));
}

TEST_CASE("session: another scene replaces the running one", "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    const auto file = holdFile(folder);
    session.open({file});
    REQUIRE(waitUntilRunning(session));
    session.open({file});  // not awaited: the next request replaces it
    session.open({file});
    REQUIRE(waitUntil([&] {
        session.update();
        return session.sceneNumber() == 2 && !session.opening();
    }));
    CHECK(session.running());
    CHECK(errors(session).empty());
}

TEST_CASE("session: a scene without roles waits for the user's choice, runs with it, and saves it", "[session]") {
    const TempFolder folder;
    engine::Scene unmarked = holdScene();
    for (const engine::Entity node : unmarked.nodes) setExtras(unmarked, node, {{"touchstone", {{"leaves", 64}}}});
    const auto file = folder.path() / "unmarked.glb";
    writeGltf(unmarked, file);

    LiveSession session(uncached());
    session.open({file});
    REQUIRE(waitUntil([&] {
        session.update();
        return session.scene() != nullptr;
    }));
    CHECK_FALSE(session.running());
    CHECK_FALSE(session.scene()->missing.empty());
    CHECK(session.record() == nullptr);

    session.mark({GiveRole{0, Role::Tool}});
    REQUIRE(waitUntil([&] {
        session.update();
        return session.sceneNumber() == 2;
    }));
    session.mark({GiveRole{1, Role::Obstacle}});
    REQUIRE(waitUntilRunning(session));

    const auto saved = folder.path() / "marked.glb";
    CHECK(session.save(saved, false));
    CHECK(errors(session).empty());
    LiveSession another(uncached());
    another.open({saved});
    CHECK(waitUntilRunning(another));
}

TEST_CASE("session: the device changes while it runs, and a device that cannot start changes nothing", "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    REQUIRE(waitUntilRunning(session));
    CHECK(session.device().mouse.get() == nullptr);

    session.chooseDevice("replay:nowhere.csv");
    CHECK(errors(session).find("nowhere.csv") != std::string::npos);
    CHECK(session.device().choice == "demo");

    session.chooseDevice("mouse");
    REQUIRE(session.device().choice == "mouse");
    REQUIRE(session.device().mouse.get());
    // The simulated hand moves to the mouse's target at its own pace.
    Pose wanted = session.scene()->world->X_WT_start;
    wanted.p.x() += 5;
    CHECK(waitUntil([&] {
        session.update();
        session.device().mouse.get()->grab(wanted);
        return session.record() && (session.record()->X_WT_device.p - wanted.p).norm() < 0.01;
    }));
    session.restart();
    CHECK(waitUntil([&] {
        session.update();
        return (session.record()->X_WT_device.p - session.scene()->world->X_WT_start.p).norm() < 0.01;
    }));
}

TEST_CASE("session: opening can be cancelled, and closing does not wait for it", "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    session.cancelOpening();
    CHECK_FALSE(session.opening());
    CHECK(waitUntil([&] {
        session.update();
        return true;
    }));
    CHECK(session.scene() == nullptr);
}

TEST_CASE("session: a mode selects its published solvers, and swapping twice changes nothing", "[session]") {
    const Settings start;
    const Settings paper = withMode(start, Mode::Paper);
    CHECK(paper.solver == "pqp");
    CHECK(paper.shadow == kNoSolver);
    CHECK(paper.tolerance == 0.01);
    CHECK(withSolversSwapped(paper).solver == paper.solver);  // no shadow, nothing to swap
    const Settings back = withMode(paper, Mode::Default);
    CHECK(back.solver == kExactSolver);
    CHECK(back.shadow == "pqp");
    const Settings swapped = withSolversSwapped(start);
    CHECK(swapped.solver == start.shadow);
    CHECK(swapped.shadow == start.solver);
    CHECK(swapped.frictionSolver == start.frictionShadow);
    CHECK(swapped.frictionShadow == start.frictionSolver);
    CHECK(withSolversSwapped(swapped).solver == start.solver);
}

TEST_CASE("tick history: keeps the newest ticks in order", "[session]") {
    TickHistory history(3);
    for (int i = 1; i <= 5; ++i) {
        TickRecord record;
        record.rows = i;
        record.wrench_C.force = Vec3(3, 4, 0) * i;
        history.push(record);
    }
    const engine::RingView rows = history.view(Channel::Rows), force = history.view(Channel::Force);
    REQUIRE(rows.count == 3);
    CHECK(rows[0] == 3);
    CHECK(rows[2] == 5);
    CHECK(force[2] == Approx(25));
    history.clear();
    CHECK(history.view(Channel::Rows).count == 0);
}

TEST_CASE("session: an edit moves an obstacle while the loop runs, and undo moves it back", "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    REQUIRE(waitUntilRunning(session));
    const auto first = session.scene();
    const auto before = first->world;
    const engine::LocalTransform from = first->scene.registry.get<engine::LocalTransform>(first->scene.nodes[1]);
    engine::LocalTransform to = from;
    to.translation.y -= 0.02;

    Settings settings = session.settings();
    settings.stiffness = 1.5;
    session.setSettings(settings);
    session.edit({engine::PlaceNode{1, from, to}});
    const Vec3 target = before->obstacles[0].X_WO.p - Vec3(0, 20, 0);
    bool onItsWay = false;
    REQUIRE(waitUntil([&] {
        session.update();
        const double left = (obstaclePose(*session.scene(), 0).p - target).norm();
        onItsWay |= left > 0 && left < 20;
        return left < 1e-9;
    }));
    CHECK(onItsWay);
    CHECK(session.scene() == first);  // no scene was reopened
    CHECK(first->world == before);    // and no world was copied
    CHECK(session.sceneNumber() == 1);
    CHECK(session.snapshot()->session == 0);
    CHECK(session.scene()->world->obstacles[0].part.spheres == before->obstacles[0].part.spheres);
    CHECK(session.settings() == settings);
    // The demonstration now ends above the slab, without force.
    CHECK(waitUntil([&] {
        session.update();
        return session.snapshot()->finished && session.record()->wrench_C.force.norm() < 1e-9;
    }));
    CHECK(session.request().edits.size() == 1);

    session.setEdits({});
    REQUIRE(waitUntil([&] {
        session.update();
        return (obstaclePose(*session.scene(), 0).p - before->obstacles[0].X_WO.p).norm() < 1e-9 &&
               session.snapshot()->finished && session.record()->wrench_C.force.norm() > 1;
    }));
    CHECK(errors(session).empty());
}

TEST_CASE("session: reports a blocked obstacle once, and moves it on when there is room", "[session]") {
    const TempFolder folder;
    // The cube is held between the slab below it and a closing lid.
    engine::Scene scene = holdScene();
    addBox(scene, "lid", {0.06f, 0.01f, 0.06f}, {{"role", "obstacle"}, {"leaves", 128}}, {.translation = {0, 0.03, 0}});
    updateWorldTransforms(scene);
    const auto file = folder.path() / "press.glb";
    writeGltf(scene, file);
    LiveSession session(uncached());
    session.open({file});
    REQUIRE(waitUntilRunning(session));
    const auto told = [&] {
        return std::count_if(session.log().messages().begin(), session.log().messages().end(), [](const Message& m) {
            return m.kind == Message::Kind::Warning && m.text.starts_with("lid is blocked");
        });
    };
    const auto placed = [&](int node, double y) {
        const auto from =
            session.scene()->scene.registry.get<engine::LocalTransform>(session.scene()->scene.nodes[node]);
        engine::LocalTransform to = from;
        to.translation.y = y;
        session.edit({engine::PlaceNode{node, from, to}});
    };
    const auto lid = [&] { return obstaclePose(*session.scene(), 1).p.y(); };
    REQUIRE(waitUntil([&] {
        session.update();
        return session.snapshot()->finished;
    }));
    placed(2, 0.015);
    REQUIRE(waitUntil([&] {
        session.update();
        CHECK(trueClearance(*worldNow(*session.scene()), session.record()->X_WT) >= -1e-3);
        return told() == 1;
    }));
    CHECK(lid() > 20);  // where the faces would touch; leaves protrude further
    placed(1, -0.02);   // the slab retreats
    REQUIRE(waitUntil([&] {
        session.update();
        CHECK(trueClearance(*worldNow(*session.scene()), session.record()->X_WT) >= -1e-3);
        return std::abs(lid() - 15) < 1e-9;
    }));
    CHECK(told() == 1);
}

TEST_CASE("session: builds another tree beside the running loop and keeps the user's settings", "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    REQUIRE(waitUntilRunning(session));
    Settings settings = session.settings();
    settings.stiffness = 1.5;
    settings.geometry = Geometry::Spheres;
    session.setSettings(settings);
    REQUIRE(waitUntil([&] {
        session.update();
        return session.sceneNumber() == 2;  // with trees
    }));
    const int leaves = session.scene()->world->tool.spheres->leafCount();

    session.mark({ChooseTree{0, {.leaves = 1000}}});
    CHECK(session.opening());
    CHECK(session.running());
    session.cancelOpening();
    CHECK_FALSE(session.opening());
    CHECK(session.newest().edits.empty());  // the cancelled request leaves no edit

    session.mark({ChooseTree{0, {.leaves = 1000}}});
    REQUIRE(waitUntil([&] {
        session.update();
        return session.sceneNumber() == 3;
    }));
    CHECK(session.scene()->world->tool.spheres->leafCount() > 2 * leaves);
    CHECK(session.settings() == settings);

    // An unreadable part changes nothing.
    session.mark({AddBody{folder.path() / "missing.glb", Role::Obstacle}});
    REQUIRE(waitUntil([&] {
        session.update();
        return !session.opening();
    }));
    CHECK(errors(session).find("missing.glb") != std::string::npos);
    CHECK(session.newest().edits.size() == 1);
    CHECK(session.running());
}

TEST_CASE("session: an edit of friction reaches the running world, and undo takes it back", "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    REQUIRE(waitUntilRunning(session));
    const auto reopened = [&](std::uint64_t number) {
        return waitUntil([&] {
            session.update();
            return session.sceneNumber() == number && session.running();
        });
    };
    const auto friction = [&] { return session.scene()->world->friction(0); };
    CHECK_FALSE(friction().any());
    const auto before = session.newest().edits;
    const engine::FrictionMaterial rough{0.8, 0.4, engine::FrictionCombine::Average};
    session.mark({ChooseFriction{0, rough}, ChooseFriction{1, rough}});
    REQUIRE(reopened(2));
    CHECK(friction() == Friction{0.8, 0.4});
    session.mark({ChooseFriction{1, engine::FrictionMaterial{.staticFriction = 1}}});
    REQUIRE(reopened(3));
    CHECK(friction().atRest == 0.9);
    session.setEdits(before);
    REQUIRE(reopened(4));
    CHECK_FALSE(friction().any());
    CHECK(errors(session).empty());
}

TEST_CASE("session: a saved scene is read back with its settings", "[session]") {
    const TempFolder folder;
    const auto saved = folder.path() / "saved.glb";
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    REQUIRE(waitUntilRunning(session));
    const auto from = session.scene()->scene.registry.get<engine::LocalTransform>(session.scene()->scene.nodes[1]);
    engine::LocalTransform to = from;
    to.translation.x += 0.005;
    to.rotation = glm::normalize(glm::dquat(glm::dvec3(0, 0.4, 0)));
    session.edit({engine::PlaceNode{1, from, to}});
    Settings settings = session.settings();
    settings.stiffness = 1.75;
    session.setSettings(settings);
    CHECK_FALSE(session.save(folder.path() / "no" / "such" / "folder.glb", true));
    REQUIRE(session.save(saved, true));
    CHECK(session.request().file == saved);
    CHECK(session.newest().edits.empty());
    const Pose X_WO = toPose(engine::worldPose(session.scene()->scene.registry, session.scene()->scene.nodes[1]));

    session.reload();
    REQUIRE(waitUntil([&] {
        session.update();
        return session.sceneNumber() == 2 && session.running();
    }));
    CHECK(session.settings() == settings);
    const Pose& again = obstaclePose(*session.scene(), 0);
    CHECK((again.p - X_WO.p).norm() < 1e-9);
    CHECK(logRotation(again.q * X_WO.q.conjugate()).norm() < 1e-9);
}

TEST_CASE("session: a recording from mid-run replays restarts, moved obstacles, settings and scenes to the bit",
          "[session]") {
    const TempFolder folder;
    const auto file = holdFile(folder), recording = folder.path() / "recording";
    const auto ticksMore = [](LiveSession& session, std::uint64_t more) {
        const std::uint64_t before = session.snapshot()->ticks;
        return waitUntil([&] {
            session.update();
            return session.running() && session.snapshot()->ticks > before + more;
        });
    };
    {
        LiveSession session(uncached());
        session.open({file});
        REQUIRE(waitUntilRunning(session));
        REQUIRE(waitUntil([&] {
            session.update();
            return session.record() && session.record()->wrench_C.force.norm() > 0.5;
        }));
        const auto lift = [&](double y) {  // lifts the slab with the tool on it
            const engine::Scene& scene = session.scene()->scene;
            const auto from = scene.registry.get<engine::LocalTransform>(scene.nodes[1]);
            engine::LocalTransform to = from;
            to.translation.y = y;
            session.edit({engine::PlaceNode{1, from, to}});
        };
        lift(0.0007);
        REQUIRE(ticksMore(session, 50));  // from here on it differs from the scene's file
        lift(0.0005);
        session.record(recording);
        REQUIRE(session.recording().recorder());
        REQUIRE(ticksMore(session, 50));
        const double force = session.record()->wrench_C.force.norm();
        lift(0.0012);
        REQUIRE(waitUntil([&] {
            session.update();
            return session.record()->wrench_C.force.norm() > force + 0.5;
        }));
        Settings settings = session.settings();
        settings.stiffness = 2;
        settings.solver = "pqp";
        session.setSettings(settings);
        REQUIRE(ticksMore(session, 200));
        session.restart();
        lift(0.0002);
        REQUIRE(ticksMore(session, 200));
        session.open({file});
        REQUIRE(waitUntil([&] {
            session.update();
            return session.sceneNumber() == 2;
        }));
        REQUIRE(ticksMore(session, 100));
        session.recording().stop();
        CHECK_FALSE(session.recording().recorder());
        CHECK(errors(session).empty());
        session.record(recording);
        CHECK_FALSE(session.recording().recorder());
        CHECK(errors(session).find("holds a recording already") != std::string::npos);
    }
    const HapticScene scene = openScene(file);
    HeadlessOptions options;
    options.device = "replay:" + recording.string();
    options.timing = false;
    const HeadlessRun run = runHeadless(scene, scene.settings, options);
    CHECK(run.replay->ticks > 600);
    CHECK(run.replay->same == run.replay->ticks);
    CHECK(run.replay->notCompared == 0);
    CHECK(run.replay->differences.empty());

    // A loop can follow the recording as well.
    LiveSession session(uncached());
    session.open({file});
    REQUIRE(waitUntilRunning(session));
    session.chooseDevice(options.device);
    CHECK(session.device().choice == options.device);
    CHECK(waitUntil([&] {
        session.update();
        return session.snapshot()->settings.solver == "pqp" && session.snapshot()->finished;
    }));
    CHECK(errors(session).empty());
}

}  // namespace touchstone::ui_session_tests
