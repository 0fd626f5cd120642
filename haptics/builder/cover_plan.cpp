#include "haptics/builder/cover_plan.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "haptics/builder/mesh_faces.hpp"

namespace touchstone {
namespace {

constexpr double kSpacing = 0.45;      // of the samples, in patch radii: closer gains little and costs its square
constexpr double kWholeBody = 4;       // growth beyond which any ball holds the whole body; its diagonal is below 2
constexpr double kRelaxGain = 1.18;    // balls more than asked for that the rounds after the greedy cover save
constexpr double kFallOff = 0.7;       // growth goes about as count to the power of minus this
constexpr double kSearched = 0.97;     // of the progress, at the end
constexpr double kFirstRound = 0.45;   // of the progress, where the rounds begin
constexpr double kCautious = 1.2;      // samples for too small a growth are many, for too large a one few
constexpr double kBloated = 1.2;       // balls over those asked for, beyond which a cover is not worth relaxing
constexpr int kSearchSteps = 8;        // greedy covers in all
constexpr double kStaleSamples = 1.5;  // samples spaced for a growth serve for others within this factor

struct Effort {
    int rounds;    ///< of relaxing
    int patience;  ///< rounds without gain before it ends
};
constexpr Effort kTightenBest{40, 12};
constexpr Effort kSaveFast{2, 2}, kSaveBest{20, 3};  // the rounds of a fixed growth save 6, 3, 2, 1 %

/// Rounds cost as the leaves they move: a coarse tree can afford more.
Effort tightenFast(std::size_t leaves) {
    const double ratio = 4096 / static_cast<double>(std::max<std::size_t>(leaves, 1));
    const int rounds = static_cast<int>(std::lround(6 * std::clamp(std::sqrt(ratio), 1.0, 6.0)));
    return {rounds, std::max(6, rounds / 2)};
}

/// The growth at which about `count` balls will do: a ball of depth d covers patches of squared radius 2 e d + e^2.
double estimateGrowth(const CoverTask& task, double count) {
    constexpr int kProbes = 1500;
    constexpr double kPatchShare = 3.3;  // patch area a ball ends up with, in squared radii: measured on the bunny
    double total = 0;
    for (const Face& f : task.mesh.faces)
        if (f.role != FaceRole::Cap) total += areaOf(f.corners);
    double growth = 4e-3;
    // Balls may sink into the facets by a share of the growth, so depths depend on it.
    for (int pass = 0; pass < 3; ++pass) {
        std::vector<double> depths;
        double sum = 0;
        for (const Face& f : task.mesh.faces) {
            if (f.role == FaceRole::Cap) continue;
            const double before = sum;
            sum += areaOf(f.corners);
            const auto first = static_cast<int>(before / total * kProbes),
                       last = static_cast<int>(sum / total * kProbes);
            for (int i = first; i < last; ++i) {
                // Spread over the triangle by the golden ratio and its square.
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
    // Few leaves can afford many candidates, and very many leaves need not.
    const auto n = static_cast<double>(balls);
    const double spacing =
        kSpacing * std::clamp(std::sqrt(n / 512), 0.7, 1.0) * std::clamp(std::pow(n / 8192, 0.25), 1.0, 1.4);
    return sampleSurface(task.mesh, task.solid, growth, spacing, 40 * balls + 4000, task.certificate.law(), task.seed,
                         task.workers);
}

struct Verdict {
    bool better;   ///< than every cover before
    bool restart;  ///< from the best cover
    double growth;
};

/// Rounds of settling, dropping what the others make idle and patching what falls bare. `judge` is told the cover that
/// a round made, the best one before (or null) and whether the next round is the last, and says how to go on.
template <class Judge>
Cover relax(const CoverTask& task, const Effort& effort, const CoverSearch& search, Cover cover, std::size_t most,
            Judge&& judge) {
    std::optional<Cover> best;
    int idle = 0;
    const auto share = [&] { return dropIdle(cover, task.certificate, proofResolution(cover.growth), task.workers); };
    CoverCertificate::Proof shares = share();
    // Without any success the growth rises from round to round, so this ends.
    for (int round = 0; round < effort.rounds ? idle < effort.patience : !best && round < effort.rounds + 20; ++round) {
        task.progress.enter(kFirstRound +
                            (kSearched - kFirstRound) * std::min(1.0, double(round + 1) / double(effort.rounds)));
        settleBalls(cover, shares, task.solid, task.certificate.law(), task.workers);
        search.dropSpare(cover);
        search.patch(cover, most);
        shares = share();
        const Verdict verdict = judge(std::as_const(cover), best ? &*best : nullptr, round + 2 == effort.rounds);
        idle = verdict.better ? 0 : idle + 1;
        if (verdict.better) best = cover;
        if (verdict.restart) cover = *best;
        cover.growth = verdict.growth;
        if (verdict.restart) shares = share();
    }
    return best ? std::move(*best) : std::move(cover);
}

}  // namespace

Cover tightestCover(const CoverTask& task, std::size_t most) {
    const double wanted = kRelaxGain * static_cast<double>(most);
    const auto room = static_cast<std::size_t>(1.5 * wanted) + 4;
    std::optional<CoverSearch> search;
    double sampled = 0;
    const auto coverWith = [&](double growth) {
        if (!search || growth > kStaleSamples * sampled || sampled > kStaleSamples * growth) {
            search.reset();  // its memory goes first
            search.emplace(samplesFor(task, growth, most), task.solid, task.certificate, task.workers);
            sampled = growth;
        }
        return search->cover(growth, room);
    };

    // Greedy covers, until one has about the count that relaxing brings down to what was asked for. Counts can jump:
    // the growths that were too small and large enough close in on such a place.
    double growth = kCautious * estimateGrowth(task, wanted), tooSmall = 0;
    Cover greedy{{}, HUGE_VAL, false};
    for (int step = 0; step < kSearchSteps; ++step) {
        task.progress.enter(kFirstRound * (1 - std::pow(0.25, step + 1)));
        Cover cover = coverWith(growth);
        const double ratio = static_cast<double>(cover.balls.size()) / wanted;
        const bool enough = cover.proven && ratio < 1.15;
        if (!enough)
            tooSmall = std::max(tooSmall, growth);
        else if (growth < greedy.growth)
            greedy = std::move(cover);
        if ((enough && ratio > 0.8) || greedy.growth < 1.03 * tooSmall) break;
        const double power = std::pow(ratio, kFallOff);
        growth *= enough ? std::clamp(power, 0.25, 0.95) : std::clamp(power, 1.1, 4.0);
        if (!(growth > tooSmall && growth < greedy.growth)) growth = std::sqrt(tooSmall * greedy.growth);
    }
    // A stubborn surface: accept any growth that can be proven, down to one ball around all.
    for (growth = std::max(growth, 1e-4); !greedy.proven; growth *= 2) {
        Cover cover = coverWith(growth);
        if (cover.proven && cover.balls.size() <= most) return cover;
        if (growth > kWholeBody) {
            cover.balls.resize(1);
            return cover;
        }
    }

    const auto judge = [&](const Cover& c, const Cover* best, bool lastNext) -> Verdict {
        const double fill = static_cast<double>(c.balls.size()) / static_cast<double>(most);
        if (c.proven && fill <= 1)
            return {!best || c.growth < best->growth, false, c.growth * std::pow(0.975 * fill, kFallOff)};
        // A round more frees more balls: one that does not fit grows only a little.
        double next = c.growth * (c.proven ? std::max(1.003, std::pow((lastNext ? 1 : 0.985) * fill, kFallOff)) : 1.1);
        if (best && !(next < best->growth)) next = std::sqrt(c.growth * best->growth);
        return {false, best && (!c.proven || fill > kBloated), next};
    };
    return relax(task, task.quality == TreeQuality::Fast ? tightenFast(most) : kTightenBest, *search, std::move(greedy),
                 room, judge);
}

Cover smallestCover(const CoverTask& task, double growth, std::size_t most) {
    task.progress.enter(kFirstRound / 2);
    CoverSearch search(samplesFor(task, growth, most), task.solid, task.certificate, task.workers);
    task.progress.enter(kFirstRound);
    Cover cover = search.cover(growth, most + most / 4);
    if (!cover.proven) return cover;
    const auto judge = [&](const Cover& c, const Cover* best, bool) -> Verdict {
        return {c.proven && c.balls.size() < (best ? best->balls.size() : most + 1), false, c.growth};
    };
    return relax(task, task.quality == TreeQuality::Fast ? kSaveFast : kSaveBest, search, std::move(cover),
                 most + most / 4, judge);
}

}  // namespace touchstone
