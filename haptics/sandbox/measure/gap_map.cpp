#include "haptics/sandbox/measure/gap_map.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>

#include "haptics/surface/surface_distance.hpp"

namespace touchstone::sandbox {
namespace {

/// Maximum number of cuts. More of them resolve the colors of a large close fit better and take longer: a microsecond
/// or two each.
constexpr int kCuts = 1 << 14;
/// No point of a triangle is farther from its nearest corner than this multiple of the longest side.
constexpr double kInside = 0.5774;

/// The longest side of a patch.
struct Side {
    double length;
    int patch, first;
    /// The longest one is cut first, so that patches are equally fine if there are too many.
    bool operator<(const Side& other) const {
        return length != other.length ? length < other.length : patch > other.patch;
    }
};

}  // namespace

GapMap gapMap(const Surface& part, std::span<const PlacedSurface> others, double limit) {
    GapMap map;
    map.points = part.features.points;
    for (const SurfaceFeatures::Face& face : part.features.faces) map.patches.push_back(face.points);
    const auto longestSide = [&](int patch) {
        const auto& c = map.patches[std::size_t(patch)];
        const Edge longest =
            longestEdge({map.points[std::size_t(c[0])], map.points[std::size_t(c[1])], map.points[std::size_t(c[2])]});
        return Side{std::sqrt(longest.length2), patch, longest.first};
    };

    // Gaps up to the limit, and as far beyond as it takes to know whether a patch may come within.
    std::vector<double> wanted(map.points.size(), limit), gaps;
    for (int i = 0; i < int(map.patches.size()); ++i)
        for (const int corner : map.patches[std::size_t(i)]) {
            double& most = wanted[std::size_t(corner)];
            most = std::max(most, limit + kInside * longestSide(i).length);
        }
    std::vector<Pose> X_OP;
    for (const PlacedSurface& other : others) X_OP.push_back(other.X_PO.inverse());
    const auto gapAt = [&](const Vec3& p, double most) {
        for (std::size_t k = 0; k < others.size(); ++k) most = distanceTo(*others[k].surface, X_OP[k] * p, most);
        return most;
    };
    for (std::size_t i = 0; i < map.points.size(); ++i) gaps.push_back(gapAt(map.points[i], wanted[i]));

    // Cut the longest sides of patches that may come within the limit.
    std::priority_queue<Side> sides;
    const auto offer = [&](int patch) {
        const Side side = longestSide(patch);
        double least = HUGE_VAL;
        for (const int corner : map.patches[std::size_t(patch)]) least = std::min(least, gaps[std::size_t(corner)]);
        if (side.length > limit / 2 && least < limit + kInside * side.length) sides.push(side);
    };
    for (int i = 0; i < int(map.patches.size()); ++i) offer(i);
    std::map<std::pair<int, int>, int> middles;  // of cut sides, shared by the patches on both sides
    for (int cuts = 0; cuts < kCuts && !sides.empty(); ++cuts) {
        const Side side = sides.top();
        sides.pop();
        const auto corners = map.patches[std::size_t(side.patch)];
        const int a = corners[std::size_t(side.first)], b = corners[std::size_t((side.first + 1) % 3)],
                  c = corners[std::size_t((side.first + 2) % 3)];
        const auto [middle, isNew] = middles.try_emplace(std::minmax(a, b), int(map.points.size()));
        if (isNew) {
            map.points.push_back((map.points[std::size_t(a)] + map.points[std::size_t(b)]) / 2);
            gaps.push_back(gapAt(map.points.back(), limit + kInside * side.length));
        }
        const int added = int(map.patches.size());
        map.patches[std::size_t(side.patch)] = {a, middle->second, c};
        map.patches.push_back({middle->second, b, c});
        offer(side.patch);
        offer(added);
    }
    for (const double gap : gaps) map.gaps.push_back(float(std::min(gap, limit)));
    return map;
}

}  // namespace touchstone::sandbox
