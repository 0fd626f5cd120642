#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tests/haptics/qp/qp_problems.hpp"

namespace touchstone::test {
namespace {

__extension__ using Quad = __float128;

constexpr int kMaxActive = 7;  // rows that can be active at once, including the dimension of the slack
constexpr int kMaxPivots = 5000;
/// Answers are doubles, so errors in their last bits are accepted.
constexpr double kLastBits = 4 * std::numeric_limits<double>::epsilon();

Quad squareRoot(Quad a) {
    if (a <= 0) return 0;
    Quad root = std::sqrt(double(a));
    for (int i = 0; i < 3; ++i) root = (root + a / root) / 2;  // doubles the digits each time: 53, 106, 113
    return root;
}
Quad size(Quad a) { return a < 0 ? -a : a; }

using Point = std::array<Quad, kMaxActive>;
Quad dot(const Point& a, const Point& b) {
    Quad sum = 0;
    for (int k = 0; k < kMaxActive; ++k) sum += a[k] * b[k];
    return sum;
}

/// Solves A x = b of size n by elimination with full pivoting; false when a pivot falls below 1e-30 (unit rows: the
/// largest is 1).
bool solveDense(int n, std::array<Point, kMaxActive> A, Point b, Point& x) {
    int order[kMaxActive];
    for (int i = 0; i < n; ++i) order[i] = i;
    for (int k = 0; k < n; ++k) {
        int row = k, column = k;
        for (int i = k; i < n; ++i) {
            for (int j = k; j < n; ++j) {
                if (size(A[i][j]) > size(A[row][column])) row = i, column = j;
            }
        }
        if (size(A[row][column]) < 1e-30) return false;
        std::swap(A[k], A[row]);
        std::swap(b[k], b[row]);
        for (auto& line : A) std::swap(line[k], line[column]);
        std::swap(order[k], order[column]);
        for (int i = k + 1; i < n; ++i) {
            const Quad factor = A[i][k] / A[k][k];
            for (int j = k; j < n; ++j) A[i][j] -= factor * A[k][j];
            b[i] -= factor * b[k];
        }
    }
    for (int k = n - 1; k >= 0; --k) {
        Quad value = b[k];
        for (int j = k + 1; j < n; ++j) value -= A[k][j] * x[order[j]];
        x[order[k]] = value / A[k][k];
    }
    return true;
}

struct Plane {
    Point n{};
    Quad d = 0;
    Quad length = 1;  ///< of the row before normalization
    int row = 0;
};

struct Nearest {
    bool feasible = true;
    bool failed = false;  ///< too badly conditioned even for 113 bits
    Point z{};
    int count = 0;
    int active[kMaxActive + 1];
    Quad force[kMaxActive + 1];

    void drop(int i) {
        --count;
        std::copy(active + i + 1, active + count + 1, active + i);
        std::copy(force + i + 1, force + count + 1, force + i);
    }
    std::array<Point, kMaxActive> gram(const std::vector<Plane>& planes) const {
        std::array<Point, kMaxActive> products{};
        for (int i = 0; i < count; ++i)
            for (int j = 0; j < count; ++j) products[i][j] = dot(planes[active[i]].n, planes[active[j]].n);
        return products;
    }
};

/// The nearest point on the planes of `start` without those that would have to pull. It is the certificate if no plane
/// is violated there, and a starting point otherwise.
Nearest nearestOn(const std::vector<Plane>& planes, std::span<const int> start) {
    Nearest state;
    for (const int plane : start) {
        if (state.count == kMaxActive) break;
        state.active[state.count++] = plane;
    }
    while (state.count > 0) {
        Point right{}, force{};
        for (int i = 0; i < state.count; ++i) right[i] = -planes[state.active[i]].d;
        if (!solveDense(state.count, state.gram(planes), right, force)) return {};
        const auto weakest = std::min_element(force.begin(), force.begin() + state.count);
        if (*weakest < 0) {
            state.drop(int(weakest - force.begin()));
            continue;
        }
        for (int i = 0; i < state.count; ++i) {
            state.force[i] = force[i];
            for (int c = 0; c < kMaxActive; ++c) state.z[c] += force[i] * planes[state.active[i]].n[c];
        }
        break;
    }
    return state;
}

/// The point nearest to the origin with n·z + d >= 0 for every plane, starting from any set of planes that all push.
Nearest nearestPoint(const std::vector<Plane>& planes, Nearest state = {}) {
    for (int pivot = 0; pivot < kMaxPivots; ++pivot) {
        int worst = -1;
        Quad least = -1e-22;
        for (int i = 0; i < int(planes.size()); ++i) {
            const Quad s = dot(planes[i].n, state.z) + planes[i].d;
            if (s < least) least = s, worst = i;
        }
        if (worst < 0) return state;
        const Plane& entering = planes[worst];
        Quad force = 0;
        for (bool entered = false; !entered;) {
            const int k = state.count;
            Point along{}, weight{};
            for (int i = 0; i < k; ++i) along[i] = dot(planes[state.active[i]].n, entering.n);
            if (!solveDense(k, state.gram(planes), along, weight)) {
                state.failed = true;
                return state;
            }
            Point across = entering.n;
            for (int i = 0; i < k; ++i) {
                for (int c = 0; c < kMaxActive; ++c) across[c] -= weight[i] * planes[state.active[i]].n[c];
            }
            const Quad across2 = dot(across, across);
            const bool dependent = across2 < 1e-44;
            int blocking = -1;
            Quad partial = 0;
            for (int i = 0; i < k; ++i) {
                if (weight[i] <= 1e-20) continue;
                const Quad step = state.force[i] / weight[i];
                if (blocking < 0 || step < partial) partial = step, blocking = i;
            }
            if (dependent && blocking < 0) {
                // Farkas: with all weights <= 0 a feasible z' has 0 <= d - weight·d_active + across·z'. No such point
                // lies within a kilometer, or rounding decides.
                Quad reach = entering.d;
                for (int i = 0; i < k; ++i) reach -= weight[i] * planes[state.active[i]].d;
                const bool contradiction = reach < -1e6 * squareRoot(across2) - 1e-20;
                state.feasible = !contradiction;
                state.failed = !contradiction;
                return state;
            }
            const Quad full = dependent ? 0 : -(dot(entering.n, state.z) + entering.d) / across2;
            entered = !dependent && (blocking < 0 || full <= partial);
            const Quad step = entered ? full : partial;
            if (!dependent) {
                for (int c = 0; c < kMaxActive; ++c) state.z[c] += step * across[c];
            }
            for (int i = 0; i < k; ++i) state.force[i] -= step * weight[i];
            force += step;
            if (entered) {
                state.active[state.count] = worst;
                state.force[state.count++] = force;
            } else {
                state.drop(blocking);
            }
        }
    }
    state.failed = true;
    return state;
}

/// The multipliers are >= 0, z = N u, no plane is violated, and z lies on every plane that pushes.
bool certified(const std::vector<Plane>& planes, const Nearest& nearest, Quad& force) {
    Point rest = nearest.z;
    bool holds = nearest.feasible && !nearest.failed;
    for (int i = 0; i < nearest.count; ++i) {
        const Plane& plane = planes[nearest.active[i]];
        holds &= nearest.force[i] >= -1e-20;
        force += nearest.force[i];
        for (int c = 0; c < kMaxActive; ++c) rest[c] -= nearest.force[i] * plane.n[c];
        holds &= size((dot(plane.n, nearest.z) + plane.d) * nearest.force[i]) < 1e-20 * (1 + nearest.force[i]);
    }
    const Quad scale = 1 + force;
    holds &= dot(rest, rest) < 1e-40 * scale * scale;
    for (const Plane& plane : planes) holds &= dot(plane.n, nearest.z) + plane.d > -1e-21 - 1e-28 * scale;
    return holds;
}

/// √(trace(N'N) trace((N'N)⁻¹)) of the normals N of the planes that push: at most seven times the ratio of their
/// largest to their smallest singular value.
double conditionOf(const std::vector<Plane>& planes, Nearest nearest) {
    for (int i = nearest.count - 1; i >= 0; --i) {
        if (nearest.force[i] <= 0) nearest.drop(i);
    }
    const auto gram = nearest.gram(planes);
    Quad trace = 0;
    for (int i = 0; i < nearest.count; ++i) {
        Point unit{}, column{};
        unit[i] = 1;
        if (!solveDense(nearest.count, gram, unit, column)) return std::numeric_limits<double>::infinity();
        trace += column[i];
    }
    return std::sqrt(double(trace * nearest.count));
}

/// Every row with a nonzero normal, scaled to unit length in the metric of G.
std::vector<Plane> planesOf(const QpProblem& problem, bool& hopeless) {
    const RowSet& rows = *problem.rows;
    Point inverseRoot{};
    for (int k = 0; k < 6; ++k) inverseRoot[k] = 1 / squareRoot(problem.stiffness[k]);
    std::vector<Plane> planes;
    planes.reserve(std::size_t(rows.size()));
    hopeless = false;
    for (int i = 0; i < rows.size(); ++i) {
        Plane plane;
        plane.row = i;
        plane.d = rows.gap()[i];
        for (int k = 0; k < 6; ++k) {
            plane.n[k] = rows.column(k)[i] * inverseRoot[k];
            plane.d += Quad(rows.column(k)[i]) * problem.wanted[k];
        }
        plane.length = squareRoot(dot(plane.n, plane.n));
        if (plane.length < 1e-15) {
            hopeless |= rows.gap()[i] < 0;
            continue;
        }
        const Quad inverse = 1 / plane.length;
        for (Quad& entry : plane.n) entry *= inverse;
        plane.d *= inverse;
        planes.push_back(plane);
    }
    return planes;
}

}  // namespace

Reference referenceAnswer(const QpProblem& problem, double elasticWeight, std::span<const Multiplier> start) {
    bool hopeless = false;
    std::vector<Plane> planes = planesOf(problem, hopeless);
    std::vector<int> startPlanes;
    for (const Multiplier& multiplier : start) {
        const auto plane = std::lower_bound(planes.begin(), planes.end(), multiplier.row,
                                            [](const Plane& p, int row) { return p.row < row; });
        if (plane != planes.end() && plane->row == multiplier.row) startPlanes.push_back(int(plane - planes.begin()));
    }

    Nearest nearest = nearestPoint(planes, nearestOn(planes, startPlanes));
    Reference answer;
    answer.feasible = nearest.feasible && !hopeless;
    if (!nearest.feasible) {
        for (Plane& plane : planes) plane.n[6] = 1 / squareRoot(elasticWeight);
        nearest = nearestPoint(planes, nearestOn(planes, startPlanes));
    }

    Quad force = 0;
    answer.certified = certified(planes, nearest, force);
    answer.force = double(force);
    answer.condition = conditionOf(planes, nearest);
    for (int k = 0; k < 6; ++k)
        answer.x[k] = double(problem.wanted[k] + nearest.z[k] / squareRoot(problem.stiffness[k]));
    answer.slack = nearest.feasible ? double(nearest.z[6]) / std::sqrt(elasticWeight) : 0;
    return answer;
}

double certificateOf(const QpProblem& problem, const SolveResult& result, double elasticWeight) {
    bool hopeless = false;
    const RowSet& rows = *problem.rows;
    const std::vector<Plane> planes = planesOf(problem, hopeless);
    Point z{};
    for (int k = 0; k < 6; ++k) z[k] = squareRoot(problem.stiffness[k]) * (Quad(result.x[k]) - problem.wanted[k]);
    const Quad length = squareRoot(dot(z, z));
    Point rest = z;
    Quad worst = 0, sum = 0;
    for (const Plane& plane : planes) {
        const Quad s = dot(plane.n, z) + plane.d + result.slack;
        Quad rounding = kLastBits * (size(plane.d) + length + result.slack);
        for (int k = 0; k < 6; ++k)
            rounding += kLastBits * size(rows.column(k)[plane.row] * Quad(result.x[k])) / plane.length;
        worst = std::max(worst, -s - rounding);
        for (const Multiplier& multiplier : result.multipliers) {
            if (multiplier.row != plane.row) continue;
            const Quad force = multiplier.value * plane.length;
            worst = std::max({worst, -force, (size(s) - rounding) * force / (1 + force)});
            for (int k = 0; k < 6; ++k) rest[k] -= force * plane.n[k];
            sum += force;
        }
    }
    if (result.slack > 0) rest[6] = (elasticWeight * Quad(result.slack) - sum) / squareRoot(elasticWeight);
    return double(std::max(worst, squareRoot(dot(rest, rest)) - kLastBits * sum));
}

Residuals residualsOf(const QpProblem& problem, const SolveResult& result) {
    const RowSet& rows = *problem.rows;
    std::vector<long double> y(rows.size(), 0);
    for (const Multiplier& multiplier : result.multipliers) y[multiplier.row] += multiplier.value;
    Residuals residuals{};
    long double balance[6];
    for (int k = 0; k < 6; ++k) {
        balance[k] = (long double)(problem.stiffness[k]) * ((long double)(result.x[k]) - problem.wanted[k]);
    }
    for (int i = 0; i < rows.size(); ++i) {
        long double s = rows.gap()[i];
        for (int k = 0; k < 6; ++k) {
            s += (long double)(rows.column(k)[i]) * result.x[k];
            balance[k] -= (long double)(rows.column(k)[i]) * y[i];
        }
        residuals.primal = std::max(residuals.primal, double(-s));
        residuals.dual = std::max(residuals.dual, double(-y[i]));
        residuals.complementarity = std::max(residuals.complementarity, double(std::abs(y[i] * s)));
    }
    const long double lever2 = problem.stiffness.tail<3>().sum() / problem.stiffness.head<3>().sum();
    long double sum = 0;
    for (int k = 0; k < 6; ++k) sum += balance[k] * balance[k] / (k < 3 ? 1 : lever2);
    residuals.stationarity = double(std::sqrt(sum));
    return residuals;
}

double distanceMm(const QpProblem& problem, const Vec6& a, const Vec6& b) {
    const double lever2 = problem.stiffness.tail<3>().sum() / problem.stiffness.head<3>().sum();
    const Vec6 difference = a - b;
    return std::sqrt(difference.head<3>().squaredNorm() + lever2 * difference.tail<3>().squaredNorm());
}

}  // namespace touchstone::test
