#pragma once
// Triangle meshes with known volumes and sides, and distances by brute force, for the tests of the sphere-tree builder.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "haptics/builder/triangle_bvh.hpp"
#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/collision/sphere_tree.hpp"

namespace touchstone::test {

/// A box from `corner`, edges along the axes, twelve triangles, front outside.
inline TriangleMesh boxMesh(const Vec3& size, const Vec3& corner = Vec3::Zero()) {
    TriangleMesh m;
    for (int i = 0; i < 8; ++i)
        m.vertices.push_back(corner + Vec3((i & 1) * size.x(), (i >> 1 & 1) * size.y(), (i >> 2 & 1) * size.z()));
    const std::array<std::array<std::uint32_t, 4>, 6> sides{
        {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
    for (const auto& s : sides) {
        m.triangles.push_back({s[0], s[1], s[2]});
        m.triangles.push_back({s[0], s[2], s[3]});
    }
    return m;
}

/// A surface point(u, v) with u, v in [0, 1), periodic in both.
inline TriangleMesh closedGrid(std::uint32_t nu, std::uint32_t nv, const std::function<Vec3(double, double)>& point) {
    TriangleMesh m;
    for (std::uint32_t i = 0; i < nu; ++i)
        for (std::uint32_t j = 0; j < nv; ++j)
            m.vertices.push_back(point(static_cast<double>(i) / nu, static_cast<double>(j) / nv));
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return i % nu * nv + j % nv; };
    for (std::uint32_t i = 0; i < nu; ++i)
        for (std::uint32_t j = 0; j < nv; ++j) {
            m.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            m.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return m;
}

inline TriangleMesh torusMesh(double R, double r, std::uint32_t nu = 32, std::uint32_t nv = 16) {
    return closedGrid(nu, nv, [=](double u, double v) {
        const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
        return Vec3((R + r * std::cos(b)) * std::cos(a), (R + r * std::cos(b)) * std::sin(a), r * std::sin(b));
    });
}

/// A tube along a flat figure of eight, 2 size long, that intersects itself at a right angle.
inline TriangleMesh eightMesh(double size, double radius, std::uint32_t nu, std::uint32_t nv) {
    return closedGrid(nu, nv, [=](double u, double v) {
        const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
        const Vec3 along = Vec3(std::cos(a), std::cos(2 * a), 0).normalized(), aside(along.y(), -along.x(), 0);
        return Vec3(size * Vec3(std::sin(a), 0.5 * std::sin(2 * a), 0) + radius * std::cos(b) * aside +
                    Vec3(0, 0, radius * std::sin(b)));
    });
}

/// A solid of revolution about z, closed by a point at either end: profile(t), t in (0, 1), gives radius and height.
inline TriangleMesh lathe(std::uint32_t around, std::uint32_t along, double bottom, double top,
                          const std::function<Vec3(double, double)>& point) {
    TriangleMesh m;
    m.vertices = {Vec3(0, 0, bottom), Vec3(0, 0, top)};
    for (std::uint32_t k = 0; k < along; ++k)
        for (std::uint32_t i = 0; i < around; ++i)
            m.vertices.push_back(point(2 * std::numbers::pi * i / around, along > 1 ? double(k) / (along - 1) : 0.5));
    const auto at = [&](std::uint32_t k, std::uint32_t i) { return 2 + k * around + i % around; };
    for (std::uint32_t i = 0; i < around; ++i) {
        m.triangles.push_back({0, at(0, i + 1), at(0, i)});
        m.triangles.push_back({1, at(along - 1, i), at(along - 1, i + 1)});
        for (std::uint32_t k = 0; k + 1 < along; ++k) {
            m.triangles.push_back({at(k, i), at(k, i + 1), at(k + 1, i + 1)});
            m.triangles.push_back({at(k, i), at(k + 1, i + 1), at(k + 1, i)});
        }
    }
    return m;
}

inline TriangleMesh cylinderMesh(double radius, double height) {
    return lathe(24, 2, 0, height,
                 [=](double a, double t) { return Vec3(radius * std::cos(a), radius * std::sin(a), t * height); });
}

/// A bumpy ball of about the given radius.
inline TriangleMesh blobMesh(double radius, std::uint32_t around = 36, std::uint32_t along = 17) {
    const auto bumpy = [=](double a, double z) { return radius * (1 + 0.15 * std::sin(3 * a) * (1 - z * z)); };
    return lathe(around, along, -radius, radius, [=](double a, double t) {
        const double b = std::numbers::pi * (0.05 + 0.9 * t), z = -std::cos(b), r = bumpy(a, z);
        return Vec3(r * std::sin(b) * std::cos(a), r * std::sin(b) * std::sin(a), radius * z);
    });
}

inline TriangleMesh sphereMesh(double radius, std::uint32_t around = 24, std::uint32_t along = 11) {
    return lathe(around, along, -radius, radius, [=](double a, double t) {
        const double b = std::numbers::pi * (t * (along - 1) + 1) / (along + 1);
        return Vec3(radius * Vec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), -std::cos(b)));
    });
}

/// A flat square [0, size]^2 in z = 0 of n x n cells, front up.
inline TriangleMesh squareMesh(double size, std::uint32_t n) {
    TriangleMesh m;
    for (std::uint32_t i = 0; i <= n; ++i)
        for (std::uint32_t j = 0; j <= n; ++j) m.vertices.push_back(Vec3(i * size / n, j * size / n, 0));
    const auto at = [&](std::uint32_t i, std::uint32_t j) { return i * (n + 1) + j; };
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
            m.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            m.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    return m;
}

inline TriangleMesh flipped(TriangleMesh m) {
    for (auto& t : m.triangles) std::swap(t[1], t[2]);
    return m;
}

inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
    const auto offset = static_cast<std::uint32_t>(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (auto t : b.triangles) a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    return a;
}

inline TriangleMesh moved(TriangleMesh m, double scale, const Vec3& by) {
    for (Vec3& v : m.vertices) v = scale * v + by;
    return m;
}

/// Triangles that share no vertex, as in STL files.
inline TriangleMesh unwelded(const TriangleMesh& m) {
    TriangleMesh out;
    for (const auto& t : m.triangles) {
        const auto n = static_cast<std::uint32_t>(out.vertices.size());
        for (std::uint32_t i : t) out.vertices.push_back(m.vertices[i]);
        out.triangles.push_back({n, n + 1, n + 2});
    }
    return out;
}

/// A cube [0, size]^3 whose side k has cells[k]^2 cells. Sides share no vertex, and unlike ones meet in T-junctions.
inline TriangleMesh patchedCube(double size, const std::array<std::uint32_t, 6>& cells) {
    TriangleMesh m;
    for (std::size_t k = 0; k < 6; ++k) {
        TriangleMesh side = squareMesh(size, cells[k]);
        for (Vec3& v : side.vertices) {
            if (k % 2 == 1) v.z() = size;
            v = Vec3(v[k / 2 % 3], v[(k / 2 + 1) % 3], v[(k / 2 + 2) % 3]);
        }
        m = joined(std::move(m), k % 2 == 1 ? side : flipped(side));
    }
    return m;
}

/// n^3 small closed bodies, some of which intersect.
inline TriangleMesh heapMesh(int n, double pitch) {
    TriangleMesh m;
    const TriangleMesh bolt = lathe(6, 2, 0, 1, [](double a, double t) { return Vec3(std::cos(a), std::sin(a), t); });
    for (int i = 0; i < n * n * n; ++i) {
        const Vec3 at(i % n, i / n % n + 0.05 * (i % 7), i / (n * n) + 0.03 * (i % 5));
        m = joined(std::move(m), moved(bolt, 1, pitch * at));
    }
    return m;
}

inline TriangleMesh soupMesh(std::uint32_t count, double size, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto point = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
    TriangleMesh m;
    for (std::uint32_t i = 0; i < count; ++i) {
        const Vec3 at = 10 * point();
        for (int k = 0; k < 3; ++k) m.vertices.push_back(at + size * point());
        m.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
    return m;
}

inline std::vector<Triangle> trianglesOf(const TriangleMesh& m) {
    std::vector<Triangle> out;
    for (const auto& t : m.triangles) out.push_back({m.vertices[t[0]], m.vertices[t[1]], m.vertices[t[2]]});
    return out;
}

/// Maps two numbers in [0, 1] to a point of a triangle, uniform in area.
inline Vec3 pointOn(const Triangle& t, double u, double v) {
    const double s = std::sqrt(u);
    return (1 - s) * t[0] + s * (1 - v) * t[1] + s * v * t[2];
}

/// Distance to a triangle: the minimum over a plane and three segments, independent of the code under test.
inline double bruteDistance(const Vec3& p, const Triangle& t) {
    double best = HUGE_VAL;
    for (int k = 0; k < 3; ++k) {
        const Vec3 a = t[k], d = t[(k + 1) % 3] - a;
        const double s = d.squaredNorm() > 0 ? std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
        best = std::min(best, (a + s * d - p).norm());
    }
    const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]);
    if (n.norm() > 1e-10 * (t[1] - t[0]).squaredNorm()) {
        bool within = true;
        for (int k = 0; k < 3; ++k) within = within && n.cross(t[(k + 1) % 3] - t[k]).dot(p - t[k]) >= 0;
        if (within) best = std::min(best, std::abs(n.normalized().dot(p - t[0])));
    }
    return best;
}

inline double bruteDistance(const Vec3& p, const std::vector<Triangle>& triangles) {
    double best = HUGE_VAL;
    for (const Triangle& t : triangles) best = std::min(best, bruteDistance(p, t));
    return best;
}

inline double bruteWinding(const Vec3& p, const std::vector<Triangle>& triangles) {
    double sum = 0;
    for (const Triangle& t : triangles) sum += solidAngleShare(p, t);
    return sum;
}

inline std::vector<Sphere> leavesOf(const SphereTree& tree) {
    std::vector<Sphere> out;
    for (int i = 0; i < tree.leafCount(); ++i) out.push_back(tree.leaf(i));
    return out;
}

/// Number of random points of the surface that lie in no leaf.
inline int barePoints(const TriangleMesh& mesh, const SphereTree& tree, int samples, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform;
    const auto triangles = trianglesOf(mesh);
    const auto leaves = leavesOf(tree);
    std::vector<double> areas;
    for (const Triangle& t : triangles) areas.push_back((t[1] - t[0]).cross(t[2] - t[0]).norm());
    std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
    int bare = 0;
    for (int i = 0; i < samples; ++i) {
        const Vec3 p = pointOn(triangles[pick(random)], uniform(random), uniform(random));
        // The point itself is rounded in double precision.
        bare += std::none_of(leaves.begin(), leaves.end(), [&](const Sphere& s) {
            return (p - s.center()).norm() <= s.r * (1 + 1e-14) + 1e-14 * p.norm();
        });
    }
    return bare;
}

}  // namespace touchstone::test
