#include "haptics/loop/step.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <utility>

#include "haptics/loop/step_state.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/surface/surface_distance.hpp"

namespace touchstone {
namespace {

/// Maximum speed of an obstacle on the way to its target, mm/ms. A faster obstacle pushes the tool in larger steps,
/// more of which are refused because a pair would overlap; a slower one lags behind the user who drags it.
constexpr double kObstacleSpeed = 0.25;
/// Lower bound of the fraction of the maximum move that an obstacle tries. Refused moves halve the fraction; at 1 kHz
/// the bound is a move of about 1 µm a tick. A smaller bound makes an obstacle take longer to get going again.
constexpr double kSmallestPace = 1.0 / (1 << 8);

Pose placeOf(const World& world, std::span<const Pose> X_WO, std::size_t obstacle) {
    return obstacle < X_WO.size() ? X_WO[obstacle] : world.obstacles[obstacle].X_WO;
}

/// q or -q, which are the same rotation: the one nearer to `like`.
Quat withSignOf(const Quat& like, const Quat& q) { return q.dot(like) < 0 ? Quat(-q.coeffs()) : q; }

/// Depth up to which parts count as touching at a start, mm: the distance that is kept, and the rounding of points and
/// poses to the floats of a file, but no more than that distance again.
double startDepth(const World& world, std::size_t obstacle, const Pose& X_WO, const Pose& X_WT, double kept) {
    const auto sizeOf = [](const Surface& part) { return part.extent.center.norm() + part.extent.reach; };
    const double largest =
        sizeOf(*world.toolSurface) + sizeOf(*world.obstacles[obstacle].surface) + X_WT.p.norm() + X_WO.p.norm();
    return kept + std::min(kept, 0x4p-24 * largest);
}

}  // namespace

StepState::Impl::Impl(const World& w) : world(&w), p_TC(w.p_TC()), reach(w.reach()) {
    int index = 0;
    for (const Obstacle& obstacle : w.obstacles) {
        obstacleReaches.push_back(obstacle.reach());
        leafLists.push_back(w.hasSpheres(index) ? std::make_unique<NeighborList>(*w.tool, *obstacle.tree, index, p_TC)
                                                : nullptr);
        featureLists.push_back(
            w.hasMeshes(index) ? std::make_unique<FeatureList>(*w.toolSurface, *obstacle.surface, index) : nullptr);
        if (w.hasSpheres()) walks.emplace_back(*w.tool, *obstacle.tree);
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
    projector = solverTable()[kExactSolver].make(kRowCapacity);
    reference = solverTable()[kExactSolver].make(kRowCapacity);
    deepest.reserve(kPaperRowCapacity);
    shadowOrder.resize(kRowCapacity);
    courses.resize(w.obstacles.size());
    contacts.reserve(kRowCapacity);
}

StepState::StepState(const World& world) : impl(std::make_unique<Impl>(world)) { reset(world.X_WT_start); }
StepState::~StepState() = default;
StepState::StepState(StepState&&) noexcept = default;
StepState& StepState::operator=(StepState&&) noexcept = default;

void StepState::begin(const StepStart& start, std::span<const Pose> X_WO) noexcept {
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
    s.lastSteps.fill({Vec6::Zero(), Vec6::Zero()});
    s.asked = {};
    for (std::size_t k = 0; k < s.courses.size(); ++k) s.courses[k] = s.inObstacle(int(k), s.graphic);
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

void StepState::resume(const TickRecord& record) noexcept {
    begin({record.tick + 1, record.X_WT, record.X_WT_device, !record.wrench_C.isZero(), record.touching});
}

std::span<const Pose> StepState::obstacles() const noexcept { return impl->X_WO; }
std::span<const Pose> StepState::obstaclesAtStart() const noexcept { return impl->X_WO_start; }

void StepState::Impl::place(int obstacle, const Pose& X) {
    X_WO[obstacle] = X;
    X_OW[obstacle] = X.inverse();
    R_WO[obstacle] = X.R();
}

void StepState::Impl::use(Geometry geometry, double contactDistance) {
    for (std::size_t k = 0; k < lists.size(); ++k) {
        const bool mesh = world->byMeshes(k, geometry);
        const bool changed = lists[k] && lists[k]->ofFeatures() != mesh;
        begun = begun && lists[k] && !changed;
        if (changed) forces.forget();  // its contacts are features of the other geometry
        lists[k] = (mesh ? featureLists : leafLists)[k].get();
        lists[k]->keepApart(mesh ? contactDistance : 0);
    }
}

bool StepState::Impl::areApart(int k) const {
    const Surface &ours = *world->toolSurface, &other = *world->obstacles[k].surface;
    const Pose X_OT = inObstacle(k, graphic);
    return !overlap(ours, other, X_OT) && !nearestPoints(ours, other, X_OT, lists[k]->distance() / 2);
}

bool StepState::Impl::isDeeper(int k, double depth) const {
    return overlapsDeeper(*world->toolSurface, *world->obstacles[k].surface, inObstacle(k, graphic), depth, false);
}

void StepState::Impl::noteStart() {
    for (int k = 0; k < int(lists.size()) && !begun; ++k) {
        if (!lists[k]->ofFeatures()) continue;
        lists[k]->beginInside(0);
        if (areApart(k)) continue;
        const double depth = startDepth(*world, std::size_t(k), X_WO[k], nodePose(graphic), lists[k]->distance());
        lists[k]->beginInside(depth, isDeeper(k, depth));
    }
    begun = true;
}

bool StepState::Impl::checkOverlaps() {
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

int StepState::Impl::findInvalidTarget(std::span<const Pose> targets) const {
    const int n = int(std::min(targets.size(), X_WO.size()));
    for (int k = 0; k < n; ++k)
        if (!targets[k].isValid()) return k;
    return -1;
}

int StepState::Impl::nextToMove(std::span<const Pose> targets) const {
    const int n = int(std::min(targets.size(), X_WO.size()));
    for (int i = 1; i <= n; ++i) {
        const int k = (lastMoved + i) % n;
        if (!(targets[k] == X_WO[k])) return k;
    }
    return -1;
}

void StepState::Impl::moveObstacle(int k, const Pose& target, double maxTravel) {
    const Vec3 center = world->obstacles[k].center();
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

const Within& StepState::asked() const noexcept { return impl->asked; }

const SearchBudget& StepState::searches() const noexcept { return *impl->searches; }

const TickInput& StepState::input() const { return impl->given; }

std::span<const ContactForce> StepState::frictionContacts() const noexcept { return impl->forces.loaded(); }
std::unique_ptr<Solver>& StepState::renderer(int solver) { return impl->renderers[static_cast<std::size_t>(solver)]; }
std::unique_ptr<FrictionSolver>& StepState::frictionRenderer(int solver) {
    return impl->frictionRenderers[static_cast<std::size_t>(solver)];
}

void StepState::Impl::rememberContacts(const RowSet& from, const SolveResult& result) {
    contacts.clear();
    // A row of paper mode is the gradient of a squared distance; its length converts the multiplier to newtons.
    for (const Multiplier& m : result.multipliers)
        contacts.push_back({from.id(m.row), m.value * from.row(m.row).head<3>().norm()});
}

double StepState::Impl::hoverAt(const Pose& q) const {
    double largest = 0, hover = 0;
    for (const Contact& c : contacts) largest = std::max(largest, c.force);
    for (const Contact& c : contacts) {
        if (c.force <= std::max(0.02, 0.01 * largest)) continue;
        const int obstacle = obstacleOf(c.id);
        hover = std::max(hover, lists[obstacle]->gap(inObstacle(obstacle, q), toolLeafOf(c.id), obstacleLeafOf(c.id)));
    }
    return hover;
}

Vec6 Tick::stiffness() const {
    Vec6 G;
    G << Vec3::Constant(settings.stiffness), Vec3::Constant(settings.torsion);
    return G;
}

Wrench Tick::coupling(const Vec6& deviation) {
    loaded = !deviation.isZero(0);
    return {settings.stiffness * deviation.head<3>(), settings.torsion * deviation.tail<3>()};
}

void Tick::note(const SolveResult& result) {
    record.iterations += result.iterations;
    record.status = std::max(record.status, result.status);
    if (result.status == SolveStatus::Elastic) record.flags |= kInfeasible;
    if (result.status == SolveStatus::IterationLimit) record.flags |= kIterationLimit;
    if (result.status == SolveStatus::Invalid) record.flags |= kNonFinite;
    if (result.byProcessor) record.flags |= kByProcessor;
    record.kkt.primal_mm = std::max(record.kkt.primal_mm, result.kkt.primal_mm);
    record.kkt.dual_N = std::max(record.kkt.dual_N, result.kkt.dual_N);
    record.kkt.stationarity_N = std::max(record.kkt.stationarity_N, result.kkt.stationarity_N);
    record.kkt.complementarity_mJ = std::max(record.kkt.complementarity_mJ, result.kkt.complementarity_mJ);
}

QpProblem Tick::problemOf(const Vec6& target, double drag) const {
    if (drag == 0) return {stiffness(), target, &state.rows};
    // A drag is a spring to where the tool is, and two springs pull as one to a place between theirs.
    const Vec6 G = stiffness() + drag * state.metric();
    return {G, stiffness().cwiseProduct(target).cwiseQuotient(G), &state.rows};
}

Tick::Solved Tick::solve(const Vec6& target, double trust, double drag) {
    const QpProblem problem = problemOf(target, drag);
    const SolverSettings limits = solverSettings(settings);
    const bool exact = solverTable()[settings.solver].exact;

    const std::uint64_t start = now();
    const QpProblem given{problem.stiffness, problem.wanted,
                          exact ? problem.rows : &screened(state.screen, state.rows)};
    SolveResult result = state.renderers[settings.solver]->solve(given, limits);
    if (!exact) {
        if (kktResiduals(problem, problem.wanted, {}).primal_mm == 0)
            result.x = problem.wanted;  // `wanted` violates no row
        if (given.rows->size() < problem.rows->size()) {
            result.kkt.primal_mm = kktResiduals(problem, result.x, {}).primal_mm;
            record.screenInexact += !RowScreen::isExact(settings.screening, result.x, state.reach, trust);
        }
    }
    note(result);
    addTime(record.solveUs, start);
    Solved solved{result.x, result.x, result.status, result.slack, given.rows->size()};
    if (result.status == SolveStatus::Invalid) return solved;
    if (exact) {
        state.rememberContacts(state.rows, result);
    } else {
        if (audit) state.rememberContacts(state.rows, state.reference->solve(problem, limits));
        if (result.kkt.primal_mm > kViolation) {
            const SolveResult onto = project(result.x);
            solved.x = onto.x;
            solved.status = onto.status;
            solved.slack = onto.slack;
        }
    }
    return solved;
}

SolveResult Tick::project(const Vec6& x) {
    const std::uint64_t start = now();
    const SolveResult onto = state.projector->solve({stiffness(), x, &state.rows}, solverSettings(settings));
    addTime(record.solveUs, start);
    if (onto.status == SolveStatus::Invalid) return onto;
    if (onto.status == SolveStatus::Elastic) record.flags |= kInfeasible;
    record.projection = std::max(record.projection, state.lengthOf(onto.x - x));
    record.flags |= kProjected;
    return onto;
}

void Tick::runShadow(const QpProblem& problem, const Vec6& rendered) {
    const std::uint64_t start = now();
    const bool paper = settings.mode == Mode::Paper;
    QpProblem shared = problem;
    if (!solverTable()[settings.shadow].exact) shared.rows = &screened(state.shadowScreen, *problem.rows);
    const int maxRows = std::min(settings.shadowRows, paper ? kPaperRowCapacity : kShadowRowCapacity);
    record.shadowRowsCut = std::max(0, problem.rows->size() - std::min(maxRows, shared.rows->size()));
    if (shared.rows->size() > maxRows) {
        // Keep the rows with the smallest gaps, ties by identity, in their order.
        const RowSet& rows = *shared.rows;
        const auto first = state.shadowOrder.begin(), middle = first + maxRows, last = first + rows.size();
        for (int i = 0; i < rows.size(); ++i) state.shadowOrder[i] = i;
        std::nth_element(first, middle, last, [&](int a, int b) {
            return rows.gap()[a] != rows.gap()[b] ? rows.gap()[a] < rows.gap()[b] : rows.id(a) < rows.id(b);
        });
        std::sort(first, middle);
        state.shadowRows.clear();
        for (auto i = first; i != middle; ++i) state.shadowRows.push(rows.row(*i), rows.gap()[*i], rows.id(*i));
        shared.rows = &state.shadowRows;
    }
    record.shadowRows = shared.rows->size();

    SolverSettings s = solverSettings(settings);
    s.workLimit = settings.shadowWork;
    if (!s.paperForm) s.maxIterations = settings.iterationCap;
    const SolveResult shadow = state.shadows[settings.shadow]->solve(shared, s);
    record.shadowIterations = shadow.iterations;
    record.shadowStatus = shadow.byProcessor ? SolveStatus::Invalid : shadow.status;
    addTime(record.shadowUs, start);

    // The error is measured against the exact answer to the same rows. If the shadow itself is exact, the difference is
    // the rendering solver's error.
    const bool renderedIsExact = solverTable()[settings.solver].exact;
    Vec6 exact = rendered;
    if (record.shadowRowsCut || !(renderedIsExact || solverTable()[settings.shadow].exact))
        exact = state.reference->solve(shared, s).x;
    const WrenchError error = wrenchError(shared, shadow.x, exact);
    record.shadowForceError = error.force_N;
    record.shadowTorqueError = error.torque_mNm;
}

void Tick::runFrictionShadow(const FrictionProblem& problem, const Vec6& rendered, bool exact) {
    const std::uint64_t start = now();
    FrictionSolver& solver = *state.frictionShadows[settings.frictionShadow];
    solver.limitWork(settings.shadowWork);
    const FrictionResult shadow = solver.solve(problem, Vec6::Zero());
    record.shadowRows = int(problem.contacts.size());
    record.shadowIterations = shadow.iterations;
    record.shadowStatus = shadow.status == FrictionStatus::None ? SolveStatus::Invalid : SolveStatus::Solved;
    addTime(record.shadowUs, start);
    if (record.shadowStatus == SolveStatus::Invalid) return;

    // As for the shadow without friction.
    Vec6 truth = rendered;
    if (!exact && !frictionSolverTable()[settings.frictionShadow].exact)
        truth = state.frictionReference->solve(problem, rendered).x;
    const WrenchError error = wrenchError({problem.stiffness, problem.wanted, nullptr}, shadow.x, truth);
    record.shadowForceError = error.force_N;
    record.shadowTorqueError = error.torque_mNm;
}

namespace {

/// Runs the mode's tick. If it returns false, the tool stays where it is, without force.
bool advance(Tick& tick, const Pose& device, Wrench& wrench) {
    StepState::Impl& state = tick.state;
    const Pose before = state.graphic;
    constexpr decltype(&defaultTick) kTicks[] = {defaultTick, paperTick, penaltyTick, godObjectTick};  // by Mode
    const bool done = kTicks[static_cast<std::size_t>(tick.settings.mode)](tick, device, wrench);
    if (done && state.graphic.isFinite() && wrench.isFinite()) return true;
    if (done) tick.record.flags |= kNonFinite;
    state.graphic = before;
    return false;
}

/// The same with a moving obstacle that may push the tool. If the tool cannot move out of its way, the obstacle stays.
bool advancePushed(Tick& tick, const Pose& device, int k, const Pose& target, Wrench& wrench) {
    StepState::Impl& s = tick.state;
    const Settings& set = tick.settings;
    const Pose graphic = s.graphic, X_WO = s.X_WO[k], before = s.inObstacle(k, graphic);
    const TouchingPairs touching = s.touching;
    const double maxMove = std::min(set.trust / 2, kObstacleSpeed * 1000 / set.rate);
    if (s.lists[k]->ofFeatures()) {
        s.X_OW_before = s.X_OW[k];
        s.pushing = k;
    }
    s.moveObstacle(k, target, s.paces[k] * maxMove);
    bool fits = advance(tick, device, wrench);
    if (set.mode != Mode::Default) return fits;
    if (fits && !s.lists[k]->ofFeatures()) {  // a step between features that would touch has failed
        const Pose after = s.inObstacle(k, s.graphic);
        fits = s.lists[k]->complete({after, 0}, set.slack) &&
               !s.lists[k]->remeasure(before, after, kOverlapTolerance).deeper();
    }
    s.pushing = -1;
    s.paces[k] = std::clamp(fits ? 2 * s.paces[k] : s.paces[k] / 2, kSmallestPace, 1.0);
    if (fits) return true;

    s.place(k, X_WO);
    s.graphic = graphic;
    s.touching = touching;
    s.obstacleTravel = 0;
    s.forces.restartTick();
    const TickRecord tried = std::exchange(tick.record, {});
    tick.record.tick = tried.tick;
    tick.record.flags = kObstacleHeld;
    tick.record.collisionUs = tried.collisionUs;  // the refused attempt took time, too
    tick.record.solveUs = tried.solveUs;
    tick.record.shadowUs = tried.shadowUs;
    return advance(tick, device, wrench);
}

}  // namespace

TickRecord step(const World& world, const Settings& settings, const StepInput& input, StepState& stepState,
                const StageClock& clock, bool audit) noexcept {
    StepState::Impl& state = *stepState.impl;
    assert(world.tool == state.world->tool && world.toolSurface == state.world->toolSurface);
    TickRecord record;
    record.tick = state.tick++;
    state.asked = {};
    state.searches->beginTick();
    state.given = {
        .X_WT_device = input.X_WT_device, .settings = settings, .start = std::exchange(state.start, std::nullopt)};
    Tick tick{state, settings, clock, audit, record};
    state.use(geometryOf(settings), settings.contactDistance);
    for (std::size_t k = 0; k < state.lists.size(); ++k)
        state.lists[k]->offer(k < input.entries.size() ? input.entries[k] : nullptr);

    Wrench wrench;
    Pose device = state.device;
    const Quat before = state.graphic.q;
    bool hold = true;
    const int invalidTarget = state.findInvalidTarget(input.X_WO);
    const bool lacksSpheres = settings.mode != Mode::Default && !world.hasSpheres();
    if (!state.hasValidStart || !input.X_WT_device.isValid() || invalidTarget >= 0 || lacksSpheres) {
        record.flags |= kBadInput;
        if (invalidTarget >= 0) {  // a replay needs the invalid target to repeat this tick
            state.given.obstacle = invalidTarget;
            state.given.X_WO = input.X_WO[invalidTarget];
        }
    } else {
        // With the tool's sign, so that the tool's does not jump where it follows the device.
        device = state.referencePose({input.X_WT_device.p, withSignOf(before, input.X_WT_device.q.normalized())});
        if (settings.pause) {
            record.flags |= kPaused;
        } else {
            state.noteStart();
            const int k = state.nextToMove(input.X_WO);
            state.obstacleTravel = 0;
            if (k >= 0) {
                state.given.obstacle = k;
                state.given.X_WO = input.X_WO[k];
            }
            hold = !(k < 0 ? advance(tick, device, wrench) : advancePushed(tick, device, k, input.X_WO[k], wrench));
            if (state.checkOverlaps()) record.flags |= kOverlapping;
        }
    }
    if (hold) wrench = {};
    if (hold || settings.mode != Mode::Default) {
        state.forces.forget();
        state.touching.clear();
    }
    if (settings.mode != Mode::Default) {  // what default mode remembers of its last tick
        for (int k = 0; k < int(state.courses.size()); ++k) state.courses[k] = state.inObstacle(k, state.graphic);
    }
    state.forces.endTick();
    state.graphic.q = withSignOf(before, state.graphic.q);
    state.wrench = wrench;
    state.device = device;
    state.loaded = !hold && tick.loaded && !wrench.isZero();  // as resume() finds it in a record

    record.X_WT_device = state.nodePose(device);
    record.X_WT = state.nodePose(state.graphic);
    record.touching = state.touching;
    record.wrench_C = wrench;
    record.wrench_o = wrench;
    record.wrench_o.torque += (device.p - record.X_WT_device.p).cross(wrench.force);
    return record;
}

bool hasFriction(const World& world, const Settings& settings) {
    return settings.mode == Mode::Default &&
           std::any_of(world.obstacles.begin(), world.obstacles.end(),
                       [&](const Obstacle& obstacle) { return obstacle.frictionIn(settings).any(); });
}

bool startsInside(const World& world, const Pose& X_WT, std::span<const Pose> X_WO, const Settings& settings) {
    for (std::size_t k = 0; k < world.obstacles.size(); ++k) {
        if (!world.byMeshes(k, geometryOf(settings))) continue;
        const Pose X = placeOf(world, X_WO, k);
        if (overlapsDeeper(*world.toolSurface, *world.obstacles[k].surface, X.inverse() * X_WT,
                           startDepth(world, k, X, X_WT, settings.contactDistance)))
            return true;
    }
    return false;
}

double trueClearance(const World& world, const Pose& X_WT, double atMost, std::span<const Pose> X_WO,
                     Geometry geometry) {
    double least = atMost;
    for (std::size_t k = 0; k < world.obstacles.size(); ++k) {
        const Pose X_OT = placeOf(world, X_WO, k).inverse() * X_WT;
        const Obstacle& obstacle = world.obstacles[k];
        if (!world.byMeshes(k, geometry)) {
            least = leastGap(*world.tool, *obstacle.tree, X_OT, least);
            continue;
        }
        const Surface &ours = *world.toolSurface, &other = *obstacle.surface;
        if (overlap(ours, other, X_OT))
            least = std::min(least, -overlapDepth(ours, other, X_OT));
        else if (const auto nearest = nearestPoints(ours, other, X_OT, least))
            least = std::min(least, nearest->distance());
    }
    return least;
}

PenetrationMeter::PenetrationMeter(const World& world) : world_(&world) {
    if (!world.hasSpheres()) return;
    for (const Obstacle& obstacle : world.obstacles) walks_.emplace_back(*world.tool, *obstacle.tree);
}

double PenetrationMeter::depth(const Pose& X_WT, std::span<const Pose> X_WO, Geometry geometry) {
    // Depth at the last pose, mm, from which the branch-and-bound search replaces the walk. The walk visits every
    // overlapping pair; a deep pose has many, most of which the search prunes. At shallow poses the walk is faster.
    constexpr double kDeep = 0.1;
    const bool deep = depth_ > kDeep;
    depth_ = 0;
    for (std::size_t k = 0; k < world_->obstacles.size(); ++k) {
        const Pose X_OT = placeOf(*world_, X_WO, k).inverse() * X_WT;
        if (world_->byMeshes(k, geometry)) {
            const Surface &ours = *world_->toolSurface, &other = *world_->obstacles[k].surface;
            if (overlap(ours, other, X_OT)) depth_ = std::max(depth_, overlapDepth(ours, other, X_OT));
            continue;
        }
        const SphereTree &tool = *world_->tool, &obstacle = *world_->obstacles[k].tree;
        depth_ = std::max(depth_, -(deep || walks_.empty() ? leastGap(tool, obstacle, X_OT, 0)
                                                           : deepestGap(tool, obstacle, walks_[k], X_OT)));
    }
    return depth_;
}

std::uint64_t hashTick(const TickRecord& record, std::uint64_t hash) {
    const auto mix = [&](std::uint64_t word) {
        for (int byte = 0; byte < 8; ++byte, word >>= 8) hash = (hash ^ (word & 0xff)) * 0x100000001b3ull;
    };
    const auto mixAll = [&](const auto& values) {
        for (int i = 0; i < values.size(); ++i) mix(std::bit_cast<std::uint64_t>(double(values[i])));
    };
    mix(record.tick);
    for (const Pose* pose : {&record.X_WT_device, &record.X_WT}) {
        mixAll(pose->p);
        mixAll(pose->q.coeffs());
    }
    mixAll(record.wrench_C.force);
    mixAll(record.wrench_C.torque);
    mix(record.flags);
    mix(std::uint64_t(record.status));
    return hash;
}

}  // namespace touchstone
