#include "haptics/builder/bare_surface.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone {
namespace {

constexpr double kPoint = 0x1p-40;  // pieces that no leaf holds get so small only about points where leaves just meet
constexpr int kDeepest = 120;       // halvings that any triangle needs to become that small
constexpr double kGapShare = 1e-3;  // to which the largest gap is sought,
constexpr double kGapFine = 0.25;   // or to this share of the finest length: many small gaps are to take no longer

double areaOf(const Triangle& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm(); }

/// Its longest side runs from corner k to corner k + 1.
int longestSide(const Triangle& t, double& length) {
    const std::array<double, 3> side2{(t[1] - t[0]).squaredNorm(), (t[2] - t[1]).squaredNorm(),
                                      (t[0] - t[2]).squaredNorm()};
    const auto k = std::max_element(side2.begin(), side2.end()) - side2.begin();
    length = std::sqrt(side2[static_cast<std::size_t>(k)]);
    return static_cast<int>(k);
}

std::array<Triangle, 2> halves(const Triangle& t, int side) {
    const Vec3 &a = t[side], &b = t[(side + 1) % 3], &c = t[(side + 2) % 3];
    const Vec3 middle = 0.5 * (a + b);
    return {Triangle{a, middle, c}, Triangle{middle, b, c}};
}

class Finder {
  public:
    Finder(const LeafUnion& leaves, double fine, bool first) : leaves_(leaves), fine_(fine), first_(first) {}

    BareSurface found;

    void visit(const Triangle& t) {
        // Neighbors in the list tend to be neighbors in space.
        if (last_ >= 0 && holds(last_, t)) return;
        const Vec3 middle = (t[0] + t[1] + t[2]) / 3;
        near_.clear();
        bool held = false;
        leaves_.near(middle, reachOf(t, middle), [&](int i) {
            if (held) return;
            near_.push_back(i);
            if (!holds(i, t)) return;
            held = true;
            last_ = i;
        });
        if (!held) visitPiece(t, 0, near_.size(), 0);
    }
    bool done() const { return first_ && !found.none; }

  private:
    static double reachOf(const Triangle& t, const Vec3& middle) {
        return std::sqrt(std::max(
                   {(t[0] - middle).squaredNorm(), (t[1] - middle).squaredNorm(), (t[2] - middle).squaredNorm()})) *
               (1 + 1e-14);
    }
    bool holds(int leaf, const Vec3& p) const {
        const Leaf& s = leaves_.leaves()[leaf];
        return s.radius >= 0 && (p - s.center).squaredNorm() <= s.radius * s.radius;
    }
    bool holds(int leaf, const Triangle& t) const {
        return holds(leaf, t[0]) && holds(leaf, t[1]) && holds(leaf, t[2]);
    }

    void visitPiece(const Triangle& t, std::size_t first, std::size_t last, int depth) {
        if (done()) return;
        // Of the leaves listed for the parent those that may touch this piece, and the corners that they hold.
        const Vec3 middle = (t[0] + t[1] + t[2]) / 3;
        const double reach = reachOf(t, middle);
        near_.resize(last);
        std::array<bool, 3> covered{};
        for (std::size_t i = first; i < last; ++i) {
            const int leaf = near_[i];
            const Leaf& s = leaves_.leaves()[leaf];
            const double r = s.radius + reach;
            if ((s.center - middle).squaredNorm() > r * r) continue;
            const std::array<bool, 3> in{holds(leaf, t[0]), holds(leaf, t[1]), holds(leaf, t[2])};
            if (in[0] && in[1] && in[2]) {
                last_ = leaf;
                return;
            }
            for (int k = 0; k < 3; ++k) covered[k] = covered[k] || in[k];
            near_.push_back(leaf);
        }
        double length = 0;
        const int side = longestSide(t, length);
        const auto bareCorners = std::count(covered.begin(), covered.end(), false);
        const bool clear = near_.size() == last;
        const bool decided = clear || (bareCorners > 0 && (first_ || length <= fine_));
        if (decided || length <= kPoint || depth >= kDeepest) {
            const bool whole = clear || bareCorners == 0;  // the second: as good as bare
            found.none = false;
            found.area += areaOf(t) * (whole ? 1.0 : static_cast<double>(bareCorners) / 3);
            if (first_) {
                const auto bare = std::find(covered.begin(), covered.end(), false) - covered.begin();
                found.where = t[static_cast<std::size_t>(bare % 3)];
            } else if (nearestListed(middle, first) + reach > found.largestGap + close()) {
                seekGap(t, 0);
            }
            return;
        }
        const std::size_t end = near_.size();
        for (const Triangle& half : halves(t, side)) visitPiece(half, last, end, depth + 1);
    }

    /// How near to the largest gap counts as no larger.
    double close() const { return std::max(kGapShare * found.largestGap, kGapFine * fine_); }

    /// Distance of p from the nearest leaf that is listed behind `first`: at least its gap.
    double nearestListed(const Vec3& p, std::size_t first) const {
        double least = HUGE_VAL;
        for (std::size_t i = first; i < near_.size(); ++i) {
            const Leaf& s = leaves_.leaves()[near_[i]];
            least = std::min(least, (p - s.center).norm() - s.radius);
        }
        return least;
    }

    // The gap changes no faster than the point moves, so a piece that cannot beat the largest so far is left.
    void seekGap(const Triangle& t, int depth) {
        const Vec3 middle = (t[0] + t[1] + t[2]) / 3;
        const double gap = leaves_.gap(middle);
        if (gap > found.largestGap) {
            found.largestGap = gap;
            found.where = middle;
        }
        if (gap + reachOf(t, middle) <= found.largestGap + close() || depth >= kDeepest) return;
        double length = 0;
        const int side = longestSide(t, length);
        for (const Triangle& half : halves(t, side)) seekGap(half, depth + 1);
    }

    const LeafUnion& leaves_;
    double fine_;
    bool first_;
    int last_ = -1;          ///< the leaf that held the piece before
    std::vector<int> near_;  ///< leaves near the triangle; behind them, near the pieces on the way down
};

}  // namespace

BareSurface findBareSurface(std::span<const Triangle> surface, const LeafUnion& leaves, double fine, bool first,
                            const std::function<void(double)>& beat) {
    Finder finder(leaves, fine, first);
    for (std::size_t i = 0; i < surface.size() && !finder.done(); ++i) {
        if (i % 256 == 0) beat(static_cast<double>(i) / static_cast<double>(surface.size()));
        finder.visit(surface[i]);
    }
    return finder.found;
}

}  // namespace touchstone
