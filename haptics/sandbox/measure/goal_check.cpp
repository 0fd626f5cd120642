#include "haptics/sandbox/measure/goal_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/scene/scene.hpp"
#include "engine/scene/text.hpp"
#include "haptics/surface/surface_distance.hpp"
#include "haptics/surface/surface_overlap.hpp"

namespace touchstone::sandbox {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDegree = kTurn / 360;
constexpr double kZero = 1e-4, kZeroShare = 1e-6;  // mm, and share of the reach: parts that overlap by less touch
constexpr double kMidAir = 0.2;                    // share of the reach: a tool farther from everything is in mid-air
constexpr int kTurns = 360;                        // tried about the axis
constexpr int kCoarseTurns = 60;                   // whose depth is measured if none of them is free
constexpr int kBisections = 40;                    // of a turn or a raise: to the rounding of the poses
constexpr double kFineRaise = 0.001, kFineEnd = 0.1, kCoarseRaise = 0.02;  // shares of the reach
constexpr double kInHole = 0.9;    // share of the depth: a tool that is raised by more is out of the hole
constexpr double kInFloor = 1.5;   // of the overlap: a tool that is raised by less comes out of a floor
constexpr double kSeat = 0.1;      // leads by which a tool is screwed out of its seat to look for its phase
constexpr double kPressed = 0.02;  // leads: threads that overlap by more are not in phase
constexpr int kMostStarts = 8;

bool isFree(const World& world, const Pose& X_WT) {
    return std::ranges::none_of(world.obstacles, [&](const Obstacle& obstacle) {
        return overlap(*world.tool.surface, *obstacle.part.surface, obstacle.X_WO.inverse() * X_WT);
    });
}

bool hasMeshes(const World& world) {
    for (std::size_t k = 0; k < world.obstacles.size(); ++k)
        if (!world.hasMeshes(k)) return false;
    return true;
}

Pose aboutY(double turn) { return {Vec3::Zero(), expRotation({0, turn, 0})}; }

/// The end of an interval in which `test` holds: it holds at `in` and not at `out`.
template <class Test>
double lastThat(double in, double out, Test&& test) {
    for (int i = 0; i < kBisections; ++i) {
        const double middle = (in + out) / 2;
        (test(middle) ? in : out) = middle;
    }
    return in;
}

/// The free turn nearest to none, and the middle of those around it. `free(turn)` says whether a turn is.
template <class Test>
std::optional<FreeTurn> nearestFreeTurn(Test&& free) {
    const double step = kTurn / kTurns;
    for (int k = 0; k <= kTurns / 2; ++k)
        for (const int sign : {1, -1}) {
            const int at = sign * k;
            if (!free(at * step)) continue;
            int low = at, high = at;
            while (high - low < kTurns && free((low - 1) * step)) --low;
            while (high - low < kTurns && free((high + 1) * step)) ++high;
            if (high - low >= kTurns) return FreeTurn{0, kTurn / 2};
            const double from = lastThat(low * step, (low - 1) * step, free),
                         to = lastThat(high * step, (high + 1) * step, free);
            return FreeTurn{(from + to) / 2, (to - from) / 2};
        }
    return {};
}

}  // namespace

PartGap partGap(const World& world, const Pose& X_WT, double atMost, Overlaps overlaps) {
    PartGap found{.gap = atMost};
    const double zero = std::max(kZero, kZeroShare * world.reach());
    for (std::size_t k = 0; k < world.obstacles.size(); ++k) {
        const Obstacle& obstacle = world.obstacles[k];
        const Pose X_OT = obstacle.X_WO.inverse() * X_WT;
        const auto points = nearestPoints(*world.tool.surface, *obstacle.part.surface, X_OT, std::max(found.gap, zero));
        const bool inside =
            overlaps != Overlaps::Impossible && overlap(*world.tool.surface, *obstacle.part.surface, X_OT);
        const double gap =
            inside   ? -overlapDepth(*world.tool.surface, *obstacle.part.surface, X_OT, overlaps == Overlaps::Measured)
            : points ? points->distance()
                     : INFINITY;
        if (gap < found.gap)
            found = {std::abs(gap) < zero ? 0 : gap, points ? obstacle.X_WO * points->onObstacle : X_WT * world.p_TC(),
                     k};
    }
    return found;
}

FreePlaces freePlaces(const World& world, const GoalRegion& goal, const MeasureProgress& progress) {
    FreePlaces places;
    const Vec3 out = goal.outAtGoal();
    const double reach = world.reach();
    bool ended = false;
    const auto freeAt = [&](double raise, double turn) {
        return isFree(world, goal.X_WT * Pose{raise * out, Quat::Identity()} * aboutY(turn));
    };
    const auto go = [&] { return !(ended = ended || (progress && !progress(0))); };

    // A tool inside a floor is free once raised by about its depth in it; one inside the walls, by most of the hole.
    const double inside = -partGap(world, goal.X_WT, 0, Overlaps::Estimated).gap;
    const double fineEnd = kFineEnd * reach,
                 end = std::max(goal.depth > 0 ? kInHole * goal.depth : fineEnd, kInFloor * inside);
    for (double before = 0, raise = 0; before < end && !places.raised && go(); before = raise) {
        raise = std::min(end, before + (before < fineEnd ? kFineRaise : kCoarseRaise) * reach);
        if (freeAt(raise, 0)) places.raised = lastThat(raise, before, [&](double r) { return freeAt(r, 0); });
    }
    // A little above the goal, so that a seat on which the tool rests does not count.
    for (const double raise : {0.0, std::min(goal.tolerance, fineEnd) / 2})
        if (!places.turned) places.turned = nearestFreeTurn([&](double turn) { return go() && freeAt(raise, turn); });
    return ended ? FreePlaces{} : places;
}

std::string insideClause(const World& world, const PartGap& inside, const FreePlaces& free) {
    const std::string name = "\"" + engine::escaped(world.obstacles[inside.obstacle].name) + "\"";
    const double depth = -inside.gap;
    std::string clause =
        (free.raised ? engine::formatted("the goal lies %.*f mm inside ", depth < 0.1 ? 4 : 3, depth) + name
                     : engine::formatted("the parts overlap by %.*f mm beside ", depth < 0.1 ? 4 : 3, depth) + name) +
        engine::formatted(", at (%.1f, %.1f, %.1f) mm", inside.p_W.x(), inside.p_W.y(), inside.p_W.z());
    if (const Pose& X_WO = world.obstacles[inside.obstacle].X_WO; X_WO != Pose{}) {
        const Vec3 own = X_WO.inverse() * inside.p_W;
        clause +=
            engine::formatted(", which is (%.1f, %.1f, %.1f) mm in its own coordinates", own.x(), own.y(), own.z());
    }
    if (!free.raised && !free.turned) return clause;
    clause += "; it fits when ";
    if (free.turned) clause += engine::formatted("turned by %.1f°", free.turned->turn / kDegree);
    if (free.turned && free.raised) clause += " or ";
    if (free.raised) clause += engine::formatted("raised by %.3f mm", std::ceil(1000 * *free.raised) / 1000);
    return clause;
}

std::string midAirDoubt(const World& world, const GoalRegion& goal) {
    if (!hasMeshes(world)) return {};
    const double gap = partGap(world, goal.X_WT, 1e30, Overlaps::Estimated).gap;
    if (gap <= kMidAir * world.reach()) return {};
    return engine::formatted("at its goal the tool is %.3g mm from every obstacle: are the parts on one axis?", gap);
}

std::string goalDoubt(const World& world, const GoalRegion& goal) {
    if (!hasMeshes(world)) return {};
    const PartGap at = partGap(world, goal.X_WT, 1e30);
    if (at.gap < -goal.tolerance)
        return "at its goal the tool does not fit: " + insideClause(world, at, freePlaces(world, goal)) +
               engine::formatted("; the goal's tolerance is %.3g mm", goal.tolerance);
    return at.gap > kMidAir * world.reach() ? midAirDoubt(world, goal) : "";
}

ThreadPhase threadPhase(const World& world, const GoalRegion& goal) {
    // The tool's pose after this many leads out of its seat. `hand`: 1 as the lead says, -1 the other way.
    const auto screwed = [&](double leads, double turn, double hand = 1) {
        return goal.X_WT * Pose{{0, leads * std::abs(goal.lead), 0}, Quat::Identity()} *
               aboutY(turn + std::copysign(kTurn, goal.lead) * (kSeat + hand * (leads - kSeat)));
    };
    // The turn at which the threads are free of each other just above the seat.
    const auto found = nearestFreeTurn([&](double turn) { return isFree(world, screwed(kSeat, turn)); });
    if (found && found->play >= kTurn / 2)
        return {{}, 1, "at its goal the tool turns freely, so its thread does not engage: check where the goal is"};
    FreeTurn phase = found.value_or(FreeTurn{});
    double least = 0;
    if (!found) {  // threads without clearance: search for the turn at which they overlap least
        const auto depth = [&](double turn) {
            return -partGap(world, screwed(kSeat, turn), 1e30, Overlaps::Estimated).gap;
        };
        least = INFINITY;
        for (int k = 0; k < kCoarseTurns; ++k)
            if (const double there = depth(k * kTurn / kCoarseTurns); there < least)
                least = there, phase.turn = k * kTurn / kCoarseTurns;
        for (double step = kTurn / kCoarseTurns / 2; step > 1e-5; step /= 2)
            for (const double turn : {phase.turn - step, phase.turn + step})
                if (const double there = depth(turn); there < least) least = there, phase.turn = turn;
        phase.turn = std::remainder(phase.turn, kTurn);
    }
    if (least > kPressed * std::abs(goal.lead))
        return {{},
                1,
                engine::formatted("the threads overlap by %.3f mm at every turn: check that the parts are on one axis, "
                                  "and the place of the goal",
                                  least)};
    // Count the starts, and test whether the tool comes out with this lead or with the opposite one.
    const auto inPhase = [&](const Pose& X_WT) {
        return found ? isFree(world, X_WT)
                     : -partGap(world, X_WT, 1e30, Overlaps::Estimated).gap < 2 * kPressed * std::abs(goal.lead);
    };
    const auto comesOut = [&](double hand) {
        return std::ranges::all_of(std::initializer_list<double>{0.25, 0.5, 0.75, 1, 1.5},
                                   [&](double leads) { return inPhase(screwed(leads, phase.turn, hand)); });
    };
    const auto hasStarts = [&](int starts) {
        for (int k = 1; k < starts; ++k)
            if (!inPhase(screwed(kSeat, phase.turn + k * kTurn / starts))) return false;
        return true;
    };
    int starts = kMostStarts;
    while (!hasStarts(starts)) --starts;
    if (comesOut(1)) return {phase, starts, {}};
    return {phase, starts,
            comesOut(-1) ? "turned out with this lead the threads overlap, and with the opposite sign they do "
                           "not: the lead of a left-handed thread is negative"
                         : "turned out with this lead the threads overlap: check the lead, the travel per turn"};
}

}  // namespace touchstone::sandbox
