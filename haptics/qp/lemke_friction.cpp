#include "haptics/qp/lemke_friction.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "haptics/math/aligned.hpp"
#include "haptics/qp/friction_facets.hpp"

namespace touchstone {
namespace {

/// Smallest entry to pivot on, and difference of two ratios that counts as none. The tableau is scaled so that its
/// entries are about 1, and rounding grows with the pivots. Where contacts repeat each other, as at the corner of a
/// mesh, it leaves entries of some 1e-10, and a pivot on one of them spoils the tableau.
constexpr double kLeastPivot = 1e-8, kSameRatio = 1e-11;
constexpr int kPivotsPerUnknown = 10;
/// Largest violation of an answer, mm, and N per stiffness: a spoiled tableau is far beyond.
constexpr double kAccepted = 1e-6;
/// A pivot changes this number of entries in the time of one row x iteration of PQP.
constexpr int kEntriesPerRow = 100;

class LemkeFriction final : public FrictionSolver {
  public:
    LemkeFriction(int capacity, int facets);
    FrictionResult solve(const FrictionProblem& problem, const Vec6& start) noexcept override;
    void limitWork(std::int64_t limit) noexcept override { workLimit_ = limit; }

  private:
    void fill(const FrictionProblem& problem);
    bool follow(int& pivots);
    int leavingRow(int column) const;
    double perturbation(int row, int w) const;
    void pivot(int row, int column);
    double* row(int i) { return &tableau_[std::size_t(i) * std::size_t(n_ + 2)]; }
    const double* row(int i) const { return &tableau_[std::size_t(i) * std::size_t(n_ + 2)]; }

    int facets_;
    std::int64_t workLimit_ = INT64_MAX;
    int n_ = 0;         ///< unknowns
    double unit_ = 1;   ///< N: forces in the tableau are multiples of it, so that its entries are about 1
    int mostContacts_;  ///< in a tableau
    // basic = T nonbasic + q, row by row: a column for each of the n unknowns and for z0, then q. Variables are
    // w (0 .. n-1), z (n .. 2n-1) and z0 (2n); the complement of w_j is z_j.
    AlignedVector<double> tableau_;
    std::vector<int> basic_, nonbasic_;  ///< the variable of each row and column
    std::vector<int> place_;             ///< of each variable: its row, or n + its column
    std::vector<Vec6> wrenches_;         ///< of one newton along each direction: the normal, then the facets
    std::vector<Vec3> forces_;
};

LemkeFriction::LemkeFriction(int capacity, int facets)
    : facets_(facets), mostContacts_(std::min(capacity, kMostLemkeUnknowns / (facets + 2))) {
    assert(facets >= 4 && facets % 2 == 0);
    const std::size_t n = std::size_t(mostContacts_) * std::size_t(facets + 2);
    tableau_.resize(n * (n + 2));
    basic_.resize(n);
    nonbasic_.resize(n + 1);
    place_.resize(2 * n + 1);
    wrenches_.resize(std::size_t(mostContacts_) * std::size_t(facets + 1));
    forces_.resize(std::size_t(capacity));
}

/// Fills the tableau with w = M z + q + z0. The unknowns of each contact are f_n, a force β along each facet and λ.
void LemkeFriction::fill(const FrictionProblem& problem) {
    const int m = int(problem.contacts.size()), block = facets_ + 2;
    n_ = m * block;
    unit_ = problem.stiffness.head<3>().mean();
    std::fill_n(tableau_.begin(), std::size_t(n_) * std::size_t(n_ + 2), 0.0);
    // q, the wrench of one newton along each direction, and the rows Σ β <= µ f_n with their λ.
    for (int i = 0; i < m; ++i) {
        const FrictionContact& c = problem.contacts[std::size_t(i)];
        const Facets facets(c.n, facets_);
        for (int k = 0; k <= facets_; ++k) {
            const Vec3 d = k == 0 ? c.n : facets.direction(k - 1);
            Vec6& wrench = wrenches_[std::size_t(i * (facets_ + 1) + k)];
            wrench << d, c.r.cross(d);
            row(i * block + k)[n_ + 1] = wrench.dot(problem.wanted) + (k == 0 ? c.gap : d.dot(c.slipped));
        }
        double* limit = row(i * block + facets_ + 1);
        limit[i * block] = c.coefficient;
        for (int k = 1; k <= facets_; ++k) {
            row(i * block + k)[i * block + facets_ + 1] = 1;
            limit[i * block + k] = -1;
        }
    }
    // The motion along each direction that a force along any other causes.
    for (int i = 0; i < m * (facets_ + 1); ++i) {
        const Vec6 motion = unit_ * wrenches_[std::size_t(i)].cwiseQuotient(problem.stiffness);
        const int column = i / (facets_ + 1) * block + i % (facets_ + 1);
        for (int j = 0; j < m * (facets_ + 1); ++j)
            row(j / (facets_ + 1) * block + j % (facets_ + 1))[column] = wrenches_[std::size_t(j)].dot(motion);
    }
    // The column of z0, and the first basis: all w.
    for (int i = 0; i < n_; ++i) {
        row(i)[n_] = 1;
        basic_[std::size_t(i)] = i, place_[std::size_t(i)] = i;
        nonbasic_[std::size_t(i)] = n_ + i, place_[std::size_t(n_ + i)] = n_ + i;
    }
    nonbasic_[std::size_t(n_)] = 2 * n_, place_[std::size_t(2 * n_)] = 2 * n_;
}

/// Coefficient of ε^j in a basic variable if the j-th entry of q grows by ε^j.
double LemkeFriction::perturbation(int i, int w) const {
    const int place = place_[std::size_t(w)];
    return place >= n_ ? -row(i)[place - n_] : place == i ? 1 : 0;
}

/// The row that first falls to zero as the variable of the column grows, or -1. z0 wins a tie, which ends the path; the
/// powers of ε decide the others, so no basis returns.
int LemkeFriction::leavingRow(int column) const {
    int best = -1;
    double least = 0;
    for (int i = 0; i < n_; ++i) {
        const double slope = -row(i)[column];
        if (slope < kLeastPivot) continue;
        const double ratio = std::max(0.0, row(i)[n_ + 1]) / slope;
        double ahead = best < 0 ? -1 : ratio - least;
        if (best >= 0 && std::abs(ahead) <= kSameRatio * (1 + least)) {
            if (basic_[std::size_t(best)] == 2 * n_) continue;
            ahead = basic_[std::size_t(i)] == 2 * n_ ? -1 : 0;
            const double slopeOfBest = -row(best)[column];
            for (int w = 0; w < n_ && std::abs(ahead) <= kSameRatio; ++w)
                ahead = perturbation(i, w) / slope - perturbation(best, w) / slopeOfBest;
        }
        if (ahead < 0) best = i, least = ratio;
    }
    return best;
}

/// Exchanges the basic variable of a row for the nonbasic one of a column.
void LemkeFriction::pivot(int leaving, int column) {
    const int width = n_ + 2;
    double* const p = row(leaving);
    const double scale = -1 / p[column];
    for (int k = 0; k < width; ++k) p[k] *= scale;
    p[column] = -scale;
    for (int i = 0; i < n_; ++i) {
        double* const t = row(i);
        const double factor = t[column];
        if (i == leaving || factor == 0) continue;
        t[column] = 0;
        for (int k = 0; k < width; ++k) t[k] += factor * p[k];
    }
    std::swap(basic_[std::size_t(leaving)], nonbasic_[std::size_t(column)]);
    place_[std::size_t(basic_[std::size_t(leaving)])] = leaving;
    place_[std::size_t(nonbasic_[std::size_t(column)])] = n_ + column;
}

/// Lemke's path from z = 0: z0 enters first, and then always the complement of what left. Returns whether z0 fell to
/// zero.
bool LemkeFriction::follow(int& pivots) {
    int leaving = -1;
    for (int i = 0; i < n_; ++i)  // the last of equal rows is the least in the order of ε
        if (row(i)[n_ + 1] < 0 && (leaving < 0 || row(i)[n_ + 1] <= row(leaving)[n_ + 1])) leaving = i;
    if (leaving < 0) return true;
    const auto most = std::min<std::int64_t>(kPivotsPerUnknown * n_, workLimit_ / (1 + n_ * n_ / kEntriesPerRow));
    for (int column = n_; pivots < most;) {
        const int left = basic_[std::size_t(leaving)];
        pivot(leaving, column);
        ++pivots;
        if (left == 2 * n_) return true;
        column = place_[std::size_t(left < n_ ? left + n_ : left - n_)] - n_;
        leaving = leavingRow(column);
        if (leaving < 0) return false;
    }
    return false;
}

FrictionResult LemkeFriction::solve(const FrictionProblem& problem, const Vec6& start) noexcept {
    assert(problem.contacts.size() <= forces_.size());
    const std::size_t m = problem.contacts.size();
    FrictionResult result;
    result.x = start;
    result.forces = {forces_.data(), m};
    std::fill_n(forces_.begin(), m, Vec3::Zero());
    if (m > std::size_t(mostContacts_)) return result;
    fill(problem);
    if (!follow(result.iterations)) return result;

    // The forces, and how far any is beyond its pyramid.
    const auto valueOf = [&](int unknown) {
        const int place = place_[std::size_t(n_ + unknown)];
        return place >= n_ ? 0 : unit_ * std::max(0.0, row(place)[n_ + 1]);
    };
    Vec6 wrench = Vec6::Zero();
    double beyond = 0;
    for (std::size_t i = 0; i < m; ++i) {
        double room = 0;
        for (int k = 0; k <= facets_; ++k) {
            const Vec6& along = wrenches_[i * std::size_t(facets_ + 1) + std::size_t(k)];
            const double value = valueOf(int(i) * (facets_ + 2) + k);
            forces_[i] += value * along.head<3>();
            wrench += value * along;
            room += k == 0 ? problem.contacts[i].coefficient * value : -value;
        }
        beyond = std::max(beyond, -room);
    }
    // The pose, which must not overlap.
    const Vec6 x = problem.wanted + wrench.cwiseQuotient(problem.stiffness);
    for (const FrictionContact& c : problem.contacts) beyond = std::max(beyond, -unit_ * c.distance(x));
    if (beyond > kAccepted * unit_) {
        std::fill_n(forces_.begin(), m, Vec3::Zero());
        return result;
    }
    result.x = x;
    result.status = FrictionStatus::Approximate;
    return result;
}

}  // namespace

std::unique_ptr<FrictionSolver> makeLemkeFriction(int capacity, int facets) {
    return std::make_unique<LemkeFriction>(capacity, facets);
}

}  // namespace touchstone
