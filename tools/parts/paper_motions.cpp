#include "tools/parts/paper_motions.hpp"

#include <bit>
#include <cmath>
#include <numbers>

#include "haptics/collision/leaf_gaps.hpp"
#include "haptics/collision/tree_walk.hpp"
#include "haptics/sandbox/scene/units.hpp"
#include "tools/parts/angles.hpp"
#include "tools/parts/demonstration.hpp"
#include "tools/parts/scene_kit.hpp"

namespace touchstone::app {
namespace {

/// The number of intersecting pairs of leaves, with the obstacle at the origin.
class PairCounter {
  public:
    explicit PairCounter(const SphereTree& tree) : tree_(tree), walk_(tree, tree) {}

    int at(const ToolPose& pose) {
        const glm::dvec3& p = pose.position;
        const Pose X{Vec3(p.x, p.y, p.z), sandbox::toEigen(pose.rotation)};
        int pairs = 0;
        walk_.run({X, 0}, [&](const PairEntry* entries, int count) {
            for (int i = 0; i < count; ++i) {
                const Sphere leaf = tree_.leaf(entries[i].tool);
                const LeafGaps gaps = leafGaps(X * leaf.center(), leaf.r, tree_, entries[i].obstacle);
                pairs += std::popcount(simd::lessEqual(gaps.gap, simd::splat(0.0)) & 0xffu);
            }
        });
        return pairs;
    }

  private:
    const SphereTree& tree_;
    TreeWalk walk_;
};

/// A path over the surface at such depths that the pair count goes from `fewest` to `most` and back three times.
Demonstration bunnyMotion(const SphereTree& tree, double fewest, double most) {
    constexpr double kSlide = 4, kBegin = 0.4;  // s; the first pairs intersect within kBegin
    PairCounter counter(tree);
    const auto on = [&](double t, double x) {
        const double turn = kTau * t / kSlide;
        return ToolPose{{x, 3 * std::sin(turn), 8 * std::sin(2 * turn)},
                        about({1, 0, 0}, 0.15 * std::sin(turn)) * about({0, 0, 1}, 0.05 * std::sin(2 * turn))};
    };
    const auto at = [&](double t) {
        const double wave = fewest + (most - fewest) * (0.5 - 0.5 * std::cos(3 * kTau * t / kSlide));
        const double ends = std::min({1.0, t / kBegin, (kSlide - t) / kBegin});
        double shallow = 130 - travelToContact(tree, tree, on(t, 130), {-1, 0, 0}), deep = shallow - 8;
        for (int i = 0; i < 24; ++i) {
            const double x = (shallow + deep) / 2;
            (counter.at(on(t, x)) < ends * wave ? shallow : deep) = x;
        }
        return on(t, shallow);
    };
    ToolPose away = at(0);
    away.position.x += 8;
    Demonstration motion(away);
    motion.moveTo(at(0), 0.25);
    motion.follow(kSlide, at);
    motion.moveTo(away, 0.25);
    motion.hold(0.1);
    return motion;
}

}  // namespace

void addBunnyFigures(engine::Scene& scene, engine::Entity tool, const SphereTree& tree) {
    scene.animations.push_back(bunnyMotion(tree, 50, 200).animation(tool, "figure-5"));
    scene.animations.push_back(bunnyMotion(tree, 200, 1000).animation(tool, "figure-5-deeper"));
}

void addSplineFigure(engine::Scene& scene, engine::Entity tool, const SplineFit& fit) {
    const double misaligned = std::numbers::pi / fit.keys;
    const auto at = [&](double depth, double angle, double aside = 0, double tilt = 0) {
        return ToolPose{{aside, fit.length / 2 - depth, 0}, about({0, 0, 1}, tilt) * about({0, 1, 0}, angle)};
    };
    const double pressed = 0.5, bottom = fit.depth - 1, seconds = (bottom - pressed) / 15;
    Demonstration motion(at(-5, misaligned));
    motion.hold(0.2);
    motion.moveTo(at(pressed, misaligned), 0.5);
    motion.hold(0.2);
    motion.moveTo(at(pressed, 0), 1.5);
    motion.hold(0.2);
    motion.follow(seconds, [&](double t) {
        const double way = t / seconds, depth = pressed + (bottom - pressed) * way;
        return at(depth, 0, 0.8 * fit.clearance * std::sin(2 * kTau * way), 0.003 * std::sin(3 * kTau * way));
    });
    motion.hold(0.3);
    scene.animations.push_back(motion.animation(tool, "figure-7"));
}

}  // namespace touchstone::app
