#pragma once
// Generated parts with the finest features that files of parts have: fillets of micrometers, faces 10,000 times longer
// than wide, slivers as thin as the rounding of the file.
#include "tests/support/random.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::test {

/// A polygon in the plane, counter-clockwise.
using Outline = std::vector<Eigen::Vector2d>;

/// Appends the corner between two neighbors, rounded by an arc of this many pieces. Sharp without pieces.
inline void addFillet(Outline& out, const Eigen::Vector2d& before, const Eigen::Vector2d& corner,
                      const Eigen::Vector2d& after, double radius, int pieces) {
    const Eigen::Vector2d in = (corner - before).normalized(), on = (after - corner).normalized();
    const double turn = std::atan2(in.x() * on.y() - in.y() * on.x(), in.dot(on));
    if (pieces == 0) return out.push_back(corner);
    const Eigen::Vector2d start = corner - radius * std::tan(std::abs(turn) / 2) * in;
    const Eigen::Vector2d center = start + std::copysign(radius, turn) * Eigen::Vector2d(-in.y(), in.x());
    for (int i = 0; i <= pieces; ++i) out.push_back(center + Eigen::Rotation2Dd(turn * i / pieces) * (start - center));
}

/// The polygon with all corners rounded.
inline Outline filleted(const Outline& sharp, double radius, int pieces) {
    Outline out;
    const std::size_t n = sharp.size();
    for (std::size_t i = 0; i < n; ++i)
        addFillet(out, sharp[(i + n - 1) % n], sharp[i], sharp[(i + 1) % n], radius, pieces);
    return out;
}

/// Straight teeth around a hub, with fillets at tips and roots.
inline Outline gearOutline(int teeth, double root, double tip, double fillet, int pieces) {
    Outline sharp;
    for (int k = 0; k < teeth; ++k)
        for (const auto& [at, r] : {std::pair{0.0, root}, {0.3, root}, {0.42, tip}, {0.78, tip}, {0.9, root}}) {
            if (at == 0) continue;
            const double a = 2 * std::numbers::pi * (k + at) / teeth;
            sharp.push_back(r * Eigen::Vector2d(std::cos(a), std::sin(a)));
        }
    return filleted(sharp, fillet, pieces);
}

/// A prism over an outline that is seen whole from the origin, from -height/2 to height/2. Its ends are fans.
inline TriangleMesh extruded(const Outline& outline, double height) {
    TriangleMesh m;
    const auto n = std::uint32_t(outline.size());
    m.vertices = {Vec3(0, 0, -height / 2), Vec3(0, 0, height / 2)};
    for (const Eigen::Vector2d& p : outline)
        for (const double z : {-height / 2, height / 2}) m.vertices.emplace_back(p.x(), p.y(), z);
    for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % n);
        m.triangles.insert(m.triangles.end(), {{a, b, b + 1}, {a, b + 1, a + 1}, {0, b, a}, {1, a + 1, b + 1}});
    }
    return m;
}

/// A bolt's thread about z with fillets at crests and roots: rows of points that rise along the helix.
inline TriangleMesh threadMesh(double root, double crest, double pitch, int turns, std::uint32_t around, double fillet,
                               int pieces) {
    // (height, -radius) over a pitch: counter-clockwise turns are roots.
    const Outline sharp{{0, -root}, {0.2 * pitch, -root}, {0.5 * pitch, -crest}, {0.7 * pitch, -crest}};
    Outline row;
    const Eigen::Vector2d shift(pitch, 0);
    for (std::size_t i = 0; i < 4; ++i)
        addFillet(row, i > 0 ? sharp[i - 1] : sharp[3] - shift, sharp[i], i < 3 ? sharp[i + 1] : sharp[0] + shift,
                  fillet, pieces);
    const auto perPitch = std::uint32_t(row.size()), rows = perPitch * std::uint32_t(turns) + 1;
    TriangleMesh m;
    for (std::uint32_t k = 0; k < rows + perPitch; ++k)
        for (std::uint32_t i = 0; i < around; ++i) {
            const Eigen::Vector2d& p = row[k % perPitch];
            const double a = 2 * std::numbers::pi * i / around, z = p.x() + pitch * (k / perPitch + double(i) / around);
            m.vertices.emplace_back(-p.y() * std::cos(a), -p.y() * std::sin(a), z);
        }
    // After a turn the helix goes on a pitch higher.
    const auto at = [&](std::uint32_t i, std::uint32_t k) {
        return i < around ? k * around + i : (k + perPitch) * around;
    };
    const auto low = std::uint32_t(m.vertices.size()), high = low + 1;
    m.vertices.emplace_back(0, 0, -pitch);
    m.vertices.emplace_back(0, 0, pitch * (turns + 2));
    for (std::uint32_t i = 0; i < around; ++i) {
        for (std::uint32_t k = 0; k + 1 < rows; ++k) {
            m.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
            m.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
        }
        m.triangles.push_back({low, at(i + 1, 0), at(i, 0)});
        m.triangles.push_back({high, at(i, rows - 1), at(i + 1, rows - 1)});
    }
    for (std::uint32_t k = 0; k < perPitch; ++k) {
        m.triangles.push_back({low, at(0, k), at(0, k + 1)});
        m.triangles.push_back({high, at(0, rows + k), at(0, rows - 1 + k)});
    }
    return m;
}

/// Every coordinate rounded to a multiple of the grid, as in files of few digits.
inline TriangleMesh roundedTo(TriangleMesh m, double grid) {
    for (Vec3& p : m.vertices) p = ((p / grid).array().round() * grid).matrix();
    m.grid = grid;
    return m;
}

/// Splits the sides of some triangles at points on the grid and fills what that leaves with slivers, as meshers do.
inline TriangleMesh withSlivers(TriangleMesh m, double share, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform;
    for (std::size_t i = 0, n = m.triangles.size(); i < n; ++i) {
        if (uniform(random) >= share) continue;
        const auto [a, b, c] = m.triangles[i];
        const double at = 0.2 + 0.6 * uniform(random);
        const Vec3 v = m.vertices[a] + at * (m.vertices[b] - m.vertices[a]);
        const auto middle = std::uint32_t(m.vertices.size());
        m.vertices.emplace_back(m.grid > 0 ? Vec3(((v / m.grid).array().round() * m.grid).matrix()) : v);
        m.triangles[i] = {a, middle, c};
        m.triangles.push_back({middle, b, c});
        m.triangles.push_back({a, b, middle});
    }
    return m;
}

}  // namespace touchstone::test
