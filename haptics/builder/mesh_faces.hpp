#pragma once
// Faces as triples of vertices, and the edges between them. The stages of mesh repair share these types.
#include <algorithm>
#include <array>
#include <numeric>
#include <span>
#include <vector>

#include "haptics/builder/mesh_repair.hpp"

namespace touchstone {

/// Calls a heartbeat at every 1024th step of a loop.
class Pulse {
  public:
    explicit Pulse(const Heartbeat& heartbeat) : heartbeat_(heartbeat) {}
    void operator()() {
        if (++steps_ % 1024 == 0 && heartbeat_) heartbeat_();
    }

  private:
    const Heartbeat& heartbeat_;
    unsigned steps_ = 0;
};

/// Indices of three vertices, counter-clockwise seen from the front.
using Corners = std::array<int, 3>;

/// Whether the triangle has an area, so that it is not degenerate.
inline bool isUsable(const Triangle& t) {
    constexpr double kUsable = 1e-12;  // least ratio of the area to the squared longest side
    const double longest2 =
        std::max({(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(), (t[0] - t[2]).squaredNorm()});
    return areaOf(t) > kUsable * longest2;
}

/// The least of the three altitudes. Pre: the triangle has an area.
inline double altitudeOf(const Triangle& t) { return 2 * areaOf(t) / std::sqrt(longestEdge(t).length2); }

/// The numbers 0 to count - 1 in groups of equal key, in rising order inside a group. Time O(count + groups); 4 bytes
/// for each number and group.
class Grouped {
  public:
    Grouped() = default;
    template <class Key>
    Grouped(std::size_t count, std::size_t groups, Key&& key) : order_(count), start_(groups + 1, 0) {
        for (std::size_t i = 0; i < count; ++i) ++start_[key(static_cast<int>(i))];
        std::partial_sum(start_.begin(), start_.end(), start_.begin());
        for (std::size_t i = count; i-- > 0;) order_[--start_[key(static_cast<int>(i))]] = static_cast<int>(i);
    }
    int groups() const { return static_cast<int>(start_.size()) - 1; }
    std::span<const int> operator[](int group) const {
        return {order_.data() + start_[group], order_.data() + start_[group + 1]};
    }
    std::span<int> operator[](int group) { return {order_.data() + start_[group], order_.data() + start_[group + 1]}; }

  private:
    std::vector<int> order_, start_;
};

/// Disjoint sets with union and find. The smallest member names the set.
class DisjointSets {
  public:
    explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
    int find(int i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(int a, int b) {
        a = find(a);
        b = find(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }

  private:
    std::vector<int> parent_;
};

/// The edges of faces, each with its uses. A use is the number 3 * face + side, where side k runs from corner k to the
/// next one.
class EdgeTable {
  public:
    struct Edge {
        int low, high;              ///< vertices
        std::span<const int> uses;  ///< in rising order of the face
    };

    /// Pre: each face has three different corners. The faces must outlive the table.
    EdgeTable(const std::vector<Corners>& faces, std::size_t vertices, Pulse& pulse)
        : faces_(faces), byLow_(3 * faces.size(), vertices, [&](int use) { return std::min(from(use), to(use)); }) {
        for (int v = 0; v < byLow_.groups(); ++v) {
            pulse();
            const std::span<int> uses = byLow_[v];
            std::sort(uses.begin(), uses.end(), [&](int a, int b) {
                const int highA = high(a), highB = high(b);
                return highA < highB || (highA == highB && a < b);
            });
        }
    }

    int from(int use) const { return faces_[use / 3][use % 3]; }
    int to(int use) const { return faces_[use / 3][(use + 1 - use / 3 * 3) % 3]; }

    template <class Visit>
    void forEach(Visit&& visit) const {
        for (int v = 0; v < byLow_.groups(); ++v) {
            const std::span<const int> uses = byLow_[v];
            for (std::size_t i = 0, j = 0; i < uses.size(); i = j) {
                const int other = high(uses[i]);
                while (j < uses.size() && high(uses[j]) == other) ++j;
                visit(Edge{v, other, uses.subspan(i, j - i)});
            }
        }
    }

  private:
    int high(int use) const { return std::max(from(use), to(use)); }

    const std::vector<Corners>& faces_;
    Grouped byLow_;
};

}  // namespace touchstone
