#include "haptics/builder/tree_builder.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "haptics/builder/cover_plan.hpp"
#include "haptics/builder/hollow.hpp"
#include "haptics/math/single.hpp"
#include "haptics/math/statistics.hpp"

namespace touchstone {
namespace {

// Share of the leaves that is reserved for the inside of a solid. Medial balls leave little of it empty.
constexpr double kFilling = 1.0 / 64;
// Depth in growths beyond which balls grow less, to keep flats smooth: the ripple is then about 1 %.
constexpr double kFlat = 28;
// Growth that is too small to be felt on a flat, as a share of the diagonal.
constexpr double kSmooth = 2.5e-4;
// Fraction of the progress at which the cover is found.
constexpr double kCoverDone = 0.98;

Sphere sphereAt(const Vec3& c) { return {toSingle(c.x()), toSingle(c.y()), toSingle(c.z()), 0}; }

/// One sentence for the user if the tree has a limitation; otherwise empty.
std::string noteFor(const RepairedMesh& body, const TreeCertificate& certificate, double depth, int leaves) {
    if (!certificate.covered)
        return "Single precision leaves gaps between the spheres; move the part nearer to the origin of its frame.";
    if (std::any_of(body.faces.begin(), body.faces.end(), [](const Face& f) { return f.exposed; }))
        return "The surface is open or does not bound a volume: where it is open it is felt as a sheet as thick as its "
               "spheres, so close the mesh if it is meant to be solid.";
    if (body.holes > 0)
        return "The surface has " + std::to_string(body.holes) +
               (body.holes == 1 ? " small hole that is" : " small holes that are") +
               " treated as closed, and the protrusion is measured to the closed surface.";
    const double e = certificate.protrusion * body.scale;
    if (depth > 0 && 2 * depth < e) {
        // The number of leaves is proportional to 1 / (2 e d + e^2), for a protrusion e and a depth d. A protrusion of
        // half the thickness, e = d, is enough to resolve the part.
        const double more = leaves * (2 * e * depth + e * e) / (3 * depth * depth);
        const std::string reach = "The leaves protrude from the part by more than its thickness";
        if (more > TreeOptions::kMaxLeaves)
            return reach + ", and no allowed leaf count can resolve it: it is felt as thick as its spheres.";
        return reach + "; about " + std::to_string(std::llround(more / 1000 + 1) * 1000) + " leaves would resolve it.";
    }
    return {};
}

/// Finds the cover for the options. Throws std::invalid_argument if the requested error cannot be reached.
Cover coverFor(const TreeOptions& options, const CoverTask& task, double rounding) {
    if (options.maxError > 0) {
        const double growth = options.maxError * task.mesh.scale - task.mesh.weld - rounding;
        Cover cover;
        if (growth > 0) cover = smallestCover(task, growth, TreeOptions::kMaxLeaves);
        if (cover.proven && cover.balls.size() <= TreeOptions::kMaxLeaves) return cover;
        throw std::invalid_argument("so small an error needs more than " + std::to_string(TreeOptions::kMaxLeaves) +
                                    " leaves on this part; choose a larger one" +
                                    (task.mesh.closed() ? ""
                                                        : ", or close the mesh: where it bounds no volume, spheres of "
                                                          "that radius cover it as a sheet"));
    }
    const int leaves = std::clamp(options.leaves, 1, TreeOptions::kMaxLeaves);
    const int filling = options.interior == Interior::Solid ? static_cast<int>(kFilling * leaves) : 0;
    return tightestCover(task, static_cast<std::size_t>(leaves - filling));
}

/// Leaves in single precision. Centers are rounded, depths are measured at the rounded centers, and radii cover the
/// assigned pieces.
std::vector<Sphere> leavesOf(Cover& cover, const CoverTask& task, double rounding) {
    const double scale = task.mesh.scale;
    std::vector<Sphere> spheres;
    for (const Ball& b : cover.balls) spheres.push_back(sphereAt(b.center / scale));
    task.workers.eachRange(spheres.size(), 256, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            cover.balls[i].center = spheres[i].center() * scale;
            cover.balls[i].depth = task.solid.depth(cover.balls[i].center);
        }
    });
    const CoverCertificate::Proof proof =
        task.certificate.prove(cover.balls, cover.growth, proofResolution(cover.growth), task.workers);
    std::vector<Sphere> leaves;
    for (std::size_t i = 0; i < spheres.size(); ++i) {
        if (proof.need[i] == -HUGE_VAL) continue;  // no piece is assigned to this ball
        spheres[i].r = toSingleUp((cover.balls[i].depth + proof.need[i] + 2 * rounding) / scale);
        leaves.push_back(spheres[i]);
    }
    return leaves;
}

/// Adds leaves inside the body until no hollow is larger than the protrusion of the leaves. Returns the proven bound on
/// the hollows, mm.
double fill(std::vector<Sphere>& leaves, const TreeOptions& options, const CoverTask& task) {
    const double scale = task.mesh.scale;
    std::vector<SolidSphere> shell;
    double protrusion = 0;
    for (const Sphere& leaf : leaves) {
        shell.push_back({leaf.center() * scale, leaf.r * scale});
        protrusion = std::max(protrusion, shell.back().radius - task.solid.depth(shell.back().center));
    }
    const std::size_t maxBalls =
        options.maxError > 0
            ? static_cast<std::size_t>(kFilling / (1 - kFilling) * static_cast<double>(leaves.size())) + 8
            : static_cast<std::size_t>(std::max(0, options.leaves - static_cast<int>(leaves.size())));
    const Filling filling = fillHollows(task.solid, shell, protrusion, maxBalls, task.workers);
    for (const Vec3& center : filling.centers) {
        leaves.push_back(sphereAt(center / scale));
        leaves.back().r = toSingle(task.solid.depth(leaves.back().center() * scale) / scale);
    }
    return filling.hollow / scale;
}

/// Measures the leaves as they are stored in the tree, and fills in the certificate.
void certify(SphereTree& tree, const CoverTask& task, double growth, double rounding) {
    const double scale = task.mesh.scale;
    const auto count = static_cast<std::size_t>(tree.leafCount());
    std::vector<Ball> stored(count);
    std::vector<double> depths(count);
    task.workers.eachRange(count, 256, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            const Sphere leaf = tree.leaf(static_cast<int>(i));
            stored[i] = {leaf.center() * scale, leaf.r * scale};
            depths[i] = task.solid.depth(stored[i].center);
        }
    });
    double protrusion = 0;
    for (std::size_t i = 0; i < count; ++i) protrusion = std::max(protrusion, stored[i].depth - depths[i]);
    TreeCertificate& out = tree.certificate;
    out.diagonal = task.mesh.diagonal / scale;
    out.protrusion = (protrusion + task.mesh.weld + rounding) / scale;
    out.covered = task.certificate.gaps(stored, -rounding, proofResolution(growth), 1, task.workers).empty();
    out.closed = task.mesh.closed();
    out.note = noteFor(task.mesh, out, upperMedian(depths), tree.leafCount());
}

}  // namespace

SphereTree buildSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const BuildProgress& report) {
    Progress progress(report);
    const Heartbeat heartbeat = [&] { progress.beat(); };
    const Workers workers(options.threads, heartbeat);

    progress.enter(0.05);
    const RepairedMesh body = repairMesh(mesh, heartbeat);
    workers.beat();
    const SolidDepth solid(body);
    const CoverCertificate certificate(
        body.cover, {options.quality == TreeQuality::Fast ? kFlat : HUGE_VAL, kSmooth * body.diagonal});
    const CoverTask task{body, solid, certificate, options.quality, options.seed, workers, progress};
    double extent = 0;
    for (const Triangle& t : body.cover)
        for (const Vec3& v : t) extent = std::max(extent, v.cwiseAbs().maxCoeff());
    // Bounds on the rounding of a corner and its distance in double precision, and of a leaf in single precision.
    const double rounding = 16 * std::numeric_limits<double>::epsilon() * extent;
    const double leafRounding = 4 * std::numeric_limits<float>::epsilon() * extent;

    Cover cover = coverFor(options, task, leafRounding);
    progress.enter(kCoverDone);
    if (cover.proven) {
        const double resolution = proofResolution(cover.growth);
        relaxBalls(cover, assignPieces(cover, certificate, resolution, workers), solid, certificate.law(), workers);
    }
    std::vector<Sphere> leaves = leavesOf(cover, task, rounding);
    const double hollow = options.interior == Interior::Solid && body.closed() ? fill(leaves, options, task) : -1;
    SphereTree tree = makeSphereTree(std::move(leaves));
    tree.certificate.hollow = hollow;
    certify(tree, task, cover.growth, rounding);
    progress.finish();
    return tree;
}

}  // namespace touchstone
