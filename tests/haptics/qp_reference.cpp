#include <cmath>

#include "qp_problems.hpp"

namespace touchstone::test {
namespace {

__extension__ using Quad = __float128;

Quad squareRoot(Quad a) {
    if (a <= 0) return 0;
    Quad root = std::sqrt(double(a));
    for (int i = 0; i < 3; ++i) root = (root + a / root) / 2;  // doubles the digits each time: 53, 106, 113
    return root;
}

using Point = std::array<Quad, 7>;
Quad dot(const Point& a, const Point& b) {
    Quad sum = 0;
    for (int k = 0; k < 7; ++k) sum += a[k] * b[k];
    return sum;
}

/// Solves A x = b by elimination with full pivoting; false when a pivot falls below 1e-30 (unit rows: the largest is
/// 1).
bool solveDense(std::vector<std::vector<Quad>> A, std::vector<Quad> b, std::vector<Quad>& x) {
    const int n = int(b.size());
    std::vector<int> order(n);
    for (int i = 0; i < n; ++i) order[i] = i;
    for (int k = 0; k < n; ++k) {
        int row = k, column = k;
        const auto size = [&](int i, int j) { return A[i][j] < 0 ? -A[i][j] : A[i][j]; };
        for (int i = k; i < n; ++i) {
            for (int j = k; j < n; ++j) {
                if (size(i, j) > size(row, column)) row = i, column = j;
            }
        }
        if (size(row, column) < 1e-30) return false;
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
    x.assign(n, 0);
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
};

struct Nearest {
    bool feasible = true;
    bool failed = false;  ///< too badly conditioned even for 113 bits
    Point z{};
    std::vector<int> active;
    std::vector<Quad> force;
};

/// The point nearest to the origin with n·z + d >= 0 for every plane.
Nearest nearestPoint(const std::vector<Plane>& planes) {
    Nearest state;
    for (int pivot = 0; pivot < 5000; ++pivot) {
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
            const int k = int(state.active.size());
            std::vector<std::vector<Quad>> gram(k, std::vector<Quad>(k));
            std::vector<Quad> along(k), weight;
            for (int i = 0; i < k; ++i) {
                for (int j = 0; j < k; ++j) gram[i][j] = dot(planes[state.active[i]].n, planes[state.active[j]].n);
                along[i] = dot(planes[state.active[i]].n, entering.n);
            }
            if (!solveDense(gram, along, weight)) {
                state.failed = true;
                return state;
            }
            Point across = entering.n;
            for (int i = 0; i < k; ++i) {
                for (int c = 0; c < 7; ++c) across[c] -= weight[i] * planes[state.active[i]].n[c];
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
                // Farkas: with all weights <= 0 a feasible z' has 0 <= d - weight·d_active + across·z'. None within a
                // kilometre, or too close to call.
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
                for (int c = 0; c < 7; ++c) state.z[c] += step * across[c];
            }
            for (int i = 0; i < k; ++i) state.force[i] -= step * weight[i];
            force += step;
            if (entered) {
                state.active.push_back(worst);
                state.force.push_back(force);
            } else {
                state.active.erase(state.active.begin() + blocking);
                state.force.erase(state.force.begin() + blocking);
            }
        }
    }
    state.failed = true;
    return state;
}

}  // namespace

Reference referenceAnswer(const QpProblem& problem, double elasticWeight) {
    const RowSet& rows = *problem.rows;
    Point root{};
    for (int k = 0; k < 6; ++k) root[k] = squareRoot(problem.stiffness[k]);
    std::vector<Plane> planes;
    bool hopeless = false;
    for (int i = 0; i < rows.size(); ++i) {
        Plane plane;
        plane.d = rows.gap()[i];
        for (int k = 0; k < 6; ++k) {
            plane.n[k] = rows.column(k)[i] / root[k];
            plane.d += Quad(rows.column(k)[i]) * problem.wanted[k];
        }
        const Quad length = squareRoot(dot(plane.n, plane.n));
        if (length < 1e-15) {
            hopeless |= rows.gap()[i] < 0;
            continue;
        }
        for (Quad& entry : plane.n) entry /= length;
        plane.d /= length;
        planes.push_back(plane);
    }

    Nearest nearest = nearestPoint(planes);
    Reference answer;
    answer.feasible = nearest.feasible && !hopeless;
    if (!nearest.feasible) {
        for (Plane& plane : planes) plane.n[6] = 1 / squareRoot(elasticWeight);
        nearest = nearestPoint(planes);
    }

    // The certificate: multipliers >= 0, z = N u, and no plane violated.
    Point rest = nearest.z;
    bool certified = nearest.feasible && !nearest.failed;
    for (std::size_t i = 0; i < nearest.active.size(); ++i) {
        certified &= nearest.force[i] >= -1e-20;
        answer.force += double(nearest.force[i]);
        for (int c = 0; c < 7; ++c) rest[c] -= nearest.force[i] * planes[nearest.active[i]].n[c];
        const Quad s = dot(planes[nearest.active[i]].n, nearest.z) + planes[nearest.active[i]].d;
        certified &= s * nearest.force[i] < 1e-20;
    }
    const Quad scale = 1 + answer.force;
    certified &= dot(rest, rest) < 1e-40 * scale * scale;
    for (const Plane& plane : planes) certified &= dot(plane.n, nearest.z) + plane.d > -1e-20 * scale;
    answer.certified = certified;
    for (int k = 0; k < 6; ++k) answer.x[k] = double(problem.wanted[k] + nearest.z[k] / root[k]);
    answer.slack = nearest.feasible ? double(nearest.z[6]) / std::sqrt(elasticWeight) : 0;
    return answer;
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
