#include "haptics/qp/friction_table.hpp"

#include <algorithm>

#include "haptics/qp/cone_newton.hpp"
#include "haptics/qp/convex_friction.hpp"
#include "haptics/qp/gauss_seidel_friction.hpp"
#include "haptics/qp/lemke_friction.hpp"

namespace touchstone {

std::span<const FrictionSolverInfo> frictionSolverTable() {
    using Made = std::unique_ptr<FrictionSolver>;
    static constexpr FrictionSolverInfo kTable[] = {
        {kExactFrictionSolver, "Coulomb's law to rounding: Newton's method in the six unknowns of the pose.", true,
         [](int capacity) -> Made { return std::make_unique<ConeNewton>(capacity); }},
        {"lemke-4",
         "A linear complementarity problem with four facets for each cone, by Lemke's method.",
         false,
         [](int capacity) -> Made { return makeLemkeFriction(capacity, 4); },
         {.facets = 4}},
        {"lemke-8",
         "A linear complementarity problem with eight facets for each cone, by Lemke's method.",
         false,
         [](int capacity) -> Made { return makeLemkeFriction(capacity, 8); },
         {.facets = 8}},
        {"convex",
         "The convex relaxation with eight facets, solved exactly; sliding contacts hover.",
         false,
         [](int capacity) -> Made { return makeConvexFriction(capacity, ConvexMethod::DualActiveSet); },
         {.facets = 8, .hovers = true}},
        {"convex-pqp",
         "The convex relaxation with eight facets, by the paper's parallel quadratic programming.",
         false,
         [](int capacity) -> Made { return makeConvexFriction(capacity, ConvexMethod::Pqp); },
         {.facets = 8, .hovers = true, .accuracy = 1e-4}},
        {"gauss-seidel",
         "Projected Gauss-Seidel: one contact after the other, up to a number of sweeps.",
         false,
         [](int capacity) -> Made { return makeGaussSeidelFriction(capacity); },
         {.accuracy = 1e-7, .sweeps = GaussSeidelSettings().maxSweeps}},
    };
    return kTable;
}

const FrictionSolverInfo* findFrictionSolver(std::string_view name) {
    const auto table = frictionSolverTable();
    const auto found =
        std::find_if(table.begin(), table.end(), [&](const FrictionSolverInfo& info) { return info.name == name; });
    return found == table.end() ? nullptr : &*found;
}

}  // namespace touchstone
