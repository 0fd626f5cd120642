#include "haptics/sandbox/measure/contact_finder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "haptics/collision/leaf_gaps.hpp"
#include "haptics/sandbox/measure/watched_solver.hpp"

namespace touchstone::sandbox {
namespace {

constexpr int kRows = 1 << 15;
constexpr int kMany = 1 << 13;         // rows above which the margin shrinks: solving for more takes over a millisecond
constexpr double kCellsPerReach = 30;  // contacts within a cell of this size look like one

}  // namespace

ContactFinder::ContactFinder(std::shared_ptr<const World> world)
    : world_(std::move(world)),
      repeated_(*world_),
      reach_(world_->reach()),
      leaves_(world_->obstacles.size()),
      features_(world_->obstacles.size()),
      rows_(kRows),
      solver_(findSolver(kExactSolver)->make(kRows)) {
    for (const Obstacle& obstacle : world_->obstacles) X_WO_.push_back(obstacle.X_WO);
}

bool ContactFinder::anyMeshes(Geometry geometry) const {
    for (std::size_t i = 0; i < X_WO_.size(); ++i)
        if (world_->byMeshes(i, geometry)) return true;
    return false;
}

FeaturePairFinder& ContactFinder::features(std::size_t obstacle) {
    auto& finder = features_[obstacle];
    if (!finder)
        finder = std::make_unique<FeaturePairFinder>(*world_->tool.surface, *world_->obstacles[obstacle].part.surface);
    return *finder;
}

void ContactFinder::collectLeaves(const TickRecord& record, Geometry geometry, double margin) {
    rows_.clear();
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
        if (world_->byMeshes(i, geometry)) continue;
        auto& list = leaves_[i];
        if (!list)
            list = std::make_unique<NeighborList>(*world_->tool.spheres, *world_->obstacles[i].part.spheres, int(i));
        const Pose& X_WO = X_WO_[i];
        const Pose X_OT = X_WO.inverse() * record.X_WT;
        list->forget();
        if (!list->complete({X_OT, margin}, 0)) continue;  // the overlap is deeper than any picture could show
        if (!list->appendRows(X_OT, X_WO.R(), margin, rows_)) list->appendNearestRows(X_OT, X_WO.R(), margin, rows_);
    }
}

std::span<const NearPair> ContactFinder::pairs(const TickRecord& record, Geometry geometry, double margin) {
    collectLeaves(record, geometry, margin);
    pairs_.clear();
    for (int i = 0; i < rows_.size(); ++i) {
        const std::uint64_t id = rows_.id(i);
        pairs_.push_back({obstacleOf(id), toolLeafOf(id), obstacleLeafOf(id), rows_.gap()[i]});
    }
    return pairs_;
}

/// The contacts of the collected rows.
void ContactFinder::addLeaves(const TickRecord& record) {
    for (int i = 0; i < rows_.size(); ++i) {
        const Sphere leaf = world_->tool.spheres->leaf(toolLeafOf(rows_.id(i)));
        const Vec3 n = rows_.row(i).head<3>();
        contacts_.push_back({.p_W = record.X_WT * leaf.center() - double(leaf.r) * n, .n_W = n, .gap = rows_.gap()[i]});
    }
}

/// Adds the pairs of features within the margin whose nearest points are a local minimum of the distance: the foot of
/// a vertex lies inside the face, those of two edges between their ends.
void ContactFinder::addFeatures(const TickRecord& record, std::size_t obstacle, double margin) {
    const Pose& X_WO = X_WO_[obstacle];
    const Pose X_OT = X_WO.inverse() * record.X_WT;
    const SurfaceFeatures &ours = world_->tool.surface->features,
                          &others = world_->obstacles[obstacle].part.surface->features;
    FeaturePairFinder& finder = features(obstacle);
    finder.forEachPair({X_OT, margin}, [&](const PairEntry& pair, float) {
        ++found_;
        const NearestPoints near = finder.nearest(X_OT, pair);
        const Vec3 apart = near.onTool - near.onObstacle;
        const double gap = apart.norm();
        constexpr double kSkew = 1e-3;  // rad, by which the line of the two points may be off the normal
        const auto isNormal = [&](const Vec3& along) {
            return std::abs(along.dot(apart)) <= kSkew * along.norm() * gap;
        };
        const auto direction = [](const SurfaceFeatures& part, const auto& ends) {
            return Vec3(part.points[ends[1]] - part.points[ends[0]]);
        };
        const int feature = featureOf(pair.tool);
        bool isMinimum = gap > 0 && gap <= margin;
        switch (kindOf(pair.tool)) {
            case PairKind::VertexFace:
                isMinimum = isMinimum && others.faces[pair.obstacle].normal.cross(apart).norm() <= kSkew * gap;
                break;
            case PairKind::FaceVertex:
                isMinimum = isMinimum && (X_OT.q * ours.faces[feature].normal).cross(apart).norm() <= kSkew * gap;
                break;
            case PairKind::EdgeEdge:
                isMinimum = isMinimum && isNormal(X_OT.q * direction(ours, ours.edges[feature].points)) &&
                            isNormal(direction(others, others.edges[pair.obstacle].points));
                break;
        }
        if (isMinimum) contacts_.push_back({X_WO * near.onTool, X_WO.q * (apart / gap), gap});
        return true;
    });
}

/// The tick's own problem, at the pose where the tool came to rest: its multipliers are the contact forces.
void ContactFinder::solveLeaves(const TickRecord& record, const Settings& settings) {
    const Vec3 p_TC = world_->p_TC();
    QpProblem problem;
    problem.stiffness << Vec3::Constant(settings.stiffness), Vec3::Constant(settings.torsion);
    problem.wanted << record.X_WT_device * p_TC - record.X_WT * p_TC,
        logRotation(record.X_WT_device.q * record.X_WT.q.conjugate());
    problem.rows = &rows_;
    solver_->reset();  // without a warm start the result depends on the tick only
    for (const Multiplier& m : solver_->solve(problem, {}).multipliers) contacts_[m.row].load = m.value;
}

/// Which pairs of features are rows depends on the step, so the next tick is made with the device where it is: its last
/// problem has the rows and multipliers of the contacts at this pose.
void ContactFinder::repeatTick(const TickRecord& record, const Settings& settings) {
    loads_.clear();
    if (!state_) {
        state_ = std::make_unique<TickState>(repeated_);
        std::unique_ptr<Solver>& solver = renderer(*state_, kExactSolver);
        solver = std::make_unique<WatchedSolver>(
            std::move(solver), [this](const QpProblem& problem, const SolveResult& result) {
                loads_.clear();
                for (const Multiplier& m : result.multipliers)
                    loads_.push_back({problem.rows->id(m.row), problem.rows->row(m.row).head<3>(), m.value});
            });
    }
    // The repeated tick knows of no contact that slid before.
    const bool slides = record.sliding > 0 && record.sticking == 0;
    const auto repeat = [&](Part& part, const Part& from) {
        part.material = from.material;
        if (slides && part.material) part.material->friction.atRest = part.material->friction.sliding;
    };
    repeat(repeated_.tool, world_->tool);
    for (std::size_t k = 0; k < repeated_.obstacles.size(); ++k)
        repeat(repeated_.obstacles[k].part, world_->obstacles[k].part);
    Settings once = settings;
    once.solver = kExactSolver;
    once.shadow = kNoSolver;
    once.linearizations = 1;
    once.pause = false;
    state_->begin({.tick = record.tick, .X_WT = record.X_WT, .X_WT_device = record.X_WT_device, .loadedBefore = true},
                  X_WO_);
    step(repeated_, once, {.X_WT_device = record.X_WT_device}, *state_);
    if (!frictionContacts(*state_).empty()) loads_.clear();
    for (const ContactForce& contact : frictionContacts(*state_)) {
        const double normal = contact.normal.dot(contact.force);
        loads_.push_back({contact.id, contact.normal, normal, contact.force - normal * contact.normal});
    }
    for (const Load& load : loads_) {
        const int tool = toolLeafOf(load.id), other = obstacleLeafOf(load.id);
        const auto k = std::size_t(obstacleOf(load.id));
        const Pose X_OT = X_WO_[k].inverse() * record.X_WT;
        ContactPoint point{.n_W = load.n_W, .load = load.newtons, .friction_W = load.friction_W};
        if (world_->byMeshes(k, geometryOf(settings))) {
            const NearestPoints near = features(k).nearest(X_OT, {tool, other});
            point.p_W = X_WO_[k] * near.onTool;
            point.gap = near.distance();
        } else {
            const Sphere leaf = world_->tool.spheres->leaf(tool);
            point.p_W = record.X_WT * leaf.center() - double(leaf.r) * load.n_W;
            point.gap = leafGap(leaf, world_->obstacles[k].part.spheres->leaf(other), X_OT);
        }
        const Friction friction = world_->friction(k, settings);
        constexpr double kGreatest = 0.999;
        point.slides = record.sliding > 0 && point.friction_W.norm() >= kGreatest * friction.sliding * point.load;
        point.coefficient = point.slides ? friction.sliding : friction.atRest;
        contacts_.push_back(point);
    }
}

std::span<const ContactPoint> ContactFinder::find(const TickRecord& record, const Settings& settings, double margin,
                                                  int most) {
    if (record.tick != std::exchange(tick_, record.tick)) {  // the picture of one tick must not change
        if (found_ > kMany) marginShare_ /= 2;
        if (found_ < kMany / 4) marginShare_ = std::min(2 * marginShare_, 1.0);
    }
    const Geometry geometry = geometryOf(settings);
    contacts_.clear();
    collectLeaves(record, geometry, marginShare_ * margin);
    found_ = rows_.size();
    addLeaves(record);
    if (anyMeshes(geometry)) {
        for (std::size_t k = 0; k < X_WO_.size(); ++k)
            if (world_->byMeshes(k, geometry)) addFeatures(record, k, marginShare_ * margin);
        repeatTick(record, settings);
    } else if (!contacts_.empty()) {
        if (hasFriction(*world_, settings))
            repeatTick(record, settings);
        else
            solveLeaves(record, settings);
    }
    thin(most);
    return contacts_;
}

void ContactFinder::thin(int most) {
    const double cell = std::max(reach_ / kCellsPerReach, 1e-3);
    const auto cellOf = [&](const ContactPoint& c) {
        std::uint64_t key = 0;
        for (const double x : c.p_W) key = key << 21 | (static_cast<std::int64_t>(std::floor(x / cell)) & 0x1fffff);
        return key;
    };
    const auto isBefore = [](const ContactPoint& a, const ContactPoint& b) {
        return a.load != b.load ? a.load > b.load : a.gap < b.gap;
    };
    cells_.clear();
    for (const ContactPoint& contact : contacts_) cells_.emplace_back(cellOf(contact), static_cast<int>(cells_.size()));
    std::sort(cells_.begin(), cells_.end(), [&](const auto& a, const auto& b) {
        if (a.first != b.first) return a.first < b.first;
        const ContactPoint &x = contacts_[a.second], &y = contacts_[b.second];
        return isBefore(x, y) || (!isBefore(y, x) && a.second < b.second);
    });
    std::vector<ContactPoint> kept;
    for (std::size_t i = 0; i < cells_.size(); ++i)
        if (const ContactPoint& contact = contacts_[cells_[i].second];
            contact.load != 0 || i == 0 || cells_[i].first != cells_[i - 1].first)
            kept.push_back(contact);
    std::stable_sort(kept.begin(), kept.end(), isBefore);
    if (kept.size() > static_cast<std::size_t>(most)) kept.resize(static_cast<std::size_t>(most));
    contacts_ = std::move(kept);
}

}  // namespace touchstone::sandbox
