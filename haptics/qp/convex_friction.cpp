#include "haptics/qp/convex_friction.hpp"

#include <algorithm>
#include <cassert>
#include <vector>

#include "haptics/qp/dual_active_set.hpp"
#include "haptics/qp/friction_facets.hpp"
#include "haptics/qp/pqp.hpp"

namespace touchstone {
namespace {

constexpr int kConvexFacets = 8;
constexpr std::int64_t kMostWork = 10'000'000;  ///< rows x iterations

class ConvexFriction final : public FrictionSolver {
  public:
    ConvexFriction(int capacity, ConvexMethod method, double tolerance)
        : solver_(method == ConvexMethod::Pqp ? makePqp(kConvexFacets * capacity)
                                              : makeDualActiveSet(kConvexFacets * capacity)),
          rows_(kConvexFacets * capacity),
          edges_(std::size_t(kConvexFacets * capacity)),
          forces_(std::size_t(capacity)) {
        settings_.tolerance = tolerance;
        settings_.workLimit = kMostWork;
    }

    void limitWork(std::int64_t limit) noexcept override { settings_.workLimit = std::min(limit, kMostWork); }

    FrictionResult solve(const FrictionProblem& problem, const Vec6&) noexcept override {
        assert(problem.contacts.size() <= forces_.size());
        const std::size_t m = problem.contacts.size();
        rows_.clear();
        for (std::size_t i = 0; i < m; ++i) {
            const FrictionContact& c = problem.contacts[i];
            forces_[i].setZero();
            const Facets facets(c.n, kConvexFacets);
            // Without friction the rows of a contact are all the same.
            const int edges = c.coefficient > 0 ? kConvexFacets : 1;
            for (int k = 0; k < edges; ++k) {
                const Vec3 d = facets.direction(k), edge = c.n + c.coefficient * d;
                Vec6 row;
                row << edge, c.r.cross(edge);
                edges_[std::size_t(rows_.size())] = {i, edge};
                rows_.push(row, c.gap + c.coefficient * d.dot(c.slipped), std::uint64_t(rows_.size()));
            }
        }
        solver_->reset();
        const SolveResult answer = solver_->solve({problem.stiffness, problem.wanted, &rows_}, settings_);
        for (const Multiplier& multiplier : answer.multipliers) {
            const Edge& edge = edges_[std::size_t(multiplier.row)];
            forces_[edge.contact] += multiplier.value * edge.direction;
        }
        FrictionResult result;
        result.status = answer.status == SolveStatus::Solved ? FrictionStatus::Approximate : FrictionStatus::None;
        result.x = answer.x;
        result.iterations = answer.iterations;
        result.forces = {forces_.data(), m};
        return result;
    }

  private:
    struct Edge {
        std::size_t contact = 0;
        Vec3 direction = Vec3::Zero();  ///< n + µ d
    };

    std::unique_ptr<Solver> solver_;
    SolverSettings settings_;
    RowSet rows_;
    std::vector<Edge> edges_;  ///< of each row
    std::vector<Vec3> forces_;
};

}  // namespace

std::unique_ptr<FrictionSolver> makeConvexFriction(int capacity, ConvexMethod method, double tolerance) {
    return std::make_unique<ConvexFriction>(capacity, method, tolerance);
}

}  // namespace touchstone
