#pragma once
// Names of the solver table for tests that hold for a whole kind of solver, so that a new row needs no edit.
#include <string_view>
#include <vector>

#include "haptics/qp/solver.hpp"

namespace touchstone::test {

/// All rows of solverTable().
inline std::vector<std::string_view> allSolvers() {
    std::vector<std::string_view> names;
    for (const SolverInfo& info : solverTable()) names.push_back(info.name);
    return names;
}

/// The rows whose answers the tick projects onto the constraints.
inline std::vector<std::string_view> approximateSolvers() {
    std::vector<std::string_view> names;
    for (const SolverInfo& info : solverTable())
        if (!info.exact) names.push_back(info.name);
    return names;
}

}  // namespace touchstone::test
