#include "haptics/surface/surface_features.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <optional>
#include <set>

#include "tests/support/test_meshes.hpp"

namespace touchstone::surface_features_tests {
namespace {

using Vec2 = Eigen::Vector2d;
using test::boxMesh;
using test::joined;

SurfaceFeatures featuresOf(const TriangleMesh& mesh) { return surfaceFeatures(repairMesh(mesh)); }

TriangleMesh moved(TriangleMesh m, const Vec3& by) {
    for (Vec3& v : m.vertices) v += by;
    return m;
}

TriangleMesh turned(TriangleMesh m) {
    const Mat3 R = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    for (Vec3& v : m.vertices) v = R * v;
    return m;
}

/// A body of random heights over a grid, with a flat bottom.
TriangleMesh terrain(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> height(4, 6);
    return test::lathe(17, 9, 0, 5, [&](double a, double t) {
        const double r = height(random);
        return Vec3(r * std::cos(a), r * std::sin(a), 1 + 3 * t);
    });
}

/// A direction that forms an obtuse angle with each of these unit vectors, if there is one, by all planes through two
/// of them: the mean normal of those that have none in front.
std::optional<Vec3> supportOf(const std::vector<Vec3>& spokes) {
    Vec3 mean = Vec3::Zero();
    for (const Vec3& a : spokes)
        for (const Vec3& b : spokes) {
            const Vec3 n = a.cross(b);
            if (n.norm() < 1e-9) continue;
            for (const Vec3& m : {Vec3(n.normalized()), Vec3(-n.normalized())})
                if (std::all_of(spokes.begin(), spokes.end(), [&](const Vec3& s) { return m.dot(s) < 1e-12; }))
                    mean += m;
        }
    const bool strict = std::all_of(spokes.begin(), spokes.end(), [&](const Vec3& s) { return mean.dot(s) < -1e-9; });
    return strict ? std::optional(mean.normalized()) : std::nullopt;
}

}  // namespace

TEST_CASE("surface features: a box has its edges and corners, not the diagonals of its sides") {
    const SurfaceFeatures box = featuresOf(boxMesh({3, 4, 5}));
    CHECK(box.faces.size() == 12);
    CHECK(box.edges.size() == 12);
    CHECK(box.vertices.size() == 8);
    CHECK(box.dropped.flatEdges == 6);
    CHECK(box.dropped.concaveEdges == 0);
    CHECK(box.points.size() == 8);
    for (const auto& edge : box.edges) {
        const Vec3 along = box.points[edge.points[1]] - box.points[edge.points[0]];
        for (const int f : edge.faces) CHECK(std::abs(box.faces[f].normal.dot(along)) < 1e-12);
        CHECK(box.faces[edge.faces[0]].normal.dot(box.faces[edge.faces[1]].normal) == Approx(0).margin(1e-12));
    }
    double greatest = 0;
    for (const Vec3& p : box.points) greatest = std::max(greatest, p.maxCoeff());
    CHECK(greatest == 5);  // mm, not the frame of the repair
}

TEST_CASE("surface features: vertices in flat sides and on straight edges are dropped") {
    TriangleMesh mesh = boxMesh({2, 2, 2});
    const auto middle = std::uint32_t(mesh.vertices.size());
    mesh.vertices.emplace_back(1, 1, 2);  // of the top
    mesh.vertices.emplace_back(1, 0, 2);  // of the edge between top and front
    std::erase_if(mesh.triangles, [&](const auto& t) {
        const auto on = [&](int axis, double at) {
            return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.vertices[v][axis] == at; });
        };
        return on(2, 2) || on(1, 0);
    });
    const std::array<std::uint32_t, 5> top{4, middle + 1, 5, 7, 6};
    for (std::size_t k = 0; k < 5; ++k) mesh.triangles.push_back({middle, top[k], top[(k + 1) % 5]});
    mesh.triangles.push_back({0, 1, middle + 1});
    mesh.triangles.push_back({1, 5, middle + 1});
    mesh.triangles.push_back({4, 0, middle + 1});
    for (const TriangleMesh& m : {mesh, test::flipped(mesh)}) {
        const SurfaceFeatures f = featuresOf(m);
        CHECK(f.vertices.size() == 8);
        CHECK(f.dropped.unsupportedVertices == 2);
        CHECK(f.edges.size() == 13);  // one of them in two parts
    }
}

TEST_CASE("surface features: of a cavity the tips of its walls count, not the corners of the room") {
    const SurfaceFeatures f = featuresOf(joined(boxMesh({9, 9, 9}), test::flipped(boxMesh({3, 3, 3}, {3, 3, 3}))));
    CHECK(f.faces.size() == 24);
    CHECK(f.edges.size() == 12);
    CHECK(f.vertices.size() == 8);
    CHECK(f.dropped.concaveEdges == 12);
    CHECK(f.dropped.unsupportedVertices == 8);
}

TEST_CASE("surface features: shells inside others have none, and touching ones keep theirs") {
    const SurfaceFeatures nested = featuresOf(joined(boxMesh({9, 9, 9}), boxMesh({3, 3, 3}, {3, 3, 3})));
    CHECK(nested.faces.size() == 12);
    CHECK(nested.edges.size() == 12);
    CHECK(nested.vertices.size() == 8);

    // Two boxes share an edge only: material lies in two opposite quarters around it, and each is a wedge of its own.
    const SurfaceFeatures quarters = featuresOf(joined(boxMesh({2, 2, 2}), boxMesh({2, 2, 2}, {2, 2, 0})));
    CHECK(quarters.edges.size() == 24);
    CHECK(quarters.vertices.size() == 16);
    CHECK(quarters.dropped.concaveEdges == 0);
    for (const auto& edge : quarters.edges) {
        const Vec3 middle = (quarters.points[edge.points[0]] + quarters.points[edge.points[1]]) / 2;
        const Vec3 inward = -quarters.faces[edge.faces[0]].normal - quarters.faces[edge.faces[1]].normal;
        const Vec3 p = middle + 0.1 * inward;
        const bool first = (p.array() > 0).all() && (p.array() < 2).all();
        const bool second = first || ((p - Vec3(2, 2, 0)).array() > 0).all();
        CHECK(second);  // the wedge's faces enclose material
    }

    // Two boxes side by side: the walls between them cancel, and the seam is flat.
    const SurfaceFeatures pair = featuresOf(joined(boxMesh({2, 2, 2}), boxMesh({2, 2, 2}, {2, 0, 0})));
    CHECK(pair.edges.size() == 16);  // the four long ones in two parts each
    CHECK(pair.vertices.size() == 8);
    CHECK(pair.dropped.concaveEdges == 0);

    // Two tips meet in a point.
    const SurfaceFeatures tips = featuresOf(joined(boxMesh({2, 2, 2}), boxMesh({2, 2, 2}, {2, 2, 2})));
    CHECK(tips.vertices.size() == 16);
    CHECK(tips.points.size() == 15);
}

TEST_CASE("surface features: at the junction of overlapping shells the faces inside are dropped with their edges") {
    // The grid of the box is fine, so that some of its faces lie wholly inside the torus.
    const TriangleMesh ball = test::sphereMesh(2, 40, 30);
    const SurfaceFeatures alone = featuresOf(ball), twice = featuresOf(joined(ball, moved(ball, {1.5, 0.1, 0.2})));
    CHECK(twice.faces.size() < 2 * alone.faces.size() - 200);
    CHECK(twice.dropped.buriedEdges > 10);
    CHECK(twice.dropped.buriedVertices > 10);
    for (const auto& vertex : twice.vertices) {
        const Vec3& p = twice.points[vertex.point];
        CHECK(std::max(p.norm(), (p - Vec3(1.5, 0.1, 0.2)).norm()) > 1.95);
    }
}

/// A prism over a convex polygon, counter-clockwise, between two heights.
TriangleMesh prism(const std::vector<Vec2>& base, double bottom, double top) {
    TriangleMesh m;
    const auto n = std::uint32_t(base.size());
    for (const double z : {bottom, top})
        for (const Vec2& p : base) m.vertices.push_back({p.x(), p.y(), z});
    for (std::uint32_t i = 0, j = 1; i < n; ++i, j = (i + 1) % n) {
        m.triangles.push_back({i, j, n + j});
        m.triangles.push_back({i, n + j, n + i});
        if (i < 2) continue;
        m.triangles.push_back({0, i, i - 1});
        m.triangles.push_back({n, n + i - 1, n + i});
    }
    return m;
}

TEST_CASE(
    "surface features: where shells share a corner of the part it is found, whichever of their faces meet there") {
    // Boxes in a room of 4 x 4 x 4 cells share corners, edges and planes. A point is a tip of their union where one of
    // the eight cells around it is full, and a line is a convex edge where one of four is.
    std::mt19937 random(1);
    int closed = 0, tips = 0, edges = 0;
    for (int round = 0; round < 300; ++round) {
        CAPTURE(round);
        TriangleMesh mesh;
        std::set<std::array<int, 3>> full;
        for (auto n = 2 + random() % 6; n > 0; --n) {
            std::array<int, 3> lo, size;
            for (int k = 0; k < 3; ++k) {
                lo[k] = int(random() % 4);
                size[k] = 1 + int(random() % std::size_t(4 - lo[k]));
            }
            mesh = joined(mesh, boxMesh(Vec3(size[0], size[1], size[2]), Vec3(lo[0], lo[1], lo[2])));
            for (int x = 0; x < size[0]; ++x)
                for (int y = 0; y < size[1]; ++y)
                    for (int z = 0; z < size[2]; ++z) full.insert({lo[0] + x, lo[1] + y, lo[2] + z});
        }
        const bool askew = round % 2 == 1;
        const RepairedMesh body = repairMesh(askew ? turned(mesh) : mesh);
        if (!body.closed()) continue;  // two boxes with one and the same face
        ++closed;
        const SurfaceFeatures found = surfaceFeatures(body);
        const auto placed = [&](const Vec3& p) {
            return askew ? turned({.vertices = {p}, .triangles = {}}).vertices[0] : p;
        };
        // Full cells among those that touch a point, of which some coordinates lie inside a cell.
        const auto around = [&](const Vec3& p) {
            std::set<std::array<int, 3>> cells;
            for (int k = 0; k < 8; ++k) {
                const Vec3 q = p + 0.25 * Vec3(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
                const std::array cell{int(std::floor(q.x())), int(std::floor(q.y())), int(std::floor(q.z()))};
                if (full.contains(cell)) cells.insert(cell);
            }
            return cells.size();
        };
        const auto isTip = [&](const Vec3& p) {
            return std::any_of(found.vertices.begin(), found.vertices.end(),
                               [&](const auto& v) { return (found.points[v.point] - p).norm() < 1e-9; });
        };
        const auto isOnEdge = [&](const Vec3& p) {
            return std::any_of(found.edges.begin(), found.edges.end(), [&](const auto& e) {
                const Vec3 a = found.points[e.points[0]] - p, b = found.points[e.points[1]] - p;
                return a.norm() + b.norm() - (a - b).norm() < 1e-9;
            });
        };
        for (int i = 0; i < 125; ++i) {
            const Vec3 p(i % 5, i / 5 % 5, i / 25);
            if (around(p) == 1) {
                ++tips;
                CHECK(isTip(placed(p)));
            }
            for (int k = 0; k < 3; ++k) {
                const Vec3 middle = p + 0.5 * Vec3::Unit(k);
                if (around(middle) != 1) continue;
                ++edges;
                CHECK(isOnEdge(placed(middle)));
            }
        }
    }
    CHECK(closed > 100);
    CHECK(tips > 1000);
    CHECK(edges > 1000);

    // One prism's corner lies in the other's at an edge that both have. One of its sides ends inside, the other leaves
    // it.
    const SurfaceFeatures nested = featuresOf(
        joined(prism({{1, 0}, {0, 1}, {-2, 1}, {-4, -1}, {0, -2}}, 0, 3), prism({{1, 0}, {-4, 4}, {-2, 1}}, 0, 3)));
    CHECK(std::any_of(nested.edges.begin(), nested.edges.end(), [&](const auto& e) {
        const Vec3 &a = nested.points[e.points[0]], &b = nested.points[e.points[1]];
        return std::abs(a.z() - b.z()) == 3 && a.head<2>() == Vec2(1, 0) && b.head<2>() == Vec2(1, 0);
    }));
    for (const double z : {0., 3.})
        CHECK(std::any_of(nested.vertices.begin(), nested.vertices.end(),
                          [&](const auto& v) { return nested.points[v.point] == Vec3(1, 0, z); }));
}

TEST_CASE("surface features: they are those that a search over all planes finds") {
    const std::vector<TriangleMesh> meshes{
        turned(test::blobMesh(10)),
        turned(test::torusMesh(10, 3)),
        turned(test::cylinderMesh(3, 8)),
        turned(test::eightMesh(10, 1, 90, 12)),
        turned(terrain(1)),
        terrain(2),
        turned(test::sphereMesh(5)),
        moved(test::blobMesh(0.01), {1000, 2000, 3000}),
    };
    for (std::size_t which = 0; which < meshes.size(); ++which) {
        CAPTURE(which);
        const RepairedMesh body = repairMesh(meshes[which]);
        REQUIRE(body.closed());
        const SurfaceFeatures found = surfaceFeatures(body);
        std::set<std::pair<int, int>> edges;
        for (const auto& e : found.edges) edges.insert(std::minmax(e.points[0], e.points[1]));
        std::set<int> vertices;
        for (const auto& v : found.vertices) vertices.insert(v.point);
        REQUIRE(edges.size() == found.edges.size());
        REQUIRE(vertices.size() == found.vertices.size());

        std::map<std::pair<int, int>, std::vector<std::array<int, 3>>> uses;
        std::vector<std::vector<Vec3>> spokes(found.points.size());
        for (const auto& f : body.walls) {
            for (int k = 0; k < 3; ++k) {
                uses[std::minmax(f[k], f[(k + 1) % 3])].push_back(f);
                spokes[f[k]].push_back((found.points[f[(k + 1) % 3]] - found.points[f[k]]).normalized());
            }
        }
        std::vector<Triangle> all;
        for (const Face& f : body.faces) all.push_back(f.corners);
        const TriangleBvh bvh(all);
        std::set<int> atHoles;  // where faces inside the part were dropped
        int convex = 0, supported = 0;
        for (const auto& [edge, faces] : uses) {
            const auto& [a, b] = edge;
            if (faces.size() == 1) {
                CHECK(!edges.contains(edge));
                atHoles.insert({a, b});
                continue;
            }
            REQUIRE(faces.size() == 2);
            Vec3 mean = Vec3::Zero();
            for (const auto& [u, v, w] : faces)
                mean += (found.points[v] - found.points[u]).cross(found.points[w] - found.points[u]).normalized();
            double highest = -1;
            for (const auto& f : faces)
                for (const int v : f)
                    if (v != a && v != b)
                        highest = std::max(highest, mean.dot((found.points[v] - found.points[a]).normalized()));
            convex += highest < 0;
            if (std::abs(highest) > 1e-9) CHECK(edges.contains(edge) == (highest < 0));
        }
        for (int v = 0; v < int(spokes.size()); ++v) {
            if (spokes[v].empty()) continue;
            const std::optional<Vec3> support = supportOf(spokes[v]);
            const Vec3 way = 1e-6 * body.diagonal * support.value_or(Vec3::Zero());
            if (bvh.windingNumber(body.vertices[v] - way) > 1.5) continue;  // in two shells: nothing touches it
            const bool expected = support && !atHoles.contains(v) && bvh.windingNumber(body.vertices[v] + way) < 0.5;
            CHECK(vertices.contains(v) == expected);
            supported += expected;
        }
        CHECK(convex > 0);
        CHECK(supported > 0);
    }
}

TEST_CASE("surface features: whether an edge is convex does not depend on rounding") {
    // The top is a plane that no axis is along, x + y = z, with a point at its middle that is one unit of the last
    // digit above it, below it or in it.
    constexpr double kLast = 1, kSize = 1125899906842624.0;  // 2^50
    for (const double rise : {kLast, -kLast, 0.0}) {
        TriangleMesh mesh;
        const std::array<std::array<double, 2>, 3> corners{
            {{0, 3}, {kSize - 5, kSize / 8 + 1}, {kSize / 2 + 7, kSize - 11}}};
        for (const auto& [x, y] : corners) mesh.vertices.emplace_back(x, y, (x + y) / 2);
        for (const auto& [x, y] : corners) mesh.vertices.emplace_back(x, y, (x + y) / 2 - kSize);
        for (Vec3& v : mesh.vertices) v.z() *= 2;  // exact: all of it are whole numbers below 2^53
        const double x = kSize / 2 - 9, y = kSize / 2 - 77;
        mesh.vertices.emplace_back(x, y, x + y + rise);
        mesh.triangles = {{3, 5, 4}, {0, 1, 6}, {1, 2, 6}, {2, 0, 6}, {0, 3, 1},
                          {1, 3, 4}, {1, 4, 2}, {2, 4, 5}, {2, 5, 0}, {0, 5, 3}};
        const SurfaceFeatures f = featuresOf(mesh);
        CHECK(f.faces.size() == 10);
        CHECK(f.edges.size() == (rise > 0 ? 12u : 9u));
        CHECK(f.dropped.concaveEdges == (rise < 0 ? 3 : 0));
        CHECK(f.dropped.flatEdges == (rise == 0 ? 6 : 3));
    }
}

TEST_CASE("surface features: a needle between two faces does not hide the edge") {
    TriangleMesh mesh = boxMesh({2, 2, 2});
    const auto middle = std::uint32_t(mesh.vertices.size());
    mesh.vertices.emplace_back(1, 0, 2);  // of the edge 4-5; the top ends there, the front does not
    std::erase_if(mesh.triangles, [&](const auto& t) {
        return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.vertices[v].z() == 2; });
    });
    mesh.triangles.push_back({middle, 5, 7});
    mesh.triangles.push_back({middle, 7, 6});
    mesh.triangles.push_back({middle, 6, 4});
    mesh.triangles.push_back({4, 5, middle});  // fills the gap without area
    const SurfaceFeatures f = featuresOf(mesh);
    CHECK(f.vertices.size() == 8);
    CHECK(f.edges.size() == 13);
    CHECK(f.dropped.concaveEdges == 0);
    for (const auto& edge : f.edges)
        CHECK(f.faces[edge.faces[0]].normal.dot(f.faces[edge.faces[1]].normal) == Approx(0).margin(1e-12));
}

TEST_CASE("surface features: a sliver that is folded back does not hide the edge it lies on") {
    // The top ends at the edge 4-5, the front at a point beside it, in the plane of the top.
    TriangleMesh mesh = boxMesh({2, 2, 2});
    const auto beside = std::uint32_t(mesh.vertices.size());
    mesh.vertices.emplace_back(1, 0.01, 2);
    std::erase_if(mesh.triangles, [](const auto& t) { return t == std::array<std::uint32_t, 3>{0, 5, 4}; });
    mesh.triangles.push_back({0, 5, beside});
    mesh.triangles.push_back({0, beside, 4});
    mesh.triangles.push_back({5, 4, beside});
    const auto has = [](const SurfaceFeatures& f, const Vec3& a, const Vec3& b) {
        return std::any_of(f.edges.begin(), f.edges.end(), [&](const SurfaceFeatures::Edge& edge) {
            const Vec3 &p = f.points[edge.points[0]], &q = f.points[edge.points[1]];
            return (p == a && q == b) || (p == b && q == a);
        });
    };
    const Vec3 left(0, 0, 2), right(2, 0, 2), middle(1, 5e-4, 2);
    const SurfaceFeatures fin = featuresOf(mesh);
    CHECK(has(fin, left, right));
    mesh.grid = 2e-3;
    CHECK(featuresOf(mesh).dropped.needles == 0);
    mesh.vertices[beside].y() = 5e-4;
    const SurfaceFeatures needle = featuresOf(mesh);
    CHECK(needle.dropped.needles == 1);
    CHECK_FALSE(has(needle, left, right));
    CHECK(has(needle, left, middle));
    CHECK(has(needle, middle, right));
}

TEST_CASE("surface features: what bounds no volume has none") {
    const SurfaceFeatures sheet = featuresOf(test::squareMesh(2, 3));
    CHECK(sheet.faces.empty());
    CHECK(sheet.edges.empty());
    CHECK(sheet.vertices.empty());
}

}  // namespace touchstone::surface_features_tests
