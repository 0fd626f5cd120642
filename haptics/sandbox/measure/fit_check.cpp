#include "haptics/sandbox/measure/fit_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "haptics/loop/step.hpp"
#include "haptics/qp/solver.hpp"
#include "haptics/surface/feature_pair_finder.hpp"
#include "haptics/surface/surface_overlap.hpp"

namespace touchstone::sandbox {
namespace {

constexpr int kFitRows = 1 << 16;    // of one linearization; nearer pairs come first by halving the step
constexpr int kSteps = 30;           // linearizations at a pose
constexpr double kFirstStep = 0.05;  // mm, of the first one
constexpr double kLeastStep = 1e-5;  // mm, at which the search ends
constexpr int kHalvings = 12;        // of the interval in which the clearance of a linearization lies
constexpr int kPoses = 12;           // on the way, about
constexpr double kSpacing = 2;       // mm between them, at least
constexpr double kStuckForce = 0.5, kStuckMotion = 0.5, kStuckMs = 2000;  // N, mm, ms: of StuckWatch
constexpr double kBeforeSeat = 0.5;  // mm before the goal, where the seat does not limit the room any more
constexpr double kZero = 1e-4;       // mm: parts that overlap by less touch

struct Nearest {
    double clearance = INFINITY;
    Vec3 p_W = Vec3::Zero();
    std::size_t obstacle = 0;
};

class RoomFinder {
  public:
    explicit RoomFinder(const World& world)
        : world_(world), rows_(kFitRows), solver_(solverTable()[kExactSolver].make(kFitRows)) {
        for (const Obstacle& obstacle : world.obstacles)
            finders_.push_back(std::make_unique<FeaturePairFinder>(*world.toolSurface, *obstacle.surface));
    }

    /// The search ends when there is `enough` room, mm.
    FitRoom at(const Pose& X_WT, double enough) {
        FitRoom room{.X_WT = X_WT};
        Nearest near = nearest(X_WT, Overlap::Measured);
        room.asPlaced = near.clearance;
        if (near.clearance <= 0 && near.clearance < enough) near = apart(room.X_WT, nearest(X_WT), enough);
        if (near.clearance > 0)
            near = widen(room.X_WT, near, enough);
        else if (room.asPlaced < 0)
            near = nearest(room.X_WT, Overlap::Measured);
        room.clearance = std::min(near.clearance, kFitRange);
        room.p_W = near.p_W;
        room.obstacle = near.obstacle;
        return room;
    }

  private:
    /// What is done about parts that overlap. A search does without the points inside faces, which take long.
    enum class Overlap { Impossible, Estimated, Measured };
    Nearest nearest(const Pose& X_WT, Overlap expected = Overlap::Estimated) const {
        Nearest found{.clearance = 2 * kFitRange};
        for (std::size_t k = 0; k < world_.obstacles.size(); ++k) {
            const Obstacle& obstacle = world_.obstacles[k];
            const Pose X_OT = obstacle.X_WO.inverse() * X_WT;
            const auto points = nearestPoints(*world_.toolSurface, *obstacle.surface, X_OT, found.clearance);
            const bool inside =
                expected != Overlap::Impossible && overlap(*world_.toolSurface, *obstacle.surface, X_OT);
            const double clearance =
                inside   ? -overlapDepth(*world_.toolSurface, *obstacle.surface, X_OT, expected == Overlap::Measured)
                : points ? points->distance()
                         : INFINITY;
            if (clearance < found.clearance)
                found = {std::abs(clearance) < kZero ? 0 : clearance,
                         points ? obstacle.X_WO * points->onObstacle : X_WT * world_.p_TC(), k};
        }
        return found;
    }

    /// X_WT after a move of C and a turn about it that bring it there, a turn of 1 rad counting as the tool's reach.
    Pose after(const Pose& X_WT, const Vec6& x) const {
        const Vec3 C = X_WT * world_.p_TC();
        const Quat q = (expRotation(x.tail<3>() / world_.reach()) * X_WT.q).normalized();
        return {C + x.head<3>() - q * world_.p_TC(), q};
    }

    /// Out of an overlap, if there is a way out nearby: tries directions one by one, with ever smaller steps.
    Nearest apart(Pose& X_WT, Nearest best, double enough) const {
        const auto done = [&] { return best.clearance > 0 || best.clearance >= enough; };
        for (double step = kFitRange / 4; step > kFitRange / 4000 && !done(); step /= 2)
            for (bool better = true; better && !done();) {
                better = false;
                for (int axis = 0; axis < 6; ++axis)
                    for (const double sign : {1.0, -1.0}) {
                        const Pose tried = after(X_WT, sign * step * Vec6::Unit(axis));
                        const Nearest there = nearest(tried);
                        if (there.clearance <= best.clearance) continue;
                        best = there;
                        X_WT = tried;
                        better = true;
                        if (done()) return best;
                    }
            }
        return best;
    }

    Nearest widen(Pose& X_WT, Nearest best, double enough) {
        const Pose start = X_WT;
        double step = kFirstStep;
        for (int i = 0; i < kSteps && step > kLeastStep && best.clearance < enough; ++i) {
            const std::optional<Vec6> x = linearized(X_WT, best.clearance, step);
            const Pose tried = x ? after(X_WT, *x) : X_WT;
            // Nothing crosses a surface in a move that is shorter than its distance.
            const Nearest there =
                x ? nearest(tried, 4 * step < best.clearance ? Overlap::Impossible : Overlap::Estimated) : best;
            const bool near = (tried * world_.p_TC() - start * world_.p_TC()).norm() <= kFitRange;
            if (there.clearance <= best.clearance + 1e-9 || !near) {
                step /= 4;
                continue;
            }
            if (there.clearance > best.clearance + step / 2) step *= 2;
            best = there;
            X_WT = tried;
        }
        return best;
    }

    /// The move within `step` that leaves the most room to all pairs, which are taken as planes. Nothing if there are
    /// too many of them.
    std::optional<Vec6> linearized(const Pose& X_WT, double clearance, double step) {
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
        const int pairs = rows_.size();
        for (int axis = 0; axis < 6; ++axis)
            for (const double sign : {1.0, -1.0})
                rows_.push(sign * Vec6::Unit(axis), step, std::uint64_t(rows_.size()));
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

    const World& world_;
    std::vector<std::unique_ptr<FeaturePairFinder>> finders_;
    RowSet rows_;
    std::unique_ptr<Solver> solver_;
};

/// Poses of the tool from the goal outward, with their distance from it; straight out by `reach` if nothing is known.
std::vector<std::pair<double, Pose>> wayOut(const GoalRegion& goal, double reach) {
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
    const double spacing = std::max(kSpacing, length / kPoses);
    double passed = 0;
    for (std::size_t i = 0; i < lengths.size(); ++i) {
        const Vec6 move = incrementBetween(corners[i], corners[i + 1]);
        const auto add = [&](double share) {
            Pose X_GT{corners[i].p + share * move.head<3>(), expRotation(share * move.tail<3>()) * corners[i].q};
            if (goal.lead != 0) X_GT.q = expRotation({0, 2 * std::numbers::pi * X_GT.p.y() / goal.lead, 0});
            way.emplace_back(passed + share * lengths[i], goal.X_WT * X_GT);
        };
        if (i == 0 && lengths[0] > 2 * kBeforeSeat) add(kBeforeSeat / lengths[0]);
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
    settings.shadow = -1;
    settings.pause = false;
    StepState state(world);
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

std::string placeOf(const World& world, const FitRoom& room) {
    return "beside \"" + engine::escaped(world.obstacles[room.obstacle].name) + "\", at " +
           text("(%.1f, %.1f, %.1f) mm", room.p_W.x(), room.p_W.y(), room.p_W.z());
}

void judge(const FitQuestion& question, const Settings& settings, FitCheck& fit) {
    const World& world = *question.world;
    fit.error = settings.contactDistance;
    if (!fit.least) {
        fit.verdict = "there is room: more than " + mm(kFitRange) + " everywhere";
        return;
    }
    const std::size_t k = fit.least->obstacle;
    fit.spheres = !world.byMeshes(k, geometryOf(settings));
    if (fit.spheres && world.hasSpheres(k))
        fit.error = world.tool->certificate.protrusion + world.obstacles[k].tree->certificate.protrusion;
    const double room = fit.least->clearance;
    if (room > fit.error) {
        fit.verdict = (fit.goal ? "goes in with " : "passes with ") + mm(room - fit.error) + " to spare";
        return;
    }
    if (room <= 0) {
        fit.cause = "the parts overlap by " + mm(-room) + " " + placeOf(world, *fit.least);
        if (fit.least->depth > 0)
            fit.cause += text(", %.1f mm before the goal", fit.least->depth) +
                         (question.goal->way.empty() ? "; check the place of the goal and its +y, the way out; parts "
                                                       "that do not go straight in need a way"
                                                     : "");
    } else if (fit.spheres) {
        fit.cause = "sphere trees reach out " + mm(fit.error) + " into a clearance of " + mm(room);
        if (world.hasMeshes(k)) fit.advice = {{"mode", "default"}, {"geometry", "mesh"}};
    } else {
        fit.cause = "contacts are kept " + mm(fit.error) + " apart in a clearance of " + mm(room);
        fit.advice = {{"contact_distance", text("%.2g", room / 4)}};
    }
    fit.verdict = (room > 0 ? "sticks: " : "does not go in: ") + fit.cause;
}

}  // namespace

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
    RoomFinder finder(world);
    const auto poses = goal ? wayOut(*goal, world.reach()) : demonstrated(*question.demonstration, world, settings);
    for (const auto& [depth, X_WT] : poses) {
        if (progress && !progress(double(fit.rooms.size()) / double(poses.size()))) return {};
        // Parts that overlap all along do so by nearly the same; where a little more is not worth a search.
        const double least = fit.least ? fit.least->clearance : kFitRange, enough = std::min(least, 1.1 * least);
        FitRoom room = finder.at(X_WT, enough);
        room.depth = depth;
        // At the goal the seat limits the room, so that only an overlap counts.
        const bool seated = goal && !fit.goal && room.clearance > 0;
        if (goal && !fit.goal) fit.goal = room;
        if (!seated && room.clearance < enough) fit.least = room;
        fit.rooms.push_back(room);
    }
    judge(question, settings, fit);
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
    if (!why) return sentence;
    try {
        const std::optional<FitCheck> fit = checkFit(fitQuestion(scene), settings);
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
