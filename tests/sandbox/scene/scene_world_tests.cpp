#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_write.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/sandbox/devices/all_devices.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/sandbox/session/device_choice.hpp"
#include "tests/support/scene_maker.hpp"

namespace touchstone::scene_world_tests {

using namespace touchstone::test;
using Catch::Matchers::Contains;
using engine::Entity;
using engine::Scene;

namespace {

bool anyContains(const std::vector<std::string>& sentences, const std::string& part) {
    return std::any_of(sentences.begin(), sentences.end(),
                       [&](const std::string& s) { return s.find(part) != std::string::npos; });
}

Eigen::AlignedBox3d boxOf(const TriangleMesh& mesh) {
    Eigen::AlignedBox3d box;
    for (const Vec3& vertex : mesh.vertices) box.extend(vertex);
    return box;
}

/// Six times the enclosed volume, mm³: positive when triangles are counter-clockwise seen from outside.
double signedVolume(const TriangleMesh& mesh) {
    double sum = 0;
    for (const auto& t : mesh.triangles) sum += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
    return sum / 6;
}

/// Depth of the point inside the tree's leaves, mm; negative outside.
double depthIn(const SphereTree& tree, const Vec3& point) {
    double depth = -1e30;
    for (int i = 0; i < tree.leafCount(); ++i) {
        const Sphere s = tree.leaf(i);
        depth = std::max(depth, double(s.r) - (point - Vec3(s.x, s.y, s.z)).norm());
    }
    return depth;
}

/// The scene with the sphere trees of all parts.
sandbox::HapticScene withTrees(Scene scene, const std::filesystem::path& cache = {},
                               const sandbox::SceneProgress& progress = {}) {
    return sandbox::openScene(std::move(scene), {.treeCache = cache, .progress = progress, .allTrees = true});
}

}  // namespace

TEST_CASE("scene world: all meshes below a role node are one body, in mm, with scale and mirroring baked in",
          "[sandbox]") {
    Scene scene;
    const Entity top = addNode(scene, "assembly", {},
                               {.translation = {0.5, 0, 0}, .rotation = glm::angleAxis(0.7, glm::dvec3(0, 1, 0))});
    const Entity tool = addBox(scene, "tool", {0.01f, 0.02f, 0.03f}, {{"role", "tool"}},
                               {.translation = {0, 0.1, 0}, .scale = {-2, 1, 1}}, top);
    addBox(scene, "knob", glm::vec3(0.01f), nullptr, {.translation = {0.02, 0, 0}}, tool);
    addBox(scene, "label", glm::vec3(1.0f), {{"role", "visual"}}, {}, tool);
    updateWorldTransforms(scene);
    sandbox::assignRoles(scene);

    const TriangleMesh mesh = sandbox::bakedTriangles(scene, tool);
    CHECK(mesh.triangles.size() == 24);  // tool and knob, not the label
    // x of the tool: ±5 mm times 2. The knob's center at 20 mm times 2, mirrored: its box spans 30 to 50 mm, on the
    // side given by the mirroring of the rest matrix.
    const Eigen::AlignedBox3d box = boxOf(mesh);
    CHECK(std::min(box.max().x(), -box.min().x()) == Approx(10));
    CHECK(std::max(box.max().x(), -box.min().x()) == Approx(50));
    CHECK(box.sizes().y() == Approx(20));
    CHECK(box.sizes().z() == Approx(30));
    // 20 x 20 x 30 mm and 20 x 10 x 10 mm, oriented outward although both are mirrored.
    CHECK(signedVolume(mesh) == Approx(12000 + 2000));

    // With the frame applied again, vertices are where the engine draws them.
    const Pose X_WT = sandbox::toPose(engine::worldPose(scene.registry, tool));
    const glm::dmat4 world = scene.registry.get<engine::WorldTransform>(tool).matrix;
    const glm::dvec3 drawn = glm::dvec3(world * glm::dvec4(boxMesh({0.01f, 0.02f, 0.03f})->positions[0], 1));
    double nearest = 1e30;
    for (const Vec3& vertex : mesh.vertices) nearest = std::min(nearest, (X_WT * vertex - sandbox::toMm(drawn)).norm());
    CHECK(nearest < 1e-9);
}

TEST_CASE("scene world: trees contain the baked vertices of mirrored and scaled nodes", "[sandbox]") {
    Scene scene = pressScene();
    scene.registry.get<engine::LocalTransform>(scene.nodes[0]).scale = {1, -1.5, 1};
    scene.registry.get<engine::LocalTransform>(scene.nodes[1]).scale = {-1, 1, 0.5};
    const sandbox::HapticScene opened = withTrees(std::move(scene));
    REQUIRE(opened.world);
    for (int body = 0; body < 2; ++body) {
        const SphereTree& tree = body == 0 ? *opened.world->tool.spheres : *opened.world->obstacles[0].part.spheres;
        for (const Vec3& vertex : sandbox::bakedTriangles(opened.scene, opened.scene.nodes[body]).vertices)
            CHECK(depthIn(tree, vertex) > -1e-4);  // leaves are floats
    }
}

TEST_CASE("scene world: a collider's geometry replaces the drawn mesh, at the collider's pose", "[sandbox]") {
    Scene scene;
    const Entity wall = addBox(scene, "wall", glm::vec3(0.1f));
    const Entity holder = addNode(scene, "holder", wall, {.translation = {0, 0.2, 0}});
    const Entity shape = addBox(scene, "shape", glm::vec3(0.02f), nullptr, {.translation = {5, 5, 5}});
    addPhysics(scene, wall, {{"collider", {{"geometry", {{"node", 2}}}}}});
    addPhysics(scene, holder, {{"collider", {{"geometry", {{"node", 2}}}}}});
    (void)shape;
    updateWorldTransforms(scene);
    sandbox::assignRoles(scene);
    // Each collider is a separate obstacle with the box of 20 mm; the translation of the referenced node is ignored.
    for (const Entity node : {wall, holder}) {
        const TriangleMesh mesh = sandbox::bakedTriangles(scene, node);
        CHECK(mesh.triangles.size() == 12);
        CHECK(boxOf(mesh).center().norm() < 1e-6);  // single-precision vertices
        CHECK(boxOf(mesh).sizes().x() == Approx(20));
    }
}

TEST_CASE("scene world: a press scene becomes one tool, one obstacle and their poses", "[sandbox]") {
    std::vector<double> fractions;
    std::vector<std::string> parts;
    std::size_t highest = 0;
    bool estimated = false;
    const auto progress = [&](const sandbox::SceneStatus& status) {
        parts.push_back(status.part);
        fractions.push_back(status.fraction);
        highest = std::max(highest, status.number);
        estimated = estimated || status.secondsLeft >= 0;
        CHECK(status.of == 2);
        return true;
    };
    const sandbox::HapticScene scene = withTrees(pressScene(), {}, progress);
    REQUIRE(scene.world);
    CHECK(scene.missing.empty());
    CHECK(scene.world->tool.spheres->leafCount() <= 64);
    REQUIRE(scene.world->obstacles.size() == 1);
    CHECK(scene.world->obstacles[0].name == "slab");
    CHECK(scene.world->X_WT_start.p.isApprox(Vec3(0, 15, 0), 1e-6));
    // The faces are 5 mm apart; leaves protrude from them by the certified protrusion.
    const double out = scene.world->tool.spheres->certificate.protrusion +
                       scene.world->obstacles[0].part.spheres->certificate.protrusion;
    const double clearance = trueClearance(*scene.world, scene.world->X_WT_start);
    CHECK(clearance > 5 - out - 1e-3);
    CHECK(clearance < 5);
    REQUIRE(scene.demonstration);
    CHECK(scene.demonstration->duration() == Approx(800));
    REQUIRE_FALSE(fractions.empty());
    CHECK(std::is_sorted(fractions.begin(), fractions.end()));
    CHECK(fractions.back() <= 1);
    CHECK(anyContains(parts, "cube"));
    CHECK(anyContains(parts, "slab"));
    CHECK(highest == 2);
    CHECK(estimated);
}

TEST_CASE("scene world: bodies of one shape share one tree", "[sandbox]") {
    Scene scene;
    addBox(scene, "a", glm::vec3(0.01f), {{"role", "tool"}, {"leaves", 64}});
    addBox(scene, "b", glm::vec3(0.01f), {{"role", "obstacle"}, {"leaves", 64}}, {.translation = {0.1, 0, 0}});
    addBox(scene, "c", glm::vec3(0.01f), {{"role", "obstacle"}, {"leaves", 8}}, {.translation = {-0.1, 0, 0}});
    const sandbox::HapticScene opened = withTrees(std::move(scene));
    CHECK(opened.world->tool.spheres == opened.world->obstacles[0].part.spheres);
    CHECK(opened.world->tool.spheres != opened.world->obstacles[1].part.spheres);
    CHECK(opened.world->X_WT_start.p.norm() == 0);
    CHECK(opened.world->obstacles[0].X_WO.p.isApprox(Vec3(100, 0, 0)));
    CHECK(opened.demonstration == nullptr);
}

TEST_CASE("scene world: the second time trees come from the cache", "[sandbox]") {
    const TempFolder folder;
    const sandbox::HapticScene first = withTrees(pressScene(), folder.path());
    CHECK_FALSE(std::filesystem::is_empty(folder.path()));
    int calls = 0;
    const auto never = [&](const sandbox::SceneStatus&) { return ++calls, true; };
    const sandbox::HapticScene second = withTrees(pressScene(), folder.path(), never);
    CHECK(first.world->tool.spheres->leafCount() == second.world->tool.spheres->leafCount());
    CHECK(calls <= 2);  // at most one final call for each part
}

TEST_CASE("scene world: a damaged cache entry is rebuilt, and a warning says so", "[sandbox]") {
    const TempFolder folder;
    const sandbox::HapticScene first = withTrees(pressScene(), folder.path());
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
        std::filesystem::resize_file(entry.path(), std::filesystem::file_size(entry.path()) - 1);
    const sandbox::HapticScene second = withTrees(pressScene(), folder.path());
    CHECK(second.world->tool.spheres->leafCount() == first.world->tool.spheres->leafCount());
    CHECK(anyContains(second.warnings, "node 0 \"cube\""));
    CHECK(anyContains(second.warnings, "built again"));
}

TEST_CASE("scene world: each node with a role finds its tree", "[sandbox]") {
    sandbox::HapticScene scene = withTrees(pressScene());
    CHECK(sandbox::treeOf(scene, scene.roles.tool) == scene.world->tool.spheres.get());
    CHECK(sandbox::treeOf(scene, scene.roles.obstacles[0]) == scene.world->obstacles[0].part.spheres.get());
    CHECK(sandbox::treeOf(scene, Entity{}) == nullptr);
    scene.world = nullptr;
    CHECK(sandbox::treeOf(scene, scene.roles.tool) == nullptr);
}

TEST_CASE("scene world: a scene without roles is one mesh in its own frame", "[sandbox]") {
    Scene scene;
    const Entity top = addNode(scene, "group", {}, {.translation = {0.1, 0, 0}});
    addBox(scene, "a", glm::vec3(0.01f), nullptr, {.translation = {0, 0.02, 0}}, top);
    addBox(scene, "b", glm::vec3(0.01f), nullptr, {.scale = {1, 2, -1}}, top);
    updateWorldTransforms(scene);
    const TriangleMesh mesh = sandbox::bakedTriangles(scene);
    CHECK(mesh.triangles.size() == 24);
    // x: 100 ± 5 mm. y: from -10 mm (b, twice as high) to 25 mm (a).
    CHECK(boxOf(mesh).min().isApprox(Vec3(95, -10, -5), 1e-6));
    CHECK(boxOf(mesh).max().isApprox(Vec3(105, 25, 5), 1e-6));
    CHECK(signedVolume(mesh) == Approx(1000 + 2000));
}

TEST_CASE("scene world: a part is built with its own maximum error", "[sandbox]") {
    Scene scene = pressScene();
    setExtras(scene, scene.nodes[0], {{"touchstone", {{"role", "tool"}, {"max_error_mm", 0.5}}}});
    const sandbox::HapticScene opened = withTrees(std::move(scene));
    REQUIRE(opened.world);
    CHECK(opened.world->tool.spheres->certificate.protrusion <= 0.5);
    CHECK(opened.world->tool.spheres->leafCount() < 4096);  // as few as necessary, not the default count
}

TEST_CASE("scene world: a part that asks for spheres is touched by them, beside parts that are touched by their meshes",
          "[sandbox]") {
    const auto opened = [](const char* ofTool, const char* ofWall) {
        Scene scene = pressScene();
        addBox(scene, "wall", {0.01f, 0.06f, 0.06f}, {{"role", "obstacle"}, {"leaves", 64}, {"geometry", ofWall}},
               {.translation = {0.03, 0.01, 0}});
        (*scene.registry.get<engine::NodeMarking>(scene.nodes[0]).extras)["touchstone"]["geometry"] = ofTool;
        return sandbox::openScene(std::move(scene));
    };
    const auto mixed = opened("mesh", "spheres");
    REQUIRE(mixed.world->obstacles.size() == 2);
    CHECK(mixed.world->byMeshes(0, Geometry::Mesh));
    CHECK_FALSE(mixed.world->obstacles[0].part.spheres);
    CHECK_FALSE(mixed.world->byMeshes(1, Geometry::Mesh));
    CHECK(mixed.world->hasSpheres(1));
    const auto all = opened("spheres", "mesh");
    for (const std::size_t k : {0u, 1u}) CHECK_FALSE(all.world->byMeshes(k, Geometry::Mesh));
}

TEST_CASE("scene world: cancelling stops the build", "[sandbox]") {
    const auto cancel = [](const sandbox::SceneStatus&) { return false; };
    CHECK_THROWS_AS(withTrees(pressScene(), {}, cancel), BuildCancelled);
}

TEST_CASE("scene world: warns about sizes that suggest a wrong unit", "[sandbox]") {
    Scene scene;
    addBox(scene, "giant", glm::vec3(20), {{"role", "tool"}, {"leaves", 64}});
    addBox(scene, "dwarf", glm::vec3(1e-4f), {{"role", "obstacle"}, {"leaves", 64}});
    sandbox::SceneOptions options;
    options.buildWorld = false;
    const sandbox::HapticScene opened = sandbox::openScene(std::move(scene), options);
    CHECK(opened.world == nullptr);
    CHECK(opened.missing.empty());
    CHECK(anyContains(opened.warnings, "\"giant\" is 34641 mm across"));  // 20 m times sqrt(3)
    CHECK(anyContains(opened.warnings, "\"dwarf\" is 0.173205 mm across"));
}

TEST_CASE("scene world: asks about the unit that explains all sizes", "[sandbox]") {
    const auto scaleFor = [](std::vector<double> mm) {
        const auto asked = sandbox::unitQuestion(std::vector<std::string>(mm.size(), "a part"), mm);
        return asked ? asked->scale : 1;
    };
    CHECK(scaleFor({16'000, 30'000}) == 0.001);  // a nut of 16 m
    CHECK(scaleFor({800, 30'000}) == 0.01);      // as millimeters the smaller one would be 0.8 mm
    CHECK(scaleFor({0.016, 0.03}) == 1000);
    CHECK(scaleFor({1, 1000}) == 1);
    CHECK(scaleFor({0.1, 30'000}) == 1);  // no unit explains both
    CHECK(scaleFor({}) == 1);
}

TEST_CASE("scene world: a role without triangles is refused in one sentence", "[sandbox]") {
    Scene scene;
    addNode(scene, "ghost");
    setExtras(scene, scene.nodes[0], {{"touchstone", {{"role", "tool"}}}});
    addBox(scene, "wall", glm::vec3(0.01f), {{"role", "obstacle"}, {"leaves", 64}});
    CHECK_THROWS_WITH(sandbox::openScene(std::move(scene)), Contains("node 0 \"ghost\"") && Contains("no triangles"));
}

TEST_CASE("scene world: the cache folder follows the environment", "[sandbox]") {
    const auto keep = [](const char* name) {
        const char* value = std::getenv(name);
        return value ? std::optional<std::string>(value) : std::nullopt;
    };
    const auto put = [](const char* name, const std::optional<std::string>& value) {
        if (value)
            setenv(name, value->c_str(), 1);
        else
            unsetenv(name);
    };
    const auto own = keep("TOUCHSTONE_CACHE"), xdg = keep("XDG_CACHE_HOME"), home = keep("HOME");
    put("TOUCHSTONE_CACHE", "/a");
    put("XDG_CACHE_HOME", "/b");
    put("HOME", "/c");
    CHECK(sandbox::treeCacheFolder() == "/a");
    put("TOUCHSTONE_CACHE", std::nullopt);
    CHECK(sandbox::treeCacheFolder() == "/b/touchstone");
    put("XDG_CACHE_HOME", "relative");
    CHECK(sandbox::treeCacheFolder() == "/c/.cache/touchstone");
    put("HOME", std::nullopt);
    CHECK(sandbox::treeCacheFolder().empty());
    put("TOUCHSTONE_CACHE", own);
    put("XDG_CACHE_HOME", xdg);
    put("HOME", home);
}

TEST_CASE("device choice: separates names and files, and names an unknown device or missing file", "[sandbox]") {
    const sandbox::HapticScene scene = sandbox::openScene(pressScene());
    const auto demo = sandbox::startDevice(scene, "demo");
    CHECK(demo->read(0, 1).X_WT_device.p.isApprox(Vec3(0, 15, 0), 1e-6));
    std::string names;
    for (const DeviceInfo& device : sandbox::allDevices())
        names += (names.empty() ? "" : ", ") + std::string(device.name);
    CHECK_THROWS_WITH(sandbox::startDevice(scene, "joystick"), Contains("'joystick'") && Contains(names));
    CHECK_THROWS_WITH(sandbox::startDevice(scene, "replay:/no/such:file.csv"), Contains("/no/such:file.csv"));
}

}  // namespace touchstone::scene_world_tests
