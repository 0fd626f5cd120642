#include "haptics/surface/feature_crossing.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone {
namespace {

/// Distance by which faces and edges are widened, mm, so that nothing passes between neighbors by rounding.
constexpr double kOverlap = 1e-9;
/// The smallest sine of the angle between two edges that cross. Edges that are more parallel meet at their ends, which
/// are vertices.
constexpr double kParallel = 1e-6;
/// Sine of the angle by which a face may rise in front of the normal: rounding.
constexpr double kFlat = 1e-9;

/// The times in [0, 1] at which a + b t + c t² is 0, or `near` to either side of it, in rising order, and 1.
struct Times {
    std::array<double, 7> at{};
    int count = 0;

    Times(double a, double b, double c, double near) {
        const auto add = [&](double t) {
            if (t >= 0 && t <= 1) at[count++] = t;
        };
        for (const double level : {-near, 0.0, near}) {
            const double discriminant = b * b - 4 * (a - level) * c;
            if (discriminant < 0) continue;
            const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
            if (q != 0) add((a - level) / q);
            if (c != 0) add(q / c);
        }
        add(1);
        std::sort(at.begin(), at.begin() + count);
    }
};

}  // namespace

bool linesStayApart(const std::array<PointPath, 2>& ends, const std::array<Vec3, 2>& resting, double least) {
    // The volume between the edges is a quadratic function of time, which lies between its Bézier coefficients. It is
    // the distance of the lines times the length of the cross product, which is largest at an end.
    const Vec3 v = resting[1] - resting[0];
    const Vec3 c0 = (ends[1].from - ends[0].from).cross(v), c1 = (ends[1].to - ends[0].to).cross(v);
    const Vec3 w0 = ends[0].from - resting[0], w1 = ends[0].to - resting[0];
    const double first = c0.dot(w0), last = c1.dot(w1), middle = (c0.dot(w1) + c1.dot(w0)) / 2;
    const double lowest = std::min({first, middle, last}), highest = std::max({first, middle, last});
    // Lines that stay further apart than the level at which crossing() tests them are tested at the end alone, where
    // the distance of the points that meet is that of the lines.
    const double near = least * (c0 + c1).norm() / 2 * (1 + 1e-9);
    return std::max(lowest, -highest) > near && last * last > least * least * (1 + 1e-9) * c1.squaredNorm();
}

EdgePlace edgePlaceOf(const SurfaceFeatures& surface, const SurfaceFeatures::Edge& edge) {
    const Vec3 &a = surface.points[edge.points[0]], &b = surface.points[edge.points[1]];
    const Vec3 along = (b - a).normalized();
    return {{a, b},
            {surface.faces[edge.faces[0]].normal.cross(along), along.cross(surface.faces[edge.faces[1]].normal)}};
}

std::optional<FeatureCrossing> crossing(const PointPath& vertex, const Triangle& face, const Vec3& normal, double least,
                                        double inside, double sag) {
    const double off = inside + sag;
    const double before = normal.dot(vertex.from - face[0]), after = normal.dot(vertex.to - face[0]);
    if (after >= least || before < -inside || (before >= 0 && before < after)) return std::nullopt;
    double from = 0, to = 1;
    for (int k = 0; k < 3; ++k) {
        const Vec3 inward = normal.cross(face[(k + 1) % 3] - face[k]).normalized();
        const double first = inward.dot(vertex.from - face[k]) + kOverlap + off,
                     last = inward.dot(vertex.to - face[k]) + kOverlap + off;
        if (first < 0 && last < 0) return std::nullopt;
        if (first < 0) from = std::max(from, first / (first - last));
        if (last < 0) to = std::min(to, first / (first - last));
    }
    const auto heightAt = [&](double t) { return before + t * (after - before); };
    if (from > to || heightAt(from) < -off || heightAt(to) >= least) return std::nullopt;
    const double time = before > after ? std::clamp((before - least) / (before - after), from, to) : from;
    return FeatureCrossing{time, normal, vertex.at(time), after, before};
}

std::optional<FeatureCrossing> crossing(const std::array<PointPath, 2>& ends, const EdgePlace& moving,
                                        const EdgePlace& resting, double turn, double least, double inside) {
    const Vec3 b = resting.ends[0], v = resting.ends[1] - b;
    const auto crossingAt = [&](double time) -> std::optional<FeatureCrossing> {
        const Vec3 a = ends[0].at(time), u = ends[1].at(time) - a, w = a - b, cross = u.cross(v);
        const double uu = u.squaredNorm(), vv = v.squaredNorm(), det = cross.squaredNorm();
        if (det <= kParallel * kParallel * uu * vv) return std::nullopt;
        const double uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
        const double onMoving = (uv * vw - vv * uw) / det, onResting = (uu * vw - uv * uw) / det;
        const auto within = [&](double at, double length2) {
            const double share = (kOverlap + inside) / std::sqrt(length2);
            return at >= -share && at <= 1 + share;
        };
        if (!within(onMoving, uu) || !within(onResting, vv)) return std::nullopt;
        Vec3 normal = cross / std::sqrt(det);
        if (normal.dot(resting.wings[0] + resting.wings[1]) > 0) normal = -normal;
        for (int k = 0; k < 2; ++k)
            if (normal.dot(resting.wings[k]) > turn + kFlat || normal.dot(moving.wings[k]) < -turn - kFlat)
                return std::nullopt;
        // Lines that met beyond an end of an edge have passed each other there.
        if (std::abs(normal.dot(w)) > 2 * std::max(least, inside) + kOverlap) return std::nullopt;
        // The points that meet are followed, not the nearest points afterwards.
        const Vec3 point = b + onResting * v;
        const PointPath met{ends[0].from + onMoving * (ends[1].from - ends[0].from),
                            ends[0].to + onMoving * (ends[1].to - ends[0].to)};
        const double after = normal.dot(met.to - point);
        const double before = normal.dot(met.from - point);
        if (after >= least || before < -inside || (before >= 0 && before < after)) return std::nullopt;
        return FeatureCrossing{time, normal, point, after, before};
    };
    // The volume between the edges is a quadratic function of time; it vanishes where the lines meet. The pair that is
    // first too near need not be the one that is first to meet, so both times are tried.
    const Vec3 u0 = ends[1].from - ends[0].from, u1 = ends[1].to - ends[0].to - u0;
    const Vec3 w0 = ends[0].from - b, w1 = ends[0].to - ends[0].from;
    const Vec3 c0 = u0.cross(v), c1 = u1.cross(v);
    if (inside > 0)  // edges that begin behind each other may meet at no time
        if (const auto found = crossingAt(0); found && found->before < 0) return found;
    const Times times(c0.dot(w0), c0.dot(w1) + c1.dot(w0), c1.dot(w1), least * (c0 + 0.5 * c1).norm());
    for (int k = 0; k < times.count; ++k)
        if (const auto found = crossingAt(times.at[k])) return found;
    return std::nullopt;
}

CrossingRow rowOf(const FeatureCrossing& crossing, const PointPath& C, const Vec6& step, double kept) {
    CrossingRow out;
    out.row << crossing.normal, (crossing.point - C.at(crossing.time)).cross(crossing.normal);
    out.gap = crossing.after - out.row.dot(step) - kept;
    return out;
}

}  // namespace touchstone
