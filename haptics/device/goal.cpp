#include "haptics/device/goal.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace touchstone {
namespace {

constexpr double kLever = 45;   // mm per rad
constexpr double kMaxTurn = 1;  // rad between neighbors of a simplified path

/// Distance of a pose from the straight way between two others, mm.
double distanceToWay(const Pose& from, const Pose& to, const Pose& pose) {
    const Vec6 whole = incrementBetween(from, to), part = incrementBetween(from, pose);
    Vec6 scale = Vec6::Ones();
    scale.tail<3>().setConstant(kLever);
    const Vec6 w = scale.cwiseProduct(whole), v = scale.cwiseProduct(part);
    const double t = w.squaredNorm() > 0 ? std::clamp(v.dot(w) / w.squaredNorm(), 0.0, 1.0) : 0;
    return (v - t * w).norm();
}

/// Direction from the end of a piece of the way to its beginning; zero for one that mostly turns.
Vec3 outOf(const GoalRegion& goal, std::size_t piece) {
    const Pose& end = piece + 1 < goal.way.size() ? goal.way[piece + 1] : Pose{};
    const Vec6 move = incrementBetween(end, goal.way[piece]);
    const double along = move.head<3>().norm(), around = kLever * move.tail<3>().norm();
    return along > std::max(around, 1e-6) ? Vec3(move.head<3>() / along) : Vec3::Zero();
}

void simplify(std::span<const Pose> path, double tolerance, std::vector<Pose>& kept) {
    const Pose &first = path.front(), &last = path.back();
    std::size_t farthest = 0;
    double most = tolerance;
    for (std::size_t i = 1; i + 1 < path.size(); ++i)
        if (const double distance = distanceToWay(first, last, path[i]); distance > most) most = distance, farthest = i;
    if (farthest == 0 && path.size() > 2 && logRotation(last.q * first.q.conjugate()).norm() > kMaxTurn)
        farthest = path.size() / 2;
    if (farthest == 0) {
        kept.push_back(last);
        return;
    }
    simplify(path.first(farthest + 1), tolerance, kept);
    simplify(path.subspan(farthest), tolerance, kept);
}

}  // namespace

double foldedTwist(const Quat& q, int fold) {
    if (fold == 0) return 0;
    const double twist = 2 * std::atan2(q.y(), q.w()), step = 2 * std::numbers::pi / fold;
    return twist - step * std::round(twist / step);
}

Vec3 GoalRegion::outAtGoal() const {
    for (std::size_t i = way.size(); i-- > 0;)
        if (const Vec3 out = outOf(*this, i); !out.isZero()) return out;
    return Vec3::UnitY();
}

Vec3 GoalRegion::outAtStart() const {
    for (std::size_t i = 0; i < way.size(); ++i)
        if (const Vec3 out = outOf(*this, i); !out.isZero()) return out;
    return Vec3::UnitY();
}

double GoalRegion::angle(const Pose& X_WO) const {
    const Quat q = X_WT.q.conjugate() * X_WO.q;
    const double whole = 2 * std::atan2(q.y(), q.w());
    return logRotation(q * expRotation({0, twist(X_WO) - whole, 0})).norm();
}

std::vector<Pose> simplified(std::span<const Pose> path, double tolerance) {
    std::vector<Pose> kept;
    if (path.empty()) return kept;
    kept.push_back(path.front());
    if (path.size() > 1) simplify(path, tolerance, kept);
    return kept;
}

}  // namespace touchstone
