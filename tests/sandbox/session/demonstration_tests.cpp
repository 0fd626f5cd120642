// The goal and the demonstration of a scene, set in a running session, undone, saved and read again.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_read.hpp"
#include "haptics/sandbox/scene/scene_motion.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/goal_edit.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/session.hpp"
#include "tests/support/ui_scene.hpp"

namespace touchstone::demonstration_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;
namespace fs = std::filesystem;

namespace {

const SceneOptions kUncached{.treeCache = {}, .progress = {}};

SessionOptions uncached() {
    SessionOptions options;
    options.treeCache.clear();
    options.loop.realTime.raise = false;
    return options;
}

bool reaches(LiveSession& session, const std::function<bool()>& holds) {
    return waitUntil([&] {
        session.update();
        return session.running() && !session.switching() && holds();
    });
}

/// Runs for this many ticks of the present session.
void run(LiveSession& session, std::uint64_t ticks) {
    const std::uint64_t until = session.record()->tick + ticks;
    REQUIRE(reaches(session, [&] { return session.record()->tick >= until; }));
}

std::string textOf(const LiveSession& session, Message::Kind kind) {
    std::string all;
    for (const Message& message : session.log().messages())
        if (message.kind == kind) all += message.text + "\n";
    return all;
}

std::uint64_t hashOf(const HapticScene& scene) {
    HeadlessOptions options;
    options.timing = false;
    return runHeadless(scene, scene.settings, options).report.hash;
}

/// A motion of the tool along x in `seconds`.
engine::SceneEdit motionOf(const engine::Scene& scene, int node, double seconds,
                           std::shared_ptr<const engine::Animation> from = {}) {
    const std::vector<MotionKey> keys{{0, {{0, 20, 0}, Quat::Identity()}},
                                      {1000 * seconds, {{7, 20, 0}, expRotation({0, 0.5, 0})}}};
    return engine::SetMotion{node, std::move(from),
                             std::make_shared<const engine::Animation>(
                                 animationOf(scene, scene.nodes[static_cast<std::size_t>(node)], keys))};
}

}  // namespace

TEST_CASE("edits: a motion replaces that of the node in the first animation, is saved once, and can be undone",
          "[edit]") {
    const TempFolder folder;
    const fs::path file = folder.path() / (GENERATE(true, false) ? "scene.glb" : "scene.gltf");
    engine::Scene made = holdScene();
    const bool before = GENERATE(true, false);
    if (before) {  // with a channel of another node, which stays
        made.animations[0].channels.push_back({made.nodes[1],
                                               engine::AnimationPath::Scale,
                                               engine::Interpolation::Linear,
                                               {0, 1},
                                               {{1, 1, 1, 0}, {1, 1, 1, 0}}});
        made.animations[0].extras = nlohmann::json{{"kept", 1}};
        made.animations.push_back(translation(made.nodes[0], {0, 1}, {{0, 1, 0, 0}, {0, 2, 0, 0}}));
    } else {
        made.animations.clear();
    }
    writeGltf(made, file);
    engine::Scene scene = engine::readGltf(file);
    const std::vector<engine::SceneEdit> none, edits{motionOf(scene, 0, 0.7)};
    engine::applyEdits(scene, edits);
    const SceneMotion motion(scene, scene.animations.at(0), scene.nodes[0]);
    CHECK(motion.duration() == 700);
    engine::saveScene(scene, file);
    const auto size = fs::file_size(file);

    const HapticScene again = openScene(file, {.treeCache = {}, .progress = {}, .buildWorld = false});
    REQUIRE(again.scene.animations.size() == (before ? 2u : 1u));
    REQUIRE(again.demonstration);
    for (double t = -10; t < 800; t += 7.3) CHECK(again.demonstration->at(t) == motion.at(t));
    if (before) {
        CHECK(again.scene.animations[0].channels.size() == 3);
        CHECK(*again.scene.animations[0].extras == nlohmann::json{{"kept", 1}});
        CHECK(again.scene.animations[0].name == made.animations[0].name);
        CHECK(again.motions.size() == 2);
    } else {
        CHECK(again.scene.animations[0].name == "demonstration");
    }

    // The next one takes the place of the first, in the file too.
    engine::Scene second = engine::readGltf(file);
    engine::applyEdits(second, {motionOf(second, 0, 1.5)});
    engine::saveScene(second, file);
    CHECK(std::abs(double(fs::file_size(file)) - double(size)) < 16);
    CHECK(openScene(file, {.treeCache = {}, .progress = {}, .buildWorld = false}).demonstration->duration() == 1500);

    const auto back = engine::reversibleChange(edits, none);
    REQUIRE(back.has_value());
    engine::applyEdits(scene, *back);
    REQUIRE(scene.animations.size() == made.animations.size());
    if (before) {
        CHECK(scene.animations[0].channels.size() == 2);
        CHECK(SceneMotion(scene, scene.animations[0], scene.nodes[0]).duration() == 200);
    }
}

TEST_CASE("edits: an animated node that had a matrix gets translation, rotation and scale", "[edit]") {
    const TempFolder folder;
    const fs::path file = folder.path() / "matrix.gltf";
    engine::Scene made = holdScene();
    made.animations.clear();
    writeGltf(made, file);
    auto document = engine::parseOrderedJson(file, engine::readContainer(file).json);
    document["nodes"][0].erase("translation");
    document["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0.015, 0, 1};
    const std::string text = document.dump();
    engine::writeBytes(file, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    engine::Scene scene = engine::readGltf(file);
    engine::applyEdits(scene, {motionOf(scene, 0, 1)});
    engine::saveScene(scene, file);
    CHECK(openScene(file, kUncached).demonstration->duration() == 1000);
}

TEST_CASE("demonstration: a motion by hand that ends in contact is recorded, replayed, saved, run headless and undone",
          "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    REQUIRE(reaches(session, [] { return true; }));
    session.chooseDevice("mouse", true);
    REQUIRE(reaches(session, [&] { return session.device().mouse != nullptr; }));
    session.recordDemonstration();
    REQUIRE(session.demonstration());
    run(session, 50);
    session.device().mouse->grab({{6, 15, 0}, Quat::Identity()});
    run(session, 300);
    session.device().mouse->grab({{6, 7, 0}, expRotation({0, 0.4, 0})});  // 3 mm too deep
    run(session, 500);
    const Pose tool = session.record()->X_WT;
    CHECK(session.record()->wrench_C.force.norm() > 0.5);
    const auto edits = session.newest().edits;
    session.finishDemonstration();
    CHECK_FALSE(session.demonstration());
    REQUIRE(session.newest().edits.size() == edits.size() + 1);
    REQUIRE(session.scene()->demonstration);
    const double duration = session.scene()->demonstration->duration();
    CHECK(duration > 800);
    // The mouse goes on with the tool where it is.
    REQUIRE(reaches(session, [&] { return session.record()->tick > 5; }));
    CHECK(session.device().choice == "mouse");
    CHECK((session.record()->X_WT.p - tool.p).norm() < 0.5);
    CHECK(session.sceneNumber() == 1);

    const fs::path saved = folder.path() / "saved.glb";
    const std::uint64_t hash = hashOf(*session.scene());
    session.chooseDevice("demo", true);  // Replay
    REQUIRE(reaches(session, [&] { return session.snapshot()->finished; }));
    CHECK((session.record()->X_WT.p - tool.p).norm() < 0.05);
    REQUIRE(session.save(saved, false));
    const HapticScene again = openScene(saved, kUncached);
    CHECK(again.demonstration->duration() == duration);
    CHECK(hashOf(again) == hash);
    HeadlessOptions options;
    options.timing = false;
    const HeadlessRun headless = runHeadless(again, again.settings, options);
    CHECK(headless.report.ended == "motion");
    CHECK(headless.last.wrench_C.force.norm() > 0.5);
    CHECK(headless.report.overlapping == 0);
    CHECK(headless.report.penetration.max.value() <= 0.001);
    CHECK(textOf(session, Message::Kind::Error) == "");
}

TEST_CASE("demonstration: undo restores the old motion, reset begins the recording again, another scene ends it",
          "[session]") {
    const TempFolder folder;
    LiveSession session(uncached());
    session.open({holdFile(folder)});
    REQUIRE(reaches(session, [] { return true; }));
    const Pose old = session.scene()->demonstration->at(1e9);
    session.recordDemonstration();
    session.finishDemonstration();  // at once
    CHECK_FALSE(session.demonstration());
    CHECK(session.newest().edits.empty());
    CHECK(textOf(session, Message::Kind::Warning).find("did not move") != std::string::npos);

    session.chooseDevice("mouse", true);
    REQUIRE(reaches(session, [&] { return session.device().mouse != nullptr; }));
    session.recordDemonstration();
    session.device().mouse->grab({{20, 15, 0}, Quat::Identity()});
    run(session, 300);
    CHECK(session.demonstration()->moved());
    session.restart();
    CHECK_FALSE(session.demonstration()->moved());
    REQUIRE(reaches(session, [&] { return session.record()->tick > 20; }));
    session.device().mouse->grab({{-6, 30, 0}, Quat::Identity()});
    run(session, 600);
    session.finishDemonstration();
    const auto recorded = session.scene()->demonstration;
    CHECK((recorded->at(1e9).p - Vec3(-6, 30, 0)).norm() < 0.1);
    CHECK(recorded->at(100).p.x() <= 0.1);  // nothing of the way to x = 20
    session.setEdits({});
    CHECK(session.scene()->demonstration->at(1e9) == old);

    REQUIRE(reaches(session, [] { return true; }));
    session.recordDemonstration();
    session.open({holdFile(folder)});
    REQUIRE(reaches(session, [&] { return session.sceneNumber() == 2; }));
    CHECK_FALSE(session.demonstration());
    CHECK(textOf(session, Message::Kind::Warning).find("opened again") != std::string::npos);
    CHECK(textOf(session, Message::Kind::Error) == "");
}

TEST_CASE("demonstration: a scene gets its first, and a stop in between takes no time", "[session]") {
    const TempFolder folder;
    engine::Scene still = holdScene();
    still.animations.clear();
    const fs::path file = folder.path() / "still.glb";
    writeGltf(still, file);
    LiveSession session(uncached());
    session.open({file});
    REQUIRE(reaches(session, [&] { return session.device().mouse != nullptr; }));
    session.recordDemonstration();
    session.device().mouse->grab({{3, 20, 0}, Quat::Identity()});
    run(session, 400);
    session.stop();
    REQUIRE(reaches(session, [&] { return session.snapshot()->engagement == Engagement::Stopped; }));
    const double before = session.demonstration()->duration();
    run(session, 500);
    CHECK(session.demonstration()->duration() - before < 30);  // ticks before the stop that arrived late
    session.engage();
    REQUIRE(reaches(session, [&] { return session.engaged(); }));
    session.device().mouse->grab({{5, 20, 0}, Quat::Identity()});
    run(session, 400);
    session.finishDemonstration();
    REQUIRE(session.scene()->demonstration);
    CHECK(session.scene()->outcomes.size() == 1);
    CHECK((session.scene()->demonstration->at(1e9).p - Vec3(5, 20, 0)).norm() < 0.3);
    REQUIRE(session.save(file, false));
    CHECK(openScene(file, kUncached).motions.size() == 1);
}

TEST_CASE("goal: the tool pose becomes the goal below the nearest obstacle, while the loop runs, and is saved",
          "[session]") {
    const TempFolder folder;
    engine::Scene scene = holdScene();
    addBox(scene, "far", glm::vec3(0.01f), {{"role", "obstacle"}, {"leaves", 64}}, {.translation = {0.2, 0, 0}});
    // A slab that is turned and scaled: the goal is a pose in its frame.
    auto& slab = scene.registry.get<engine::LocalTransform>(scene.nodes[1]);
    slab.rotation = glm::dquat(glm::dvec3(0, 0.5, 0));
    slab.scale = {1.5, 1, 1.5};
    updateWorldTransforms(scene);
    const fs::path file = folder.path() / "scene.glb", saved = folder.path() / "saved.glb";
    writeGltf(scene, file);
    LiveSession session(uncached());
    session.open({file});
    REQUIRE(reaches(session, [&] { return session.snapshot()->finished; }));
    const std::uint64_t loop = session.snapshot()->session;
    session.setGoalHere();
    REQUIRE(session.scene()->roles.goal);
    const GoalRegion goal = *session.scene()->roles.goal;
    const Pose tool = session.record()->X_WT;
    CHECK((goal.X_WT.p - tool.p).norm() < 1e-6);
    CHECK(logRotation(goal.X_WT.q * tool.q.conjugate()).norm() < 1e-9);
    CHECK(goal.tolerance == kNewGoalMm);
    CHECK(goal.hold == kNewGoalHoldMs);
    const engine::Registry& registry = session.scene()->scene.registry;
    const engine::Entity node = session.scene()->roles.goalNode;
    CHECK(registry.get<engine::Hierarchy>(node).parent == session.scene()->roles.obstacles[0]);

    // It moves with the obstacle.
    const engine::LocalTransform place = registry.get<engine::LocalTransform>(session.scene()->scene.nodes[1]);
    engine::LocalTransform lower = place;
    lower.translation.y -= 0.004;
    session.edit({engine::PlaceNode{1, place, lower}});
    CHECK(session.scene()->roles.goal->X_WT.p.y() == Approx(tool.p.y() - 4));
    REQUIRE(reaches(session, [&] { return obstaclePose(*session.scene(), 0).p.y() < -3.999; }));

    // Now it is moved, with other tolerances.
    run(session, 50);
    session.setGoalHere();
    CHECK(session.scene()->roles.goalNode == node);
    CHECK((session.scene()->roles.goal->X_WT.p - session.record()->X_WT.p).norm() < 1e-3);
    GoalRegion wider = *session.scene()->roles.goal;
    wider.tolerance = 2.5;
    wider.toleranceAngle = 0.3;
    wider.depth = 7;
    session.edit({goalWith(*session.scene(), wider)});
    CHECK(session.scene()->roles.goal->tolerance == Approx(2.5));
    CHECK(session.snapshot()->session == loop);
    CHECK(session.sceneNumber() == 1);

    // Saved twice, with one goal.
    const Pose there = session.scene()->roles.goal->X_WT;
    REQUIRE(session.save(saved, false));
    REQUIRE(session.save(saved, false));
    const HapticScene again = openScene(saved, kUncached);
    REQUIRE(again.roles.goal);
    CHECK((again.roles.goal->X_WT.p - there.p).norm() < 1e-6);
    CHECK(again.roles.goal->tolerance == Approx(2.5));
    CHECK(again.roles.goal->toleranceAngle == Approx(0.3));
    CHECK(again.roles.goal->depth == Approx(7));
    CHECK(again.scene.nodes.size() == scene.nodes.size() + 1);
    CHECK(again.warnings.empty());
    CHECK(textOf(session, Message::Kind::Error) == "");
}

TEST_CASE("goal: its depth is how far the tool reaches into the obstacle along its way out, none where it rests on it",
          "[session]") {
    engine::Scene made;  // a cube of 10 mm beside a wall of 20 mm
    addBox(made, "cube", glm::vec3(0.01f), {{"role", "tool"}, {"leaves", 64}}, {.translation = {0, 0.02, 0}});
    addBox(made, "wall", {0.01f, 0.02f, 0.02f}, {{"role", "obstacle"}, {"leaves", 64}},
           {.translation = {0.0101, 0, 0}});
    updateWorldTransforms(made);
    const HapticScene scene = openScene(std::move(made), kUncached);
    const auto depthAt = [&](const Pose& X_WT) {
        const auto edits = goalHere(scene, X_WT, Geometry::Mesh);
        REQUIRE(edits.size() == 1);
        const nlohmann::json extras = *std::get<engine::AddNode>(edits[0]).extras;
        return extras.at("touchstone").at("goal").value("depth_m", 0.0);
    };
    CHECK(depthAt({{0, 4, 0}, Quat::Identity()}) == Approx(0.011));  // from 1 mm below the middle to the top at 10 mm
    CHECK(depthAt({{0, 15, 0}, Quat::Identity()}) == 0);
    // Turned by a right angle its way out is -x, where the wall begins 5.1 mm from the middle and the cube ends at 5
    // mm.
    CHECK(depthAt({{0, 4, 0}, Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ()))}) == 0);
}

TEST_CASE("goal: undo takes it away, and a goal in the extras of the tool moves there", "[session]") {
    const TempFolder folder;
    engine::Scene scene = holdScene();
    const bool ofTool = GENERATE(true, false);
    if (ofTool)
        (*scene.registry.get<engine::NodeMarking>(scene.nodes[0]).extras)["touchstone"]["goal"] = {
            {"translation", {0, 1, 0}}, {"tolerance_m", 0.002}, {"fold", 2}};
    const fs::path file = folder.path() / "scene.glb";
    writeGltf(scene, file);
    LiveSession session(uncached());
    session.open({file});
    REQUIRE(reaches(session, [&] { return session.snapshot()->finished; }));
    session.setGoalHere();
    CHECK((session.scene()->roles.goal->X_WT.p - session.record()->X_WT.p).norm() < 1e-6);
    if (ofTool) {
        CHECK(session.scene()->roles.goal->tolerance == 2);
        CHECK(session.scene()->roles.goal->fold == 2);
        REQUIRE(session.save(folder.path() / "saved.glb", false));
        CHECK((openScene(folder.path() / "saved.glb", kUncached).roles.goal->X_WT.p - session.record()->X_WT.p).norm() <
              1e-6);
        return;
    }
    session.setEdits({});
    REQUIRE(waitUntil([&] {
        session.update();
        return session.running() && !session.scene()->roles.goal;
    }));
    CHECK(session.scene()->scene.nodes.size() == scene.nodes.size());
}

TEST_CASE("goal: one that its way does not suit is refused, and the scene stays as it was", "[session]") {
    const TempFolder folder;
    engine::Scene scene = holdScene();
    scene.animations.push_back(
        {"out", translation(scene.nodes[0], {0, 1}, {{0, 0.01, 0, 0}, {0, 0.05, 0, 0}}).channels});
    const engine::Entity goal = addNode(scene, "seat", {}, {.translation = {0, 0.01, 0}});
    setExtras(scene, goal, {{"touchstone", {{"role", "goal"}, {"goal", {{"tolerance_m", 0.001}, {"way", "out"}}}}}});
    updateWorldTransforms(scene);
    const fs::path file = folder.path() / "scene.glb";
    writeGltf(scene, file);
    LiveSession session(uncached());
    session.open({file});
    REQUIRE(reaches(session, [&] { return session.device().choice == "demo"; }));
    session.restart();  // at 15 mm, 5 mm from where the way begins
    REQUIRE(reaches(session, [&] { return session.record()->X_WT.p.y() > 14; }));
    session.setGoalHere();
    CHECK(textOf(session, Message::Kind::Error).find("way") != std::string::npos);
    CHECK(session.newest().edits.empty());
    REQUIRE(session.scene()->roles.goal);
    CHECK(session.scene()->roles.goal->X_WT.p.y() == Approx(10));
}

}  // namespace touchstone::demonstration_tests
