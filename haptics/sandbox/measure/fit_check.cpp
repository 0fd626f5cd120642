#include "haptics/sandbox/measure/fit_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "haptics/loop/step.hpp"
#include "haptics/qp/solver.hpp"
#include "haptics/surface/feature_pair_finder.hpp"

namespace touchstone::sandbox {
namespace {

constexpr int kFitRows = 1 << 16;    // of one linearization; nearer pairs come first by halving the step
constexpr int kSteps = 30;           // linearizations at a pose
constexpr double kFirstStep = 0.05;  // of the range, of the first one
constexpr double kLeastStep = 1e-5;  // of the range, at which the search ends
constexpr int kHalvings = 12;        // of the interval in which the clearance of a linearization lies
constexpr int kTrials = 200;         // of moves out of an overlap
constexpr double kFirstTrial = 0.25, kLeastTrial = 1e-3;  // of the range
constexpr int kPoses = 12;                                // on the way, about
constexpr double kSpacing = 0.1;                          // of the reach, and at most kFarthest: between them, at least
constexpr double kFarthest = 2;                           // mm
constexpr double kStuckForce = 0.5, kStuckMotion = 0.5, kStuckMs = 2000;  // N, mm, ms: of StuckWatch
constexpr double kLargestRange = 1, kRange = 0.04;                        // mm, and share of the reach: of fitRange()
constexpr double kBeforeSeat = 0.5;  // ranges before the goal, where the seat does not limit the room

class RoomFinder {
  public:
    /// `go`: asked before each measurement; false ends the search.
    RoomFinder(const World& world, std::function<bool()> go)
        : world_(world),
          go_(std::move(go)),
          range_(fitRange(world)),
          rows_(kFitRows),
          solver_(findSolver(kExactSolver)->make(kFitRows)) {
        for (const Obstacle& obstacle : world.obstacles)
            finders_.push_back(std::make_unique<FeaturePairFinder>(*world.tool.surface, *obstacle.part.surface));
    }

    /// The search ends when there is `enough` room, mm. `goal`: the pose is at it.
    std::optional<FitRoom> at(const Pose& X_WT, double enough, const GoalRegion* goal) {
        start_ = X_WT;
        goal_ = goal;
        FitRoom room{.X_WT = X_WT};
        PartGap near = partGap(world_, X_WT, 2 * range_, Overlaps::Measured);
        room.asPlaced = near.gap;
        if (near.gap <= 0 && near.gap < enough) near = apart(room.X_WT, near, enough);
        if (near.gap > 0)
            near = widen(room.X_WT, near, enough);
        else if (room.asPlaced < 0)
            near = partGap(world_, room.X_WT, 2 * range_, Overlaps::Measured);
        if (ended_) return {};
        room.clearance = std::min(near.gap, range_);
        room.p_W = near.p_W;
        room.obstacle = near.obstacle;
        return room;
    }

  private:
    PartGap gapAt(const Pose& X_WT, Overlaps overlaps = Overlaps::Estimated) {
        ended_ = ended_ || (go_ && !go_());
        return ended_ ? PartGap{-INFINITY} : partGap(world_, X_WT, 2 * range_, overlaps);
    }

    /// Whether the tool may be moved there: within the range, and within the tolerance of the goal.
    bool allowed(const Pose& X_WT) const {
        const Vec3 moved = X_WT * world_.p_TC() - start_ * world_.p_TC();
        const double turned = logRotation(X_WT.q * start_.q.conjugate()).norm() * world_.reach();
        return moved.norm() <= range_ && turned <= range_ && (!goal_ || goal_->contains(X_WT));
    }

    /// X_WT after a translation of C and a rotation about it; a turn of 1 rad counts as the tool's reach.
    Pose after(const Pose& X_WT, const Vec6& x) const {
        const Vec3 C = X_WT * world_.p_TC();
        const Quat q = (expRotation(x.tail<3>() / world_.reach()) * X_WT.q).normalized();
        return {C + x.head<3>() - q * world_.p_TC(), q};
    }

    /// Out of an overlap, if there is a way out nearby: tries the directions of the tool's axes one by one, with ever
    /// smaller steps.
    PartGap apart(Pose& X_WT, PartGap best, double enough) {
        // No point of the tool moves by more than the range, plus as much by turning.
        if (-best.gap > 2 * range_) return best;
        const Mat3 axes = X_WT.q.toRotationMatrix();
        int trials = 0;
        const auto done = [&] { return ended_ || trials >= kTrials || best.gap > 0 || best.gap >= enough; };
        const double range = goal_ ? std::min(range_, goal_->tolerance) : range_;
        for (double step = kFirstTrial * range; step > kLeastTrial * range && !done(); step /= 2)
            for (bool better = true; better && !done();) {
                better = false;
                for (int k = 0; k < 12 && !done(); ++k) {
                    Vec6 move = Vec6::Zero();
                    move.segment<3>(k / 6 * 3) = (k % 2 ? -step : step) * axes.col(kAxes[std::size_t(k % 6 / 2)]);
                    const Pose tried = after(X_WT, move);
                    if (!allowed(tried)) continue;
                    ++trials;
                    const PartGap there = gapAt(tried);
                    if (there.gap <= best.gap) continue;
                    best = there;
                    X_WT = tried;
                    better = true;
                    --k;  // again the same way
                }
            }
        return best;
    }

    PartGap widen(Pose& X_WT, PartGap best, double enough) {
        double step = kFirstStep * range_;
        for (int i = 0; i < kSteps && step > kLeastStep * range_ && best.gap < enough; ++i) {
            const std::optional<Vec6> x = linearized(X_WT, best.gap, step);
            const Pose tried = x ? after(X_WT, *x) : X_WT;
            // Nothing crosses a surface in a move that is shorter than its distance.
            const PartGap there =
                x ? gapAt(tried, 4 * step < best.gap ? Overlaps::Impossible : Overlaps::Estimated) : best;
            if (there.gap <= best.gap + 1e-9 || !allowed(tried)) {
                step /= 4;
                continue;
            }
            if (there.gap > best.gap + step / 2) step *= 2;
            best = there;
            X_WT = tried;
        }
        return best;
    }

    /// The move within `step` that leaves the most room to all pairs, which are taken as planes. Nothing if there are
    /// too many of them.
    std::optional<Vec6> linearized(const Pose& X_WT, double clearance, double step) {
        // A row for each near pair, with turns as lengths at the tool's reach.
        rows_.clear();
        const Vec3 C = X_WT * world_.p_TC();
        bool fits = true;
        for (std::size_t k = 0; k < finders_.size() && fits; ++k) {
            const Pose& X_WO = world_.obstacles[k].X_WO;
            const Pose X_OT = X_WO.inverse() * X_WT;
            finders_[k]->forEachPair({X_OT, clearance + 4 * step}, [&](const PairEntry& pair, float) {
                const NearestPoints near = finders_[k]->nearest(X_OT, pair);
                const Vec3 apart = near.onTool - near.onObstacle;
                const double gap = apart.norm();
                if (gap <= 0 || gap > clearance + 4 * step) return true;
                if (rows_.size() + 16 >= kFitRows) return fits = false;
                const Vec3 n = X_WO.q * (apart / gap);
                Vec6 row;
                row << n, (X_WO * near.onTool - C).cross(n) / world_.reach();
                rows_.push(row, gap, std::uint64_t(rows_.size()));
                return true;
            });
        }
        if (!fits) return {};
        // Bounds on each component of the move.
        const int pairs = rows_.size();
        for (int axis = 0; axis < 6; ++axis)
            for (const double sign : {1.0, -1.0})
                rows_.push(sign * Vec6::Unit(axis), step, std::uint64_t(rows_.size()));
        // The greatest room that a move can give to all pairs, by bisection.
        std::vector<double> gaps(rows_.gap(), rows_.gap() + pairs);
        std::optional<Vec6> best;
        double low = clearance, high = clearance + 2 * step;
        for (int i = 0; i < kHalvings; ++i) {
            const double asked = (low + high) / 2;
            for (int r = 0; r < pairs; ++r) rows_.gap()[r] = gaps[std::size_t(r)] - asked;
            solver_->reset();
            const SolveResult result = solver_->solve({.rows = &rows_}, {});
            if (result.status == SolveStatus::Solved) {
                best = result.x;
                low = asked;
            } else {
                high = asked;
            }
        }
        return best;
    }

    static constexpr std::array<int, 3> kAxes{1, 0, 2};  // the way out is a goal's y

    const World& world_;
    const std::function<bool()> go_;
    const double range_;
    Pose start_;
    const GoalRegion* goal_ = nullptr;
    bool ended_ = false;  // by go_
    std::vector<std::unique_ptr<FeaturePairFinder>> finders_;
    RowSet rows_;
    std::unique_ptr<Solver> solver_;
};

/// Poses of the tool from the goal outward, with their distance from it; straight out by `reach` if nothing is known.
std::vector<std::pair<double, Pose>> wayOut(const GoalRegion& goal, double reach, double range) {
    std::vector<Pose> corners{Pose{}};
    corners.insert(corners.end(), goal.way.rbegin(), goal.way.rend());
    if (goal.way.empty()) corners.push_back({{0, goal.depth > 0 ? goal.depth : reach, 0}});
    double length = 0;
    std::vector<double> lengths;
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
        const Vec6 move = incrementBetween(corners[i], corners[i + 1]);
        lengths.push_back(std::max(move.head<3>().norm(), 10 * move.tail<3>().norm()));
        length += lengths.back();
    }
    std::vector<std::pair<double, Pose>> way{{0, goal.X_WT}};
    const double spacing = std::max(std::min(kFarthest, kSpacing * reach), length / kPoses);
    double passed = 0;
    for (std::size_t i = 0; i < lengths.size(); ++i) {
        const Vec6 move = incrementBetween(corners[i], corners[i + 1]);
        const auto add = [&](double share) {
            Pose X_GT{corners[i].p + share * move.head<3>(), expRotation(share * move.tail<3>()) * corners[i].q};
            if (goal.lead != 0) X_GT.q = expRotation({0, 2 * std::numbers::pi * X_GT.p.y() / goal.lead, 0});
            way.emplace_back(passed + share * lengths[i], goal.X_WT * X_GT);
        };
        if (const double before = kBeforeSeat * range; i == 0 && lengths[0] > 2 * before) add(before / lengths[0]);
        const int pieces = std::max(1, int(std::lround(lengths[i] / spacing)));
        for (int k = 1; k <= pieces; ++k) add(double(k) / pieces);
        passed += lengths[i];
    }
    return way;
}

/// Poses that the tool takes when the demonstration moves it between meshes.
std::vector<std::pair<double, Pose>> demonstrated(const Motion& motion, const World& world, Settings settings) {
    std::vector<std::pair<double, Pose>> poses;
    settings.mode = Mode::Default;
    settings.geometry = Geometry::Mesh;
    settings.solver = kExactSolver;
    settings.shadow = kNoSolver;
    settings.pause = false;
    TickState state(world);
    const double dt = 1000 / settings.rate, duration = motion.duration();
    int next = 0;
    for (double t = 0; t <= duration; t += dt) {
        const TickRecord record = step(world, settings, {.X_WT_device = motion.at(t)}, state);
        if (t < next * duration / kPoses) continue;
        ++next;
        poses.emplace_back(0, record.X_WT);
    }
    return poses;
}

std::string text(const char* format, auto... values) {
    char buffer[400];
    std::snprintf(buffer, sizeof buffer, format, values...);
    return buffer;
}

std::string mm(double value) { return text("%.*f mm", std::abs(value) < 0.1 ? 4 : 3, value); }

std::string describePlace(const World& world, const FitRoom& room) {
    return "beside \"" + engine::escaped(world.obstacles[room.obstacle].name) + "\", at " +
           text("(%.1f, %.1f, %.1f) mm", room.p_W.x(), room.p_W.y(), room.p_W.z());
}

void judge(const FitQuestion& question, const Settings& settings, FitCheck& fit) {
    const World& world = *question.world;
    fit.error = settings.contactDistance;
    const std::string doubt = question.goal ? midAirDoubt(world, *question.goal) : "",
                      also = doubt.empty() ? "" : "; " + doubt;
    if (!fit.least) {
        fit.verdict = "has room: more than " + mm(fitRange(world)) + " everywhere" + also;
        return;
    }
    // What the geometry takes: the protrusion of both trees, or the contact distance.
    const std::size_t k = fit.least->obstacle;
    fit.spheres = !world.byMeshes(k, geometryOf(settings));
    if (fit.spheres && world.hasSpheres(k))
        fit.error =
            world.tool.spheres->certificate.protrusion + world.obstacles[k].part.spheres->certificate.protrusion;
    const double room = fit.least->clearance;
    if (room > fit.error) {
        fit.verdict = (fit.goal ? "goes in with " : "passes with ") + mm(room - fit.error) + " to spare" + also;
        return;
    }
    // Too little room: say why, and what helps.
    if (room < 0 && fit.goal && fit.goal->clearance < 0) {
        fit.cause = insideClause(world, {fit.least->asPlaced, fit.least->p_W, k}, fit.free);
    } else if (room < 0) {
        fit.cause = "the parts overlap by " + mm(-room) + " " + describePlace(world, *fit.least);
        if (fit.least->depth > 0)
            fit.cause += text(", %.1f mm before the goal", fit.least->depth) +
                         (question.goal->way.empty() ? "; check the place of the goal and its +y, the way out; parts "
                                                       "that do not go straight in need a way"
                                                     : "");
    } else if (room == 0) {
        fit.cause = "no clearance: contacts are kept " + mm(fit.error) + " apart, and the parts touch " +
                    describePlace(world, *fit.least);
    } else if (fit.spheres) {
        fit.cause = "sphere trees reach out " + mm(fit.error) + " into a clearance of " + mm(room);
        if (world.hasMeshes(k)) fit.advice = {{"mode", "default"}, {"geometry", "mesh"}};
    } else {
        fit.cause = "contacts are kept " + mm(fit.error) + " apart in a clearance of " + mm(room);
        fit.advice = {{"contact_distance", text("%.2g", room / 4)}};
    }
    fit.verdict = (room >= 0 ? "sticks: " : "does not go in: ") + fit.cause;
}

}  // namespace

double fitRange(const World& world) { return std::min(kLargestRange, kRange * world.reach()); }

FitQuestion fitQuestion(const HapticScene& scene) {
    if (!scene.world) throw std::runtime_error(sceneName(scene) + ": " + scene.missing);
    for (std::size_t body = 0; body < scene.defects.size(); ++body)
        if (!scene.defects[body].empty())
            throw std::runtime_error(
                sceneName(scene) + ": the fit is measured between closed meshes, and " +
                nodeLabel(scene.scene, body == 0 ? scene.roles.tool : scene.roles.obstacles[body - 1]) + " has " +
                scene.defects[body] + ": close it in the program that made it");
    if (!scene.roles.goal && !scene.demonstration)
        throw std::runtime_error(
            sceneName(scene) +
            ": nothing says where the tool should fit: give a node the role goal, or animate the tool");
    return {worldNow(scene), scene.roles.goal, scene.demonstration};
}

std::optional<FitCheck> checkFit(const FitQuestion& question, const Settings& settings,
                                 const MeasureProgress& progress) {
    const World& world = *question.world;
    const auto& goal = question.goal;
    FitCheck fit;
    const double range = fitRange(world);
    std::size_t passed = 0;
    const auto poses =
        goal ? wayOut(*goal, world.reach(), range) : demonstrated(*question.demonstration, world, settings);
    const auto go = [&] { return !progress || progress(double(passed) / double(poses.size())); };
    RoomFinder finder(world, go);
    for (const auto& [depth, X_WT] : poses) {
        if (!go()) return {};
        const double enough = fit.least ? fit.least->clearance : range;
        const bool atGoal = goal && !fit.goal;
        std::optional<FitRoom> room = finder.at(X_WT, enough, atGoal ? &*goal : nullptr);
        if (!room) return {};
        room->depth = depth;
        // At the goal the seat limits the room, so that only an overlap counts.
        if (atGoal) fit.goal = room;
        if (!(atGoal && room->clearance > 0) && room->clearance < enough) fit.least = room;
        fit.rooms.push_back(*room);
        ++passed;
        if (room->clearance < 0) break;  // it does not go in, whatever the rest of the way leaves
    }
    if (fit.goal && fit.goal->clearance < 0) {
        fit.free = freePlaces(world, *goal, progress ? [&](double) { return go(); } : MeasureProgress());
        if (!go()) return {};
    }
    judge(question, settings, fit);
    if (goal && question.facets && fit.fits() && !fit.spheres) {
        fit.thread = threadLead(world, *goal, settings.contactDistance, [&](double) { return go(); });
        if (!go()) return {};
    }
    return fit;
}

bool StuckWatch::add(const GoalRegion& goal, const TickRecord& record, double ms) {
    const bool pressed = record.wrench_C.force.norm() > kStuckForce && !goal.contains(record.X_WT);
    if (!pressed || (record.X_WT.p - p_).norm() > kStuckMotion) {
        p_ = record.X_WT.p;
        since_ = ms;
        told_ = false;
    }
    return ms - since_ >= kStuckMs && !std::exchange(told_, true);
}

std::string stuckSentence(const HapticScene& scene, const TickRecord& last, const Settings& settings, bool why) {
    const auto& goal = scene.roles.goal;
    const double force = last.wrench_C.force.norm();
    if (!goal || !scene.world || goal->contains(last.X_WT) || force <= kStuckForce) return {};
    const Pose X_GT = goal->X_WT.inverse() * last.X_WT;
    const Vec3 out = goal->outAtGoal();
    const double above = out.dot(X_GT.p), aside = (X_GT.p - above * out).norm();
    const double tilt = std::acos(std::clamp(out.dot(X_GT.q * out), -1.0, 1.0)),
                 turned = std::abs(goal->twist(last.X_WT));
    std::string sentence =
        text("stuck %.1f mm %s the goal at %.1f N", std::abs(above), above < 0 ? "past" : "above", force);
    if (tilt > std::min(0.005, goal->toleranceAngle)) sentence += text(", tilted by %.3f rad", tilt);
    if (aside > goal->tolerance) sentence += text(", %.2f mm beside its axis", aside);
    if (turned > goal->toleranceAngle) sentence += text(", turned by %.3f rad from it", turned);
    if (goal->lead != 0 && above < 0)
        sentence += text(", so turn it back by %.2f rad", 2 * std::numbers::pi * above / -std::abs(goal->lead));
    if (!why) return sentence;
    try {
        FitQuestion question = fitQuestion(scene);
        question.facets = false;
        const std::optional<FitCheck> fit = checkFit(question, settings);
        if (!fit->fits()) return sentence + ": " + fit->cause;
        if (fit->least && tilt > 0.005)
            return sentence + text(": it fits with %s to spare when it is upright, so right it before pressing on",
                                   mm(fit->least->clearance - fit->error).c_str());
        if (fit->least) sentence += text(": it fits with %s to spare", mm(fit->least->clearance - fit->error).c_str());
    } catch (const std::runtime_error&) {
        // The fit of parts that are not closed is not measured.
    }
    return sentence;
}

}  // namespace touchstone::sandbox
