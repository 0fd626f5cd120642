#include "tools/step/step_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

namespace touchstone::step {
namespace {

using Nodes = std::vector<SlabNode>;
using Loop = std::vector<int>;

/// Twice the area of the triangle, above 0 if it turns left.
double turn(const SlabNode& a, const SlabNode& b, const SlabNode& c) {
    return (b.s - a.s) * (c.v - a.v) - (b.v - a.v) * (c.s - a.s);
}

double area(const Nodes& nodes, const Loop& loop) {
    double twice = 0;
    const SlabNode& base = nodes[std::size_t(loop[0])];
    for (std::size_t i = 1; i + 1 < loop.size(); ++i)
        twice += turn(base, nodes[std::size_t(loop[i])], nodes[std::size_t(loop[i + 1])]);
    return twice / 2;
}

bool isInside(const Nodes& nodes, const Loop& loop, const SlabNode& p) {
    bool inside = false;
    for (std::size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) {
        const SlabNode &a = nodes[std::size_t(loop[i])], &b = nodes[std::size_t(loop[j])];
        if ((a.v > p.v) != (b.v > p.v) && p.s < a.s + (p.v - a.v) / (b.v - a.v) * (b.s - a.s)) inside = !inside;
    }
    return inside;
}

bool doCross(const SlabNode& a, const SlabNode& b, const SlabNode& c, const SlabNode& d) {
    return turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0;
}

/// Joins a hole to the loop around it by a bridge between two nodes that see each other.
void bridge(const Nodes& nodes, Loop& outer, const Loop& hole) {
    double nearest = HUGE_VAL;
    std::size_t from = 0, to = 0;
    const auto isFree = [&](const SlabNode& a, const SlabNode& b) {
        for (const Loop* loop : {&std::as_const(outer), &hole})
            for (std::size_t i = 0; i < loop->size(); ++i)
                if (doCross(a, b, nodes[std::size_t((*loop)[i])], nodes[std::size_t((*loop)[(i + 1) % loop->size()])]))
                    return false;
        return true;
    };
    for (std::size_t i = 0; i < outer.size(); ++i)
        for (std::size_t k = 0; k < hole.size(); ++k) {
            const SlabNode &a = nodes[std::size_t(outer[i])], &b = nodes[std::size_t(hole[k])];
            const double length = std::hypot(a.s - b.s, a.v - b.v);
            if (length < nearest && isFree(a, b)) {
                nearest = length;
                from = i;
                to = k;
            }
        }
    Loop joined(outer.begin(), outer.begin() + std::ptrdiff_t(from) + 1);
    for (std::size_t k = 0; k <= hole.size(); ++k) joined.push_back(hole[(to + k) % hole.size()]);
    joined.insert(joined.end(), outer.begin() + std::ptrdiff_t(from), outer.end());
    outer = std::move(joined);
}

/// Cuts ears off a simple polygon. An ear without area is cut last, where nothing else is left: it keeps neighbors
/// joined.
bool clip(const Nodes& nodes, Loop loop, std::vector<std::array<int, 3>>& triangles) {
    const auto at = [&](std::size_t i) -> const SlabNode& { return nodes[std::size_t(loop[i % loop.size()])]; };
    std::size_t start = 0;
    while (loop.size() > 3) {
        const std::size_t count = loop.size();
        std::size_t ear = count, flat = count;
        for (std::size_t n = 0; n < count && ear == count; ++n) {
            const std::size_t i = (start + n) % count, next = i + 1, before = i + count - 1;
            const SlabNode &a = at(before), &b = at(i), &c = at(next);
            const double twice = turn(a, b, c);
            if (twice == 0) flat = i;
            if (twice <= 0) continue;
            bool isEmpty = true;
            for (std::size_t k = 2; k + 1 < count && isEmpty; ++k) {
                const SlabNode& p = at(i + k);
                const int node = loop[(i + k) % count];
                if (node == loop[before % count] || node == loop[i] || node == loop[next % count]) continue;
                isEmpty = turn(a, b, p) < 0 || turn(b, c, p) < 0 || turn(c, a, p) < 0;
            }
            if (isEmpty) ear = i;
        }
        if (ear == count) ear = flat;
        if (ear == count) return false;
        triangles.push_back({loop[(ear + count - 1) % count], loop[ear], loop[(ear + 1) % count]});
        loop.erase(loop.begin() + std::ptrdiff_t(ear));
        start = ear;  // the next ear lies on the other side, so that ears do not form a fan
    }
    if (loop.size() == 3) triangles.push_back({loop[0], loop[1], loop[2]});
    return true;
}

/// The part of the area in one slab.
class Slab {
  public:
    Slab(const Nodes& nodes, double left, const std::vector<int>& leftNodes, const std::vector<int>& rightNodes)
        : nodes_(nodes), left_(left), leftNodes_(leftNodes), rightNodes_(rightNodes) {}

    void add(int from, int to) { next_.emplace(from, to); }

    bool triangulate(bool rows, std::vector<std::array<int, 3>>& triangles) {
        if (!findPaths() || !findLoops()) return false;
        if (rows) return triangulateRows(triangles);
        std::vector<Loop> outers, holes;
        for (Loop& loop : loops_) {
            const double size = area(nodes_, loop);
            if (loop.size() >= 3) (size >= 0 ? outers : holes).push_back(std::move(loop));
        }
        for (const Loop& hole : holes) {
            const auto around =
                std::ranges::find_if(outers, [&](const Loop& outer) { return isInside(nodes_, outer, node(hole[0])); });
            if (around == outers.end()) return false;
            bridge(nodes_, *around, hole);
        }
        return std::ranges::all_of(outers, [&](const Loop& loop) { return clip(nodes_, loop, triangles); });
    }

  private:
    const SlabNode& node(int i) const { return nodes_[std::size_t(i)]; }
    bool isOnLine(int i) const { return node(i).s == left_ || node(i).s == left_ + 1; }

    /// Chords in sequence, from a line to a line; those that reach none are loops.
    bool findPaths() {
        while (!next_.empty()) {
            const auto first = std::ranges::find_if(next_, [&](const auto& chord) { return isOnLine(chord.first); });
            auto chord = first != next_.end() ? first : next_.begin();
            const bool isPath = first != next_.end();
            Loop path{chord->first};
            while (true) {
                const int to = chord->second;
                next_.erase(chord);
                if (!isPath && to == path.front()) break;
                path.push_back(to);
                if (isPath && isOnLine(to)) break;
                chord = next_.find(to);
                if (chord == next_.end()) return false;
            }
            (isPath ? paths_ : loops_).push_back(std::move(path));
        }
        return true;
    }

    /// The path that begins where the area goes on along the line at the end of `path`: upward on the right line,
    /// downward on the left one. Adds the nodes between to the loop.
    std::size_t follow(const Loop& path, Loop& loop) const {
        const int end = path.back();
        const bool right = node(end).s > left_;
        const double up = right ? 1 : -1;
        std::size_t best = paths_.size();
        double distance = HUGE_VAL;
        for (std::size_t i = 0; i < paths_.size(); ++i) {
            const Loop& other = paths_[i];
            if (node(other[0]).s != node(end).s) continue;
            const double ahead = up * (node(other[0]).v - node(end).v);
            if (ahead < 0 || ahead >= distance) continue;
            // Two that touch the line in one point: the area lies between them only if the way turns left there.
            if (other[0] == end && turn(node(path[path.size() - 2]), node(end), node(other[1])) < 0) continue;
            best = i;
            distance = ahead;
        }
        if (best == paths_.size()) return best;
        std::vector<int> between;
        for (const int i : right ? rightNodes_ : leftNodes_)
            if (up * (node(i).v - node(end).v) > 0 && up * (node(paths_[best][0]).v - node(i).v) > 0)
                between.push_back(i);
        if (!right) std::ranges::reverse(between);
        loop.insert(loop.end(), between.begin(), between.end());
        return best;
    }

    bool findLoops() {
        std::vector<bool> used(paths_.size(), false);
        for (std::size_t first = 0; first < paths_.size(); ++first) {
            if (used[first]) continue;
            Loop loop;
            for (std::size_t i = first; !used[i];) {
                used[i] = true;
                for (const int k : paths_[i])
                    if (loop.empty() || loop.back() != k) loop.push_back(k);
                i = follow(paths_[i], loop);
                if (i == paths_.size() || (used[i] && i != first)) return false;
            }
            while (loop.size() > 1 && loop.front() == loop.back()) loop.pop_back();
            loops_.push_back(std::move(loop));
        }
        return true;
    }

    /// Cuts the loops at rows, which are the slabs of the same area turned by a quarter.
    bool triangulateRows(std::vector<std::array<int, 3>>& triangles) const {
        SlabArea turned;
        std::vector<int> nodes;  // by node of the turned area
        std::map<int, int> known;
        const auto turnedNode = [&](int i) {
            const auto [at, isNew] = known.try_emplace(i, int(nodes.size()));
            if (isNew) {
                nodes.push_back(i);
                turned.nodes.push_back({node(i).v, -node(i).s});
            }
            return at->second;
        };
        for (const Loop& loop : loops_)
            for (std::size_t i = 0; loop.size() > 2 && i < loop.size(); ++i)
                turned.chords.push_back({turnedNode(loop[i]), turnedNode(loop[(i + 1) % loop.size()])});
        const std::size_t first = triangles.size();
        if (!turned.triangulate(triangles)) return false;
        for (std::size_t i = first; i < triangles.size(); ++i)
            for (int& corner : triangles[i]) corner = nodes[std::size_t(corner)];
        return true;
    }

    const Nodes& nodes_;
    double left_;
    const std::vector<int>&leftNodes_, &rightNodes_;
    std::multimap<int, int> next_;
    std::vector<Loop> paths_, loops_;
};

}  // namespace

void SlabArea::addCrossings() {
    std::map<double, std::vector<double>> bounds;  // by row, where chords pass it
    for (const auto& [from, to] : chords) {
        const SlabNode &a = nodes[std::size_t(from)], &b = nodes[std::size_t(to)];
        for (double row = std::ceil(std::min(a.v, b.v)); row < std::max(a.v, b.v); ++row)
            bounds[row].push_back(a.s + (row - a.v) / (b.v - a.v) * (b.s - a.s));
    }
    std::set<std::pair<double, double>> taken;
    for (const SlabNode& node : nodes) taken.emplace(node.s, node.v);
    for (auto& [row, passes] : bounds) {
        std::ranges::sort(passes);
        for (std::size_t i = 0; i + 1 < passes.size(); i += 2)
            for (double s = std::ceil(passes[i]); s <= passes[i + 1]; ++s)
                if (!taken.contains({s, row})) nodes.push_back({s, row});
    }
}

bool SlabArea::triangulate(std::vector<std::array<int, 3>>& triangles) const {
    std::map<double, std::vector<int>> lines;
    for (std::size_t i = 0; i < nodes.size(); ++i)
        if (nodes[i].s == std::floor(nodes[i].s)) lines[nodes[i].s].push_back(int(i));
    for (auto& [s, onLine] : lines) std::ranges::sort(onLine, {}, [&](int i) { return nodes[std::size_t(i)].v; });
    std::map<double, Slab> slabs;
    for (const auto& [from, to] : chords) {
        const SlabNode &a = nodes[std::size_t(from)], &b = nodes[std::size_t(to)];
        // Along a line, the area lies to the left of the way up and to the right of the way down.
        const bool isLine = a.s == b.s && a.s == std::floor(a.s);
        const double left = isLine ? a.s - (b.v > a.v ? 1 : 0) : std::floor((a.s + b.s) / 2);
        slabs.try_emplace(left, nodes, left, lines[left], lines[left + 1]).first->second.add(from, to);
    }
    return std::ranges::all_of(slabs, [&](auto& slab) { return slab.second.triangulate(rows, triangles); });
}

}  // namespace touchstone::step
