#include <algorithm>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/loop/tick_memory.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/surface/surface_distance.hpp"

namespace touchstone {

TickState::Impl::Impl(const World& w) : world(&w), p_TC(w.p_TC()), reach(w.reach()) {
    int index = 0;
    for (const Obstacle& obstacle : w.obstacles) {
        obstacleReaches.push_back(obstacle.part.reach());
        leafLists.push_back(w.hasSpheres(index)
                                ? std::make_unique<NeighborList>(*w.tool.spheres, *obstacle.part.spheres, index, p_TC)
                                : nullptr);
        featureLists.push_back(w.hasMeshes(index)
                                   ? std::make_unique<FeatureList>(*w.tool.surface, *obstacle.part.surface, index)
                                   : nullptr);
        if (w.hasSpheres()) walks.emplace_back(*w.tool.spheres, *obstacle.part.spheres);
        ++index;
    }
    searches = std::make_unique<SearchBudget>(kSearchLimits);
    for (auto* geometry : {&leafLists, &featureLists})
        for (auto& list : *geometry)
            if (list) list->use(searches.get());
    lists.resize(leafLists.size());
    use(Geometry::Spheres, 0);
    X_WO.resize(lists.size());
    X_OW.resize(lists.size());
    R_WO.resize(lists.size());
    paces.resize(lists.size(), 1);
    for (int k = 0; k < index; ++k) place(k, w.obstacles[k].X_WO.isValid() ? w.obstacles[k].X_WO : Pose{});
    hasInvalidObstacle =
        std::any_of(w.obstacles.begin(), w.obstacles.end(), [](const Obstacle& o) { return !o.X_WO.isValid(); });
    for (const SolverInfo& info : solverTable()) {
        renderers.push_back(info.make(kRowCapacity));
        shadows.push_back(info.make(kShadowRowCapacity));
    }
    for (const FrictionSolverInfo& info : frictionSolverTable()) {
        frictionRenderers.push_back(info.make(ContactForces::kMaxContacts));
        frictionShadows.push_back(info.make(ContactForces::kMaxContacts));
    }
    frictionReference = std::make_unique<ConeNewton>(ContactForces::kMaxContacts);
    projector = findSolver(kExactSolver)->make(kRowCapacity);
    reference = findSolver(kExactSolver)->make(kRowCapacity);
    deepest.reserve(kPaperRowCapacity);
    shadowOrder.resize(kRowCapacity);
    motions.resize(w.obstacles.size());
    contacts.reserve(kRowCapacity);
}

TickState::TickState(const World& world) : impl(std::make_unique<Impl>(world)) { reset(world.X_WT_start); }
TickState::~TickState() = default;
TickState::TickState(TickState&&) noexcept = default;
TickState& TickState::operator=(TickState&&) noexcept = default;

void TickState::begin(const TickStart& start, std::span<const Pose> X_WO) noexcept {
    Impl& s = *impl;
    // Invalid poses are not taken over, so that the record of a held tick stays finite.
    if (X_WO.size() >= s.X_WO.size()) s.hasInvalidObstacle = false;
    for (std::size_t k = 0; k < std::min(X_WO.size(), s.X_WO.size()); ++k)
        if (X_WO[k].isValid())
            s.place(int(k), X_WO[k]);
        else
            s.hasInvalidObstacle = true;
    s.X_WO_start = s.X_WO;
    s.start = start;
    s.tick = start.tick;
    s.hasValidStart = !s.hasInvalidObstacle && start.X_WT.isValid() && start.X_WT_device.isValid();
    if (start.X_WT.isValid()) s.graphic = s.referencePose(start.X_WT);
    if (start.X_WT_device.isValid()) s.device = s.referencePose(start.X_WT_device);
    s.graphic.q = withSignOf(Quat::Identity(), s.graphic.q);
    s.device.q = withSignOf(s.graphic.q, s.device.q);
    s.loaded = start.loadedBefore;
    s.asked = {};
    for (std::size_t k = 0; k < s.motions.size(); ++k) s.motions[k] = s.inObstacle(int(k), s.graphic);
    s.lastMoved = 0;
    std::fill(s.paces.begin(), s.paces.end(), 1);
    s.contacts.clear();
    s.touching.clear();
    for (const std::uint64_t id : start.touching.span())
        if (const int k = obstacleOf(id);
            k < int(s.lists.size()) && s.featureLists[k] && s.featureLists[k]->hasFeatures(id))
            s.touching.push(id);
    s.forces.forget();
    s.wrench = {};
    for (auto* lists : {&s.leafLists, &s.featureLists})
        for (auto& list : *lists)
            if (list) list->forget();
    s.pushing = -1;
    s.begun = false;
    for (auto* solvers : {&s.renderers, &s.shadows})
        for (auto& solver : *solvers) solver->reset();
    s.projector->reset();
    s.reference->reset();
}

void TickState::resume(const TickRecord& record) noexcept {
    begin({record.tick + 1, record.X_WT, record.X_WT_device, !record.wrench_C.isZero(), record.touching});
}

std::span<const Pose> TickState::obstacles() const noexcept { return impl->X_WO; }

void TickState::Impl::place(int obstacle, const Pose& X) {
    X_WO[obstacle] = X;
    X_OW[obstacle] = X.inverse();
    R_WO[obstacle] = X.R();
}

void TickState::Impl::use(Geometry geometry, double contactDistance) {
    for (std::size_t k = 0; k < lists.size(); ++k) {
        const bool mesh = world->byMeshes(k, geometry);
        const bool changed = lists[k] && lists[k]->ofFeatures() != mesh;
        begun = begun && lists[k] && !changed;
        if (changed) forces.forget();  // its contacts are features of the other geometry
        lists[k] = (mesh ? featureLists : leafLists)[k].get();
        lists[k]->keepApart(mesh ? contactDistance : 0);
    }
}

bool TickState::Impl::areApart(int k) const {
    const Surface &ours = *world->tool.surface, &other = *world->obstacles[k].part.surface;
    const Pose X_OT = inObstacle(k, graphic);
    return !overlap(ours, other, X_OT) && !nearestPoints(ours, other, X_OT, lists[k]->distance() / 2);
}

bool TickState::Impl::isDeeper(int k, double depth) const {
    return overlapsDeeper(*world->tool.surface, *world->obstacles[k].part.surface, inObstacle(k, graphic), depth,
                          false);
}

void TickState::Impl::noteStart() {
    for (int k = 0; k < int(lists.size()) && !begun; ++k) {
        if (!lists[k]->ofFeatures()) continue;
        lists[k]->beginInside(0);
        if (areApart(k)) continue;
        const double depth = startDepth(*world, std::size_t(k), X_WO[k], nodePose(graphic), lists[k]->distance());
        lists[k]->beginInside(depth, isDeeper(k, depth));
    }
    begun = true;
}

bool TickState::Impl::checkOverlaps() {
    bool any = false;
    for (int k = 0; k < int(lists.size()); ++k) {
        if (lists[k]->inside() == 0) continue;
        if (isDeeper(k, lists[k]->inside()))
            any = true;
        else if (areApart(k))
            lists[k]->beginInside(0);
    }
    return any;
}

void TickState::Impl::moveObstacle(int k, const Pose& target, double maxTravel) {
    const Vec3 center = world->obstacles[k].part.center();
    const Pose from{X_WO[k] * center, X_WO[k].q}, to{target * center, target.q};
    const double distance = travel(X_WO[k], target, center, obstacleReaches[k]);
    obstacleTravel = std::min(distance, maxTravel);
    if (distance <= maxTravel) {
        place(k, target);
    } else {
        const Pose reached = moved(from, incrementBetween(from, to) * (maxTravel / distance));
        place(k, {reached.p - reached.q * center, reached.q});
    }
    lastMoved = k;
}

ObstacleMove TickState::nextMove(std::span<const Pose> X_WO) const noexcept {
    const int n = int(std::min(X_WO.size(), impl->X_WO.size()));
    for (int k = 0; k < n; ++k)
        if (!X_WO[k].isValid()) return {k, X_WO[k]};
    for (int i = 1; i <= n; ++i) {
        const int k = (impl->lastMoved + i) % n;
        if (!(X_WO[k] == impl->X_WO[k])) return {k, X_WO[k]};
    }
    return {};
}

RecordedTick recordedTick(const TickState& state, const TickRecord& record, std::uint64_t session) {
    const TickState::Impl& s = *state.impl;
    return {s.given, s.settings, s.startGiven, record, session};
}

std::span<const Pose> obstaclesAtStart(const TickState& state) noexcept { return state.impl->X_WO_start; }
const Within& askedPairs(const TickState& state) noexcept { return state.impl->asked; }
const SearchBudget& searches(const TickState& state) noexcept { return *state.impl->searches; }
std::span<const ContactForce> frictionContacts(const TickState& state) noexcept { return state.impl->forces.loaded(); }
std::unique_ptr<Solver>& renderer(TickState& state, std::string_view solver) {
    return named(state.impl->renderers, solver);
}
std::unique_ptr<FrictionSolver>& frictionRenderer(TickState& state, std::string_view solver) {
    return named(state.impl->frictionRenderers, solver);
}

void TickState::Impl::rememberContacts(const RowSet& from, const SolveResult& result) {
    contacts.clear();
    // A row of paper mode is the gradient of a squared distance; its length converts the multiplier to newtons.
    for (const Multiplier& m : result.multipliers)
        contacts.push_back({from.id(m.row), m.value * from.row(m.row).head<3>().norm()});
}

double TickState::Impl::hoverAt(const Pose& q) const {
    double largest = 0, hover = 0;
    for (const Contact& c : contacts) largest = std::max(largest, c.force);
    for (const Contact& c : contacts) {
        if (c.force <= std::max(0.02, 0.01 * largest)) continue;
        const int obstacle = obstacleOf(c.id);
        hover = std::max(hover, lists[obstacle]->gap(inObstacle(obstacle, q), toolLeafOf(c.id), obstacleLeafOf(c.id)));
    }
    return hover;
}

}  // namespace touchstone
