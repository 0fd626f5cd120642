#include "haptics/builder/bare_surface.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone {
namespace {

// Edge length at which halving ends, lengths being of the order of one. A piece that no leaf contains becomes this
// small only around a point where leaves just touch.
constexpr double kMinLength = 0x1p-40;
// Maximum number of halvings of one triangle: enough to bring any triangle down to kMinLength.
constexpr int kMaxHalvings = 120;
// Accuracy of the largest gap: relative to the gap, or as a share of the length `fine`. The coarser of the two applies,
// so that many small gaps do not cost more time.
constexpr double kGapRelativeError = 1e-3;
constexpr double kGapFineShare = 0.25;

/// Returns k, where the longest side runs from corner k to corner k + 1. `length` becomes the length of that side.
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
    Finder(const LeafUnion& leaves, double fine, bool firstOnly)
        : leaves_(leaves), fine_(fine), firstOnly_(firstOnly) {}

    BareSurface found;

    void visit(const Triangle& t) {
        // Triangles that follow each other in the list are usually neighbors in space.
        if (lastLeaf_ >= 0 && contains(lastLeaf_, t)) return;
        const Vec3 middle = (t[0] + t[1] + t[2]) / 3;
        nearby_.clear();
        bool contained = false;
        leaves_.near(middle, reachOf(t, middle), [&](int i) {
            if (contained) return;
            nearby_.push_back(i);
            if (!contains(i, t)) return;
            contained = true;
            lastLeaf_ = i;
        });
        if (!contained) visitPiece(t, 0, nearby_.size(), 0);
    }
    bool done() const { return firstOnly_ && !found.covered; }

  private:
    static double reachOf(const Triangle& t, const Vec3& middle) {
        return std::sqrt(std::max(
                   {(t[0] - middle).squaredNorm(), (t[1] - middle).squaredNorm(), (t[2] - middle).squaredNorm()})) *
               (1 + 1e-14);
    }
    bool contains(int leaf, const Vec3& p) const {
        const Leaf& s = leaves_.leaves()[leaf];
        return s.radius >= 0 && (p - s.center).squaredNorm() <= s.radius * s.radius;
    }
    bool contains(int leaf, const Triangle& t) const {
        return contains(leaf, t[0]) && contains(leaf, t[1]) && contains(leaf, t[2]);
    }

    void visitPiece(const Triangle& t, std::size_t first, std::size_t last, int depth) {
        if (done()) return;
        // Keep the leaves of the parent's list that may touch this piece, and find the corners that they contain.
        const Vec3 middle = (t[0] + t[1] + t[2]) / 3;
        const double reach = reachOf(t, middle);
        nearby_.resize(last);
        std::array<bool, 3> cornerCovered{};
        for (std::size_t i = first; i < last; ++i) {
            const int leaf = nearby_[i];
            const Leaf& s = leaves_.leaves()[leaf];
            const double r = s.radius + reach;
            if ((s.center - middle).squaredNorm() > r * r) continue;
            const std::array<bool, 3> in{contains(leaf, t[0]), contains(leaf, t[1]), contains(leaf, t[2])};
            if (in[0] && in[1] && in[2]) {
                lastLeaf_ = leaf;
                return;
            }
            for (int k = 0; k < 3; ++k) cornerCovered[k] = cornerCovered[k] || in[k];
            nearby_.push_back(leaf);
        }
        double length = 0;
        const int side = longestSide(t, length);
        const auto bareCorners = std::count(cornerCovered.begin(), cornerCovered.end(), false);
        const bool clear = nearby_.size() == last;
        const bool decided = clear || (bareCorners > 0 && (firstOnly_ || length <= fine_));
        if (decided || length <= kMinLength || depth >= kMaxHalvings) {
            // A piece without a bare corner is too small to halve: it counts as bare, to be safe.
            const bool whole = clear || bareCorners == 0;
            found.covered = false;
            found.area += areaOf(t) * (whole ? 1.0 : static_cast<double>(bareCorners) / 3);
            if (firstOnly_) {
                const auto bare = std::find(cornerCovered.begin(), cornerCovered.end(), false) - cornerCovered.begin();
                found.where = t[static_cast<std::size_t>(bare % 3)];
            } else if (nearestListed(middle, first) + reach > found.largestGap + gapTolerance()) {
                seekGap(t, 0);
            }
            return;
        }
        const std::size_t end = nearby_.size();
        for (const Triangle& half : halves(t, side)) visitPiece(half, last, end, depth + 1);
    }

    /// A gap that exceeds the largest one by no more than this is not searched for.
    double gapTolerance() const { return std::max(kGapRelativeError * found.largestGap, kGapFineShare * fine_); }

    /// Distance of p from the nearest leaf of the list from `first` on. It is an upper bound on the gap at p.
    double nearestListed(const Vec3& p, std::size_t first) const {
        double least = HUGE_VAL;
        for (std::size_t i = first; i < nearby_.size(); ++i) {
            const Leaf& s = leaves_.leaves()[nearby_[i]];
            least = std::min(least, (p - s.center).norm() - s.radius);
        }
        return least;
    }

    // The gap is 1-Lipschitz in the point, so a piece whose bound does not exceed the largest gap so far is skipped.
    void seekGap(const Triangle& t, int depth) {
        const Vec3 middle = (t[0] + t[1] + t[2]) / 3;
        const double gap = leaves_.gap(middle);
        if (gap > found.largestGap) {
            found.largestGap = gap;
            found.where = middle;
        }
        if (gap + reachOf(t, middle) <= found.largestGap + gapTolerance() || depth >= kMaxHalvings) return;
        double length = 0;
        const int side = longestSide(t, length);
        for (const Triangle& half : halves(t, side)) seekGap(half, depth + 1);
    }

    const LeafUnion& leaves_;
    double fine_;
    bool firstOnly_;
    int lastLeaf_ = -1;        ///< the leaf that contained the previous piece
    std::vector<int> nearby_;  ///< stacked lists: leaves near the triangle, then those near each piece of the recursion
};

}  // namespace

BareSurface findBareSurface(std::span<const Triangle> surface, const LeafUnion& leaves, double fine, bool firstOnly,
                            const std::function<void(double)>& beat) {
    Finder finder(leaves, fine, firstOnly);
    for (std::size_t i = 0; i < surface.size() && !finder.done(); ++i) {
        if (i % 256 == 0) beat(static_cast<double>(i) / static_cast<double>(surface.size()));
        finder.visit(surface[i]);
    }
    return finder.found;
}

}  // namespace touchstone
