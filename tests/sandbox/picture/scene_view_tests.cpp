// The picture of a tick: contacts, overlays, and images without a window.
#include <catch2/catch.hpp>

#include "engine/view/gl_context.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tests/support/sphere_models.hpp"
#include "tests/support/ui_scene.hpp"

namespace touchstone::scene_view_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

TickRecord recordAt(const Pose& X_WT, const Pose& X_WT_device) {
    TickRecord record;
    record.X_WT = X_WT;
    record.X_WT_device = X_WT_device;
    return record;
}

struct Pixel {
    int r, g, b;
};

Pixel pixelAt(const engine::Image& image, glm::vec2 at) {
    const std::size_t x = std::size_t(at.x), y = std::size_t(at.y);
    const std::uint8_t* p = &image.rgba[4 * (y * std::size_t(image.width) + x)];
    return {p[0], p[1], p[2]};
}

}  // namespace

TEST_CASE("contacts: one ball on another carries the spring's force at the point of contact", "[contacts]") {
    // R 10 at the origin under R 5: they touch at a distance of 15. The device is 2 mm lower, k_t = 3 N/mm: 6 N.
    const auto world = std::make_shared<const World>(worldOf(ball(5), ball(10), at(0, 15, 0)));
    ContactFinder finder(world);
    Settings settings;
    settings.stiffness = 3;
    const auto contacts = finder.find(recordAt(at(0, 15, 0), at(0, 13, 0)), settings, 0.1);
    REQUIRE(contacts.size() == 1);
    CHECK((contacts[0].p_W - Vec3(0, 10, 0)).norm() < 1e-5);
    CHECK((contacts[0].n_W - Vec3(0, 1, 0)).norm() < 1e-6);
    CHECK(contacts[0].gap == Approx(0).margin(1e-5));
    CHECK(contacts[0].load == Approx(6).epsilon(1e-6));
    // Without a near pair nothing is shown.
    CHECK(finder.find(recordAt(at(0, 15.2, 0), at(0, 15.2, 0)), settings, 0.1).empty());
}

TEST_CASE("contacts: of hundreds of pairs a few are kept, loaded ones first, and the loads sum to the force",
          "[contacts]") {
    const auto world = std::make_shared<const World>(worldOf(slab(40, 1, 2), slab(60, 1, 2), at(0, 4.01, 0)));
    ContactFinder finder(world);
    const Settings settings;
    const auto contacts = finder.find(recordAt(at(0, 4.01, 0), at(0, 1.01, 0)), settings, 0.3, 50);
    REQUIRE(contacts.size() == 50);
    CHECK(std::is_sorted(contacts.begin(), contacts.end(), [](auto& a, auto& b) { return a.load > b.load; }));
    Vec3 sum = Vec3::Zero();
    for (const ContactPoint& contact : contacts) sum += contact.load * contact.n_W;
    // The tool as shown is 0.01 mm above the contact, so the solver moves it there first: 2.99 mm at 1 N/mm.
    CHECK((sum - Vec3(0, 2.99, 0)).norm() < 1e-3);
}

TEST_CASE("scene view: arrows grow with the force and stay in the picture", "[scene_view]") {
    CHECK(arrowLength(0) == 0);
    CHECK(arrowLength(2) > arrowLength(1));
    CHECK(arrowLength(1e6) < 1.8);
}

TEST_CASE("overlays: clearance, contact place and gaps of two balls", "[overlays]") {
    // R 5 above R 10 at the origin, 0.4 mm apart: (0, 10, 0) and (0, 10.4, 0).
    const auto world = std::make_shared<const World>(worldOf(ball(5), ball(10), at(0, 20, 0)));
    SceneOverlays overlays(world);
    const TickRecord apart = recordAt(at(0, 15.4, 0), at(0, 15.4, 0));
    DisplayOptions options;
    options.clearance = true;
    overlays.find(apart, {}, options);
    CHECK_FALSE(overlays.contactPlace());  // beyond the margin of 0.2 mm
    REQUIRE(overlays.nearestPlace());
    CHECK((overlays.nearestPlace()->p_W - Vec3(0, 10.2, 0)).norm() < 1e-5);
    CHECK((overlays.nearestPlace()->n_W - Vec3(0, 1, 0)).norm() < 1e-6);
    engine::Frame frame;
    overlays.add(frame, apart, options);
    REQUIRE(frame.labels.size() == 1);
    CHECK(frame.labels[0].text == "0.400 mm");
    options.values = false;
    frame = {};
    overlays.add(frame, apart, options);
    CHECK(frame.labels.empty());
    CHECK(frame.lines.size() == 3);  // the line and its two ends

    options.showTrees(0);
    options.byGap = true;
    overlays.find(apart, {}, options);
    frame = {};
    overlays.addSpheres(frame, apart.X_WT, options);
    REQUIRE(frame.spheres.size() == 2);
    for (const engine::Sphere& sphere : frame.spheres)
        CHECK(glm::length(glm::vec3(sphere.color) - gapColor(0.4)) < 1e-3f);

    const TickRecord touching = recordAt(at(0, 15, 0), at(0, 14, 0));
    overlays.find(touching, {}, options);
    REQUIRE(overlays.contactPlace());
    CHECK((overlays.contactPlace()->p_W - Vec3(0, 10, 0)).norm() < 1e-5);
    CHECK(overlays.contactPlace()->n_W.y() == Approx(1));
}

TEST_CASE("overlays: the trace keeps its spacing, drops the oldest point and restarts with the run", "[overlays]") {
    ToolTrace trace(1);
    std::uint64_t tick = 0;
    for (int i = 0; i < 20; ++i) trace.add(Vec3(0.25 * i, 0, 0), tick++);
    CHECK(trace.points().size() == 5);  // 0, 1, 2, 3 and 4 mm
    for (int i = 0; i < 10000; ++i) trace.add(Vec3(10 + 2 * i, 0, 0), tick++);
    CHECK(trace.points().size() <= 4000);
    CHECK(trace.points().back().x() == 10 + 2 * 9999);
    trace.add(Vec3::Zero(), 0);
    CHECK(trace.points().size() == 1);
}

TEST_CASE("overlays: levels of a tree differ in color, and gaps range from red to gray", "[overlays]") {
    for (const bool tool : {false, true})
        for (int level = 0; level < 3; ++level)
            CHECK(glm::length(glm::vec3(sphereColor(tool, level, 0)) - glm::vec3(sphereColor(tool, level + 1, 0))) >
                  0.15f);
    CHECK(gapColor(0).r > 2 * gapColor(0).b);
    CHECK(gapColor(-1) == gapColor(0));
    CHECK(gapColor(kShownGap).b > gapColor(kShownGap).r);
    CHECK(gapColor(10 * kShownGap) == gapColor(kShownGap));
}

TEST_CASE("scene view: named views look along their axes, and the contact view is close", "[gl]") {
    const HapticScene scene = openScene(holdScene());
    const engine::HeadlessContext context;
    engine::Renderer renderer;
    SceneView view(renderer, scene);
    const TickRecord record = recordAt(at(0, 10, 0), at(0, 8, 0));  // the cube rests on the slab
    const auto looking = [&](std::string_view name) {
        REQUIRE(checkView(name) == "");
        return view.look(name, &record, {}, 1.6f);
    };
    CHECK(glm::length(looking("front").forward() - glm::vec3(0, 0, -1)) < 0.02f);
    CHECK(glm::length(looking("back").forward() - glm::vec3(0, 0, 1)) < 0.02f);
    CHECK(glm::length(looking("right").forward() - glm::vec3(-1, 0, 0)) < 0.02f);
    CHECK(glm::length(looking("left").forward() - glm::vec3(1, 0, 0)) < 0.02f);
    CHECK(glm::length(looking("top").forward() - glm::vec3(0, -1, 0)) < 0.02f);
    CHECK(glm::length(looking("bottom").forward() - glm::vec3(0, 1, 0)) < 0.02f);
    const engine::OrbitCamera near = looking(kContactView);
    CHECK(near.distance < 0.7f * looking("").distance);
    CHECK(glm::length(near.target - glm::vec3(0, 0.005f, 0)) < 0.002f);
    CHECK(checkView("nowhere").find("'nowhere'") != std::string::npos);

    // A section through the place of contact removes everything nearer to the viewer.
    engine::Frame frame;
    frame.camera = looking("front");
    DisplayOptions cut;
    cut.section = true;
    view.fill(frame, &record, {}, cut);
    REQUIRE(frame.section);
    CHECK(glm::dot(*frame.section, glm::vec4(0, 0, 0.02f, 1)) < 0);
    CHECK(glm::dot(*frame.section, glm::vec4(0, 0, -0.02f, 1)) > 0);
}

TEST_CASE("scene view: tool and obstacle are drawn at their poses in their colors", "[gl]") {
    const HapticScene scene = openScene(holdScene(), {.treeCache = {}, .progress = {}, .allTrees = true});
    REQUIRE(scene.world);
    const Pose X_WT = at(15, 10, 0);  // on the slab, off its center
    constexpr int kWidth = 320, kHeight = 200;
    DisplayOptions plain;
    plain.contacts = plain.arrows = plain.grid = false;
    const auto picture = [&](const TickRecord& record, const DisplayOptions& options) {
        return renderScene(scene, record, {}, {.display = options, .width = kWidth, .height = kHeight});
    };
    const engine::OrbitCamera camera = [&] {
        const engine::HeadlessContext context;
        engine::Renderer renderer;
        return SceneView(renderer, scene).look(&X_WT, float(kWidth) / kHeight);
    }();
    const auto pixelOf = [&](const Vec3& mm) {
        return camera.project(glm::vec3(toMeters(mm)), {kWidth, kHeight}).value();
    };

    const engine::Image image = picture(recordAt(X_WT, X_WT), plain);
    REQUIRE(image.width == kWidth);
    REQUIRE(image.height == kHeight);
    const Pixel tool = pixelAt(image, pixelOf({15, 10, 0}));
    CAPTURE(tool.r, tool.g, tool.b);
    CHECK(tool.r > 2 * tool.b);
    const Pixel slab = pixelAt(image, pixelOf({-20, 5, 0}));
    CAPTURE(slab.r, slab.g, slab.b);
    CHECK(slab.b > 2 * slab.r);
    const Pixel corner = pixelAt(image, {3, 3});  // the parts fill the central 80 percent
    CHECK(std::max({corner.r, corner.g, corner.b}) < 100);
    // At the cube's place in the file, 15 mm up in the center, nothing of it is drawn.
    const Pixel before = pixelAt(image, pixelOf({0, 18, 0}));
    CHECK(before.r < 2 * before.b + 10);

    // A device 10 mm to the left appears as a ghost: the pixels under it change, those of the tool do not.
    const engine::Image ghosted = picture(recordAt(X_WT, at(0, 10, 0)), plain);
    const Pixel ghost = pixelAt(ghosted, pixelOf({-2, 10, 0})), behind = pixelAt(image, pixelOf({-2, 10, 0}));
    CHECK(std::abs(ghost.r - behind.r) + std::abs(ghost.g - behind.g) + std::abs(ghost.b - behind.b) > 20);

    // The overlay of the tree covers the tool in its own color.
    DisplayOptions leaves = plain;
    leaves.toolLevel = 0;
    const Pixel leaf = pixelAt(picture(recordAt(X_WT, X_WT), leaves), pixelOf({15, 10, 0}));
    CHECK(leaf.g > tool.g + 20);  // amber instead of red
}

}  // namespace touchstone::scene_view_tests
