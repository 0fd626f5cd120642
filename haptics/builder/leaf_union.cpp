#include "haptics/builder/leaf_union.hpp"

#include <algorithm>
#include <numbers>
#include <random>
#include <stdexcept>

#include "haptics/builder/triangle_bvh.hpp"

namespace touchstone {
namespace {

// Maximum number of cap tests for each leaf and patch: 60 times the 330 that 100,000 random leaves need.
constexpr std::int64_t kTestsEach = 20000;
// Number of leaves that are first cut coarsely, to estimate which share of the spheres is outside.
constexpr int kProbes = 512;

std::vector<Box> boxesOf(const std::vector<Leaf>& leaves) {
    std::vector<Box> boxes;
    for (const Leaf& s : leaves) {
        const Vec3 r = Vec3::Constant(std::max(0.0, s.radius));
        boxes.push_back({s.center - r, s.center + r});
    }
    return boxes;
}

double sphereArea(double radius) { return 4 * std::numbers::pi * radius * radius; }

/// Finds the patches of one sphere that lie in no other leaf. A patch is a spherical triangle, divided into four until
/// it is small.
class SphereCutter {
  public:
    SphereCutter(double area, std::size_t leaves, std::vector<OutsidePatch>& out)
        : area_(area), leaves_(static_cast<std::int64_t>(leaves)), out_(out) {}

    void begin(const Leaf& leaf) {
        leaf_ = &leaf;
        covered_ = leaf.radius < 0;
        caps_.clear();
    }

    /// Removes the part that lies in another leaf. If two leaves are equal, only the first has an outside.
    void remove(const Leaf& other, bool comesFirst) {
        const Vec3 off = other.center - leaf_->center;
        const double d = off.norm(), r = leaf_->radius, R = other.radius;
        if (d + r <= R) covered_ = covered_ || d > 0 || r < R || comesFirst;
        if (d + r <= R || d + R <= r || d >= r + R) return;
        const double cosine = std::clamp((r * r + d * d - R * R) / (2 * r * d), -1.0, 1.0);
        caps_.push_back({off / d, cosine, std::sqrt(1 - cosine * cosine)});
    }

    void cut(const Mat3& axes) {
        if (covered_) return;
        for (int octant = 0; octant < 8; ++octant) {
            const auto axis = [&](int a) -> Vec3 { return (octant >> a & 1 ? -1.0 : 1.0) * axes.col(a); };
            visit({axis(0), axis(1), axis(2)}, 0, caps_.size());
        }
    }

  private:
    struct Cap {
        Vec3 axis;
        double cosine, sine;  ///< of its half angle
    };

    void visit(const Triangle& corners, std::size_t first, std::size_t last) {
        const Vec3 middle = (corners[0] + corners[1] + corners[2]).normalized();
        double c = 1;  // cosine of the largest angle between the middle and a corner
        for (const Vec3& v : corners) c = std::min(c, middle.dot(v));
        const double s = std::sqrt(std::max(0.0, 1 - c * c));
        tests_ += static_cast<std::int64_t>(last - first);
        if (tests_ > kTestsEach * (kPatches + leaves_ + static_cast<std::int64_t>(out_.size())))
            throw std::invalid_argument(
                "The leaves nearly coincide, so their outside cannot be measured; thin them out.");
        caps_.resize(last);
        bool middleCovered = false;
        for (std::size_t i = first; i < last; ++i) {
            const Cap cap = caps_[i];
            const double along = middle.dot(cap.axis), both = cap.cosine * c, ends = cap.sine * s;
            if (cap.cosine <= c && along >= both + ends) return;    // the cap contains the patch
            if (cap.cosine >= -c && along < both - ends) continue;  // the cap is clear of the patch
            middleCovered = middleCovered || along >= cap.cosine;
            caps_.push_back(cap);
        }
        const double area = std::abs(solidAngleShare(Vec3::Zero(), corners)) * sphereArea(leaf_->radius);
        if (area <= area_) {
            if (!middleCovered) out_.push_back({leaf_->center + leaf_->radius * middle, middle, area});
            return;
        }
        const auto& [x, y, z] = corners;
        const Vec3 xy = (x + y).normalized(), yz = (y + z).normalized(), zx = (z + x).normalized();
        const std::size_t end = caps_.size();
        for (const Triangle& quarter :
             {Triangle{x, xy, zx}, Triangle{xy, y, yz}, Triangle{zx, yz, z}, Triangle{xy, yz, zx}})
            visit(quarter, last, end);
    }

    static constexpr std::int64_t kPatches = 10000;  // number of patches that the work limit allows from the start

    double area_;
    std::int64_t leaves_, tests_ = 0;
    std::vector<OutsidePatch>& out_;
    const Leaf* leaf_ = nullptr;
    bool covered_ = false;
    std::vector<Cap> caps_;  ///< stacked lists: caps of the sphere, then those of each patch of the recursion
};

}  // namespace

LeafUnion::LeafUnion(std::vector<Leaf> leaves) : leaves_(std::move(leaves)), tree_(boxesOf(leaves_)) {
    for (const int i : tree_.order()) {
        for (int a = 0; a < 3; ++a) at_[a].push_back(leaves_[i].center[a]);
        radius2_.push_back(leaves_[i].radius >= 0 ? leaves_[i].radius * leaves_[i].radius : -1);
    }
    for (int a = 0; a < 3; ++a) at_[a].resize(leaves_.size() + 4);
    radius2_.resize(leaves_.size() + 4, -1);
}

bool LeafUnion::contains(const Vec3& p) const {
    std::array<int, BoxTree::kStack> stack;
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree_.nodes()[stack[--top]];
        const Eigen::Array4d box = node.squaredDistance(p);
        for (int k = 0; k < 4; ++k) {
            if (!(box[k] <= 0)) continue;
            const int first = node.first[k];
            if (node.count[k] == 0) {
                stack[top++] = first;
                continue;
            }
            Eigen::Array4d d2 = Eigen::Array4d::Zero();
            for (int a = 0; a < 3; ++a) d2 += (Eigen::Map<const Eigen::Array4d>(at_[a].data() + first) - p[a]).square();
            for (int i = 0; i < node.count[k]; ++i)
                if (d2[i] <= radius2_[first + i]) return true;
        }
    }
    return false;
}

double LeafUnion::gap(const Vec3& p) const {
    double least = HUGE_VAL, bound2 = HUGE_VAL;
    visitNearest(tree_, p, bound2, [&](int i) {
        if (leaves_[i].radius < 0) return;
        least = std::min(least, std::max(0.0, (p - leaves_[i].center).norm() - leaves_[i].radius));
        bound2 = least * least;
    });
    return least;
}

std::int64_t LeafUnion::overlaps(std::int64_t atMost) const {
    std::int64_t count = 0;
    for (std::size_t i = 0; i < leaves_.size() && count <= atMost; ++i) {
        near(leaves_[i].center, std::max(0.0, leaves_[i].radius), [&](int) { ++count; });
        --count;  // itself
    }
    return count;
}

std::vector<OutsidePatch> LeafUnion::outside(double area, std::uint64_t seed, int stride,
                                             const std::function<void(double)>& beat) const {
    std::vector<OutsidePatch> out;
    SphereCutter cutter(area, leaves_.size(), out);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const auto n = static_cast<int>(leaves_.size());
    for (int i = 0; i < n; i += stride) {
        beat(static_cast<double>(i) / n);
        cutter.begin(leaves_[i]);
        near(leaves_[i].center, leaves_[i].radius, [&](int j) {
            if (j != i) cutter.remove(leaves_[j], j < i);
        });
        // A random orientation keeps the cuts from lining up with a regular body.
        const Eigen::Vector4d turn{normal(random), normal(random), normal(random), normal(random)};
        cutter.cut(Quat(turn.normalized()).toRotationMatrix());
    }
    return out;
}

std::vector<OutsidePatch> LeafUnion::outside(int count, std::uint64_t seed,
                                             const std::function<void(double)>& beat) const {
    constexpr double kProbing = 0.2;  // share of the progress that the probes take
    double spheres = 0, found = 0;
    for (const Leaf& s : leaves_) spheres += sphereArea(std::max(0.0, s.radius));
    const int stride = static_cast<int>(leaves_.size() / kProbes) + 1;
    for (const OutsidePatch& p : outside(spheres / stride / count, seed, stride, [&](double f) { beat(kProbing * f); }))
        found += p.area * stride;
    // The patches' areas lie between a quarter of the limit and the limit, with a mean of about half.
    return outside(2 * (found > 0 ? found : spheres) / count, seed, 1,
                   [&](double f) { beat(kProbing + (1 - kProbing) * f); });
}

}  // namespace touchstone
