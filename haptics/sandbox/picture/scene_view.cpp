#include "haptics/sandbox/picture/scene_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <glm/gtc/constants.hpp>
#include <limits>
#include <map>

#include "engine/view/gl_context.hpp"
#include "haptics/sandbox/scene/placement.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

constexpr glm::vec3 kGhostTint{0.45f, 0.70f, 1.00f}, kGoalTint{0.25f, 0.85f, 0.40f}, kGaugeColor{0.80f, 0.70f, 1.00f};

// Below these distances the ghost of the device pose would only flicker on the tool.
constexpr double kApartMm = 0.05, kApartRad = 1e-3;

constexpr float kYaw = 0.45f, kPitch = 0.32f;  // initial view, radians
constexpr float kAside = 0.25f;                // radians off the plane between two parts side by side

std::pair<glm::vec3, glm::vec3> boxOf(const std::vector<glm::vec3>& points) {
    glm::vec3 low = points.front(), high = low;
    for (const glm::vec3& p : points) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    return {low, high};
}

}  // namespace

std::span<const SceneDirection> sceneDirections() {
    constexpr float kRight = glm::half_pi<float>(), kDown = kRight - 0.01f;
    static constexpr std::array<SceneDirection, 6> kDirections{{{"front", 0, 0},
                                                                {"back", 2 * kRight, 0},
                                                                {"left", -kRight, 0},
                                                                {"right", kRight, 0},
                                                                {"top", 0, kDown},
                                                                {"bottom", 0, -kDown}}};
    return kDirections;
}

std::string checkView(std::string_view name) {
    if (name.empty() || name == kContactView) return {};
    std::string names;
    for (const SceneDirection& direction : sceneDirections()) {
        if (direction.name == name) return {};
        names += std::string(direction.name) + ", ";
    }
    return "'" + std::string(name) + "' is an unknown view; choose from " + names + std::string(kContactView);
}

void fitPoints(engine::OrbitCamera& camera, const std::vector<glm::vec3>& points, float aspect) {
    constexpr float kShare = 0.8f;  // share of the picture that the points fill
    if (points.empty()) return;
    const auto [low, high] = boxOf(points);
    camera.target = 0.5f * (low + high);
    const float tanY = kShare * std::tan(camera.fovY / 2), tanX = aspect * tanY;
    // Finds the distance at which all points lie inside the four side planes of the view; the second pass repeats this
    // after centering.
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

SceneView::SceneView(engine::Renderer& renderer, const HapticScene& scene) : renderer_(renderer), scene_(scene) {
    const engine::Registry& registry = scene.scene.registry;
    const engine::Entity tool = scene.roles.tool;
    std::map<std::pair<int, bool>, engine::GpuTexture> textures;  // by image and whether it holds colors
    const auto textureOf = [&](int image, bool colors) {
        if (image < 0) return engine::GpuTexture{};
        auto [texture, isNew] = textures.try_emplace({image, colors});
        if (isNew) texture->second = renderer.upload(scene.scene.images[static_cast<std::size_t>(image)], colors);
        return texture->second;
    };
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
                    const engine::Material& material =
                        scene.scene.materials[static_cast<std::size_t>(primitive.material)];
                    part.material = primitive.material;
                    part.item.texture = textureOf(material.texture, true);
                    part.item.metallicRoughness = textureOf(material.metallicRoughnessTexture, false);
                    part.item.normal = textureOf(material.normalTexture, false);
                    part.item.emissive = textureOf(material.emissiveTexture, true);
                }
                part.body = bodyOf(scene, owner);
                // Only a closed surface has an inside to show.
                if (surfaceOf(scene, owner)) part.item.body = solidOf(*part.body);
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
    // The floor lies below the fixed parts only, since the tool moves.
    for (const glm::vec3& p : corners(nullptr, !scene.world, true)) floor_ = std::min(floor_, p.y);
    if (!std::isfinite(floor_)) floor_ = 0;
}

int SceneView::solidOf(std::size_t body) const {
    return static_cast<int>(body == 0 ? scene_.roles.obstacles.size() + 1 : body);
}

engine::DrawItem SceneView::itemOf(const Part& part, const Pose* X_WT) const {
    engine::DrawItem item = part.item;
    item.model = glm::mat4(placeOf(scene_, part.node, X_WT));
    if (part.material >= 0) item.material = scene_.scene.materials[static_cast<std::size_t>(part.material)];
    return item;
}

std::vector<glm::vec3> SceneView::corners(const Pose* X_WT, bool moving, bool fixed) const {
    std::vector<glm::vec3> points;
    for (const Part& part : parts_) {
        if (!(part.moves ? moving : fixed) || !engine::isVisible(scene_.scene.registry, part.node)) continue;
        const glm::mat4 model(placeOf(scene_, part.node, X_WT));
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

void SceneView::fit(engine::OrbitCamera& camera, const Motion& motion, float aspect) const {
    constexpr int kPoses = 64;
    std::vector<glm::vec3> points = corners(nullptr, false, true);
    for (int k = 0; k <= kPoses; ++k) {
        const Pose X_WT = motion.at(motion.duration() * k / kPoses);
        const std::vector<glm::vec3> tool = corners(&X_WT, true, false);
        points.insert(points.end(), tool.begin(), tool.end());
    }
    fitPoints(camera, points, aspect);
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
        // Look across the line between the two, unless one is above the other. Choose the side nearer
        // to the front.
        if (glm::length(glm::vec2(across.x, across.z)) > 0.3f * std::abs(across.y)) {
            const float side = std::atan2(-across.z, across.x);
            camera.yaw = kAside + std::remainder(side, glm::pi<float>());
        }
    }
    fit(camera, X_WT, aspect);
    return camera;
}

engine::OrbitCamera SceneView::look(std::string_view name, const TickRecord* record, const Settings& settings,
                                    float aspect) {
    const Pose* X_WT = record ? &record->X_WT : scene_.world ? &scene_.world->X_WT_start : nullptr;
    engine::OrbitCamera camera = look(X_WT, aspect);
    for (const SceneDirection& direction : sceneDirections())
        if (direction.name == name) {
            camera.yaw = direction.yaw;
            camera.pitch = direction.pitch;
            fit(camera, X_WT, aspect);
        }
    SceneOverlays* const found = overlays();
    if (name != kContactView || !found) return camera;
    TickRecord start;
    start.X_WT = start.X_WT_device = scene_.world->X_WT_start;
    DisplayOptions nearest;
    nearest.clearance = true;
    found->find(record ? *record : start, settings, nearest);
    const auto place = found->contactPlace() ? found->contactPlace() : found->nearestPlace();
    if (!place) return camera;
    const Vec3& n = place->n_W;
    // Look across the normal, from the side nearer to the front. For a vertical normal all sides look alike.
    if (std::hypot(n.x(), n.z()) > 0.3)
        camera.yaw = kAside + static_cast<float>(std::remainder(std::atan2(-n.z(), n.x()), glm::pi<double>()));
    const double radius = std::max(0.3 * reach_, 1.2 * place->reach);
    camera.frame(glm::vec3(toMeters(place->p_W)), static_cast<float>(toMeters(radius)), aspect);
    return camera;
}

SceneOverlays* SceneView::overlays() {
    if (!overlays_ && scene_.world) overlays_ = std::make_unique<SceneOverlays>(scene_.world);
    if (overlays_ && !scene_.X_WO.empty()) overlays_->place(scene_.X_WO);
    return overlays_.get();
}

void SceneView::follow(const TickRecord& record) {
    if (SceneOverlays* const found = overlays()) found->follow(record);
}

glm::vec4 SceneView::section(const engine::OrbitCamera& camera, const Vec3& p_W, const DisplayOptions& options) const {
    const glm::vec3 forward = camera.forward();
    glm::vec3 n(0);  // points away from the viewer
    if (options.sectionAxis >= 0) {
        n[options.sectionAxis] = forward[options.sectionAxis] < 0 ? -1.f : 1.f;
    } else {
        constexpr float kSteep = 1;  // radians: beyond this pitch the cut is horizontal
        n = std::abs(camera.pitch) > kSteep ? glm::vec3(0, forward.y < 0 ? -1 : 1, 0)
                                            : glm::normalize(glm::vec3(forward.x, 0, forward.z));
    }
    const glm::vec3 p(toMeters(p_W));
    return glm::vec4(n, static_cast<float>(toMeters(options.sectionOffset)) - glm::dot(n, p));
}

void SceneView::fill(engine::Frame& frame, const TickRecord* record, const Settings& settings,
                     const DisplayOptions& options) {
    SceneOverlays* const drawn = overlays();
    frame.grid = {.visible = options.grid, .height = floor_};
    if (drawn && record) {
        drawn->follow(*record);
        drawn->find(*record, settings, options);
        uploadGaps(*drawn);
    }
    addParts(frame, record, options);
    if (!drawn) return;

    const Pose X_WT = record ? record->X_WT : scene_.world->X_WT_start;
    if (options.section) {
        // The section follows the contacts smoothly, so that it does not jump when they come and go.
        constexpr double kFollow = 0.12;  // share of the remaining distance per frame
        const auto place = record ? drawn->contactPlace() : std::nullopt;
        const Vec3 wanted = place ? place->p_W : X_WT * scene_.world->p_TC();
        cutAt_ = cutAt_ ? Vec3(*cutAt_ + kFollow * (wanted - *cutAt_)) : wanted;
        frame.section = section(frame.camera, *cutAt_, options);
    } else {
        cutAt_.reset();
    }
    drawn->addSpheres(frame, X_WT, options);
    if (record) drawn->add(frame, *record, options);
}

void SceneView::uploadGaps(const SceneOverlays& overlays) {
    if (overlays.gapMaps().empty()) {
        gapMeshes_.clear();
        return;
    }
    if (!gapMeshes_.empty() && gapsNumber_ == overlays.gapsNumber()) return;
    gapsNumber_ = overlays.gapsNumber();
    constexpr int kShades = 256;
    if (!gapColors_) {
        engine::Image shades{kShades, 1, {}};
        for (int i = 0; i < kShades; ++i) {
            const glm::vec3 color = gapColor(kShownGap * i / (kShades - 1));
            for (int k = 0; k < 3; ++k) shades.rgba.push_back(static_cast<std::uint8_t>(255 * color[k] + 0.5f));
            shades.rgba.push_back(255);
        }
        gapColors_ = renderer_.upload(shades);
    }
    gapMeshes_.clear();
    for (const GapMap& map : overlays.gapMaps()) {
        engine::MeshData mesh;  // without shared corners, so that edges look sharp
        for (const auto& corners : map.patches) {
            std::array<glm::vec3, 3> at;
            for (std::size_t k = 0; k < 3; ++k)
                at[k] = glm::vec3(toMeters(map.points[static_cast<std::size_t>(corners[k])]));
            const glm::vec3 n = glm::cross(at[1] - at[0], at[2] - at[0]);
            const glm::vec3 normal = glm::length(n) > 0 ? glm::normalize(n) : glm::vec3(0, 0, 1);
            for (std::size_t k = 0; k < 3; ++k) {
                const float gap = map.gaps[static_cast<std::size_t>(corners[k])] / static_cast<float>(kShownGap);
                mesh.indices.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
                mesh.positions.push_back(at[k]);
                mesh.normals.push_back(normal);
                mesh.texcoords.emplace_back((0.5f + (kShades - 1) * gap) / kShades, 0.5f);
            }
        }
        gapMeshes_.push_back(renderer_.upload(mesh));
    }
}

void SceneView::addParts(engine::Frame& frame, const TickRecord* record, const DisplayOptions& options) const {
    const Pose start = scene_.world ? scene_.world->X_WT_start : Pose{};
    const Pose* X_WT = record ? &record->X_WT : scene_.world ? &start : nullptr;
    bool goalShown = false;
    for (const Part& part : parts_) {
        if (!engine::isVisible(scene_.scene.registry, part.node) || (part.role == Role::Goal && !options.goal))
            continue;
        if (part.body && *part.body < gapMeshes_.size() && gapMeshes_[*part.body]) continue;  // see below
        engine::DrawItem item = itemOf(part, X_WT);
        if (part.role == Role::Goal) {
            item.alpha = 0.25f;
            goalShown = true;
        }
        frame.items.push_back(std::move(item));
    }
    for (std::size_t body = 0; body < gapMeshes_.size(); ++body) {
        const engine::Entity node = body == 0 ? scene_.roles.tool : scene_.roles.obstacles[body - 1];
        if (!gapMeshes_[body] || !engine::isVisible(scene_.scene.registry, node)) continue;
        engine::DrawItem item;
        item.mesh = gapMeshes_[body];
        item.model = glm::mat4(placeOf(scene_, node, X_WT));
        item.texture = gapColors_;
        item.body = solidOf(body);
        frame.items.push_back(std::move(item));
    }
    if (options.values && scene_.roles.gauge && X_WT) addGauge(frame, *X_WT);
    if (options.goal && scene_.roles.goal) addGoal(frame, X_WT ? *X_WT : Pose{}, goalShown);
    if (record && options.ghost) {
        const bool apart = (record->X_WT.p - record->X_WT_device.p).norm() > kApartMm ||
                           logRotation(record->X_WT_device.q * record->X_WT.q.conjugate()).norm() > kApartRad;
        if (apart) {
            addGhost(frame, record->X_WT_device, kGhostTint, 0.55f, 0.28f);
            const Vec3 p_TC = scene_.world->p_TC();
            const glm::vec3 C(toMeters(record->X_WT * p_TC)), wanted(toMeters(record->X_WT_device * p_TC));
            const glm::vec4 color(kGhostTint, 1);
            frame.lines.push_back({C, wanted, color, 1.5f});
            frame.lines.push_back({wanted, wanted, color, 7});
        }
    }
}

void SceneView::addGhost(engine::Frame& frame, const Pose& X_WT, glm::vec3 tint, float share, float alpha) const {
    for (const Part& part : parts_) {
        if (!part.moves || !engine::isVisible(scene_.scene.registry, part.node)) continue;
        engine::DrawItem item = itemOf(part, &X_WT);
        item.material.baseColor = glm::vec4(glm::mix(glm::vec3(item.material.baseColor), tint, share), 1);
        item.material.metallic = 0;
        item.alpha = alpha;
        frame.items.push_back(std::move(item));
    }
}

void SceneView::addGoal(engine::Frame& frame, const Pose& X_WT, bool meshShown) const {
    const GoalRegion& goal = *scene_.roles.goal;
    if (!meshShown) addGhost(frame, goal.X_WT, kGoalTint, 0.8f, 0.14f);
    // The tool node's origin must be inside this ball, which is brighter once it is.
    const bool inside = goal.contains(X_WT);
    const glm::vec3 origin(toMeters(goal.X_WT.p)), node(toMeters(X_WT.p));
    frame.spheres.push_back({.center = origin,
                             .radius = static_cast<float>(toMeters(goal.tolerance)),
                             .color = glm::vec4(kGoalTint, inside ? 0.5f : 0.25f)});
    frame.lines.push_back({node, node, glm::vec4(kGoalTint, 1), 6});
}

/// Draws a line from the tool's tip to the plane of the gauge, labeled with the depth.
void SceneView::addGauge(engine::Frame& frame, const Pose& X_WT) const {
    const Gauge& gauge = *scene_.roles.gauge;
    const double depth = gauge.depth(X_WT);
    if (depth <= 0) return;
    const Vec3 tip = X_WT * gauge.p_TP, out = gauge.X_WG.q * Vec3::UnitY();
    const glm::vec3 p(toMeters(tip)), q(toMeters(Vec3(tip + depth * out)));
    const glm::vec4 color(kGaugeColor, 1);
    frame.lines.push_back({p, q, color, 2.5f});
    for (const glm::vec3& end : {p, q}) frame.lines.push_back({end, end, color, 8});
    std::array<char, 24> text{};
    std::snprintf(text.data(), text.size(), "%.2f mm", depth);
    frame.labels.push_back({q, text.data(), color});
}

engine::Image renderScene(const HapticScene& scene, const TickRecord& record, const Settings& settings,
                          const ScenePicture& picture) {
    const engine::HeadlessContext context;
    engine::Renderer renderer;
    SceneView view(renderer, scene);
    for (const TickRecord& before : picture.before) view.follow(before);
    engine::Frame frame;
    frame.camera = view.look(picture.view, &record, settings,
                             static_cast<float>(picture.width) / static_cast<float>(picture.height));
    frame.hiddenOpacity = kHiddenOpacity;
    view.fill(frame, &record, settings, picture.display);
    return engine::renderToImage(renderer, frame, picture.width, picture.height);
}

}  // namespace touchstone::sandbox
