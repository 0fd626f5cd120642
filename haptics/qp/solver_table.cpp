#include <algorithm>
#include <array>

#include "haptics/qp/active_set.hpp"
#include "haptics/qp/dual_active_set.hpp"
#include "haptics/qp/pqp.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone {

namespace {

constexpr std::size_t kMostSolvers = 8;

struct Table {
    std::array<SolverInfo, kMostSolvers> rows{{
        {kExactSolver,
         "Exact to rounding, in a few microseconds: a dual active-set method specialized to six unknowns.", true,
         makeDualActiveSet},
        {"pqp",
         "The paper's parallel quadratic programming: updates all contact forces at once and converges to the exact "
         "answer.",
         false, makePqp},
        {"active-set", "The paper's baseline: the textbook primal active-set method.", true, makeActiveSet},
    }};
    std::size_t size = 3;
};

Table& table() {
    static Table table;
    return table;
}

}  // namespace

std::span<const SolverInfo> solverTable() { return {table().rows.data(), table().size}; }

void addSolver(const SolverInfo& info) { table().rows.at(table().size++) = info; }

const SolverInfo* findSolver(std::string_view name) {
    const auto solvers = solverTable();
    const auto found =
        std::find_if(solvers.begin(), solvers.end(), [&](const SolverInfo& info) { return info.name == name; });
    return found == solvers.end() ? nullptr : &*found;
}

}  // namespace touchstone
