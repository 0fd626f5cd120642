#pragma once
// Bodies of spheres with known answers.
#include <cmath>
#include <memory>
#include <random>

#include "haptics/collision/sphere_tree.hpp"
#include "haptics/loop/world.hpp"

namespace touchstone::test {

inline std::shared_ptr<const SphereTree> treeOf(std::vector<Sphere> spheres) {
    return std::make_shared<const SphereTree>(makeSphereTree(std::move(spheres)));
}

/// One sphere at the origin.
inline std::shared_ptr<const SphereTree> ball(float radius) { return treeOf({{0, 0, 0, radius}}); }

/// A square slab in the xz plane whose top and bottom ripple between y = ±radius: spheres on a grid, n x n, `pitch`
/// apart.
inline std::shared_ptr<const SphereTree> slab(int n, float pitch, float radius) {
    std::vector<Sphere> spheres;
    for (int i = 0; i < n; ++i)
        for (int k = 0; k < n; ++k)
            spheres.push_back(
                {(float(i) - float(n - 1) / 2) * pitch, 0, (float(k) - float(n - 1) / 2) * pitch, radius});
    return treeOf(std::move(spheres));
}

/// A bumpy closed body of about `size` mm radius with a surface of random spheres.
inline std::shared_ptr<const SphereTree> blob(int leaves, float size, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<Sphere> spheres;
    for (int i = 0; i < leaves; ++i) {
        const Vec3 d = Vec3(normal(random), normal(random), normal(random)).normalized();
        const Vec3 p = d * (size * (0.8 + 0.15 * std::sin(4 * d.x() + 1) * std::cos(3 * d.z())));
        spheres.push_back({float(p.x()), float(p.y()), float(p.z()), 0.12f * size});
    }
    return treeOf(std::move(spheres));
}

inline Pose at(double x, double y, double z, const Vec3& rotation = Vec3::Zero()) {
    return {Vec3(x, y, z), expRotation(rotation)};
}

/// A part that is touched by these spheres.
inline Part bySpheres(std::shared_ptr<const SphereTree> tree) { return {.spheres = std::move(tree)}; }

inline World worldOf(std::shared_ptr<const SphereTree> tool, std::shared_ptr<const SphereTree> obstacle,
                     const Pose& start) {
    return {bySpheres(std::move(tool)), {{"obstacle", bySpheres(std::move(obstacle))}}, start};
}

/// Gives all parts this material, so that every pair has this friction.
inline void rub(World& world, const Friction& friction) {
    world.tool.material = Material{friction};
    for (Obstacle& obstacle : world.obstacles) obstacle.part.material = Material{friction};
}

}  // namespace touchstone::test
