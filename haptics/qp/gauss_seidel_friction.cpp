#include "haptics/qp/gauss_seidel_friction.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "haptics/qp/cone.hpp"

namespace touchstone {
namespace {

/// A visit of a contact takes as long as this number of rows x iterations of PQP.
constexpr int kRowsPerVisit = 2;

class GaussSeidelFriction final : public FrictionSolver {
  public:
    GaussSeidelFriction(int capacity, const GaussSeidelSettings& settings)
        : settings_(settings), compliances_(std::size_t(capacity)), forces_(std::size_t(capacity)) {}

    FrictionResult solve(const FrictionProblem& problem, const Vec6&) noexcept override {
        assert(problem.contacts.size() <= forces_.size());
        const std::size_t m = problem.contacts.size();
        FrictionResult result;
        result.x = problem.wanted;
        for (std::size_t i = 0; i < m; ++i) {
            const FrictionContact& c = problem.contacts[i];
            compliances_[i] = complianceOf(problem, c);
            forces_[i] = projectOntoCone(c.startForce, c.n, c.coefficient).force;
            push(problem, c, forces_[i], result.x);
        }
        const Vec6 pull = problem.stiffness.cwiseProduct(problem.wanted);
        const double lever = std::sqrt(problem.stiffness.tail<3>().sum() / problem.stiffness.head<3>().sum());
        const double settled = settings_.tolerance * (1 + pull.head<3>().norm() + pull.tail<3>().norm() / lever);
        const std::int64_t visits = workLimit_ / kRowsPerVisit;
        const auto most = std::min<std::int64_t>(settings_.maxSweeps, visits / std::max<std::int64_t>(1, m));
        for (bool ended = false; !ended && result.iterations < most; ++result.iterations)
            ended = sweep(problem, result.x) <= settled;
        result.status = result.x.allFinite() ? FrictionStatus::Approximate : FrictionStatus::None;
        result.forces = {forces_.data(), m};
        return result;
    }

    void limitWork(std::int64_t limit) noexcept override { workLimit_ = limit; }

  private:
    struct Compliance {
        double normal = 0, tangential = 0;  ///< mm/N
    };

    static Compliance complianceOf(const FrictionProblem& problem, const FrictionContact& c) {
        const Vec3 t = c.n.unitOrthogonal(), b = c.n.cross(t);
        const auto between = [&](const Vec3& a, const Vec3& d) {
            return a.dot(d.cwiseQuotient(problem.stiffness.head<3>())) +
                   c.r.cross(a).dot(c.r.cross(d).cwiseQuotient(problem.stiffness.tail<3>()));
        };
        const double tt = between(t, t), bb = between(b, b), tb = between(t, b);
        return {between(c.n, c.n), (tt + bb) / 2 + std::hypot((tt - bb) / 2, tb)};
    }

    static void push(const FrictionProblem& problem, const FrictionContact& c, const Vec3& force, Vec6& x) {
        x.head<3>() += force.cwiseQuotient(problem.stiffness.head<3>());
        x.tail<3>() += c.r.cross(force).cwiseQuotient(problem.stiffness.tail<3>());
    }

    /// Returns the greatest change of a force.
    double sweep(const FrictionProblem& problem, Vec6& x) {
        double change = 0;
        for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
            const FrictionContact& c = problem.contacts[i];
            const Vec3 before = forces_[i];
            const double normalBefore = c.n.dot(before);
            const double normal = std::max(0.0, normalBefore - c.distance(x) / compliances_[i].normal);
            push(problem, c, (normal - normalBefore) * c.n, x);
            const Vec3 tangential = before - normalBefore * c.n;
            const Vec3 pushed = normal * c.n + tangential;
            forces_[i] = projectOntoCone(pushed - c.slip(x) / compliances_[i].tangential, c.n, c.coefficient).force;
            push(problem, c, forces_[i] - pushed, x);
            change = std::max(change, (forces_[i] - before).norm());
        }
        return change;
    }

    GaussSeidelSettings settings_;
    std::int64_t workLimit_ = INT64_MAX;
    std::vector<Compliance> compliances_;
    std::vector<Vec3> forces_;
};

}  // namespace

std::unique_ptr<FrictionSolver> makeGaussSeidelFriction(int capacity, const GaussSeidelSettings& settings) {
    return std::make_unique<GaussSeidelFriction>(capacity, settings);
}

}  // namespace touchstone
