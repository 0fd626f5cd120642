// The scenes of friction: parts, materials and what their motions are meant to do.
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/scene/physics_materials.hpp"
#include "engine/scene/rigid_bodies.hpp"
#include "tests/parts/mesh_checks.hpp"
#include "tools/parts/friction_scenes.hpp"

namespace touchstone::app::friction_scenes_tests {

TEST_CASE("drawer: a closed part of the volume that its dimensions give", "[parts]") {
    const DrawerFit fit;
    const engine::MeshData mesh = drawer(fit);
    CHECK(isClosed(mesh));
    CHECK(leastAngle(mesh) > 0.1);
    const double inside = (fit.length - 2 * fit.wall) * (fit.width - 2 * fit.wall) * (fit.height - fit.wall);
    const double whole = (fit.length * fit.width + fit.neck * fit.width / 4 + fit.bar * fit.barDepth) * fit.height;
    CHECK(volume(mesh) == Approx(whole - inside).epsilon(1e-5));
    // Its node is in the middle of drawer and bar, about which the springs act.
    glm::vec3 low(1), high(-1);
    for (const glm::vec3& p : mesh.positions) low = glm::min(low, p), high = glm::max(high, p);
    CHECK(glm::length(low + high) < 1e-8);
    DrawerFit thick = fit;
    thick.wall = fit.width / 2;
    CHECK_THROWS_AS(drawer(thick), std::invalid_argument);
}

TEST_CASE("drawer: turned by its tilt, opposite corners touch the rails", "[parts]") {
    const DrawerFit fit;
    const double turn = fit.tilt();
    // The corners in front at one side and behind at the other.
    const glm::dvec2 corner(fit.length / 2, fit.width / 2);
    const glm::dvec2 turned(corner.x * std::cos(turn) - corner.y * std::sin(turn),
                            corner.x * std::sin(turn) + corner.y * std::cos(turn));
    CHECK(turned.y == Approx(fit.width / 2 + fit.clearance).epsilon(1e-12));
    CHECK(2 * turned.x == Approx(fit.engaged()).epsilon(1e-12));
    CHECK(fit.engaged() < fit.length);
}

TEST_CASE("friction scenes: all parts have the material, whose pull off center is beyond the limit", "[parts]") {
    for (const auto make : {makeIncline, makeDrawer}) {
        const engine::Scene scene = make({});
        INFO(scene.name);
        const auto materials = engine::readPhysicsMaterials(scene);
        REQUIRE(materials.size() == 1);
        CHECK(materials[0].staticOr() > materials[0].dynamicOr());
        int tools = 0;
        for (const engine::Entity node : scene.nodes) {
            std::vector<std::string> warnings;
            const auto body = engine::readRigidBody(scene, node, warnings);
            REQUIRE(body);
            CHECK(warnings.empty());
            CHECK(body->collider);
            CHECK(body->material == 0);
            tools += body->motion;
        }
        CHECK(tools == 1);
    }
    // The incline holds a block that is only pressed down, and a drawer may be pulled at its bar until it jams.
    const SceneOptions options;
    const auto limit = [&](double friction) { return options.drawer.engaged() / (2 * friction); };
    CHECK(std::tan(options.slope) < 0.4);
    CHECK(options.drawer.bar / 2 > limit(0.6));
    CHECK(options.drawer.width / 2 < limit(0.6));  // else its corners would wedge by themselves
}

}  // namespace touchstone::app::friction_scenes_tests
