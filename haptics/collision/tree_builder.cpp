#include "haptics/collision/tree_builder.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "haptics/collision/sphere_cover.hpp"

namespace touchstone {
namespace {

constexpr double kSpacing = 0.45;     // of the samples, in patch radii: closer gains little and costs its square
constexpr int kSearchSteps = 8;       // greedy covers for one set of samples
constexpr double kWholeBody = 4;      // growth beyond which any ball holds the whole body; its diagonal is below 2
constexpr double kGoodFill = 0.93;    // of the leaves asked for
constexpr double kResolution = 0.15;  // of the growth: where a proof stops halving pieces
constexpr int kRelaxRounds = 5;       // the first two gain 12 %, the others some 2 % each
constexpr int kSamplings = 5;         // sets of samples before the growth just doubles until it suffices

/// Passes the progress on, at most every 20 ms, and cancels.
class Progress {
  public:
    explicit Progress(const BuildProgress& report) : report_(report) {}

    /// Enters a stage that ends at the given fraction.
    void enter(double end) {
        fraction_ = end_;
        end_ = end;
        tell();
    }
    void finish() { enter(end_); }
    /// A sign of life inside the stage: creeps toward its end.
    void beat() {
        const auto now = std::chrono::steady_clock::now();
        if (now - told_ < std::chrono::milliseconds(20)) return;
        fraction_ += 0.02 * (end_ - fraction_);
        tell();
    }

  private:
    void tell() {
        told_ = std::chrono::steady_clock::now();
        if (report_ && !report_(fraction_)) throw BuildCancelled{};
    }

    const BuildProgress& report_;
    double fraction_ = 0, end_ = 0;
    std::chrono::steady_clock::time_point told_;
};

double areaOf(const Triangle& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).norm(); }

/// The growth at which about `leaves` balls will do: a ball of depth d covers patches of squared radius 2 e d + e^2.
double estimateGrowth(const RepairedMesh& mesh, const SolidDepth& solid, int leaves, const Heartbeat& heartbeat) {
    constexpr int kProbes = 1500;
    constexpr double kPatchShare = 3.3;  // measured on the bunny: patch area a leaf ends up with, in squared radii
    double total = 0;
    for (const Face& f : mesh.faces)
        if (f.role != FaceRole::Cap) total += areaOf(f.corners);
    std::vector<double> depths;
    double sum = 0;
    for (const Face& f : mesh.faces) {
        if (f.role == FaceRole::Cap) continue;
        const double before = sum;
        sum += areaOf(f.corners);
        const auto first = static_cast<int>(before / total * kProbes), last = static_cast<int>(sum / total * kProbes);
        for (int i = first; i < last; ++i) {
            // Spread over the triangle by the golden ratio and its square.
            double u = std::fmod(0.5 + i * 0.7548776662466927, 1.0), v = std::fmod(0.5 + i * 0.5698402909980532, 1.0);
            if (u + v > 1) {
                u = 1 - u;
                v = 1 - v;
            }
            const auto& [a, b, c] = f.corners;
            const Vec3 p = a + u * (b - a) + v * (c - a);
            const Vec3 inward = -(b - a).cross(c - a).normalized();
            heartbeat();
            depths.push_back(f.role == FaceRole::Wall ? touchingBall(solid, p, inward, 1e-3, 0.05).depth
                                                      : std::max(0.0, solid.depth(p)));
        }
    }
    const auto balls = [&](double e) {
        double n = 0;
        for (double d : depths) n += total / static_cast<double>(depths.size()) / (kPatchShare * (2 * e * d + e * e));
        return n;
    };
    double lo = 1e-7, hi = 2;
    for (int i = 0; i < 60; ++i) (balls(std::sqrt(lo * hi)) > leaves ? lo : hi) = std::sqrt(lo * hi);
    return hi;
}

/// Rounds of settling, dropping what the others make idle and patching what falls bare, at a growth that follows the
/// count. Returns the best proven cover, at worst the one given.
Cover relax(Cover cover, const CoverSearch& search, const SolidDepth& solid, const CoverCertificate& certificate,
            std::size_t most, const Heartbeat& heartbeat) {
    Cover best = cover;
    for (int round = 0; round < kRelaxRounds; ++round) {
        settleBalls(cover, solid, certificate, kResolution * cover.growth, heartbeat);
        search.dropSpare(cover);
        search.patch(cover, most + most / 20);
        const bool good = cover.proven && cover.balls.size() <= most;
        if (good && cover.growth < best.growth) best = cover;
        const double fill = static_cast<double>(cover.balls.size()) / static_cast<double>(most);
        // A round more frees more balls: one that failed grows only a little.
        cover.growth *= good ? std::pow(0.985 * fill, 0.8) : 1.005;
    }
    return best;
}

/// The least growth that it can find with at most `leaves` balls. Always succeeds.
Cover searchCover(const RepairedMesh& mesh, const SolidDepth& solid, const CoverCertificate& certificate, int leaves,
                  Progress& progress, const Heartbeat& heartbeat) {
    const auto most = static_cast<std::size_t>(leaves);
    const std::size_t sampleLimit = 40 * most + 4000;
    // Few leaves can afford many candidates.
    const double spacing = kSpacing * std::clamp(std::sqrt(leaves / 512.0), 0.7, 1.0);
    double growth = estimateGrowth(mesh, solid, leaves, heartbeat);
    std::optional<Cover> best;
    double tooSmall = 0;  // the largest growth that did not suffice
    for (int sampling = 0; sampling < kSamplings; ++sampling) {
        const double sampled = growth;
        progress.enter(0.1 + 0.8 * (1 - std::pow(0.4, sampling)));
        SurfaceSamples samples = sampleSurface(mesh, solid, growth, spacing, sampleLimit, heartbeat);
        progress.enter(0.1 + 0.8 * (1 - 0.5 * std::pow(0.4, sampling)));
        CoverSearch search(std::move(samples), solid, certificate, heartbeat);
        bool done = false;
        for (int step = 0; step < kSearchSteps && !done; ++step) {
            Cover cover = search.cover(growth, most);
            const double ratio = static_cast<double>(cover.balls.size()) / leaves;
            if (cover.proven && ratio <= 1) {
                if (!best || growth < best->growth) best = std::move(cover);
                done = ratio > kGoodFill || best->growth < 1.01 * tooSmall;
                growth *= std::clamp(std::pow(ratio, 0.8), 0.25, 0.99);
            } else {
                tooSmall = std::max(tooSmall, growth);
                growth *= std::clamp(1.003 * std::pow(ratio, 0.8), 1.003, 4.0);
            }
            if (best) {
                if (!(growth > tooSmall && growth < best->growth)) growth = 0.5 * (tooSmall + best->growth);
                tooSmall = std::min(tooSmall, 0.999 * best->growth);
            }
            // Samples spaced for another growth are too few or too many.
            if (growth > 1.7 * sampled || growth < sampled / 1.7) break;
            done = done || (step + 1 == kSearchSteps && best);
        }
        if (best && (done || sampling + 1 == kSamplings))
            return relax(std::move(*best), search, solid, certificate, most, heartbeat);
    }
    // A stubborn surface: accept any growth that can be proven, down to one ball around all.
    for (growth = std::max(growth, 1e-4);; growth *= 2) {
        CoverSearch search(sampleSurface(mesh, solid, growth, spacing, sampleLimit, heartbeat), solid, certificate,
                           heartbeat);
        Cover cover = search.cover(growth, most);
        if (cover.proven && cover.balls.size() <= most) return cover;
        if (growth > kWholeBody) {
            cover.balls.resize(1);
            return cover;
        }
    }
}

/// A float not below x.
float roundedUp(double x) {
    const auto f = static_cast<float>(x);
    return f >= x ? f : std::nextafter(f, std::numeric_limits<float>::max());
}

// Each coordinate on its own and through memory: g++ 12 at -O2 drops the rounding of a vector cast to float and back.
Sphere singlePrecision(const Vec3& c) {
    return {static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z()), 0};
}

Vec3 centerOf(const Sphere& s) { return {s.x, s.y, s.z}; }

/// What the user should know, in one sentence; empty if all is well.
std::string noteFor(const RepairedMesh& body, const TreeCertificate& certificate, double depth, int leaves) {
    if (!certificate.covered)
        return "Single precision leaves gaps between the spheres; move the part nearer to the origin of its frame.";
    if (std::any_of(body.faces.begin(), body.faces.end(), [](const Face& f) { return f.exposed; }))
        return "The surface is open or does not bound a volume: where it is open it is felt as a sheet as thick as its "
               "spheres, so close the mesh if it is meant to be solid.";
    if (body.holes > 0)
        return "The surface has " + std::to_string(body.holes) +
               (body.holes == 1 ? " small hole that is" : " small holes that are") +
               " taken as closed, and the protrusion is measured to the closed surface.";
    const double e = certificate.protrusion * body.scale;
    if (depth > 0 && 2 * depth < e) {
        // Leaves go as 1 / (2 e d + e^2); wanted is a protrusion of the half thickness.
        const double more = std::min(1e9, leaves * (2 * e * depth + e * e) / (3 * depth * depth));
        return "The leaves reach further out of the part than it is thick; about " +
               std::to_string(std::llround(more / 1000 + 1) * 1000) + " leaves would follow it.";
    }
    return {};
}

}  // namespace

SphereTree buildSphereTree(const TriangleMesh& mesh, const TreeOptions& options, const BuildProgress& report) {
    Progress progress(report);
    const Heartbeat heartbeat = [&] { progress.beat(); };
    const int leaves = std::max(1, options.leaves);

    progress.enter(0.1);
    const RepairedMesh body = repairMesh(mesh);
    heartbeat();
    const SolidDepth solid(body);
    const CoverCertificate certificate(body.cover);
    Cover cover = searchCover(body, solid, certificate, leaves, progress, heartbeat);
    progress.enter(0.95);
    const double resolution = kResolution * cover.growth;
    if (cover.proven) settleBalls(cover, solid, certificate, resolution, heartbeat);

    // Centres as floats hold them, and their depths measured there; then the radius that each ball's pieces ask for.
    progress.enter(0.97);
    const double s = body.scale;
    std::vector<Sphere> spheres;
    for (const Ball& b : cover.balls) spheres.push_back(singlePrecision(b.center / s));
    for (std::size_t i = 0; i < spheres.size(); ++i) {
        heartbeat();
        cover.balls[i].center = centerOf(spheres[i]) * s;
        cover.balls[i].depth = solid.depth(cover.balls[i].center);
    }
    const CoverCertificate::Proof proof = certificate.prove(cover.balls, cover.growth, resolution, heartbeat);
    double extent = 0;
    for (const Triangle& t : body.cover)
        for (const Vec3& v : t) extent = std::max(extent, v.cwiseAbs().maxCoeff());
    const double rounding = 16 * std::numeric_limits<double>::epsilon() * extent;  // of a corner and its distance
    std::vector<Sphere> leafSpheres;
    for (std::size_t i = 0; i < spheres.size(); ++i) {
        if (proof.need[i] == -HUGE_VAL) continue;  // idle
        spheres[i].r = roundedUp((cover.balls[i].depth + proof.need[i] + 2 * rounding) / s);
        leafSpheres.push_back(spheres[i]);
    }

    // The certificate is of the leaves as the tree holds them.
    SphereTree tree = makeSphereTree(std::move(leafSpheres));
    std::vector<Ball> stored;
    std::vector<double> depths;
    double protrusion = 0;
    for (int i = 0; i < tree.leafCount(); ++i) {
        heartbeat();
        const Sphere leaf = tree.leaf(i);
        stored.push_back({centerOf(leaf) * s, leaf.r * s});
        depths.push_back(solid.depth(stored.back().center));
        protrusion = std::max(protrusion, stored.back().depth - depths.back());
    }
    TreeCertificate& out = tree.certificate;
    out.diagonal = body.diagonal / s;
    out.protrusion = (protrusion + body.weld + rounding) / s;
    out.covered = certificate.gaps(stored, -rounding, resolution, 1, heartbeat).empty();
    out.closed = body.closed();
    const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), middle, depths.end());
    out.note = noteFor(body, out, *middle, leaves);
    progress.enter(1);
    progress.finish();
    return tree;
}

}  // namespace touchstone
