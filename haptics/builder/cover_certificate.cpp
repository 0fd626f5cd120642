#include "haptics/builder/cover_certificate.hpp"

#include <algorithm>
#include <cmath>

namespace touchstone {
namespace {

// Maximum number of halvings of one triangle: beyond it the corners coincide in double precision.
constexpr int kMaxDepth = 60;

/// Growth of this ball, as a share of the growth of the smallest balls.
double weightOf(const Ball& ball, const GrowthLaw& law, double growth) {
    return growth > 0 ? law(ball.depth, growth) / growth : 1;
}

/// Stacked lists of balls in a layout that is read four balls at a time.
class NearBalls {
  public:
    NearBalls() = default;
    NearBalls(std::span<const Ball> balls, const GrowthLaw& law, double growth) {
        reserve(balls.size());
        for (std::size_t i = 0; i < balls.size(); ++i) {
            for (int a = 0; a < 3; ++a) value_[a][i] = balls[i].center[a];
            value_[3][i] = balls[i].depth;
            value_[4][i] = weightOf(balls[i], law, growth);
            id_[i] = static_cast<int>(i);
        }
    }
    void reserve(std::size_t n) {
        if (n + 4 <= id_.size()) return;
        for (auto& v : value_) v.resize(n + n / 2 + 4);
        id_.resize(n + n / 2 + 4);
    }
    /// Four balls from i on. `value` is 0 to 2 for the center, 3 for the depth and 4 for the weight.
    Eigen::Map<const Eigen::Array4d> at(int value, std::size_t i) const {
        return Eigen::Map<const Eigen::Array4d>(value_[value].data() + i);
    }
    int id(std::size_t i) const { return id_[i]; }
    void copy(const NearBalls& from, std::size_t i, std::size_t to) {
        for (std::size_t k = 0; k < value_.size(); ++k) value_[k][to] = from.value_[k][i];
        id_[to] = from.id_[i];
    }

  private:
    std::array<std::vector<double>, 5> value_;
    std::vector<int> id_;
};

}  // namespace

/// One descent from a tree node to its triangles and their pieces. Each of them has a list of the balls that may touch
/// it, stored behind the list of its parent.
class CoverCertificate::Walk {
  public:
    Walk(const CoverCertificate& c, std::pair<int, int> part, std::span<const Ball> balls, const NearBalls& all,
         double growth, double resolution)
        : c_(c),
          part_(part),
          balls_(balls),
          all_(all),
          growth_(growth),
          initialGrowth_(growth),
          resolution_(resolution) {}

    bool raise = false;     ///< raise the growth where a piece is bare, instead of reporting a gap
    std::size_t limit = 0;  ///< maximum number of gaps
    std::vector<Gap> gaps;
    std::vector<Piece> pieces;  ///< filled when raising

    void run() {
        const auto& [node, slot] = part_;
        visitSlot(all_, c_.tree_.nodes()[node], slot, 0, balls_.size(), 0);
        nearby_ = {};
    }
    double growth() const { return growth_; }

  private:
    bool full() const { return !raise && gaps.size() >= limit; }

    // Appends the balls of [first, last) that touch the box at `end`, and returns the end of the new list. When the
    // growth may rise, a margin keeps the list complete while it rises a little during the visit of the box.
    std::size_t narrow(const NearBalls& from, const Box& box, std::size_t first, std::size_t last, std::size_t end) {
        const double margin = raise ? 1.5 * growth_ : growth_;
        nearby_.reserve(end + last - first);
        for (std::size_t i = first; i < last; i += 4) {
            Eigen::Array4d off2 = Eigen::Array4d::Zero();
            for (int a = 0; a < 3; ++a) {
                const Eigen::Array4d c = from.at(a, i);
                off2 += (box.lo[a] - c).max(c - box.hi[a]).max(0.0).square();
            }
            const Eigen::Array4d r = from.at(3, i) + margin * from.at(4, i);
            const Eigen::Array<bool, 4, 1> touches = r >= 0 && off2 <= r.square();
            for (std::size_t k = 0; k < std::min<std::size_t>(4, last - i); ++k)
                if (touches[static_cast<int>(k)]) nearby_.copy(from, i + k, end++);
        }
        return end;
    }

    void visitSlot(const NearBalls& from, const BoxTree::Node& node, int k, std::size_t first, std::size_t last,
                   std::size_t end) {
        if (node.count[k] < 0) return;
        Box box;
        for (int a = 0; a < 3; ++a) {
            box.lo[a] = node.lo[a][k];
            box.hi[a] = node.hi[a][k];
        }
        const std::size_t begin = end;
        end = narrow(from, box, first, last, end);
        if (node.count[k] == 0)
            for (int child = 0; child < 4 && !full(); ++child)
                visitSlot(nearby_, c_.tree_.nodes()[node.first[k]], child, begin, end, end);
        for (int i = 0; i < node.count[k] && !full(); ++i) visitPiece(c_.surface_[node.first[k] + i], begin, end, 0);
    }

    double weight(int ball) const { return weightOf(balls_[ball], c_.law_, initialGrowth_); }

    /// The ball that covers the piece with the least growth, and that growth. Searches the list, or all balls if it is
    /// empty.
    std::pair<int, double> nearest(const Triangle& t, std::size_t first, std::size_t last) const {
        std::pair<int, double> best{-1, HUGE_VAL};
        const auto consider = [&](int i) {
            double far2 = 0;
            for (const Vec3& v : t) far2 = std::max(far2, (v - balls_[i].center).squaredNorm());
            const double needed = (std::sqrt(far2) - balls_[i].depth) / weight(i);
            if (needed < best.second) best = {i, needed};
        };
        for (std::size_t i = first; i < last; ++i) consider(nearby_.id(i));
        for (int i = 0; first == last && i < static_cast<int>(balls_.size()); ++i) consider(i);
        return best;
    }

    void visitPiece(const Triangle& t, std::size_t first, std::size_t last, int level) {
        // Find the ball that covers the piece with the least growth, and which corners are bare.
        double least = HUGE_VAL;
        int best = -1;
        std::array<bool, 3> bare{true, true, true};
        for (std::size_t i = first; i < last; i += 4) {
            const Eigen::Array4d depth = nearby_.at(3, i), weight = nearby_.at(4, i), reach = depth + growth_ * weight;
            const Eigen::Array4d reach2 = (reach >= 0).select(reach.square(), -1.0);
            std::array<Eigen::Array4d, 3> distance2;
            Eigen::Array<bool, 4, 1> whole = Eigen::Array<bool, 4, 1>::Constant(true);
            for (int k = 0; k < 3; ++k) {
                distance2[k] = (nearby_.at(0, i) - t[k].x()).square() + (nearby_.at(1, i) - t[k].y()).square() +
                               (nearby_.at(2, i) - t[k].z()).square();
                for (std::size_t rest = last - i; rest < 4; ++rest) distance2[k][static_cast<int>(rest)] = HUGE_VAL;
                const Eigen::Array<bool, 4, 1> within = distance2[k] <= reach2;
                bare[k] = bare[k] && !within.any();
                whole = whole && within;
            }
            if (!whole.any()) continue;
            if (!raise) return;
            const Eigen::Array4d need = distance2[0].max(distance2[1]).max(distance2[2]).sqrt() - depth;
            for (int lane = 0; lane < 4; ++lane)
                if (whole[lane] && need[lane] / weight[lane] < least) {
                    least = need[lane] / weight[lane];
                    best = nearby_.id(i + static_cast<std::size_t>(lane));
                }
        }
        if (best >= 0) {
            if (raise) pieces.push_back({best, least * weight(best), t});
            return;
        }
        // No ball covers the whole piece: it is a gap if it is small or a corner is bare; else it is halved.
        const auto [longest, edge2] = longestEdge(t);
        const bool small = edge2 <= resolution_ * resolution_ || level >= kMaxDepth;
        const auto hole = std::find(bare.begin(), bare.end(), true);
        if (!raise && (small || hole != bare.end())) {
            const auto corner = hole != bare.end() ? hole - bare.begin() : 0;
            gaps.push_back({t[corner], std::min(std::sqrt(edge2), resolution_), t});
            return;
        }
        if (raise) {
            // A bare corner needs growth whether or not the piece is halved.
            if (hole != bare.end()) {
                const Vec3& v = t[hole - bare.begin()];
                growth_ = std::max(growth_, nearest({v, v, v}, first, last).second);
            }
            const auto [ball, needed] = nearest(t, first, last);
            if (small || needed <= growth_) {
                growth_ = std::max(growth_, needed);
                pieces.push_back({ball, needed * weight(ball), t});
                return;
            }
        }
        // Halve the longest edge, and visit both halves with the balls near them.
        const Vec3 &a = t[longest], &b = t[(longest + 1) % 3], &c = t[(longest + 2) % 3];
        const Vec3 m = 0.5 * (a + b);
        for (const Triangle& half : {Triangle{a, m, c}, Triangle{m, b, c}}) {
            if (full()) return;
            Box box;
            for (const Vec3& v : half) box.add(v);
            const std::size_t end = narrow(nearby_, box, first, last, last);
            visitPiece(half, last, end, level + 1);
        }
    }

    const CoverCertificate& c_;
    std::pair<int, int> part_;
    std::span<const Ball> balls_;
    const NearBalls& all_;
    double growth_;
    const double initialGrowth_;  ///< before it is raised; the weights of the balls are computed from it
    double resolution_;
    NearBalls nearby_;
};

CoverCertificate::CoverCertificate(std::vector<Triangle> surface, GrowthLaw law) : law_(law), tree_(boxesOf(surface)) {
    for (int i : tree_.order()) surface_.push_back(surface[i]);
    // Two levels of the four-way tree give at most 64 parts, enough to keep all threads busy.
    constexpr int kLevels = 2;
    const auto split = [&](auto&& self, int node, int level) -> void {
        for (int k = 0; k < 4; ++k)
            if (level < kLevels && tree_.nodes()[node].count[k] == 0)
                self(self, tree_.nodes()[node].first[k], level + 1);
            else
                parts_.emplace_back(node, k);
    };
    split(split, 0, 0);
}

std::vector<CoverCertificate::Gap> CoverCertificate::gaps(std::span<const Ball> balls, double growth, double resolution,
                                                          std::size_t limit, const Workers& workers) const {
    const NearBalls everything(balls, law_, growth);
    std::vector<Walk> all;
    for (const auto& part : parts_) all.emplace_back(*this, part, balls, everything, growth, resolution);
    workers.each(all.size(), [&](std::size_t i) {
        all[i].limit = limit;
        all[i].run();
    });
    std::vector<Gap> gaps;
    for (const Walk& walk : all) gaps.insert(gaps.end(), walk.gaps.begin(), walk.gaps.end());
    if (gaps.size() > limit) gaps.resize(limit);
    return gaps;
}

CoverCertificate::Proof CoverCertificate::prove(std::span<const Ball> balls, double growth, double resolution,
                                                const Workers& workers) const {
    const NearBalls everything(balls, law_, growth);
    std::vector<Walk> all;
    for (const auto& part : parts_) all.emplace_back(*this, part, balls, everything, growth, resolution);
    Proof out{growth, std::vector<double>(balls.size(), -HUGE_VAL), {}};
    workers.each(all.size(), [&](std::size_t i) {
        all[i].raise = true;
        all[i].run();
    });
    for (Walk& walk : all) {
        out.growth = std::max(out.growth, walk.growth());
        for (const Piece& piece : walk.pieces) out.need[piece.ball] = std::max(out.need[piece.ball], piece.need);
        out.pieces.insert(out.pieces.end(), walk.pieces.begin(), walk.pieces.end());
        walk.pieces = {};
    }
    return out;
}

}  // namespace touchstone
