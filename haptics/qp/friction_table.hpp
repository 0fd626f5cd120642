#pragma once
// One table for every solver of FrictionProblem.
#include <memory>
#include <span>
#include <string_view>

#include "haptics/qp/friction.hpp"

namespace touchstone {

struct FrictionSolverInfo {
    std::string_view name;     ///< as on the command line
    std::string_view summary;  ///< one sentence for help and tooltips
    bool exact;                ///< its answers obey Coulomb's law to rounding where their status is Exact
    std::unique_ptr<FrictionSolver> (*make)(int capacity);  ///< capacity: maximum number of contacts
};

/// The solvers in the order in which users see them. The first one renders; the others are baselines to compare with.
std::span<const FrictionSolverInfo> frictionSolverTable();
/// Index into frictionSolverTable(), or -1.
int findFrictionSolver(std::string_view name);

}  // namespace touchstone
