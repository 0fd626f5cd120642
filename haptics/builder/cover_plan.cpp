#include "haptics/builder/cover_plan.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "haptics/builder/mesh_faces.hpp"

namespace touchstone {
namespace {

// Spacing of the samples, in patch radii. A smaller spacing gains little, and its cost grows with the inverse square.
constexpr double kSpacing = 0.45;
// Growth beyond which any ball contains the whole body, whose diagonal is below 2 in the frame of RepairedMesh.
constexpr double kWholeBody = 4;
// The relaxation after the greedy cover saves balls, so the greedy cover may use this many times the requested count.
constexpr double kRelaxGain = 1.18;
// The growth falls about as count^-kGrowthPower.
constexpr double kGrowthPower = 0.7;
// Fractions of the progress at the end of the greedy covers and at the end of the relaxation.
constexpr double kGreedyDone = 0.45;
constexpr double kRelaxDone = 0.97;
// The first growth is this many times the estimate: too small a growth needs many samples, too large a one only few.
constexpr double kFirstGrowth = 1.2;
// A cover with more than this many times the requested balls is not worth relaxing further.
constexpr double kMaxExcess = 1.2;
// Maximum number of greedy covers in the search for a growth.
constexpr int kMaxGreedyCovers = 8;
// Samples that were spaced for one growth are used for others within this factor.
constexpr double kSampleRange = 1.5;

struct Effort {
    int rounds;    ///< maximum number of relaxation rounds
    int patience;  ///< number of rounds without a gain after which the relaxation ends
};
constexpr Effort kTightenBest{40, 12};
constexpr Effort kSaveFast{2, 2}, kSaveBest{20, 3};  // at a fixed growth the rounds save 6, 3, 2, 1 % of the balls

/// The cost of a round is proportional to the number of leaves, so a coarse tree can afford more rounds.
Effort tightenFast(std::size_t leaves) {
    const double ratio = 4096 / static_cast<double>(std::max<std::size_t>(leaves, 1));
    const int rounds = static_cast<int>(std::lround(6 * std::clamp(std::sqrt(ratio), 1.0, 6.0)));
    return {rounds, std::max(6, rounds / 2)};
}

/// Estimates the growth e at which about `count` balls cover the surface. A ball of depth d covers a patch of squared
/// radius 2 e d + e^2.
double estimateGrowth(const CoverTask& task, double count) {
    constexpr int kProbes = 1500;        // number of surface points at which the depth is measured
    constexpr double kPatchShare = 3.3;  // mean patch area of a ball, in squared patch radii, measured on the bunny
    double total = 0;
    for (const Face& f : task.mesh.faces)
        if (f.role != FaceRole::Cap) total += areaOf(f.corners);
    double growth = 4e-3;
    // Balls may overlap the facets by a share of the growth, so the depths depend on the growth: iterate.
    for (int pass = 0; pass < 3; ++pass) {
        // Depths at points that are spread evenly over the surface.
        std::vector<double> depths;
        double sum = 0;
        for (const Face& f : task.mesh.faces) {
            if (f.role == FaceRole::Cap) continue;
            const double before = sum;
            sum += areaOf(f.corners);
            const auto first = static_cast<int>(before / total * kProbes),
                       last = static_cast<int>(sum / total * kProbes);
            for (int i = first; i < last; ++i) {
                // Quasi-random point of the triangle, from powers of the inverse plastic number.
                double u = std::fmod(0.5 + i * 0.7548776662466927, 1.0),
                       v = std::fmod(0.5 + i * 0.5698402909980532, 1.0);
                if (u + v > 1) {
                    u = 1 - u;
                    v = 1 - v;
                }
                const auto& [a, b, c] = f.corners;
                const Vec3 p = a + u * (b - a) + v * (c - a);
                const Vec3 inward = -(b - a).cross(c - a).normalized();
                task.workers.beat();
                depths.push_back(f.role == FaceRole::Wall ? touchingBall(task.solid, p, inward, growth / 4, 0.05).depth
                                                          : std::max(0.0, task.solid.depth(p)));
            }
        }
        // Bisection in the logarithm of the growth, for the requested number of balls.
        const auto balls = [&](double e) {
            double n = 0;
            for (double d : depths) {
                const double g = task.certificate.law()(d, e);
                n += total / static_cast<double>(depths.size()) / (kPatchShare * (2 * g * d + g * g));
            }
            return n;
        };
        double lo = 1e-7, hi = 2;
        for (int i = 0; i < 60; ++i) (balls(std::sqrt(lo * hi)) > count ? lo : hi) = std::sqrt(lo * hi);
        const double before = std::exchange(growth, hi);
        if (growth < 1.3 * before && before < 1.3 * growth) break;
    }
    return growth;
}

SurfaceSamples samplesFor(const CoverTask& task, double growth, std::size_t balls) {
    // With few leaves many candidates are affordable; with very many leaves they are not needed.
    const auto n = static_cast<double>(balls);
    const double spacing =
        kSpacing * std::clamp(std::sqrt(n / 512), 0.7, 1.0) * std::clamp(std::pow(n / 8192, 0.25), 1.0, 1.4);
    return sampleSurface(task.mesh, task.solid, growth, spacing, 40 * balls + 4000, task.certificate.law(), task.seed,
                         task.workers);
}

struct Verdict {
    bool better;    ///< the cover is better than every earlier one
    bool restart;   ///< the next round starts from the best cover
    double growth;  ///< of the next round
};

/// Relaxes a cover in rounds. Each round moves the balls, drops those that the others make redundant and patches what
/// becomes bare. `judge` receives the cover of the round, the best earlier one (or null) and whether the next round is
/// the last, and decides how to continue.
template <class Judge>
Cover relax(const CoverTask& task, const Effort& effort, const CoverSearch& search, Cover cover, std::size_t maxBalls,
            Judge&& judge) {
    std::optional<Cover> best;
    int roundsWithoutGain = 0;
    const auto assign = [&] {
        return assignPieces(cover, task.certificate, proofResolution(cover.growth), task.workers);
    };
    CoverCertificate::Proof proof = assign();
    // While no cover is good enough the growth rises from round to round, so this loop ends.
    for (int round = 0;
         round < effort.rounds ? roundsWithoutGain < effort.patience : !best && round < effort.rounds + 20; ++round) {
        task.progress.enter(kGreedyDone +
                            (kRelaxDone - kGreedyDone) * std::min(1.0, double(round + 1) / double(effort.rounds)));
        relaxBalls(cover, proof, task.solid, task.certificate.law(), task.workers);
        search.dropRedundant(cover);
        search.patch(cover, maxBalls);
        proof = assign();
        const Verdict verdict = judge(std::as_const(cover), best ? &*best : nullptr, round + 2 == effort.rounds);
        roundsWithoutGain = verdict.better ? 0 : roundsWithoutGain + 1;
        if (verdict.better) best = cover;
        if (verdict.restart) cover = *best;
        cover.growth = verdict.growth;
        if (verdict.restart) proof = assign();
    }
    return best ? std::move(*best) : std::move(cover);
}

}  // namespace

Cover tightestCover(const CoverTask& task, std::size_t maxBalls) {
    const double wanted = kRelaxGain * static_cast<double>(maxBalls);
    const auto room = static_cast<std::size_t>(1.5 * wanted) + 4;
    std::optional<CoverSearch> search;
    double sampled = 0;
    const auto coverWith = [&](double growth) {
        if (!search || growth > kSampleRange * sampled || sampled > kSampleRange * growth) {
            search.reset();  // frees its memory before the new samples are made
            search.emplace(samplesFor(task, growth, maxBalls), task.solid, task.certificate, task.workers);
            sampled = growth;
        }
        return search->cover(growth, room);
    };

    // Search for a growth whose greedy cover has about the count that relaxation reduces to the requested one. The
    // count may jump as a function of the growth; a bracket of a growth that is too small and one that is large enough
    // then closes in on the jump.
    double growth = kFirstGrowth * estimateGrowth(task, wanted), tooSmall = 0;
    Cover greedy{{}, HUGE_VAL, false};
    for (int step = 0; step < kMaxGreedyCovers; ++step) {
        task.progress.enter(kGreedyDone * (1 - std::pow(0.25, step + 1)));
        Cover cover = coverWith(growth);
        const double ratio = static_cast<double>(cover.balls.size()) / wanted;
        const bool enough = cover.proven && ratio < 1.15;
        if (!enough)
            tooSmall = std::max(tooSmall, growth);
        else if (growth < greedy.growth)
            greedy = std::move(cover);
        if ((enough && ratio > 0.8) || greedy.growth < 1.03 * tooSmall) break;
        const double power = std::pow(ratio, kGrowthPower);
        growth *= enough ? std::clamp(power, 0.25, 0.95) : std::clamp(power, 1.1, 4.0);
        if (!(growth > tooSmall && growth < greedy.growth)) growth = std::sqrt(tooSmall * greedy.growth);
    }
    // No cover was proven. Accept any growth that can be proven; in the end one ball contains the whole body.
    for (growth = std::max(growth, 1e-4); !greedy.proven; growth *= 2) {
        Cover cover = coverWith(growth);
        if (cover.proven && cover.balls.size() <= maxBalls) return cover;
        if (growth > kWholeBody) {
            cover.balls.resize(1);
            return cover;
        }
    }

    const auto judge = [&](const Cover& c, const Cover* best, bool lastNext) -> Verdict {
        const double fill = static_cast<double>(c.balls.size()) / static_cast<double>(maxBalls);
        if (c.proven && fill <= 1)
            return {!best || c.growth < best->growth, false, c.growth * std::pow(0.975 * fill, kGrowthPower)};
        // The next round saves more balls, so a cover with too many needs only a little more growth.
        double next =
            c.growth * (c.proven ? std::max(1.003, std::pow((lastNext ? 1 : 0.985) * fill, kGrowthPower)) : 1.1);
        if (best && !(next < best->growth)) next = std::sqrt(c.growth * best->growth);
        return {false, best && (!c.proven || fill > kMaxExcess), next};
    };
    return relax(task, task.quality == TreeQuality::Fast ? tightenFast(maxBalls) : kTightenBest, *search,
                 std::move(greedy), room, judge);
}

Cover smallestCover(const CoverTask& task, double growth, std::size_t maxBalls) {
    task.progress.enter(kGreedyDone / 2);
    CoverSearch search(samplesFor(task, growth, maxBalls), task.solid, task.certificate, task.workers);
    task.progress.enter(kGreedyDone);
    Cover cover = search.cover(growth, maxBalls + maxBalls / 4);
    if (!cover.proven) return cover;
    const auto judge = [&](const Cover& c, const Cover* best, bool) -> Verdict {
        return {c.proven && c.balls.size() < (best ? best->balls.size() : maxBalls + 1), false, c.growth};
    };
    return relax(task, task.quality == TreeQuality::Fast ? kSaveFast : kSaveBest, search, std::move(cover),
                 maxBalls + maxBalls / 4, judge);
}

}  // namespace touchstone
