#include "haptics/surface/feature_list.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "haptics/math/tick_tuning.hpp"

namespace touchstone {
namespace {

/// Features that begin nearer than is allowed must not come nearer than this in a step, mm: rounding. With a larger one
/// they come nearer step by step; with a smaller one they hold a tool that slides.
constexpr double kNearer = 1e-6;

/// Whether all spokes of a vertex rise above a face with this normal that it meets, up to this angle. The cone, by
/// which searches leave out pairs, decides as well: at a pointed cone the spokes alone would admit more.
bool stands(const Surface& part, int index, const Vec3& normal, double angle) {
    const NormalCone& tip = part.tips[index];
    if (-normal.dot(tip.axis.cast<double>()) < std::cos(std::min(double(tip.angle) + angle, std::numbers::pi)))
        return false;
    const SurfaceFeatures& surface = part.features;
    const SurfaceFeatures::Vertex& vertex = surface.vertices[index];
    const Vec3& p = surface.points[vertex.point];
    for (int k = 0; k < vertex.spokes; ++k) {
        const Vec3 spoke = surface.points[surface.spokes[vertex.firstSpoke + k]] - p;
        if (spoke.dot(normal) < -angle * spoke.norm()) return false;
    }
    return true;
}

}  // namespace

/// A step between two poses, and what the tests of pairs need of it.
struct FeatureList::Step {
    Mat3 R0, R1;
    Vec3 p0, p1;
    Vec3 turn;
    double angle, distance;
    double least;  ///< features are too near below it, mm

    Step(const Pose& before, const Pose& after, double distance_)
        : R0(before.R()),
          R1(after.R()),
          p0(before.p),
          p1(after.p),
          turn(logRotation(after.q * before.q.conjugate())),
          angle(turn.norm()),
          distance(distance_),
          least(kTooNear * distance_) {}
    /// The angle by which the normals of a pair may differ from being opposite, rad: the pair that is first in the way
    /// at one time of the step is not at another.
    double off() const { return angle + 1e-6; }
    Quat turned(double time) const { return expRotation(time * turn); }
    PointPath path(const Vec3& x) const { return {R0 * x + p0, R1 * x + p1}; }
    PointPath pathInTool(const Vec3& x) const { return {R0.transpose() * (x - p0), R1.transpose() * (x - p1)}; }
};

/// A step that is tried, in the obstacle's frame, and what its rows need.
struct FeatureList::Trial {
    Pose before, after;
    Step step;
    PointPath C;
    Vec6 x;

    Trial(const Pose& X_OT, const Pose& before_, const Mat3& R_WO, const Vec6& x_W, const Vec3& center, double distance)
        : before(before_),
          after(StraightMotion(X_OT, R_WO.transpose() * x_W.head<3>(), R_WO.transpose() * x_W.tail<3>()).end(center)),
          step(before, after, distance),
          C{before * center, after * center} {
        x << R_WO.transpose() * x_W.head<3>(), R_WO.transpose() * x_W.tail<3>();
        step.least = kNear * distance;
    }
};

FeatureList::FeatureList(const Surface& tool, const Surface& obstacle, int obstacleIndex)
    : ContactList(std::make_unique<FeaturePairFinder>(tool, obstacle), kFeatureLookAhead),
      tool_(&tool),
      obstacle_(&obstacle),
      obstacleIndex_(obstacleIndex) {
    found_.reserve(kMostCrossed);
}

Coverage FeatureList::coverageOf(const StraightMotion& step, double) const {
    Within within = extent().reach * step.turn.squaredNorm() / 2 + distance_ + 2 * inside_ + 1e-6;
    // Those of any step of the tool, so that the next one needs no other pairs; an obstacle may turn as well.
    within.turn = std::max(step.turn.norm(), 1.05 * std::sqrt(distance_ / extent().reach)) + lean();
    return {step, within};
}

bool FeatureList::appendRows(const Pose&, const Mat3&, double, RowSet&, int) const { return true; }
int FeatureList::appendNearestRows(const Pose&, const Mat3&, double, RowSet&) const { return 0; }

/// The crossing of one pair in the obstacle's frame.
std::optional<FeatureCrossing> FeatureList::crossingOf(const PairEntry& entry, const Step& step) const {
    const int feature = featureOf(entry.tool);
    const double least = step.least;
    const SurfaceFeatures &tool = tool_->features, &obstacle = obstacle_->features;
    switch (kindOf(entry.tool)) {
        case PairKind::VertexFace: {
            const SurfaceFeatures::Face& face = obstacle.faces[entry.obstacle];
            const PointPath path = step.path(tool.points[tool.vertices[feature].point]);
            const auto found =
                touchstone::crossing(path, obstacle.triangle(entry.obstacle), face.normal, least, inside_);
            if (!found) return found;
            const Vec3 n = step.R0.transpose() * (step.turned(found->time).conjugate() * face.normal);
            return stands(*tool_, feature, n, step.off() + lean()) ? found : std::nullopt;
        }
        case PairKind::FaceVertex: {
            const SurfaceFeatures::Face& face = tool.faces[feature];
            const Vec3& p = obstacle.points[obstacle.vertices[entry.obstacle].point];
            const PointPath path = step.pathInTool(p);
            const double sag = sagOf(step.angle, (path.to - path.from).norm());
            auto found = touchstone::crossing(path, tool.triangle(feature), face.normal, least, inside_, sag);
            if (!found) return found;
            found->normal = -(step.turned(found->time) * (step.R0 * found->normal));
            found->point = p;
            return stands(*obstacle_, entry.obstacle, -found->normal, step.off() + lean()) ? found : std::nullopt;
        }
        default: {
            const SurfaceFeatures::Edge &edge = tool.edges[feature], &other = obstacle.edges[entry.obstacle];
            const std::array<PointPath, 2> ends{step.path(tool.points[edge.points[0]]),
                                                step.path(tool.points[edge.points[1]])};
            const Vec3 &b0 = obstacle.points[other.points[0]], &b1 = obstacle.points[other.points[1]];
            for (int k = 0; k < 3; ++k) {
                const double lo =
                    std::min(std::min(ends[0].from[k], ends[0].to[k]), std::min(ends[1].from[k], ends[1].to[k]));
                const double hi =
                    std::max(std::max(ends[0].from[k], ends[0].to[k]), std::max(ends[1].from[k], ends[1].to[k]));
                const double wide = step.distance + inside_;
                if (lo > std::max(b0[k], b1[k]) + wide || hi < std::min(b0[k], b1[k]) - wide) return std::nullopt;
            }
            if (linesStayApart(ends, {b0, b1}, std::max(least, inside_))) return std::nullopt;
            EdgePlace moving = edgePlaceOf(tool, edge);
            for (Vec3& wing : moving.wings) wing = step.R0 * wing;
            return touchstone::crossing(ends, moving, edgePlaceOf(obstacle, other), step.angle + lean(), least,
                                        inside_);
        }
    }
}

/// Whether a step brings a pair too near, or nearer if it begins so.
bool FeatureList::deepens(const PairEntry& entry, const Step& step) const {
    const auto met = crossingOf(entry, step);
    return met && !(inside_ > 0 && met->before < step.least && met->after > met->before - kNearer);
}

/// Whether there is room for what the trial step crosses; notes the pair if it is crossed.
bool FeatureList::test(const PairEntry& entry, const Trial& trial) {
    const auto met = crossingOf(entry, trial.step);
    if (!met) return true;
    if (found_.size() == kMostCrossed) return false;
    found_.push_back(
        {contactId(obstacleIndex_, entry.tool, entry.obstacle), met->after, rowOf(*met, trial.C, trial.x, distance_)});
    return true;
}

Crossed FeatureList::appendCrossed(const Pose& X_OT, const Pose& before, const Mat3& R_WO, double, const Crossing& by,
                                   RowSet& rows, RowSet& crossed) {
    if (suspended_) return Crossed::Nothing;
    const Trial trial(X_OT, before, R_WO, by.x, extent().center, distance_);
    found_.clear();
    bool fits = true;
    const StraightMotion motion(before, trial.C.to - trial.C.from, trial.step.turn);
    pairs().forEachCrossing(
        narrow_, coverageOf(motion, 0), before, trial.after, trial.step.least,
        [&](const PairEntry& entry) { return fits = test(entry, trial); }, inside_);
    return fits ? appendFound(R_WO, by, trial.step.least, rows, crossed) : Crossed::Overflow;
}

/// Appends rows of the pairs that were found nearer than `least`, or renews those in `rows`.
Crossed FeatureList::appendFound(const Mat3& R_WO, const Crossing& by, double least, RowSet& rows, RowSet& crossed) {
    if (found_.empty()) return Crossed::Nothing;
    double deepest = least;
    for (const Found& f : found_) deepest = std::min(deepest, f.after);
    // The deepest first: many of the others are crossed only as long as these are.
    const double limit = (least + deepest) / 2;
    std::erase_if(found_, [&](const Found& f) { return f.after > limit; });
    std::sort(found_.begin(), found_.end(), [](const Found& a, const Found& b) { return a.id < b.id; });
    const int start = crossed.size();
    bool fits = true;
    Crossed result = Crossed::Known;
    for (const Found& f : found_) {
        Vec6 row;
        row << R_WO * f.row.row.head<3>(), R_WO * f.row.row.tail<3>();
        const int at = rows.find(f.id);
        if (at < 0) {
            fits = rows.size() + crossed.size() - start < rows.capacity();
            if (!fits) break;
            crossed.push(row, f.row.gap, f.id);
            result = Crossed::Rows;
            continue;
        }
        // The answer satisfies the row of an earlier trial, which was wrong here; or it resolves at its end what the
        // part that is taken has to resolve.
        const bool satisfied = rows.row(at).dot(by.x) + rows.gap()[at] >= (least - distance_) / 2;
        if (!satisfied && (!by.whole || by.share == 0 || by.slack > 0)) continue;
        const double gap = satisfied ? f.row.gap : std::min(f.row.gap, f.row.gap / by.share);
        // The same row again would lead to the same answer.
        if (rows.row(at) == row && rows.gap()[at] == gap) continue;
        for (int k = 0; k < 6; ++k) rows.column(k)[at] = row[k];
        rows.gap()[at] = gap;
        result = Crossed::Rows;
    }
    if (!fits) crossed.setSize(start);
    return fits ? result : Crossed::Overflow;
}

double FeatureList::lean() const { return inside_ > 0 ? kLean : 0; }

FeaturePairFinder& FeatureList::pairs() const { return static_cast<FeaturePairFinder&>(*finder_); }

ContactList::Overlap FeatureList::remeasure(const Pose& before, const Pose& after, double) {
    Overlap overlap;
    if (suspended_ || before == after) return overlap;
    const Step step(before, after, distance_);
    const Vec3& center = extent().center;
    const StraightMotion motion(before, after * center - before * center, step.turn);
    pairs().forEachCrossing(
        narrow_, coverageOf(motion, 0), before, after, kTooNear * distance_,
        [&](const PairEntry& entry) {
            overlap.deeper = deepens(entry, step);
            return !overlap.deeper;
        },
        inside_);
    return overlap;
}

bool FeatureList::deepens(const PairEntry& pair, const Pose& before, const Pose& after) const {
    return before != after && deepens(pair, Step(before, after, distance_));
}

/// The normal of a face is its own, since a vertex at its rim may be nearest to the rim.
ContactList::Nearest FeatureList::nearest(const Pose& X_OT, int toolFeature, int obstacleFeature) const {
    const NearestPoints points = pairs().nearest(X_OT, {toolFeature, obstacleFeature});
    Vec3 normal = (points.onTool - points.onObstacle).normalized();
    if (kindOf(toolFeature) == PairKind::VertexFace) normal = obstacle_->features.faces[obstacleFeature].normal;
    if (kindOf(toolFeature) == PairKind::FaceVertex)
        normal = -(X_OT.q * tool_->features.faces[featureOf(toolFeature)].normal);
    return {points.onTool, normal, points.distance()};
}

/// A motion is free if no pair on it comes so near that the bend of its turn could bring the two together; near pairs
/// may stay where the bend is small and their crossing is computed.
double FeatureList::freeShare(const StraightMotion& motion, double atMost) {
    if (suspended_) return atMost;
    for (double share = atMost; share > kLeastShare; share /= 2) {
        const StraightMotion part = motion.times(share);
        const double bend = extent().reach * part.turn.squaredNorm() / 2;
        const Pose after = part.end(extent().center);
        const Step step(part.X_OT, after, distance_);
        bool free = true;
        beginFlight();
        const bool finished = pairs().forEachPair({part, bend + 2 * distance_}, [&](const PairEntry& entry, float) {
            free = bend < distance_ / 8 && !crossingOf(entry, step);
            return free;
        });
        if (free && finished) return share;
    }
    return 0;
}

bool FeatureList::hasFeatures(std::uint64_t pair) const {
    const auto within = [&](const auto& ours, const auto& others) {
        return featureOf(toolLeafOf(pair)) < int(ours.size()) && obstacleLeafOf(pair) < int(others.size());
    };
    const SurfaceFeatures &tool = tool_->features, &obstacle = obstacle_->features;
    switch (kindOf(toolLeafOf(pair))) {
        case PairKind::VertexFace:
            return within(tool.vertices, obstacle.faces);
        case PairKind::FaceVertex:
            return within(tool.faces, obstacle.vertices);
        case PairKind::EdgeEdge:
            return within(tool.edges, obstacle.edges);
    }
    return false;
}

ContactList::Stand FeatureList::stand(const Pose& X_OT, std::uint64_t pair) const {
    const int ours = toolLeafOf(pair), other = obstacleLeafOf(pair);
    if (kindOf(ours) != PairKind::EdgeEdge) {
        const NearestPoints at = pairs().nearest(X_OT, {ours, other});
        const bool ofTool = kindOf(ours) == PairKind::FaceVertex;
        const Vec3 normal = ofTool ? Vec3(-(X_OT.q * tool_->features.faces[featureOf(ours)].normal))
                                   : obstacle_->features.faces[other].normal;
        const Vec3 between = at.onTool - at.onObstacle;
        const double height = normal.dot(between);
        const Vec3 aside = between - height * normal;
        return {ofTool ? Vec3(at.onTool - aside) : at.onTool, normal, height, aside.norm()};
    }
    const auto ends = [](const SurfaceFeatures& surface, int edge) {
        const auto& [a, b] = surface.edges[edge].points;
        return std::array{surface.points[a], surface.points[b]};
    };
    const auto [a, a1] = ends(tool_->features, featureOf(ours));
    const auto [b, b1] = ends(obstacle_->features, other);
    const Vec3 u = X_OT.q * (a1 - a), v = b1 - b, w = X_OT * a - b, cross = u.cross(v);
    const double det = cross.squaredNorm(), height = w.dot(cross) / std::sqrt(det);
    const auto outside = [](double at, double length) { return length * std::max({0.0, -at, at - 1}); };
    const double s = v.cross(w).dot(cross) / det, t = u.cross(w).dot(cross) / det;
    return {X_OT * a + s * u, std::copysign(1.0, height) * cross.normalized(), std::abs(height),
            std::max(outside(s, u.norm()), outside(t, v.norm()))};
}

bool FeatureList::hasTwin(const Pose& X_OT, std::uint64_t pair, const Stand& like, double within) const {
    if (suspended_) return false;
    const bool own = obstacleOf(pair) == obstacleIndex_;
    for (int i = 0; i < narrow_.count; ++i) {
        const PairEntry& entry = narrow_.at[i];
        const bool shares = entry.tool == toolLeafOf(pair) || (own && entry.obstacle == obstacleLeafOf(pair) &&
                                                               kindOf(entry.tool) == kindOf(toolLeafOf(pair)));
        if (!shares) continue;
        const Stand other = stand(X_OT, contactId(obstacleIndex_, entry.tool, entry.obstacle));
        if (other.beside <= within && (other.foot - like.foot).norm() <= within &&
            std::abs(other.height - like.height) <= within && (other.normal - like.normal).norm() <= kSameNormal)
            return true;
    }
    return false;
}

}  // namespace touchstone
