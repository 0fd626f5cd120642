#include <algorithm>

#include "haptics/qp/active_set.hpp"
#include "haptics/qp/dual_active_set.hpp"
#include "haptics/qp/pqp.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone {

std::span<const SolverInfo> solverTable() {
    static constexpr SolverInfo kTable[] = {
        {"dual-active-set",
         "Exact to rounding, in a few microseconds: a dual active-set method specialized to six unknowns.", true,
         makeDualActiveSet},
        {"pqp",
         "The paper's parallel quadratic programming: updates all contact forces at once and converges to the exact "
         "answer.",
         false, makePqp},
        {"active-set", "The paper's baseline: the textbook primal active-set method.", true, makeActiveSet},
    };
    return kTable;
}

int findSolver(std::string_view name) {
    const auto table = solverTable();
    const auto found =
        std::find_if(table.begin(), table.end(), [&](const SolverInfo& info) { return info.name == name; });
    return found == table.end() ? -1 : int(found - table.begin());
}

}  // namespace touchstone
