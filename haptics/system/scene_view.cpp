#include "haptics/system/scene_view.hpp"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <map>

#include "engine/view/gl_context.hpp"
#include "engine/view/image_file.hpp"
#include "haptics/system/units.hpp"

namespace touchstone::system {
namespace {

constexpr glm::vec4 kForceColor{1.00f, 0.36f, 0.22f, 1}, kTorqueColor{0.66f, 0.48f, 1.00f, 1};
constexpr glm::vec4 kContactColor{0.30f, 0.85f, 0.95f, 1}, kLoadColor{1.00f, 0.30f, 0.15f, 1};
constexpr glm::vec3 kGhostTint{0.45f, 0.70f, 1.00f}, kGoalTint{0.25f, 0.85f, 0.40f};

// Below these the device's ghost would only flicker on the tool.
constexpr double kApartMm = 0.05, kApartRad = 1e-3;

constexpr float kYaw = 0.45f, kPitch = 0.32f;  // of the first view, radians
constexpr float kAside = 0.25f;                // off the plane between two parts that stand side by side

std::pair<glm::vec3, glm::vec3> boxOf(const std::vector<glm::vec3>& points) {
    glm::vec3 low = points.front(), high = low;
    for (const glm::vec3& p : points) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    return {low, high};
}

}  // namespace

glm::vec4 sphereColor(bool tool, int level, int index) {
    const float a = std::fmod(0.618034f * static_cast<float>(index), 1.f),
                b = std::fmod(0.754878f * static_cast<float>(index), 1.f);
    const glm::vec3 low = tool ? glm::vec3(0.95f, 0.55f, 0.15f) : glm::vec3(0.20f, 0.50f, 0.80f);
    const glm::vec3 high = tool ? glm::vec3(1.00f, 0.85f, 0.40f) : glm::vec3(0.45f, 0.80f, 0.85f);
    return {glm::mix(low, high, a) * (0.8f + 0.2f * b), level == 0 ? 1.f : 0.22f};
}

double arrowLength(double newtons) {
    constexpr double kLongest = 1.8, kHalfwayNewtons = 10;
    return kLongest * newtons / (newtons + kHalfwayNewtons);
}

void fitPoints(engine::OrbitCamera& camera, const std::vector<glm::vec3>& points, float aspect) {
    constexpr float kShare = 0.8f;  // of the picture, for the parts
    if (points.empty()) return;
    const auto [low, high] = boxOf(points);
    camera.target = 0.5f * (low + high);
    const float tanY = kShare * std::tan(camera.fovY / 2), tanX = aspect * tanY;
    // How far the eye must stand back for every corner to lie inside the four planes through it; then centred once
    // more.
    for (int pass = 0; pass < 2; ++pass) {
        float left = 0, right = 0, down = 0, up = 0;
        for (const glm::vec3& p : points) {
            const glm::vec3 d = p - camera.target;
            const float depth = glm::dot(d, camera.forward()), x = glm::dot(d, camera.right()),
                        y = glm::dot(d, camera.up());
            right = std::max(right, x / tanX - depth);
            left = std::max(left, -x / tanX - depth);
            up = std::max(up, y / tanY - depth);
            down = std::max(down, -y / tanY - depth);
        }
        camera.distance = std::max({left, right, up, down, 1e-3f});
        if (pass == 0)
            camera.target += 0.5f * (tanX * (right - left) * camera.right() + tanY * (up - down) * camera.up());
    }
}

SceneView::SceneView(engine::Renderer& renderer, const HapticScene& scene) : scene_(scene) {
    const engine::Registry& registry = scene.scene.registry;
    const engine::Entity tool = scene.roles.tool;
    if (tool) toolFromWorld_ = glm::inverse(engine::rigidMatrix(engine::worldPose(registry, tool)));

    std::vector<engine::GpuTexture> textures;
    for (const engine::Image& image : scene.scene.images) textures.push_back(renderer.upload(image));
    std::map<const engine::MeshData*, engine::GpuMesh> uploaded;
    registry.each<engine::MeshInstance, engine::WorldTransform>(
        [&](engine::Entity node, const engine::MeshInstance& instance, const engine::WorldTransform& world) {
            const engine::Entity owner = roleOwner(registry, node);
            for (const engine::Primitive& primitive : instance.primitives) {
                if (primitive.mesh->indices.empty()) continue;
                Part part{.node = node, .item = {}, .moves = tool && engine::isBelow(registry, node, tool)};
                part.role = owner ? registry.get<Role>(owner) : Role::Visual;
                auto [mesh, isNew] = uploaded.try_emplace(primitive.mesh.get());
                if (isNew) mesh->second = renderer.upload(*primitive.mesh);
                part.item.mesh = mesh->second;
                part.item.model = world.matrix;
                if (primitive.material >= 0) {
                    part.item.material = scene.scene.materials[static_cast<std::size_t>(primitive.material)];
                    if (const int texture = part.item.material.texture; texture >= 0)
                        part.item.texture = textures[static_cast<std::size_t>(texture)];
                }
                part.low = part.high = primitive.mesh->positions.front();
                for (const glm::vec3& p : primitive.mesh->positions) {
                    part.low = glm::min(part.low, p);
                    part.high = glm::max(part.high, p);
                }
                parts_.push_back(std::move(part));
            }
        });

    if (scene.world) reach_ = std::max(scene.world->reach(), 1e-3);
    floor_ = std::numeric_limits<float>::infinity();
    // The tool may go below the floor: the floor does not follow it.
    for (const glm::vec3& p : corners(nullptr, !scene.world, true)) floor_ = std::min(floor_, p.y);
    if (!std::isfinite(floor_)) floor_ = 0;
}

glm::mat4 SceneView::modelAt(const Part& part, const Pose* X_WT) const {
    const engine::Registry& registry = scene_.scene.registry;
    const glm::dmat4& placed = registry.get<engine::WorldTransform>(part.node).matrix;
    if (!part.moves || !X_WT) return glm::mat4(placed);
    return glm::mat4(toMatrix(*X_WT) * toolFromWorld_ * placed);
}

std::vector<glm::vec3> SceneView::corners(const Pose* X_WT, bool moving, bool fixed) const {
    std::vector<glm::vec3> points;
    for (const Part& part : parts_) {
        if (!(part.moves ? moving : fixed) || !engine::isVisible(scene_.scene.registry, part.node)) continue;
        const glm::mat4 model = modelAt(part, X_WT);
        for (int corner = 0; corner < 8; ++corner) {
            const glm::vec3 p{corner & 1 ? part.high.x : part.low.x, corner & 2 ? part.high.y : part.low.y,
                              corner & 4 ? part.high.z : part.low.z};
            points.emplace_back(model * glm::vec4(p, 1));
        }
    }
    return points;
}

void SceneView::fit(engine::OrbitCamera& camera, const Pose* X_WT, float aspect) const {
    fitPoints(camera, corners(X_WT, true, true), aspect);
}

engine::OrbitCamera SceneView::look(const Pose* X_WT, float aspect) const {
    engine::OrbitCamera camera;
    camera.yaw = kYaw;
    camera.pitch = kPitch;
    const std::vector<glm::vec3> tool = corners(X_WT, true, false), rest = corners(X_WT, false, true);
    if (!tool.empty() && !rest.empty()) {
        const auto [toolLow, toolHigh] = boxOf(tool);
        const auto [restLow, restHigh] = boxOf(rest);
        const glm::vec3 across = toolLow + toolHigh - restLow - restHigh;
        // Across the line between the two, unless one stands on the other; of the two sides the one nearer to the
        // front.
        if (glm::length(glm::vec2(across.x, across.z)) > 0.3f * std::abs(across.y)) {
            const float side = std::atan2(-across.z, across.x);
            camera.yaw = kAside + std::remainder(side, glm::pi<float>());
        }
    }
    fit(camera, X_WT, aspect);
    return camera;
}

void SceneView::fill(engine::Frame& frame, const TickRecord* record, const Settings& settings,
                     const DisplayOptions& options) {
    if (scene_.roles.tool)  // nodes may have been moved since the last frame
        toolFromWorld_ = glm::inverse(engine::rigidMatrix(engine::worldPose(scene_.scene.registry, scene_.roles.tool)));
    if (contactWorld_ != scene_.world) {
        contactWorld_ = scene_.world;
        contacts_ = contactWorld_ ? std::make_unique<ContactFinder>(contactWorld_) : nullptr;
    }
    frame.grid = {.visible = options.grid, .height = floor_};
    addParts(frame, record, options);
    if (!scene_.world) return;

    const Pose X_WT = record ? record->X_WT : scene_.world->X_WT_start;
    addSpheres(frame, *scene_.world->tool, X_WT, options.toolLevel, true);
    for (const Obstacle& obstacle : scene_.world->obstacles)
        addSpheres(frame, *obstacle.tree, obstacle.X_WO, options.obstacleLevel, false);
    if (options.cut) {
        const glm::vec3 n = -frame.camera.forward();
        const glm::vec3 p_WC(toMetres(X_WT * scene_.world->p_TC()));
        frame.section = glm::vec4(-n, glm::dot(n, p_WC));
    }
    if (record && options.contacts) addContacts(frame, *record, settings, options.contactMargin);
    if (record && options.arrows) addArrows(frame, *record);
}

void SceneView::addParts(engine::Frame& frame, const TickRecord* record, const DisplayOptions& options) const {
    const Pose start = scene_.world ? scene_.world->X_WT_start : Pose{};
    const Pose* X_WT = record ? &record->X_WT : scene_.world ? &start : nullptr;
    bool goalShown = false;
    for (const Part& part : parts_) {
        if (!engine::isVisible(scene_.scene.registry, part.node) || (part.role == Role::Goal && !options.goal))
            continue;
        engine::DrawItem item = part.item;
        item.model = modelAt(part, X_WT);
        if (part.role == Role::Goal) {
            item.alpha = 0.25f;
            goalShown = true;
        }
        frame.items.push_back(std::move(item));
    }
    if (options.goal && scene_.roles.goal && !goalShown)
        addGhost(frame, scene_.roles.goal->X_WT, kGoalTint, 0.8f, 0.14f);
    if (record && options.ghost) {
        const bool apart = (record->X_WT.p - record->X_WT_device.p).norm() > kApartMm ||
                           logRotation(record->X_WT_device.q * record->X_WT.q.conjugate()).norm() > kApartRad;
        if (apart) addGhost(frame, record->X_WT_device, kGhostTint, 0.55f, 0.28f);
    }
}

void SceneView::addGhost(engine::Frame& frame, const Pose& X_WT, glm::vec3 tint, float share, float alpha) const {
    for (const Part& part : parts_) {
        if (!part.moves || !engine::isVisible(scene_.scene.registry, part.node)) continue;
        engine::DrawItem item = part.item;
        item.model = modelAt(part, &X_WT);
        item.material.baseColor = glm::vec4(glm::mix(glm::vec3(item.material.baseColor), tint, share), 1);
        item.material.metallic = 0;
        item.alpha = alpha;
        frame.items.push_back(std::move(item));
    }
}

void SceneView::addContacts(engine::Frame& frame, const TickRecord& record, const Settings& settings, double margin) {
    const std::span<const ContactPoint> contacts = contacts_->find(record, settings, margin);
    double total = 1e-9;
    for (const ContactPoint& contact : contacts) total += contact.load;
    // The loaded ones come first and are to be drawn last, over the others.
    for (auto contact = contacts.rbegin(); contact != contacts.rend(); ++contact) {
        // Normals of loaded contacts share out the length of the force's arrow.
        const bool loaded = contact->load > 1e-3;
        const double length = reach_ * (loaded ? 0.15 + 0.6 * arrowLength(total) * contact->load / total : 0.05);
        const glm::vec3 p(toMetres(contact->p_W)), q(toMetres(Vec3(contact->p_W + length * contact->n_W)));
        const glm::vec4 color = loaded ? kLoadColor : kContactColor;
        frame.lines.push_back({p, q, color, loaded ? 3.5f : 1.5f});
        frame.lines.push_back({p, p, color, loaded ? 14.f : 6.f});
    }
}

void SceneView::addArrows(engine::Frame& frame, const TickRecord& record) const {
    const Vec3 C = record.X_WT * scene_.world->p_TC();
    const auto add = [&](const Vec3& v, double newtons, const glm::vec4& color, double thickness) {
        if (newtons < 1e-3) return;
        const Vec3 tip = C + reach_ * arrowLength(newtons) * v.normalized();
        frame.arrows.push_back({glm::vec3(toMetres(C)), glm::vec3(toMetres(tip)),
                                static_cast<float>(toMetres(thickness * reach_)), color});
    };
    add(record.wrench_C.force, record.wrench_C.force.norm(), kForceColor, 0.016);
    add(record.wrench_C.torque, record.wrench_C.torque.norm() / reach_, kTorqueColor, 0.012);
}

void SceneView::addSpheres(engine::Frame& frame, const SphereTree& tree, const Pose& X_WB, int level, bool tool) const {
    if (level < 0) return;
    level = std::min(level, static_cast<int>(tree.levels.size()) - 1);
    const int count = tree.levels[static_cast<std::size_t>(level)].count;
    for (int i = 0; i < count; ++i) {
        const Sphere s = tree.block(level, i);
        frame.spheres.push_back({.center = glm::vec3(toMetres(Vec3(X_WB * Vec3(s.x, s.y, s.z)))),
                                 .radius = static_cast<float>(toMetres(double(s.r))),
                                 .color = sphereColor(tool, level, i)});
    }
}

void renderScreenshot(const HapticScene& scene, const TickRecord& record, const Settings& settings,
                      const DisplayOptions& options, const std::filesystem::path& file, int width, int height) {
    const engine::HeadlessContext context;
    engine::Renderer renderer;
    SceneView view(renderer, scene);
    engine::Frame frame;
    frame.camera = view.look(&record.X_WT, static_cast<float>(width) / static_cast<float>(height));
    frame.hiddenOpacity = kHiddenOpacity;
    view.fill(frame, &record, settings, options);
    engine::writePng(file, engine::renderToImage(renderer, frame, width, height));
}

}  // namespace touchstone::system
