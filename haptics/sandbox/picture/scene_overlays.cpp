#include "haptics/sandbox/picture/scene_overlays.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "engine/scene/text.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone::sandbox {
namespace {

constexpr glm::vec4 kForceColor{1.00f, 0.36f, 0.22f, 1}, kTorqueColor{0.66f, 0.48f, 1.00f, 1};
constexpr glm::vec4 kContactColor{0.30f, 0.85f, 0.95f, 1}, kClearanceColor{0.55f, 1.00f, 0.60f, 1};
constexpr glm::vec4 kSticksColor{0.35f, 0.95f, 0.50f, 1}, kSlidesColor{1.00f, 0.30f, 0.90f, 1};
constexpr glm::vec3 kLightLoad{1.00f, 0.82f, 0.25f}, kHeavyLoad{1.00f, 0.16f, 0.08f};
constexpr glm::vec3 kTraceOld{0.25f, 0.32f, 0.45f}, kTraceNew{0.85f, 0.95f, 1.00f};
constexpr double kLoaded = 1e-3;  // N: contacts below this are drawn as unloaded
constexpr std::size_t kTracePoints = 4000;
constexpr double kTracePointsPerReach = 200;
constexpr double kNearCut = 0.06;  // relative to the reach
constexpr float kFar = 1e30f;

glm::vec3 point(const Vec3& mm) { return glm::vec3(toMeters(mm)); }

}  // namespace

double arrowLength(double newtons) {
    constexpr double kLongest = 1.8, kHalfwayNewtons = 10;
    return kLongest * newtons / (newtons + kHalfwayNewtons);
}

glm::vec4 sphereColor(bool tool, int level, int index) {
    struct Range {
        glm::vec3 low, high;
    };
    // Warm colors for the tool, cold ones for obstacles.
    constexpr std::array<Range, 4> kTool{Range{{0.95f, 0.55f, 0.15f}, {1.00f, 0.85f, 0.40f}},
                                         {{0.95f, 0.35f, 0.30f}, {1.00f, 0.55f, 0.45f}},
                                         {{0.90f, 0.30f, 0.60f}, {1.00f, 0.50f, 0.80f}},
                                         {{0.70f, 0.40f, 0.90f}, {0.85f, 0.60f, 1.00f}}};
    constexpr std::array<Range, 4> kObstacle{Range{{0.20f, 0.50f, 0.80f}, {0.45f, 0.80f, 0.85f}},
                                             {{0.15f, 0.65f, 0.55f}, {0.35f, 0.85f, 0.70f}},
                                             {{0.30f, 0.65f, 0.25f}, {0.55f, 0.85f, 0.40f}},
                                             {{0.40f, 0.45f, 0.90f}, {0.60f, 0.65f, 1.00f}}};
    const float a = std::fmod(0.618034f * static_cast<float>(index), 1.f),
                b = std::fmod(0.754878f * static_cast<float>(index), 1.f);
    const Range& range = (tool ? kTool : kObstacle)[static_cast<std::size_t>(level) % kTool.size()];
    return {glm::mix(range.low, range.high, a) * (0.8f + 0.2f * b), level == 0 ? 1.f : 0.22f};
}

glm::vec3 gapColor(double gap) {
    constexpr std::array<glm::vec3, 4> kStops{
        glm::vec3{0.95f, 0.15f, 0.10f}, {1.00f, 0.80f, 0.20f}, {0.35f, 0.75f, 0.35f}, {0.40f, 0.45f, 0.55f}};
    const float t = static_cast<float>(std::clamp(gap / kShownGap, 0.0, 1.0)) * (kStops.size() - 1);
    const std::size_t k = std::min(static_cast<std::size_t>(t), kStops.size() - 2);
    return glm::mix(kStops[k], kStops[k + 1], t - static_cast<float>(k));
}

void ToolTrace::add(const Vec3& p_WC, std::uint64_t tick) {
    if (tick < last_) points_.clear();
    last_ = tick;
    if (!points_.empty() && (points_.back() - p_WC).norm() < spacing_) return;
    points_.push_back(p_WC);
    if (points_.size() > kTracePoints) points_.pop_front();
}

SceneOverlays::SceneOverlays(std::shared_ptr<const World> world)
    : world_(std::move(world)),
      reach_(std::max(world_->reach(), 1e-3)),
      finder_(world_),
      trace_(reach_ / kTracePointsPerReach),
      nearestPairs_(world_->obstacles.size()),
      nearestFaces_(world_->obstacles.size()) {}

void SceneOverlays::follow(const TickRecord& record) { trace_.add(record.X_WT * world_->p_TC(), record.tick); }

void SceneOverlays::find(const TickRecord& record, const Settings& settings, const DisplayOptions& options) {
    contacts_.clear();
    place_.reset();
    nearest_.reset();
    if (options.contacts || options.section) {
        const auto found = finder_.find(record, settings, options.contactMargin);
        contacts_.assign(found.begin(), found.end());
    }
    const Geometry geometry = geometryOf(settings);
    if (!options.byGap) {
        leafGaps_.clear();
        gapMaps_.clear();
        gapsDue_ = 0;
    } else if (const std::uint64_t now = steadyNanoseconds(); now > gapsDue_) {
        findGaps(record, geometry, options.trees());
        constexpr int kRest = 9;  // pause, in durations of the search: a tight fit has tens of thousands of near pairs
        gapsDue_ = steadyNanoseconds() + kRest * (steadyNanoseconds() - now);
    }

    ContactPlace sum;
    double count = 0, load = 0;
    for (const ContactPoint& contact : contacts_) {
        ++count;
        load += std::max(contact.load, kLoaded);
        sum.p_W += contact.p_W;
        sum.n_W += std::max(contact.load, kLoaded) * contact.n_W;
    }
    if (count > 0) {
        place_ = ContactPlace{sum.p_W / count, sum.n_W / load, 0};
        for (const ContactPoint& contact : contacts_)
            place_->reach = std::max(place_->reach, (contact.p_W - place_->p_W).norm());
    }
    if (options.clearance) findNearest(record.X_WT, geometry);
}

std::optional<ContactPlace> SceneOverlays::nearestPlace() const {
    if (!nearest_) return std::nullopt;
    return ContactPlace{0.5 * (nearest_->p_W + nearest_->q_W), nearest_->n_W, 0};
}

void SceneOverlays::findGaps(const TickRecord& record, Geometry geometry, bool spheres) {
    const std::size_t bodies = 1 + world_->obstacles.size();
    leafGaps_.assign(bodies, {});
    gapMaps_.assign(bodies, {});
    ++gapsNumber_;
    std::vector<PlacedSurface> others;
    bool leaves = false;
    for (std::size_t i = 0; i < world_->obstacles.size(); ++i) {
        const Obstacle& obstacle = world_->obstacles[i];
        if (!world_->byMeshes(i, geometry)) {
            leaves = spheres;
            continue;
        }
        others.push_back({obstacle.part.surface.get(), record.X_WT.inverse() * finder_.obstacle(i)});
        const PlacedSurface tool{world_->tool.surface.get(), finder_.obstacle(i).inverse() * record.X_WT};
        gapMaps_[1 + i] = gapMap(*obstacle.part.surface, {&tool, 1}, kShownGap);
    }
    if (!others.empty()) gapMaps_[0] = gapMap(*world_->tool.surface, others, kShownGap);
    if (!leaves) return;
    const auto clear = [](std::vector<float>& gaps, const SphereTree& tree) {
        gaps.assign(static_cast<std::size_t>(tree.leafCount()), kFar);
    };
    clear(leafGaps_[0], *world_->tool.spheres);
    for (std::size_t i = 0; i < world_->obstacles.size(); ++i)
        if (!world_->byMeshes(i, geometry)) clear(leafGaps_[1 + i], *world_->obstacles[i].part.spheres);
    for (const NearPair& pair : finder_.pairs(record, geometry, kShownGap)) {
        const auto keep = [&](std::vector<float>& of, int leaf) {
            float& gap = of[static_cast<std::size_t>(leaf)];
            gap = std::min(gap, static_cast<float>(pair.gap));
        };
        keep(leafGaps_[0], pair.toolLeaf);
        keep(leafGaps_[1 + static_cast<std::size_t>(pair.obstacle)], pair.obstacleLeaf);
    }
}

void SceneOverlays::findNearest(const Pose& X_WT, Geometry geometry) {
    double least = INFINITY;
    for (std::size_t i = 0; i < world_->obstacles.size(); ++i) {
        const Obstacle& obstacle = world_->obstacles[i];
        const Pose &X_WO = finder_.obstacle(i), X_OT = X_WO.inverse() * X_WT;
        if (world_->byMeshes(i, geometry)) {
            const auto near =
                nearestPoints(*world_->tool.surface, *obstacle.part.surface, X_OT, least, &nearestFaces_[i]);
            if (!near) continue;
            least = near->distance();
            const Vec3 p = X_WO * near->onTool, q = X_WO * near->onObstacle;
            nearest_ = Nearest{p, q, least > 0 ? Vec3((p - q) / least) : Vec3(Vec3::Zero()), least};
            continue;
        }
        LeafPair& pair = nearestPairs_[i];
        const double gap = leastGap(*world_->tool.spheres, *obstacle.part.spheres, X_OT, 1e30, &pair);
        if (gap >= least) continue;
        least = gap;
        const Sphere a = world_->tool.spheres->leaf(pair.toolLeaf), b = obstacle.part.spheres->leaf(pair.obstacleLeaf);
        const Vec3 p = X_WT * a.center(), q = X_WO * b.center(), n = (p - q).normalized();
        nearest_ = Nearest{p - double(a.r) * n, q + double(b.r) * n, n, gap};
    }
}

void SceneOverlays::add(engine::Frame& frame, const TickRecord& record, const DisplayOptions& options) const {
    // Arrows and normals get shorter when the camera comes close.
    const double unit = std::min(reach_, 0.3 * kMmPerMeter * double(frame.camera.distance));
    if (options.trace) {
        const auto& points = trace_.points();
        for (std::size_t i = 1; i < points.size(); ++i) {
            const float age = static_cast<float>(i) / static_cast<float>(points.size());
            frame.lines.push_back(
                {point(points[i - 1]), point(points[i]), glm::vec4(glm::mix(kTraceOld, kTraceNew, age), 1), 2});
        }
    }
    if (options.contacts) addContacts(frame, unit);
    if (options.arrows) addArrows(frame, record, options.values, unit);
    if (options.clearance && nearest_) {
        const glm::vec3 p = point(nearest_->p_W), q = point(nearest_->q_W);
        frame.lines.push_back({p, q, kClearanceColor, 2.5f});
        frame.lines.push_back({p, p, kClearanceColor, 8});
        frame.lines.push_back({q, q, kClearanceColor, 8});
        const double gap = std::abs(nearest_->gap) < 5e-4 ? 0 : nearest_->gap;  // avoids printing -0.000
        if (options.values) frame.labels.push_back({p, engine::formatted("%.3f mm", gap), kClearanceColor});
    }
}

void SceneOverlays::addContacts(engine::Frame& frame, double unit) const {
    double total = 1e-9, most = 1e-9;
    for (const ContactPoint& contact : contacts_) {
        total += contact.load;
        most = std::max(most, contact.load);
    }
    // Loaded contacts come first in the list and must be drawn last, over the others.
    for (auto contact = contacts_.rbegin(); contact != contacts_.rend(); ++contact) {
        const bool loaded = contact->load > kLoaded;
        const glm::vec3 p = point(contact->p_W);
        if (!loaded && frame.section) {
            // Unloaded contacts are shown only near the cut, to keep the picture readable.
            const double behind = kMmPerMeter * double(glm::dot(*frame.section, glm::vec4(p, 1)));
            if (behind < 0 || behind > kNearCut * reach_) continue;
        }
        // The normals of loaded contacts divide the length of the force arrow among them.
        const double share = contact->load / total;
        const double length = unit * (loaded ? 0.15 + 0.6 * arrowLength(total) * share : 0.05);
        const glm::vec3 q = point(contact->p_W + length * contact->n_W);
        const float weight = static_cast<float>(contact->load / most);
        const glm::vec4 color = loaded ? glm::vec4(glm::mix(kLightLoad, kHeavyLoad, weight), 1) : kContactColor;
        frame.lines.push_back({p, q, color, loaded ? 3.5f : 1.5f});
        if (loaded && contact->coefficient > 0) addCone(frame, *contact, length);
        frame.lines.push_back({p, p, color, loaded ? 10 + 4 * weight : 6.f});
    }
}

/// The cone that Coulomb's law allows, as high as the normal, and the force within it.
void SceneOverlays::addCone(engine::Frame& frame, const ContactPoint& contact, double length) {
    constexpr int kSides = 16;
    const glm::vec4 color = contact.slides ? kSlidesColor : kSticksColor;
    const Vec3 across = contact.n_W.unitOrthogonal(), other = contact.n_W.cross(across);
    const auto rim = [&](int i) {
        const double angle = 2 * std::numbers::pi * i / kSides;
        return point(contact.p_W + length * (contact.n_W + contact.coefficient *
                                                               (std::cos(angle) * across + std::sin(angle) * other)));
    };
    for (int i = 0; i < kSides; ++i) {
        frame.lines.push_back({rim(i), rim(i + 1), color, 1.5f});
        if (i % 4 == 0) frame.lines.push_back({point(contact.p_W), rim(i), color, 1});
    }
    const Vec3 tip = contact.p_W + length * (contact.n_W + contact.friction_W / contact.load);
    frame.lines.push_back({point(contact.p_W), point(tip), color, 3.5f});
}

void SceneOverlays::addArrows(engine::Frame& frame, const TickRecord& record, bool values, double unit) const {
    const Vec3 C = record.X_WT * world_->p_TC();
    const auto add = [&](const Vec3& v, double newtons, const glm::vec4& color, double thickness, const char* format) {
        if (newtons < 1e-3) return;
        const glm::vec3 tip = point(C + unit * arrowLength(newtons) * v.normalized());
        frame.arrows.push_back({point(C), tip, static_cast<float>(toMeters(thickness * unit)), color});
        constexpr double kLabeled = 0.05;  // N: smaller arrows get no label
        if (values && newtons > kLabeled)
            frame.labels.push_back({tip, engine::formatted(format, v.norm()), glm::mix(color, glm::vec4(1), 0.35f)});
    };
    const Wrench& wrench = record.wrench_C;
    add(wrench.force, wrench.force.norm(), kForceColor, 0.016, "%.2f N");
    add(wrench.torque, wrench.torque.norm() / reach_, kTorqueColor, 0.012, "%.0f mN·m");
}

void SceneOverlays::addSpheres(engine::Frame& frame, const Pose& X_WT, const DisplayOptions& options) const {
    const auto gapsOf = [&](std::size_t body) {
        return options.byGap && body < leafGaps_.size() && !leafGaps_[body].empty() ? &leafGaps_[body] : nullptr;
    };
    if (world_->tool.spheres) addTree(frame, *world_->tool.spheres, X_WT, options.toolLevel, true, gapsOf(0));
    for (std::size_t i = 0; i < world_->obstacles.size(); ++i)
        if (const SphereTree* tree = world_->obstacles[i].part.spheres.get())
            addTree(frame, *tree, finder_.obstacle(i), options.obstacleLevel, false, gapsOf(1 + i));
}

void SceneOverlays::addTree(engine::Frame& frame, const SphereTree& tree, const Pose& X_WB, int level, bool tool,
                            const std::vector<float>* gaps) const {
    if (level < 0) return;
    level = std::min(level, static_cast<int>(tree.levels.size()) - 1);
    const int count = tree.levels[static_cast<std::size_t>(level)].count;
    const std::ptrdiff_t leaves = std::ptrdiff_t{1} << (3 * level);  // leaves below each sphere of this level
    frame.spheres.reserve(frame.spheres.size() + static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const Sphere s = tree.block(level, i);
        glm::vec4 color = sphereColor(tool, level, i);
        if (gaps) {
            const auto first = gaps->begin() + i * leaves;
            const auto last = gaps->end() - first > leaves ? first + leaves : gaps->end();
            color = glm::vec4(gapColor(double(*std::min_element(first, last))), color.a);
        }
        frame.spheres.push_back(
            {.center = point(X_WB * s.center()), .radius = static_cast<float>(toMeters(double(s.r))), .color = color});
    }
}

}  // namespace touchstone::sandbox
