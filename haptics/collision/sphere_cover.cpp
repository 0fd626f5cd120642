#include "haptics/collision/sphere_cover.hpp"

#include <algorithm>
#include <cmath>
#include <queue>

namespace touchstone {
namespace {

constexpr double kShare = 0.85;       // of the growth for the samples; the rest is for what lies between them
constexpr double kResolution = 0.15;  // of the growth: where halving pieces ends
constexpr int kPatchRounds = 10;
constexpr int kSpare = 2;  // samples that a ball may have to itself and yet be dropped
constexpr int kSettleSteps = 14;
constexpr std::size_t kMostGaps = 100000;

std::vector<Box> boxesOf(const std::vector<Vec3>& points) {
    std::vector<Box> boxes(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) boxes[i].add(points[i]);
    return boxes;
}

/// Moves a ball to where the growth that `share` asks of it is least: away from the nearest wall, toward the farthest
/// point, by shrinking steps that never leave the free ball it is in.
void settle(Ball& ball, const std::vector<Vec3>& share, const SolidDepth& solid, double step) {
    const auto farthest = [&](const Vec3& c) {
        const Vec3* far = &share.front();
        for (const Vec3& p : share)
            if ((p - c).squaredNorm() > (*far - c).squaredNorm()) far = &p;
        return std::pair(*far, (*far - c).norm());
    };
    TriangleBvh::Hit hit = solid.wall(ball.center, ball.depth * (1 + 1e-9) + 1e-12);
    if (hit.triangle < 0) return;
    auto [far, distance] = farthest(ball.center);
    double need = distance - hit.distance;
    const auto improves = [&](const Vec3& direction) {
        const double length = std::min(step, 0.9 * ball.depth), norm = direction.norm();
        if (!(norm > 1e-3)) return false;
        const Vec3 c = ball.center + length / norm * direction;
        const auto [newFar, newDistance] = farthest(c);
        if (newDistance - ball.depth - length >= need) return false;  // no depth it could have would help
        const TriangleBvh::Hit newHit = solid.wall(c, ball.depth + length * (1 + 1e-9) + 1e-12);
        if (newDistance - newHit.distance >= need) return false;
        need = newDistance - newHit.distance;
        ball = {c, newHit.distance};
        hit = newHit;
        far = newFar;
        return true;
    };
    for (int i = 0; i < kSettleSteps; ++i) {
        const Vec3 toward = (far - ball.center).normalized(), away = (ball.center - hit.point).normalized();
        // On a ridge of the depth, as in the middle of a plate, only the way along the wall leads on.
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
                         const Heartbeat& heartbeat)
    : samples_(std::move(samples)), solid_(solid), certificate_(certificate), heartbeat_(heartbeat) {}

CoverSearch::Reach CoverSearch::reachOf(const std::vector<Vec3>& points, const std::vector<Ball>& balls,
                                        double growth) const {
    const PointIndex index(points);
    Reach reach;
    for (const Ball& ball : balls) {
        if (reach.start.size() % 256 == 0) heartbeat_();
        index.within(ball.center, ball.depth + growth, [&](int sample, double distance) {
            reach.entries.push_back({sample, static_cast<float>(distance - ball.depth)});
        });
        reach.start.push_back(reach.entries.size());
    }
    return reach;
}

// The ball that covers most bare samples next. Counts only fall, so a stale count is an upper bound and only the top of
// the heap needs a recount.
void CoverSearch::coverGreedily(const Reach& reach, double growth, std::size_t most, std::vector<char>& covered,
                                std::vector<Ball>& balls) const {
    const float limit = static_cast<float>(growth);
    const auto gain = [&](int ball) {
        int n = 0;
        for (const auto& entry : reach.of(ball)) n += entry.need <= limit && !covered[entry.sample];
        return n;
    };
    struct Choice {
        int gain, ball;
        bool operator<(const Choice& o) const { return gain < o.gain || (gain == o.gain && ball > o.ball); }
    };
    std::vector<Choice> choices;
    for (int b = 0; b < static_cast<int>(reach.balls()); ++b)
        if (const int n = gain(b); n > 0) choices.push_back({n, b});
    std::priority_queue<Choice> heap({}, std::move(choices));
    for (int beat = 1; !heap.empty() && balls.size() <= most; ++beat) {
        if (beat % 1024 == 0) heartbeat_();
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
            if (entry.need <= limit) covered[entry.sample] = 1;
    }
}

Cover CoverSearch::cover(double growth, std::size_t most) {
    if (growth > reachGrowth_) {
        reachGrowth_ = 1.15 * growth;
        reach_ = reachOf(samples_.points, samples_.balls, kShare * reachGrowth_);
    }
    Cover out{{}, growth, false};
    std::vector<char> covered(samples_.points.size(), 0);
    coverGreedily(reach_, kShare * growth, 2 * most, covered, out.balls);
    patch(out, most);
    return out;
}

void CoverSearch::patch(Cover& out, std::size_t most) const {
    const double growth = out.growth;
    out.proven = false;
    for (int round = 0; round < kPatchRounds && out.balls.size() <= most; ++round) {
        const auto gaps = certificate_.gaps(out.balls, growth, kResolution * growth, kMostGaps, heartbeat_);
        if (gaps.empty()) {
            out.proven = true;
            break;
        }
        std::vector<Vec3> points;
        for (const auto& gap : gaps) points.push_back(gap.point);
        Reach reach = reachOf(points, samples_.balls, growth);
        for (auto& entry : reach.entries) entry.need += static_cast<float>(gaps[entry.sample].margin);
        std::vector<char> patched(points.size(), 0);
        coverGreedily(reach, growth, 2 * most, patched, out.balls);
        for (std::size_t i = 0; i < points.size() && out.balls.size() <= most; ++i)
            if (!patched[i]) out.balls.push_back({points[i], std::max(0.0, solid_.depth(points[i]))});
    }
}

void CoverSearch::dropSpare(Cover& cover) const {
    const Reach reach = reachOf(samples_.points, cover.balls, kShare * cover.growth);
    std::vector<int> coverers(samples_.points.size(), 0);
    for (const auto& entry : reach.entries) ++coverers[entry.sample];
    const auto alone = [&](int ball) {
        int n = 0;
        for (const auto& entry : reach.of(ball)) n += coverers[entry.sample] == 1;
        return n;
    };
    std::vector<std::pair<int, int>> order;
    for (int b = 0; b < static_cast<int>(reach.balls()); ++b)
        if (const int n = alone(b); n <= kSpare) order.emplace_back(n, b);
    std::sort(order.begin(), order.end());
    std::vector<char> dropped(reach.balls(), 0);
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

void settleBalls(Cover& cover, const SolidDepth& solid, const CoverCertificate& certificate, double resolution,
                 const Heartbeat& heartbeat) {
    const CoverCertificate::Proof proof = certificate.prove(cover.balls, cover.growth, resolution, heartbeat);
    std::vector<std::vector<Vec3>> share(cover.balls.size());
    for (const auto& [ball, piece] : proof.pieces) share[ball].insert(share[ball].end(), piece.begin(), piece.end());
    for (std::size_t b = 0; b < cover.balls.size(); ++b) {
        heartbeat();
        if (!share[b].empty() && cover.balls[b].depth > 0) settle(cover.balls[b], share[b], solid, cover.growth / 2);
    }
}

}  // namespace touchstone
