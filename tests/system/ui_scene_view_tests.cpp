// What is drawn of a tick: contacts, and pictures without a window.
#include <catch2/catch.hpp>

#include "engine/view/gl_context.hpp"
#include "haptics/system/scene_view.hpp"
#include "haptics/system/units.hpp"
#include "tests/support/sphere_models.hpp"
#include "tests/system/ui_scene.hpp"

using namespace touchstone;
using namespace touchstone::system;
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

TEST_CASE("contacts: one ball on another carries the spring's force where they touch", "[contacts]") {
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
    // Out of reach nothing is shown.
    CHECK(finder.find(recordAt(at(0, 15.2, 0), at(0, 15.2, 0)), settings, 0.1).empty());
}

TEST_CASE("contacts: of hundreds a few stay, the loaded ones first, and the loads add up to the force", "[contacts]") {
    const auto world = std::make_shared<const World>(worldOf(slab(40, 1, 2), slab(60, 1, 2), at(0, 4.01, 0)));
    ContactFinder finder(world);
    const Settings settings;
    const auto contacts = finder.find(recordAt(at(0, 4.01, 0), at(0, 1.01, 0)), settings, 0.3, 50);
    REQUIRE(contacts.size() == 50);
    CHECK(std::is_sorted(contacts.begin(), contacts.end(), [](auto& a, auto& b) { return a.load > b.load; }));
    Vec3 sum = Vec3::Zero();
    for (const ContactPoint& contact : contacts) sum += contact.load * contact.n_W;
    // The shown tool is 0.01 mm above the contact, so the solver moves it there first: 2.99 mm at 1 N/mm.
    CHECK((sum - Vec3(0, 2.99, 0)).norm() < 1e-3);
}

TEST_CASE("scene view: arrows grow with the force and stay in the picture", "[scene_view]") {
    CHECK(arrowLength(0) == 0);
    CHECK(arrowLength(2) > arrowLength(1));
    CHECK(arrowLength(1e6) < 1.8);
}

TEST_CASE("scene view: tool and obstacle have their colours where they must be", "[gl]") {
    const HapticScene scene = openScene(holdScene());
    REQUIRE(scene.world);
    const Pose X_WT = at(15, 10, 0);  // on the slab, beside its middle
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
        return camera.project(glm::vec3(toMetres(mm)), {kWidth, kHeight}).value();
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
    const Pixel corner = pixelAt(image, {3, 3});  // the parts fill the middle 80 percent
    CHECK(std::max({corner.r, corner.g, corner.b}) < 100);
    // Where the file has the cube, 15 mm up in the middle, nothing of it is left.
    const Pixel before = pixelAt(image, pixelOf({0, 18, 0}));
    CHECK(before.r < 2 * before.b + 10);

    // A device 10 mm to the left is seen as a ghost: what lies under it changes, the tool does not.
    const engine::Image ghosted = picture(recordAt(X_WT, at(0, 10, 0)), plain);
    const Pixel ghost = pixelAt(ghosted, pixelOf({-2, 10, 0})), behind = pixelAt(image, pixelOf({-2, 10, 0}));
    CHECK(std::abs(ghost.r - behind.r) + std::abs(ghost.g - behind.g) + std::abs(ghost.b - behind.b) > 20);

    // The overlay of the tree covers the tool in its own colour.
    DisplayOptions leaves = plain;
    leaves.toolLevel = 0;
    const Pixel leaf = pixelAt(picture(recordAt(X_WT, X_WT), leaves), pixelOf({15, 10, 0}));
    CHECK(leaf.g > tool.g + 20);  // amber instead of red
}
