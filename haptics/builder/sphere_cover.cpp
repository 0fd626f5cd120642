#include "haptics/builder/sphere_cover.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <tuple>

namespace touchstone {
namespace {

// Share of the growth that is used to cover the samples; the rest covers the surface between them.
constexpr double kShare = 0.85;
// Maximum number of rounds of patching.
constexpr int kPatchRounds = 10;
// A ball is dropped if no other ball covers at most this many of its samples.
constexpr int kSpare = 2;
// Number of steps in which a ball moves.
constexpr int kSettleSteps = 14;
// Tolerance of the depth, as a share of the step.
constexpr double kStepTolerance = 0.002;
// Maximum number of gaps that are listed at a time, for each ball that may be used.
constexpr std::size_t kMaxGaps = 20;

std::vector<Box> boxesOf(const std::vector<Vec3>& points) {
    std::vector<Box> boxes(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) boxes[i].add(points[i]);
    return boxes;
}

/// Moves a ball to reduce the growth that it needs to cover the points of `share`. It moves toward the farthest point
/// and away from the nearest wall, by shrinking steps that never leave the free ball around its center.
void settle(Ball& ball, const std::vector<Vec3>& share, const SolidDepth& solid, double step) {
    const auto farthest = [&](const Vec3& c) {
        const Vec3* far = &share.front();
        for (const Vec3& p : share)
            if ((p - c).squaredNorm() > (*far - c).squaredNorm()) far = &p;
        return std::pair(*far, (*far - c).norm());
    };
    const double tolerance = kStepTolerance * step;
    TriangleBvh::Hit hit = solid.wall(ball.center, ball.depth + 4 * tolerance, 0, tolerance);
    if (hit.triangle < 0) return;
    Vec3 far;
    double need = 0;
    std::tie(far, need) = farthest(ball.center);
    need -= ball.depth;
    const auto improves = [&](const Vec3& direction) {
        const double length = std::min(step, 0.9 * ball.depth), norm = direction.norm();
        if (!(norm > 1e-3)) return false;
        const Vec3 c = ball.center + length / norm * direction;
        const auto [newFar, newDistance] = farthest(c);
        if (newDistance - ball.depth - length >= need) return false;  // no possible depth there would help
        const TriangleBvh::Hit newHit =
            solid.wall(c, ball.depth + length + 2 * tolerance, newDistance - need + tolerance, tolerance);
        const double newDepth = std::min(newHit.distance, ball.depth + length + 2 * tolerance) - tolerance;
        if (newHit.triangle < 0 || newDistance - newDepth >= need) return false;
        need = newDistance - newDepth;
        ball = {c, newDepth};
        hit = newHit;
        far = newFar;
        return true;
    };
    for (int i = 0; i < kSettleSteps; ++i) {
        const Vec3 toward = (far - ball.center).normalized(), away = (ball.center - hit.point).normalized();
        // On a ridge of the depth, as in the middle of a plate, only a step parallel to the wall improves the ball.
        if (!improves(toward + away) && !improves(toward - toward.dot(away) * away)) step *= 0.5;
    }
}

}  // namespace

PointIndex::PointIndex(const std::vector<Vec3>& points) : tree_(boxesOf(points)) {
    for (int a = 0; a < 3; ++a) {
        for (int i : tree_.order()) at_[a].push_back(points[i][a]);
        at_[a].resize(points.size() + 4, HUGE_VAL);
    }
}

CoverSearch::CoverSearch(SurfaceSamples samples, const SolidDepth& solid, const CoverCertificate& certificate,
                         const Workers& workers)
    : samples_(std::move(samples)), solid_(solid), certificate_(certificate), workers_(workers) {}

CoverSearch::Reach CoverSearch::reachOf(const std::vector<Vec3>& points, const std::vector<Ball>& balls, double growth,
                                        double share) const {
    const PointIndex index(points);
    Reach reach;
    reach.blocks.resize((balls.size() + Reach::kBlock - 1) / Reach::kBlock);
    workers_.eachRange(balls.size(), Reach::kBlock, [&](std::size_t first, std::size_t last) {
        Reach::Block& block = reach.blocks[first / Reach::kBlock];
        for (std::size_t b = first; b < last; ++b) {
            const Ball& ball = balls[b];
            index.within(ball.center, ball.depth + share * certificate_.law()(ball.depth, growth),
                         [&](int sample, double distance) {
                             block.entries.push_back({sample, static_cast<float>(distance - ball.depth)});
                         });
            block.start.push_back(static_cast<std::uint32_t>(block.entries.size()));
        }
        block.entries.shrink_to_fit();
    });
    return reach;
}

// Takes the ball that covers the most bare samples, again and again. The counts only fall, so an old count is an
// upper bound and only the top of the heap needs a recount.
void CoverSearch::coverGreedily(const Reach& reach, double growth, double share, std::size_t maxBalls,
                                std::vector<char>& covered, std::vector<Ball>& balls) const {
    std::vector<float> limits;
    for (const Ball& ball : samples_.balls)
        limits.push_back(static_cast<float>(share * certificate_.law()(ball.depth, growth)));
    const auto gain = [&](int ball) {
        int n = 0;
        for (const auto& entry : reach.of(ball)) n += entry.need <= limits[ball] && !covered[entry.sample];
        return n;
    };
    struct Choice {
        int gain, ball;
        bool operator<(const Choice& o) const { return gain < o.gain || (gain == o.gain && ball > o.ball); }
    };
    std::vector<Choice> choices;
    const int candidates = static_cast<int>(samples_.balls.size());
    for (int b = 0; b < candidates; ++b)
        if (const int n = gain(b); n > 0) choices.push_back({n, b});
    std::priority_queue<Choice> heap({}, std::move(choices));
    for (int beat = 1; !heap.empty() && balls.size() <= maxBalls; ++beat) {
        if (beat % 1024 == 0) workers_.beat();
        Choice top = heap.top();
        heap.pop();
        top.gain = gain(top.ball);
        if (top.gain == 0) continue;
        if (!heap.empty() && top < heap.top()) {
            heap.push(top);
            continue;
        }
        balls.push_back(samples_.balls[top.ball]);
        for (const auto& entry : reach.of(top.ball))
            if (entry.need <= limits[top.ball]) covered[entry.sample] = 1;
    }
}

Cover CoverSearch::cover(double growth, std::size_t maxBalls) {
    if (growth > reachGrowth_) {
        reachGrowth_ = 1.15 * growth;
        reach_ = reachOf(samples_.points, samples_.balls, reachGrowth_, kShare);
    }
    Cover out{{}, growth, false};
    std::vector<char> covered(samples_.points.size(), 0);
    coverGreedily(reach_, growth, kShare, 2 * maxBalls, covered, out.balls);
    patch(out, maxBalls);
    return out;
}

void CoverSearch::patch(Cover& out, std::size_t maxBalls) const {
    const double growth = out.growth, resolution = proofResolution(growth);
    const std::size_t limit = kMaxGaps * (maxBalls + 1000);
    const auto bare = [&](const CoverCertificate& surface) {
        return surface.gaps(out.balls, growth, resolution, limit, workers_);
    };
    std::vector<CoverCertificate::Gap> gaps = bare(certificate_);
    for (int round = 0; round < kPatchRounds && !gaps.empty() && out.balls.size() <= maxBalls; ++round) {
        std::vector<Vec3> points;
        std::vector<Triangle> pieces;
        for (const auto& gap : gaps) {
            points.push_back(gap.point);
            pieces.push_back(gap.piece);
        }
        Reach reach = reachOf(points, samples_.balls, growth, 1);
        for (Reach::Block& block : reach.blocks)
            for (auto& entry : block.entries) entry.need += static_cast<float>(gaps[entry.sample].margin);
        std::vector<char> patched(points.size(), 0);
        coverGreedily(reach, growth, 1, 2 * maxBalls, patched, out.balls);
        for (std::size_t i = 0; i < points.size() && out.balls.size() <= maxBalls; ++i)
            if (!patched[i]) out.balls.push_back({points[i], std::max(0.0, solid_.depth(points[i]))});
        // Balls are only added, so covered pieces stay covered: check only the bare pieces again, unless there were too
        // many to list.
        const bool all = gaps.size() < limit;
        gaps = all ? bare(CoverCertificate(std::move(pieces), certificate_.law())) : bare(certificate_);
    }
    out.proven = gaps.empty();
}

void CoverSearch::dropRedundant(Cover& cover) const {
    const Reach reach = reachOf(samples_.points, cover.balls, cover.growth, kShare);
    std::vector<int> coverers(samples_.points.size(), 0);
    for (const Reach::Block& block : reach.blocks)
        for (const auto& entry : block.entries) ++coverers[entry.sample];
    const auto alone = [&](int ball) {
        int n = 0;
        for (const auto& entry : reach.of(ball)) n += coverers[entry.sample] == 1;
        return n;
    };
    std::vector<std::pair<int, int>> order;
    for (int b = 0; b < static_cast<int>(cover.balls.size()); ++b)
        if (const int n = alone(b); n <= kSpare) order.emplace_back(n, b);
    std::sort(order.begin(), order.end());
    std::vector<char> dropped(cover.balls.size(), 0);
    for (const auto& [n, ball] : order) {
        if (alone(ball) > kSpare) continue;
        dropped[ball] = 1;
        for (const auto& entry : reach.of(ball)) --coverers[entry.sample];
    }
    std::size_t kept = 0;
    for (std::size_t b = 0; b < cover.balls.size(); ++b)
        if (!dropped[b]) cover.balls[kept++] = cover.balls[b];
    cover.balls.resize(kept);
    cover.proven = false;
}

CoverCertificate::Proof assignPieces(Cover& cover, const CoverCertificate& certificate, double resolution,
                                     const Workers& workers) {
    CoverCertificate::Proof proof = certificate.prove(cover.balls, cover.growth, resolution, workers);
    std::vector<int> place(cover.balls.size());
    int kept = 0;
    for (std::size_t b = 0; b < cover.balls.size(); ++b) {
        place[b] = kept;
        if (proof.need[b] == -HUGE_VAL) continue;
        cover.balls[kept] = cover.balls[b];
        proof.need[kept++] = proof.need[b];
    }
    cover.balls.resize(kept);
    proof.need.resize(kept);
    for (auto& piece : proof.pieces) piece.ball = place[piece.ball];
    return proof;
}

void relaxBalls(Cover& cover, const CoverCertificate::Proof& proof, const SolidDepth& solid, GrowthLaw law,
                const Workers& workers) {
    // Sort the pieces by ball.
    std::vector<std::uint32_t> start(cover.balls.size() + 1, 0), order(proof.pieces.size());
    for (const auto& piece : proof.pieces) ++start[piece.ball + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<std::uint32_t> next = start;
    for (std::uint32_t i = 0; i < order.size(); ++i) order[next[proof.pieces[i].ball]++] = i;
    constexpr std::size_t kGrain = 64;
    workers.eachRange(cover.balls.size(), kGrain, [&](std::size_t first, std::size_t last) {
        std::vector<Vec3> share;
        for (std::size_t b = first; b < last; ++b) {
            share.clear();
            for (std::uint32_t i = start[b]; i < start[b + 1]; ++i)
                share.insert(share.end(), proof.pieces[order[i]].corners.begin(), proof.pieces[order[i]].corners.end());
            if (!share.empty() && cover.balls[b].depth > 0)
                settle(cover.balls[b], share, solid, law(cover.balls[b].depth, cover.growth) / 2);
        }
    });
}

}  // namespace touchstone
