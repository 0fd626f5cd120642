#include "haptics/builder/hollow.hpp"

#include <algorithm>
#include <cmath>
#include <queue>

namespace touchstone {
namespace {

constexpr double kCloseEnough = 0.8;    // a ball is placed where its radius is at least this share of the cell's bound
constexpr double kSmallestCell = 1e-4;  // half the side of the smallest cell; the body's diagonal is below 2

void addTo(Box& box, const SolidSphere& s) {
    box.add(s.center - Vec3::Constant(s.radius));
    box.add(s.center + Vec3::Constant(s.radius));
}

/// The distance to the nearest of a set of spheres.
class SphereField {
  public:
    explicit SphereField(std::span<const SolidSphere> spheres) : tree_(boxesOf(spheres)) {
        for (int i : tree_.order()) spheres_.push_back(spheres[i]);
    }

    /// The least |p - c| - r over all spheres. The search ends early at any value that is not above `enough`.
    double distance(const Vec3& p, double enough) const {
        struct Waiting {
            double squaredDistance;
            int node;
        };
        std::array<Waiting, BoxTree::kStack> stack;
        int top = 0;
        double best = HUGE_VAL;
        stack[top++] = {0, 0};
        while (top > 0) {
            const Waiting w = stack[--top];
            if (best > 0 ? w.squaredDistance >= best * best : w.squaredDistance > 0) continue;
            const BoxTree::Node& node = tree_.nodes()[w.node];
            const Eigen::Array4d d = node.squaredDistance(p);
            for (int k = 0; k < 4; ++k) {
                if (node.count[k] < 0 || (best > 0 ? d[k] >= best * best : d[k] > 0)) continue;
                if (node.count[k] == 0) stack[top++] = {d[k], node.first[k]};
                for (int i = 0; i < node.count[k]; ++i) {
                    const SolidSphere& s = spheres_[node.first[k] + i];
                    best = std::min(best, (p - s.center).norm() - s.radius);
                }
                if (best <= enough) return best;
            }
        }
        return best;
    }

  private:
    static std::vector<Box> boxesOf(std::span<const SolidSphere> spheres) {
        std::vector<Box> boxes;
        for (const SolidSphere& s : spheres) {
            boxes.emplace_back();
            addTo(boxes.back(), s);
        }
        return boxes;
    }

    std::vector<SolidSphere> spheres_;
    BoxTree tree_;
};

/// A cube that may contain the center of a hollow. No such hollow has a radius larger than `bound`.
struct Cell {
    double bound;
    double radius;  ///< radius of the hollow at the cube's center, or an upper bound on it
    Vec3 center;
    double half;       ///< half the side of the cube
    std::size_t seen;  ///< number of balls that had been placed when it was measured
    bool operator<(const Cell& o) const { return bound < o.bound; }
};

}  // namespace

Filling fillHollows(const SolidDepth& solid, std::span<const SolidSphere> leaves, double enough, std::size_t maxBalls,
                    const Workers& workers) {
    Filling out;
    if (leaves.empty() || !solid.hasWalls()) return out;
    const SphereField field(leaves);
    std::vector<SolidSphere> placed;
    const auto diagonal = [](double half) { return std::sqrt(3.0) * half; };
    const auto measure = [&](const Vec3& center, double half) -> Cell {
        const double reach = diagonal(half);
        double radius = field.distance(center, enough - reach);
        for (const SolidSphere& s : placed) radius = std::min(radius, (center - s.center).norm() - s.radius);
        if (radius + reach > enough) radius = std::min(radius, solid.depth(center));
        return {radius + reach, radius, center, half, placed.size()};
    };

    Box box;
    for (const SolidSphere& s : leaves) addTo(box, s);
    std::priority_queue<Cell> cells;
    const auto keep = [&](const Cell& cell) {
        if (cell.bound > enough) cells.push(cell);
    };
    keep(measure(box.center(), 0.5 * (box.hi - box.lo).maxCoeff()));
    out.hollow = 0;
    for (int beat = 1; !cells.empty(); ++beat) {
        if (beat % 256 == 0) workers.beat();
        Cell cell = cells.top();
        cells.pop();
        if (cell.seen < placed.size()) {
            for (std::size_t i = cell.seen; i < placed.size(); ++i)
                cell.radius = std::min(cell.radius, (cell.center - placed[i].center).norm() - placed[i].radius);
            cell.bound = std::min(cell.bound, cell.radius + diagonal(cell.half));
            cell.seen = placed.size();
            keep(cell);
            continue;
        }
        if (cell.radius >= kCloseEnough * cell.bound && cell.radius > 0) {
            if (placed.size() == maxBalls) {
                out.hollow = cell.bound;
                return out;
            }
            placed.push_back({cell.center, solid.depth(cell.center)});
            out.centers.push_back(cell.center);
            keep(cell);
            continue;
        }
        if (cell.half < kSmallestCell) {
            out.hollow = std::max(out.hollow, cell.bound);  // the cell is not divided further
            continue;
        }
        const double half = 0.5 * cell.half;
        for (int corner = 0; corner < 8; ++corner) {
            const Vec3 to((corner & 1) ? half : -half, (corner & 2) ? half : -half, (corner & 4) ? half : -half);
            Cell child = measure(cell.center + to, half);
            child.bound = std::min(child.bound, cell.bound);
            keep(child);
        }
    }
    out.hollow = std::max(out.hollow, enough);
    return out;
}

}  // namespace touchstone
