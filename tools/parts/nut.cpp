#include "tools/parts/nut.hpp"

#include <algorithm>
#include <functional>
#include <vector>

#include "tools/parts/angles.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::app {
namespace {

constexpr double kBeyond = 0.3;  ///< radius by which chamfers reach beyond crest and root, mm
constexpr double kNear = 0.005;  ///< mm: points of a section nearer than this would make needles

/// One side of a section along the axis: points (height, radius) by rising height, joined by lines.
using Profile = std::vector<glm::dvec2>;

double radiusAt(const Profile& profile, double y) {
    const auto after = std::ranges::find_if(profile.begin() + 1, profile.end() - 1, [&](auto p) { return p.x >= y; });
    const glm::dvec2 a = *(after - 1), b = *after;
    return a.y + (b.y - a.y) * (y - a.x) / (b.x - a.x);
}

/// The smaller or the larger radius of two profiles of the same range at each height.
Profile combined(const Profile& a, const Profile& b, bool larger) {
    std::vector<double> heights;
    for (const Profile* profile : {&a, &b})
        for (const glm::dvec2& p : *profile) heights.push_back(p.x);
    std::ranges::sort(heights);
    heights.erase(std::ranges::unique(heights).begin(), heights.end());
    Profile result;
    for (std::size_t i = 0; i < heights.size(); ++i) {
        const double y = heights[i], ra = radiusAt(a, y), rb = radiusAt(b, y);
        if (i > 0) {  // where the profiles cross
            const double before = radiusAt(a, heights[i - 1]) - radiusAt(b, heights[i - 1]), now = ra - rb;
            if (before * now < 0) {
                const double crossing = std::lerp(heights[i - 1], y, before / (before - now));
                result.push_back({crossing, radiusAt(a, crossing)});
            }
        }
        result.push_back({y, larger ? std::max(ra, rb) : std::min(ra, rb)});
    }
    return result;
}

/// Without points on the line between their neighbors, and with one of two points that are too near: the one with the
/// larger or the smaller radius, so that nothing is added to a nut or a bolt. The ends remain.
Profile simplified(const Profile& profile, bool larger) {
    Profile result;
    for (const glm::dvec2& p : profile) {
        if (!result.empty() && glm::distance(result.back(), p) < kNear) {
            const bool keepsOld = result.size() == 1 || (p.y > result.back().y) != larger;
            if (keepsOld && &p != &profile.back()) continue;
            result.pop_back();
        }
        while (result.size() > 1) {
            const glm::dvec2 a = result[result.size() - 2], along = p - a, to = result.back() - a;
            if (std::abs(along.x * to.y - along.y * to.x) > 1e-9 * glm::length(along)) break;
            result.pop_back();
        }
        result.push_back(p);
    }
    return result;
}

/// The basic profile moved outward by the clearance, with the middle of a crest at `phase`.
Profile thread(const ThreadFit& fit, double clearance, double phase, double low, double high) {
    const double crest = fit.diameter / 2 + clearance, root = fit.minorDiameter() / 2 + clearance;
    // A flank is `clearance` away when it has moved by clearance / sin(flank) along the radius: the flats move by one
    // clearance, and the rest widens the crest and narrows the root.
    const double angle = fit.flankAngle(), wider = clearance * (1 - std::sin(angle)) / std::cos(angle);
    const double crestHalf = fit.pitch / 16 + wider, rootHalf = fit.rootHalf() - wider;
    Profile whole;
    for (double k = std::floor((low - phase) / fit.pitch) - 1; k * fit.pitch + phase < high + 2 * fit.pitch; ++k) {
        const double at = phase + k * fit.pitch, between = at + fit.pitch / 2;
        whole.insert(
            whole.end(),
            {{at - crestHalf, crest}, {at + crestHalf, crest}, {between - rootHalf, root}, {between + rootHalf, root}});
    }
    Profile part{{low, radiusAt(whole, low)}};
    std::ranges::copy_if(whole, std::back_inserter(part), [&](auto p) { return p.x > low && p.x < high; });
    part.push_back({high, radiusAt(whole, high)});
    return part;
}

/// The surface through a section at each of n angles about y, facing away from the axis or toward it. Lines from one
/// section to the next go by the shorter way, so that corners of a thread meet their own continuation.
void addTurned(Solid& solid, int n, bool outward, const std::function<Profile(int)>& section) {
    const auto point = [&](int i, glm::dvec2 p) {
        const double angle = kTau * (i % n) / n;  // as polygon() has it
        return glm::dvec3(p.y * std::cos(angle), p.x, -p.y * std::sin(angle));
    };
    const auto add = [&](const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
        outward ? solid.add(a, b, c) : solid.add(a, c, b);
    };
    const Profile first = section(0);
    Profile from = first;
    for (int i = 0; i < n; ++i) {
        const Profile to = i + 1 < n ? section(i + 1) : first;
        for (std::size_t a = 0, b = 0; a + 1 < from.size() || b + 1 < to.size();) {
            const glm::dvec3 p = point(i, from[a]), q = point(i + 1, to[b]);
            const bool left = b + 1 == to.size() ||
                              (a + 1 < from.size() &&
                               glm::distance(point(i, from[a + 1]), q) <= glm::distance(p, point(i + 1, to[b + 1])));
            if (left)
                add(p, q, point(i, from[++a]));
            else
                add(p, q, point(i + 1, to[++b]));
        }
        from = to;
    }
}

Outline hexagon(const ThreadFit& fit) {
    return subdivided(polygon(fit.acrossFlats() / std::sqrt(3.0), 6), fit.spacing());
}

/// A part with a thread of the other hand is the mirror image.
engine::MeshData finished(Solid solid, bool left) {
    if (left) {
        for (glm::dvec3& point : solid.points) point.z = -point.z;
        for (auto& triangle : solid.triangles) std::swap(triangle[1], triangle[2]);
    }
    return app::finished(solid);
}

void check(const ThreadFit& fit) {
    require(fit.pitch > 0 && fit.height > 0, "the pitch and the nut's height must be positive");
    require(fit.minorDiameter() / 2 > 2 * kBeyond, "the bolt must be thicker than its thread is deep");
    require(fit.clearance >= 0 && fit.clearance < fit.pitch / 8,
            "the clearance of a thread must lie between 0 and an eighth of the pitch");
    require(fit.standing() >= fit.pitch, "the pitch must be smaller: the bolt has less than one turn above the plate");
    require(fit.height > fit.pitch + 2 * kBeyond + 2 * fit.cut(),
            "the nut must be higher than its chamfers and a turn of the thread");
    require(fit.flank >= 0.5 && fit.flank < 60, "the flank of a thread must lie between 0.5 and 60 degrees");
    require(fit.rootHalf() > fit.clearance, "the thread must be less deep: its flanks meet above the root");
    require(fit.segments >= 12 && fit.nutSections() >= 12, "bolt and nut need twelve segments or more");
    require(fit.starts >= 1 && 4 * fit.starts <= fit.segments && 4 * fit.starts <= fit.nutSections(),
            "a thread has one start or more, and four sections for each");
}

}  // namespace

engine::MeshData bolt(const ThreadFit& fit) {
    check(fit);
    const double tip = fit.standing(), under = -fit.plate(), end = tip - fit.threaded();
    const double shank = fit.diameter / 2, root = fit.minorDiameter() / 2, least = root - kBeyond;
    const Profile chamfer{{under, shank}, {tip - (shank - least), shank}, {tip, least}};
    const Profile runOut{{under, shank}, {end, shank}, {end + fit.runOut(), root}, {tip, least}};
    Solid solid;
    addTurned(solid, fit.segments, true, [&](int i) {
        const Profile cut = thread(fit, 0, fit.lead() * i / fit.segments, under, tip);
        return simplified(combined(combined(cut, chamfer, false), runOut, true), false);
    });
    addEnd(solid, tip, triangulate(polygon(least, fit.segments), {}, fit.spacing()), true);

    const Outline head = hexagon(fit);
    const Section sides[] = {{under - fit.head(), head}, {under, head}};
    addWall(solid, sides, fit.head());
    addEnd(solid, under, triangulate(head, polygon(shank, fit.segments), fit.spacing()), true);
    addEnd(solid, under - fit.head(), triangulate(head, {}, fit.spacing()), false);
    return finished(std::move(solid), fit.left);
}

engine::MeshData nut(const ThreadFit& fit) {
    check(fit);
    const int n = fit.nutSections();
    const double out = 1 / std::cos(kPi / n);  // the sides touch the circles on which the sections lie
    const double root = fit.minorDiameter() / 2 + fit.clearance, wide = fit.diameter / 2 + fit.clearance + kBeyond;
    const double reach = wide - root;
    const Profile mouths{{0, wide}, {reach, root}, {fit.height - reach, root}, {fit.height, wide}};
    Solid solid;
    addTurned(solid, n, false, [&](int i) {
        const Profile cut = thread(fit, fit.clearance, fit.lead() * i / n, 0, fit.height);
        Profile section = simplified(combined(cut, mouths, true), true);
        for (glm::dvec2& p : section) p.y *= out;
        return section;
    });
    const Outline outer = hexagon(fit);
    const Section sides[] = {{0, outer}, {fit.height, outer}};
    addWall(solid, sides, fit.height);
    const PlanarMesh end = triangulate(outer, polygon(wide * out, n), fit.spacing());
    addEnd(solid, fit.height, end, true);
    addEnd(solid, 0, end, false);
    return finished(std::move(solid), fit.left);
}

}  // namespace touchstone::app
