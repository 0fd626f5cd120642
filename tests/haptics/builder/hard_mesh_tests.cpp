// How meshes that are not clean solids are treated, kind by kind.
#include <catch2/catch.hpp>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>

#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/tree_builder.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::hard_mesh_tests {
namespace {

using namespace test;

TriangleMesh without(TriangleMesh m, std::size_t first, std::size_t count = 1) {
    const auto at = m.triangles.begin() + static_cast<std::ptrdiff_t>(first);
    m.triangles.erase(at, at + static_cast<std::ptrdiff_t>(count));
    return m;
}

TriangleMesh tube(double radius, double length) {
    TriangleMesh m = cylinderMesh(radius, length);
    std::erase_if(m.triangles, [](const auto& t) { return t[0] < 2; });  // the fans at both ends
    return m;
}

TriangleMesh everyOtherFlipped(TriangleMesh m) {
    for (std::size_t i = 0; i < m.triangles.size(); i += 2) std::swap(m.triangles[i][0], m.triangles[i][1]);
    return m;
}

TriangleMesh withZeroAreas(TriangleMesh m) {
    const auto n = static_cast<std::uint32_t>(m.triangles.size());
    for (std::uint32_t i = 0; i < n; ++i) {
        const auto [a, b, c] = m.triangles[i];
        m.triangles.push_back({a, a, b});
        m.vertices.push_back(0.5 * (m.vertices[b] + m.vertices[c]));
        m.triangles.push_back({b, static_cast<std::uint32_t>(m.vertices.size() - 1), c});
    }
    return m;
}

TriangleMesh jittered(TriangleMesh m, double by) {
    m = unwelded(m);
    std::mt19937 random(8);
    std::uniform_real_distribution<double> uniform(-by, by);
    for (Vec3& v : m.vertices) v += Vec3(uniform(random), uniform(random), uniform(random));
    return m;
}

/// Two chambers [0, 20] x [0, 10]^2 with a common wall; its rim belongs to both, so its edges have three faces.
TriangleMesh chambers() {
    const TriangleMesh left = boxMesh(Vec3(10, 10, 10)), right = boxMesh(Vec3(10, 10, 10), Vec3(10, 0, 0));
    return joined(left, without(right, 8, 2));  // side 4 of boxMesh is the plane x = its corner's x
}

/// A rib on the middle of a plate's top that shares its foot with it: an edge of four faces.
TriangleMesh ribbed() {
    TriangleMesh m = patchedCube(10, {2, 2, 2, 2, 2, 2});
    const auto n = static_cast<std::uint32_t>(m.vertices.size());
    for (const Vec3& v : {Vec3(5, 0, 10), Vec3(5, 5, 10), Vec3(5, 5, 15), Vec3(5, 0, 15)}) m.vertices.push_back(v);
    m.triangles.push_back({n, n + 1, n + 2});
    m.triangles.push_back({n, n + 2, n + 3});
    return m;
}

/// A band of `half` half turns about z; with an odd number it has only one side.
TriangleMesh band(int half) {
    TriangleMesh m;
    constexpr std::uint32_t kAround = 48;
    for (std::uint32_t i = 0; i < kAround; ++i)
        for (const double w : {-3.0, 3.0}) {
            const double a = 2 * std::numbers::pi * i / kAround, b = half * a / 2;
            m.vertices.push_back(
                Vec3((10 + w * std::cos(b)) * std::cos(a), (10 + w * std::cos(b)) * std::sin(a), w * std::sin(b)));
        }
    for (std::uint32_t i = 0; i < kAround; ++i) {
        const bool crossed = i + 1 == kAround && half % 2 == 1;
        const std::uint32_t a = 2 * i, b = a + 1, c = (a + 2) % (2 * kAround) + crossed, d = c ^ 1u;
        m.triangles.push_back({a, b, c});
        m.triangles.push_back({b, d, c});
    }
    return m;
}

/// A Klein bottle: a figure of eight that makes half a turn on its way around. It has no rim and no inside.
TriangleMesh kleinBottle() {
    constexpr std::uint32_t kAround = 40, kAlong = 24;
    TriangleMesh m = closedGrid(kAround, kAlong, [](double u, double v) {
        const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * (v + 0.5 / kAlong);
        const double x = std::cos(a / 2) * std::sin(b) - std::sin(a / 2) * std::sin(2 * b);
        const double z = std::sin(a / 2) * std::sin(b) + std::cos(a / 2) * std::sin(2 * b);
        return Vec3((10 + 4 * x) * std::cos(a), (10 + 4 * x) * std::sin(a), 4 * z);
    });
    // After one round x and z change sign, as if b ran backwards: the last row meets the first one mirrored.
    for (auto& t : m.triangles) {
        const bool last = std::any_of(t.begin(), t.end(), [](std::uint32_t i) { return i >= (kAround - 1) * kAlong; });
        for (std::uint32_t& i : t)
            if (last && i < kAlong) i = kAlong - 1 - i;
    }
    return m;
}

/// Nested shells, all with the same orientation or every second one inverted.
TriangleMesh onion(bool alternating) {
    TriangleMesh m;
    for (int k = 0; k < 6; ++k) {
        const TriangleMesh layer = sphereMesh(10 - k, 12, 7);
        m = joined(std::move(m), alternating && k % 2 == 1 ? flipped(layer) : layer);
    }
    return m;
}

/// Pages that share one edge.
TriangleMesh book(int pages) {
    TriangleMesh m;
    m.vertices = {Vec3(0, 0, 0), Vec3(0, 0, 10)};
    for (int i = 0; i < pages; ++i) {
        const double a = std::numbers::pi * i / pages;
        m.vertices.push_back(Vec3(10 * std::cos(a), 10 * std::sin(a), 5));
        m.triangles.push_back({0, 1, static_cast<std::uint32_t>(i + 2)});
    }
    return m;
}

TriangleMesh withStrayVertices(TriangleMesh m) {
    m.vertices.insert(m.vertices.begin(), 20000, Vec3::Constant(1e9));
    m.vertices.push_back(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
    for (auto& t : m.triangles)
        for (auto& i : t) i += 20000;
    return m;
}

TriangleMesh triangleMesh(const Vec3& a, const Vec3& b, const Vec3& c) { return {{a, b, c}, {{0, 1, 2}}}; }

struct HardMesh {
    const char* name;
    const char* treatment;
    TriangleMesh mesh;
    bool closed;
    const char* note;  // a phrase of the note; "" for no note
    double percent;    // protrusion with 100 leaves, in percent of the diagonal: 1.25 times the measured value
};

const char* const kOpen = "open or does not bound a volume";
const char* const kThin = "protrude from the part by more than its thickness";

std::vector<HardMesh> hardMeshes() {
    const TriangleMesh box = boxMesh(Vec3(10, 10, 10)), ball = blobMesh(10, 20, 11);
    const TriangleMesh inner = boxMesh(Vec3(6, 6, 6), Vec3(2, 2, 2));
    const TriangleMesh fineInner = moved(patchedCube(6, {9, 9, 9, 9, 9, 9}), 1, Vec3(2, 2, 2));
    return {
        {"box", "nothing to do", box, true, "", 4.6},
        {"small hole", "closed by a flat or smooth cap", without(ball, 150), true, "", 0.93},
        {"three small holes", "each closed by a cap", without(without(without(ball, 300), 200), 100), true, "", 0.93},
        {"large hole", "a sheet, and noted", without(box, 10, 2), false, kOpen, 13.0},
        {"tube", "a sheet, and noted", tube(5, 30), false, kOpen, 9.8},
        {"edge of four", "two shells that touch", joined(box, boxMesh(Vec3(10, 10, 10), Vec3(10, 10, 0))), true, "",
         4.2},
        {"edges of three", "the wall between them is an inner sheet", chambers(), true, "", 4.4},
        {"rib", "a closed shell and a sheet", ribbed(), false, kOpen, 4.8},
        {"book", "sheets", book(24), false, kOpen, 9.4},
        {"soup", "sheets", soupMesh(200, 2, 9), false, kOpen, 11.0},
        {"dense soup", "sheets", soupMesh(100, 15, 9), false, kOpen, 10.9},
        {"inverted", "oriented by its volume", flipped(box), true, "", 4.6},
        {"mixed orientation", "oriented by the majority, then by volume", everyOtherFlipped(ball), true, "", 0.9},
        {"zero areas", "dropped, their seams closed", withZeroAreas(box), true, "", 4.6},
        {"duplicates", "one of each is kept", joined(box, joined(box, box)), true, "", 4.6},
        {"both sides", "a closed body: one of each face is kept", joined(box, flipped(box)), true, "", 4.6},
        {"unwelded", "welded", unwelded(ball), true, "", 0.85},
        {"unwelded and jittered", "welded within 1e-6 of the diagonal", jittered(ball, 1e-6), true, "", 0.83},
        {"T-junctions", "faces split at vertices on their edges", patchedCube(10, {1, 2, 3, 4, 5, 7}), true, "", 4.5},
        {"inner shell", "buried: uses no leaves", joined(box, inner), true, "", 4.8},
        {"fine inner shell", "buried: uses no leaves", joined(box, fineInner), true, "", 4.9},
        {"cavity", "kept hollow", joined(box, flipped(inner)), true, "", 6.2},
        {"onion", "all but the outermost buried", onion(false), true, "", 1.2},
        {"onion of hollows", "the largest container decides: hollows stay", onion(true), true, kThin, 10.3},
        {"overlap", "one body", joined(box, boxMesh(Vec3(10, 10, 10), Vec3(5, 5, 5))), true, "", 4.9},
        {"touching", "one body; the common face is an inner sheet",
         joined(box, boxMesh(Vec3(10, 10, 10), Vec3(10, 0, 0))), true, "", 4.4},
        {"stacked askew", "one body", joined(box, boxMesh(Vec3(6, 6, 6), Vec3(1, 1, 10))), true, "", 4.7},
        {"self-intersecting", "walls are buried where the winding number is two", eightMesh(10, 2, 40, 8), true, "",
         2.0},
        {"apart", "one body of two shells", joined(box, boxMesh(Vec3(1, 1, 1), Vec3(300, 0, 0))), true, "", 0.26},
        {"heap", "intersecting shells become one body", heapMesh(5, 1.2), true, kThin, 14.5},
        {"open sheet", "a sheet, and noted", squareMesh(10, 8), false, kOpen, 7.6},
        {"one-sided band", "a sheet, and noted", band(1), false, kOpen, 6.3},
        {"two-sided band", "a sheet, and noted", band(2), false, kOpen, 6.5},
        {"one-sided bottle", "a sheet, and noted", kleinBottle(), false, kOpen, 10.5},
        {"thin plate", "covered, and recommends more leaves", boxMesh(Vec3(60, 60, 0.4)), true, kThin, 7.1},
        {"foil", "covered, and recommends more leaves", boxMesh(Vec3(60, 60, 1e-3)), true, kThin, 7.6},
        {"needle box", "covered", boxMesh(Vec3(100, 0.1, 0.1)), true, kThin, 0.86},
        {"needle triangle", "a sheet", triangleMesh(Vec3(0, 0, 0), Vec3(100, 0, 0), Vec3(50, 0.1, 0)), false, kOpen,
         6.0},
        {"one triangle", "a sheet", triangleMesh(Vec3(0, 0, 0), Vec3(10, 0, 0), Vec3(0, 10, 0)), false, kOpen, 5.5},
        {"fan", "nothing to do",
         lathe(120, 1, 0, 10, [](double a, double) { return Vec3(5 * std::cos(a), 5 * std::sin(a), 2); }), true, "",
         2.1},
        {"stray vertices", "ignored", withStrayVertices(box), true, "", 4.6},
        {"1e-6", "scaled by a power of two", moved(box, 1e-6, Vec3::Zero()), true, "", 4.6},
        {"1e6", "scaled by a power of two", moved(box, 1e6, Vec3::Zero()), true, "", 4.6},
        {"1e-20", "scaled by a power of two", moved(box, 1e-20, Vec3::Zero()), true, "", 4.6},
        {"1e30", "scaled by a power of two", moved(box, 1e30, Vec3::Zero()), true, "", 4.6},
        {"far", "covered", moved(box, 1, Vec3(1e6 + 0.3, -2e6 + 0.1, 7)), true, "", 4.9},
    };
}

TEST_CASE("hard mesh: each kind gets a covering tree whose note names the defect", "[tree][long]") {
    for (const HardMesh& hard : hardMeshes()) {
        INFO(hard.name << ": " << hard.treatment);
        const SphereTree tree = buildSphereTree(hard.mesh, {.leaves = 100});
        const TreeCertificate& certificate = tree.certificate;
        INFO("note: " << certificate.note);
        INFO("protrusion " << 100 * certificate.protrusion / certificate.diagonal << " % of the diagonal");
        CHECK(tree.leafCount() <= 100);
        CHECK(certificate.covered);
        CHECK(certificate.closed == hard.closed);
        CHECK(certificate.note.find(hard.note) != std::string::npos);
        CHECK(certificate.note.empty() == (*hard.note == '\0'));
        CHECK(certificate.protrusion < 0.01 * hard.percent * certificate.diagonal);
        std::mt19937 random(6);
        CHECK(barePoints(hard.mesh, tree, 500, random) == 0);
    }
}

/// The triangles that a tree covers.
TriangleMesh keptOf(const TriangleMesh& mesh) {
    const RepairedMesh body = repairMesh(mesh);
    std::map<std::array<double, 3>, std::uint32_t> places;
    TriangleMesh kept;
    for (const Triangle& t : body.cover) {
        std::array<std::uint32_t, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 p = t[k] / body.scale;
            const auto [place, isNew] = places.try_emplace({p.x(), p.y(), p.z()}, std::uint32_t(kept.vertices.size()));
            if (isNew) kept.vertices.push_back(p);
            corners[k] = place->second;
        }
        kept.triangles.push_back(corners);
    }
    return kept;
}

/// Whether parity distinguishes inside from outside: all rays from one point meet the same number of faces, mod 2.
/// Exact copies count once.
bool bounds(const TriangleMesh& mesh, std::mt19937& random) {
    std::set<std::array<std::uint32_t, 3>> seen;
    std::vector<Triangle> triangles;
    for (const auto& t : mesh.triangles) {
        auto sorted = t;
        std::sort(sorted.begin(), sorted.end());
        if (seen.insert(sorted).second)
            triangles.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
    }
    std::uniform_real_distribution<double> uniform(-12, 12);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 50; ++i) {
        const Vec3 from(uniform(random), uniform(random), uniform(random));
        std::array<bool, 3> odd{};
        for (bool& o : odd) {
            const Vec3 way(normal(random), normal(random), normal(random));
            for (const Triangle& t : triangles) {
                const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], h = way.cross(ac), s = from - t[0], q = s.cross(ab);
                const double det = ab.dot(h), u = s.dot(h) / det, v = way.dot(q) / det;
                o ^= u > 0 && v > 0 && u + v < 1 && ac.dot(q) / det > 0;
            }
        }
        if (odd[0] != odd[1] || odd[1] != odd[2]) return false;
    }
    return true;
}

/// One of the clean solids, inside a ball of radius 12 about the origin.
TriangleMesh anySolid(std::mt19937& random) {
    switch (random() % 6) {
        case 0:
            return boxMesh(Vec3(10, 8, 6), Vec3(-5, -4, -3));
        case 1:
            return torusMesh(8, 3, 16, 8);
        case 2:
            return blobMesh(9, 12, 7);
        case 3:
            return cylinderMesh(5, 6);
        case 4:
            return patchedCube(6, {1, 2, 3, 2, 1, 4});
        default:
            return joined(sphereMesh(4, 10, 5), moved(sphereMesh(4, 9, 6), 1, Vec3(3, 1, 2)));
    }
}

TEST_CASE("hard mesh: random damage gives a covering tree, and only a mesh that bounds a volume is closed", "[tree]") {
    const unsigned seed = 17;
    CAPTURE(seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    int closed = 0, open = 0;
    for (std::uint32_t i = 0; i < 30; ++i) {
        CAPTURE(i);
        TriangleMesh mesh = anySolid(random);
        const auto some = [&] { return random() % mesh.triangles.size(); };
        bool junk = false;
        for (unsigned k = random() % 4; k > 0; --k) {
            switch (random() % 7) {
                case 0:
                    mesh = without(mesh, some());
                    break;
                case 1:
                    for (int n = 0; n < 9; ++n) std::swap(mesh.triangles[some()][0], mesh.triangles[some()][1]);
                    break;
                case 2:
                    mesh = unwelded(mesh);
                    break;
                case 3:
                    mesh = jittered(mesh, 1e-7);
                    break;
                case 4:
                    mesh.triangles.push_back(mesh.triangles[some()]);
                    break;
                case 5:
                    mesh.vertices[mesh.triangles[some()][0]] += Vec3(uniform(random), uniform(random), uniform(random));
                    break;
                default:
                    mesh = joined(mesh, soupMesh(1 + i % 5, 3, i));
                    junk = true;
            }
        }
        const SphereTree tree = buildSphereTree(mesh, {.leaves = 24});
        CHECK(tree.leafCount() <= 24);
        CHECK(tree.certificate.covered);
        const TriangleMesh kept = keptOf(mesh);  // without what is loose, and with what closes holes
        CHECK(barePoints(kept, tree, 100, random) == 0);
        // Extra faces may lie inside, where they do no harm.
        if (tree.certificate.closed && !junk) CHECK(bounds(kept, random));
        if (!tree.certificate.closed) CHECK_FALSE(tree.certificate.note.empty());
        (tree.certificate.closed ? closed : open) += 1;
    }
    CHECK(closed > 5);
    CHECK(open > 5);
}

TEST_CASE("hard mesh: buried shells use no leaves", "[tree]") {
    const auto protrusion = [](const TriangleMesh& m) {
        return buildSphereTree(m, {.leaves = 128}).certificate.protrusion;
    };
    const TriangleMesh box = boxMesh(Vec3(10, 10, 10)), ball = sphereMesh(10, 12, 7);
    const TriangleMesh fineInner = moved(patchedCube(6, {9, 9, 9, 9, 9, 9}), 1, Vec3(2, 2, 2));
    CHECK(protrusion(joined(box, fineInner)) < 1.3 * protrusion(box));
    CHECK(protrusion(onion(false)) < 1.4 * protrusion(ball));
    CHECK(protrusion(chambers()) < 1.3 * protrusion(boxMesh(Vec3(20, 10, 10))));
}

TEST_CASE("hard mesh: scaling a mesh by a power of two scales its tree with the same bits", "[tree]") {
    for (const TriangleMesh& mesh : {blobMesh(10, 12, 7), without(torusMesh(10, 3, 16, 8), 40), soupMesh(40, 4, 2)}) {
        const auto before = leavesOf(buildSphereTree(mesh, {.leaves = 48}));
        for (const int exponent : {-60, -20, -1, 1, 20, 60}) {
            CAPTURE(exponent);
            auto after =
                leavesOf(buildSphereTree(moved(mesh, std::ldexp(1.0, exponent), Vec3::Zero()), {.leaves = 48}));
            for (Sphere& s : after)
                for (float* x : {&s.x, &s.y, &s.z, &s.r}) *x = std::ldexp(*x, -exponent);
            REQUIRE(after.size() == before.size());
            CHECK(std::memcmp(after.data(), before.data(), after.size() * sizeof(Sphere)) == 0);
        }
    }
}

TEST_CASE("hard mesh: the quality of a tree does not depend on place and size of the mesh", "[tree]") {
    const TriangleMesh mesh = blobMesh(10, 12, 7);
    const TreeCertificate before = buildSphereTree(mesh, {.leaves = 48}).certificate;
    for (const double scale : {1e-6, 1e-3, 1e3, 1e6})
        for (const double offset : {0.0, 1.0, 1e3}) {
            CAPTURE(scale, offset);
            const TriangleMesh there = moved(mesh, scale, scale * offset * Vec3(20, -10, 5));
            const SphereTree tree = buildSphereTree(there, {.leaves = 48});
            std::mt19937 random(3);
            CHECK(tree.certificate.covered);
            CHECK(tree.certificate.closed);
            CHECK(barePoints(there, tree, 300, random) == 0);
            // The search branches differently after different roundings: up to a fifth with so few leaves. Far from the
            // origin, floats round by 1e-7 of the offset.
            const double rounding = 4e-7 * scale * offset * 20;
            CHECK(tree.certificate.protrusion == Approx(scale * before.protrusion).epsilon(0.2).margin(rounding));
        }
}

// Sanitizers take much longer.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::uint32_t kFine = 100;
#else
constexpr std::uint32_t kFine = 1000;
#endif

TEST_CASE("hard mesh: two million triangles", "[tree][slow][long]") {
    const TriangleMesh mesh = blobMesh(10, kFine, kFine);
    REQUIRE(mesh.triangles.size() == 2 * kFine * kFine);
    const SphereTree tree = buildSphereTree(mesh, {.leaves = 8});
    CHECK(tree.certificate.covered);
    CHECK(tree.certificate.closed);
    // The same as with few triangles, where the bumps are the same.
    const TreeCertificate coarse = buildSphereTree(blobMesh(10, 60, 40), {.leaves = 8}).certificate;
    CHECK(tree.certificate.protrusion < 1.25 * coarse.protrusion);
}

}  // namespace
}  // namespace touchstone::hard_mesh_tests
